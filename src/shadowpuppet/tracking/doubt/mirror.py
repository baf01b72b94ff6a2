"""Mirror images of an arm in depth: other poses that one camera sees alike, and how well the silhouette allows them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.segments import dofs_of
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import limb_of
from shadowpuppet.motion.motion import Mode
from shadowpuppet.tracking.doubt.doubt import STEP
from shadowpuppet.tracking.doubt.variance import kind_before_one, variance_model
from shadowpuppet.tracking.monocular.settings import pixel_scale
from shadowpuppet.tracking.silhouette_cost import Observation

FLIPS = ((-1, -1), (-1, 1), (1, -1))
"""Bones whose part along the view changes its sign: both, the upper arm, the forearm."""
STEPS, DAMPING = 6, 1e-3
"""Steps of the search for a mirror image within the joints' limits, and their damping (m^2)."""
ALLOWED = 60.0
"""A mirror image counts half in the joints' variances if it costs this much more (pixels at 320 x 240), times ln 3."""
APART = 0.1
"""Distance (m) of elbow or wrist from which on two poses of an arm are different modes."""
MOVED = 0.03
"""Distance (m) from which on a mode moves a joint."""
LEAST = 0.05
"""Weight below which a mode is not stated."""


class Images(NamedTuple):
    """Mirror images of the arms of a pose: other poses that draw nearly the same silhouette."""

    points: Array
    """Landmarks (A, 3, L, 3) of the three images of each of A arms, camera's frame, metres."""
    more: Array
    """What each costs more than the pose (A, 3), pixels at 320 x 240."""

    def displacements(self, points: Array) -> Array:
        """Root mean square (L, 3), metres, of the landmarks' distances from those of the pose, `points` (L, 3), weighted by what the images
        cost more: half for the cost `ALLOWED`, times ln 3."""
        likely = 1 / (1 + np.exp(np.clip(self.more / ALLOWED, -30, 30)))
        return np.sqrt(np.einsum("ai,ailx->lx", likely, (self.points - points) ** 2))


@dataclass(frozen=True, eq=False)
class Mirrors:
    """The mirror images of the arms of a body in a picture."""

    picture: Picture

    def images(self, pose: Array, points: Array, observation: Observation) -> Images:
        """The mirror images of a pose (D,) with landmarks `points` (L, 3), within the joints' limits."""
        if not self.arms:
            return Images(np.zeros((0, len(FLIPS), *points.shape)), np.zeros((0, len(FLIPS))))
        poses = self.nearest(pose, points)
        costs = np.array([observation.cost_and_overlap(self.picture.draw(each))[0] for each in (pose, *poses)])
        more = (costs[1:] - costs[0]).reshape(-1, len(FLIPS)) / pixel_scale(self.picture.camera.size)
        found = self.picture.points(poses)
        return Images(found.reshape(-1, len(FLIPS), *found.shape[1:]), more)

    def modes(self, points: Array, images: Images) -> tuple[Mode, ...]:
        """Places of the arms, in the world, that differ from the estimate, `points` (L, 3), and from one another; the likelier first."""
        found, T = list[Mode](), self.picture.camera.T_camera_world
        for (_, chain), more, own in zip(self.arms, images.more, images.points):
            for n, weight in _weights(points[chain[1:]], own[:, chain[1:]], more, kind_before_one(self.picture.body)).items():
                moved = np.linalg.norm(own[n] - points, axis=1) > MOVED
                places = np.where(moved[:, None], (own[n] - T[:3, 3]) @ T[:3, :3], np.nan)
                found.append(Mode(limb_of(self.picture.body.landmark_names[chain[0]]), weight, places))
        return tuple(found)

    @cached_property
    def arms(self) -> list[tuple[NDArray[np.int64], list[int]]]:
        """Of each arm the DOF, and the indices of shoulder, elbow and wrist."""
        names, skeleton = self.picture.body.landmark_names, self.picture.body.skeleton
        return [(dofs_of(skeleton, f"{side}_arm"), [names.index(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist")])
                for side in SIDES if f"{side}_wrist" in names]

    def nearest(self, pose: Array, points: Array) -> Array:
        """Poses (N, D) nearest to the mirror images within the joints' limits."""
        jobs = list(product(self.arms, FLIPS))
        dofs, ends = np.array([arm[0] for arm, _ in jobs]), np.array([arm[1][1:] for arm, _ in jobs])
        targets = _mirrored(points[[arm[1] for arm in self.arms]]).reshape(-1, 6)
        rows, poses = np.arange(len(jobs))[:, None], np.repeat(pose[None], len(jobs), axis=0)
        # begin half-way to the middle of the limits: from the estimate itself the derivatives may vanish
        poses[rows, dofs] = 0.5 * (poses[rows, dofs] + self._middle(pose)[dofs])
        return self._approach(poses, dofs, ends, targets)

    def _middle(self, pose: Array) -> Array:
        """The middle of the limits (D,); of degrees of freedom without limits, as in the pose (D,)."""
        low, high = self.picture.body.skeleton.limits
        return np.where(np.isfinite(high - low), 0.5 * (np.maximum(low, -np.pi) + np.minimum(high, np.pi)), pose)

    def _approach(self, poses: Array, dofs: NDArray[np.int64], ends: NDArray[np.int64], targets: Array) -> Array:
        """Poses (N, D) after Levenberg-Marquardt steps, each of a radian at most, of their `dofs` (N, d) that bring the landmarks `ends`
        (N, E) to `targets` (N, 3 E), metres, within the joints' limits."""
        low, high = self.picture.body.skeleton.limits
        rows, (number, width) = np.arange(len(poses)), dofs.shape
        for _ in range(STEPS):
            tried = np.repeat(poses[:, None], width + 1, axis=1)
            tried[rows[:, None], np.arange(1, width + 1), dofs] += STEP
            at = self.picture.points(tried.reshape(-1, poses.shape[1])).reshape(number, width + 1, -1, 3)
            at = at[rows[:, None, None], np.arange(width + 1)[:, None], ends[:, None]].reshape(number, width + 1, -1)
            J, off = (at[:, 1:] - at[:, :1]) / STEP, targets - at[:, 0]
            step = np.linalg.solve(J @ J.transpose(0, 2, 1) + DAMPING * np.eye(width), J @ off[:, :, None])[..., 0]
            moved = poses[rows[:, None], dofs] + np.clip(step, -1.0, 1.0)
            poses[rows[:, None], dofs] = np.clip(moved, low[dofs], high[dofs])
        return poses


def _mirrored(chains: Array) -> Array:
    """Elbow and wrist (A, 3, 6) of chains (A, 3, 3) in which the part along the view of some bones has the other sign, for each of
    `FLIPS`."""
    views = chains[:, 1:] / np.linalg.norm(chains[:, 1:], axis=2, keepdims=True)
    bones = np.diff(chains, axis=1)
    turned = bones - 2 * (bones * views).sum(2, keepdims=True) * views
    chosen = np.where(np.array(FLIPS)[None, :, :, None] < 0, turned[:, None], bones[:, None])
    return (chains[:, None, :1] + np.cumsum(chosen, axis=2)).reshape(len(chains), len(FLIPS), 6)


def _weights(ends: Array, images: Array, more: Array, kind: str = "monocular") -> dict[int, float]:
    """Weights, by index, of those images (3, 2, 3) of elbow and wrist that differ from the estimate's, `ends` (2, 3), and from cheaper
    ones, the cheapest first. `more` (3,): what they cost more, pixels at 320 x 240; `kind`: of `kind_before_one`."""
    places, kept = [ends], list[int]()
    for n in np.argsort(more, kind="stable").tolist():
        if all(np.linalg.norm(images[n] - place, axis=1).max() >= APART for place in places):
            places.append(images[n])
            kept.append(n)
    weights = variance_model(kind).modes
    assert weights is not None
    return {n: share for n, share in zip(kept, weights.shares(more[kept]).tolist()) if share >= LEAST}
