"""Mirror images of an arm in depth: other poses that one camera sees alike, and how well the silhouette allows them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.segments import dofs_of
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.settings import pixel_scale
from shadowpuppet.tracking.silhouette_cost import Observation

FLIPS = ((-1, -1), (-1, 1), (1, -1))
"""Bones whose part along the view changes its sign: both, the upper arm, the forearm."""
STEPS, DAMPING = 6, 1e-3
"""Steps of the search for a mirror image within the joints' limits, and their damping (m^2)."""
DERIVATIVE = 1e-3
"""Step of its derivatives, rad."""
ALLOWED = 60.0
"""A mirror image is half as likely as the estimate if it costs this much more (pixels at 320 x 240), times ln 3."""


@dataclass(frozen=True, eq=False)
class Mirrors:
    """The mirror images of the arms of a body in a picture."""

    picture: Picture

    def displacements(self, pose: Array, points: Array, observation: Observation) -> Array:
        """Root mean square (L, 3), metres, along the camera's axes, by which the landmarks (L, 3) of a pose (D,) would move if the arms'
        mirror images were true, each weighted by its likelihood."""
        squares = np.zeros_like(points)
        if not self.arms:
            return squares
        poses = self.nearest(pose, points)
        moved = self.picture.points(poses) - points
        cost = observation.cost_and_overlap(self.picture.draw(pose))[0]
        more = np.array([observation.cost_and_overlap(self.picture.draw(each))[0] for each in poses]) - cost
        likely = 1 / (1 + np.exp(np.clip(more / (ALLOWED * pixel_scale(self.picture.camera.size)), -30, 30)))
        return np.sqrt(np.einsum("n,nla->la", likely, moved**2))

    @cached_property
    def arms(self) -> list[tuple[NDArray[np.int64], list[int]]]:
        """Of each arm the DOF, and the indices of shoulder, elbow and wrist."""
        names, skeleton = self.picture.body.landmark_names, self.picture.body.skeleton
        return [(dofs_of(skeleton, f"{side}_arm"), [names.index(f"{side}_{joint}") for joint in ("shoulder", "elbow", "wrist")])
                for side in SIDES if f"{side}_wrist" in names]

    def nearest(self, pose: Array, points: Array) -> Array:
        """Poses (N, D) nearest to the mirror images within the joints' limits: Levenberg-Marquardt steps on elbow and wrist."""
        skeleton, jobs = self.picture.body.skeleton, list(product(self.arms, FLIPS))
        low, high = skeleton.limits
        dofs = np.array([arm[0] for arm, _ in jobs])
        ends = np.array([arm[1][1:] for arm, _ in jobs])
        targets = np.array([_mirrored(points[arm[1]], flips) for arm, flips in jobs])
        rows, number = np.arange(len(jobs)), dofs.shape[1]
        poses = np.repeat(pose[None], len(jobs), axis=0)
        # begin half-way to the middle of the limits: from the estimate itself the derivatives may vanish
        middle = np.where(np.isfinite(high - low), 0.5 * (np.maximum(low, -np.pi) + np.minimum(high, np.pi)), pose)
        poses[rows[:, None], dofs] = 0.5 * (poses[rows[:, None], dofs] + middle[dofs])
        for _ in range(STEPS):
            tried = np.repeat(poses[:, None], number + 1, axis=1)
            tried[rows[:, None], np.arange(1, number + 1), dofs] += DERIVATIVE
            at = self.picture.points(tried.reshape(-1, len(pose))).reshape(len(jobs), number + 1, len(points), 3)
            at = at[rows[:, None, None], np.arange(number + 1)[:, None], ends[:, None]].reshape(len(jobs), number + 1, -1)
            J = (at[:, 1:] - at[:, :1]) / DERIVATIVE
            step = np.linalg.solve(J @ J.transpose(0, 2, 1) + DAMPING * np.eye(number), J @ (targets - at[:, 0])[:, :, None])[..., 0]
            moved = poses[rows[:, None], dofs] + np.clip(step, -1, 1)
            poses[rows[:, None], dofs] = np.clip(moved, low[dofs], high[dofs])
        return poses


def _mirrored(chain: Array, flips: tuple[int, int]) -> Array:
    """Elbow and wrist (6,) of a chain (3, 3) in which the part along the view of some bones has the other sign."""
    found, place = [], chain[0]
    for sign, start, end in zip(flips, chain[:-1], chain[1:], strict=True):
        view, bone = end / np.linalg.norm(end), end - start
        place = place + (bone if sign > 0 else bone - 2 * (bone @ view) * view)
        found.append(place)
    return np.concatenate(found)
