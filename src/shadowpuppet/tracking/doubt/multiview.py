"""What the frames of several cameras say about doubt: the components of the joints' variances, along the world's axes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Limbs
from shadowpuppet.body.skeleton import other_side
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.camera.projection import make_lens, pixel_nearest
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.motion.limbs import LIMBS, limb_of
from shadowpuppet.tracking.doubt.doubt import Doubt, Evidence, state_doubt
from shadowpuppet.tracking.doubt.keypoints import keypoint_view
from shadowpuppet.tracking.doubt.limbs import levers_of, limb_of_part
from shadowpuppet.tracking.doubt.steps import CONSTANT, DISTANCE, Trail, stillness, surprise
from shadowpuppet.tracking.frozen import same_silhouette
from shadowpuppet.tracking.multiview.keypoint_evidence import KeypointEvidence
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.resampling import normalise

GOOD_MISFIT = 0.08
"""One less the overlap of a body that fits."""
FAR = 0.06
"""Distance (m) from a part's surface beyond which a surface point is unexplained."""
POINTS = 600
"""Number of surface points that are looked at, about."""
FEW = 3
"""Number of surface points of a limb below which their distance is unknown."""
AXIS_POINTS = 7
"""Number of points along each part's axis that are looked up in the silhouettes."""
CROSSING = 0.15
"""Distance (m) of left and right within which they may have been confused, and for how long (s) that counts."""
MEMORY = 1.0


class Before(NamedTuple):
    """What the next frame needs of this one."""

    seconds: float
    trail: Trail
    """Of the landmarks, world."""
    masks: tuple[Mask | None, ...]
    still: int
    """Number of frames for which no camera's silhouette has changed, or some camera's has not."""
    apart: Array
    """Least recent distance (L,) of each joint from its counterpart on the other side, metres; infinite for joints without one."""


@dataclass(frozen=True, eq=False)
class MultiviewDoubt:
    """States doubt about the estimates of a `MultiviewTracker`."""

    tracker: MultiviewTracker

    def __call__(self, state: MultiviewState, surface: SurfacePoints, masks: Sequence[Mask | None], seconds: float,
                 before: Before | None, keypoints: KeypointEvidence | None = None) -> tuple[Doubt, Before]:
        """Doubt about the estimate from surface points and masks (H, W) at a time (s), and keypoints; and what the next frame needs."""
        body = self.tracker.body
        evidence, now = self.evidence(state, surface, masks, seconds, before, keypoints)
        kind = kind_of(masks, keypoints)
        return state_doubt(kind, evidence, self.names, body.skeleton, body.points, state.pose, state.status, np.eye(3)), now

    def evidence(self, state: MultiviewState, surface: SurfacePoints, masks: Sequence[Mask | None], seconds: float,
                 before: Before | None, keypoints: KeypointEvidence | None = None) -> tuple[Evidence, Before]:
        """What the frame shows about the accuracy of the estimate from surface points and masks (H, W) at a time (s); and what the next
        frame needs.

        Of every joint there are: a constant; the particles' spread; of its limb, the surface near it that no part explains, the share
        outside a silhouette, the share without surface points, and the share that few cameras see, times the joint's lever, and the
        distance of the surface that its parts explain; how far the joint left its course; the misfit of the whole body; silhouettes that do
        not change; the distance to its counterpart on the other side, if they were close within the last second; and, with two cameras,
        that to the upright axis through the pelvis, about which the body may be turned. Where keypoints show
        a limb, what silhouettes do not show of it counts less; and there are the components of `keypoint_view`, and the error of the
        person's distance from an only camera.
        """
        body, levers = self.tracker.body, levers_of(self.names)
        points = body.points(state.pose[None])[0]
        trail = Trail() if before is None else before.trail
        still = count_still(before, masks)
        apart = self._apart(points, seconds, before)
        weights = normalise(state.particles.log_weights)
        spread = np.sqrt(np.einsum("n,nla->la", weights, (body.points(state.particles.poses) - points) ** 2))
        found = {"spread": spread} | _along_axes({"constant": np.full(len(points), CONSTANT), "surprise": surprise(points, seconds, trail)})
        unseen = np.ones(len(LIMBS))
        if keypoints is not None:
            shown = keypoint_view(body, state.pose, keypoints)
            found, unseen = found | shown.components, 1 - shown.known
            if len(self.tracker.cameras) == 1:
                found |= {"distance": DISTANCE * np.abs(points - self.tracker.cameras[0].centre)}
        if keypoints is None or any(mask is not None for mask in masks):
            shares = self._limb_shares(state.pose, surface, masks)
            shares[:, :4] *= unseen[:, None]
            by_joint, unseen = shares[self._limbs_of_joints].T, shares[:, 0]
            columns = dict(zip(("bare", "unexplained", "outside", "unseen"), by_joint[:4] * levers)) | {"residual": by_joint[4]}
            columns |= {"misfit": np.fmax(1 - state.overlap - GOOD_MISFIT, 0) * levers, "still": stillness(still) * levers}
            found |= _along_axes(columns) | {"swapped": np.abs(points - points[self.counterparts]) * (apart < CROSSING)[:, None]}
            if kind_of(masks, keypoints) == "pair":
                found["turned"] = self._beside_axis(points)
        now = Before(seconds, trail.with_frame(seconds, points), tuple(masks), still, apart)
        return Evidence(found, dict(zip(LIMBS, unseen.tolist()))), now

    def _limb_shares(self, pose: Array, surface: SurfacePoints, masks: Sequence[Mask | None]) -> Array:
        """For each of `LIMBS`: the share of it without surface points, the points near it that no part explains over those that its
        surface should have, the share outside a silhouette, the root of the inverse number of cameras that see it, and the distance
        (m) of the surface that its parts explain, (5, 5)."""
        T = self.tracker.body.skeleton.forward(pose[None])[0][self._limbs.joints]
        starts, ends = (T[:, :, 3] + (T[:, :, :3] @ places[:, :, None])[..., 0] for places in (self._limbs.starts, self._limbs.ends))
        bare, unexplained, residual = self._explained(starts, ends, surface.points[:: max(1, len(surface.points) // POINTS)])
        outside, seen = self._looked_up(starts, ends, masks)
        return np.stack([bare, unexplained, outside, seen, residual], 1)

    def _explained(self, starts: Array, ends: Array, points: Array) -> tuple[Array, Array, Array]:
        """For each of `LIMBS`: the share of it without surface points; the points near it that no part explains, over those that its
        surface should have; and the root mean square distance (m) of the others from its parts. `starts`, `ends`: of the parts' axes
        (S, 3); `points` (P, 3)."""
        along, squared = ends - starts, ((ends - starts) ** 2).sum(1)
        to, across = points @ along.T - (starts * along).sum(1), (points**2).sum(1)[:, None] - 2 * points @ starts.T + (starts**2).sum(1)
        share = np.clip(to / np.maximum(squared, 1e-9), 0, 1)
        distances = np.sqrt(np.maximum(across - share * (2 * to - share * squared), 0)) - self._radii
        part = distances.argmin(1)
        limb, distance = self._limb_of_parts[part], distances[np.arange(len(part)), part]
        expected = np.maximum(self._surface_shares * len(points), 1e-9)
        good, bad = (np.bincount(limb[which], minlength=len(LIMBS)) for which in (distance < FAR, distance >= FAR))
        squares = np.bincount(limb, np.minimum(distance, FAR) ** 2, minlength=len(LIMBS))
        residual = np.where(good + bad >= FEW, np.sqrt(squares / np.maximum(good + bad, 1)), FAR)
        return np.clip(1 - good / expected, 0, 1), np.minimum(bad / expected, 2.0), residual

    def _looked_up(self, starts: Array, ends: Array, masks: Sequence[Mask | None]) -> tuple[Array, Array]:
        """For each of `LIMBS`: the share of its axis outside a silhouette, and the root of the inverse number of cameras that see it."""
        share = np.linspace(0.05, 0.95, AXIS_POINTS)[:, None, None]
        axis = np.ascontiguousarray((starts + share * (ends - starts)).reshape(-1, 3))
        limb = np.tile(self._limb_of_parts, AXIS_POINTS)
        seen, out = np.zeros(len(LIMBS)), np.zeros(len(LIMBS))
        for camera, mask in zip(self.tracker.cameras, masks):
            if mask is None or not may_be_person(mask):
                continue
            _look_up(axis, limb, camera.T_camera_world, make_lens(camera), mask, seen, out)
        number = np.maximum(seen / np.maximum(np.bincount(limb, minlength=len(LIMBS)), 1), 0.25)
        return out / np.maximum(seen, 1), 1 / np.sqrt(number)

    def _beside_axis(self, points: Array) -> Array:
        """Distance of each joint (L, 3) from the upright axis through the pelvis, along both level axes (L, 3), metres."""
        beside = np.linalg.norm((points - points[self.names.index("pelvis")])[:, :2], axis=1)
        return beside[:, None] * np.array([1.0, 1.0, 0.0])

    def _apart(self, points: Array, seconds: float, before: Before | None) -> Array:
        """Least distance (L,) of each joint from its counterpart in about the last second."""
        now = np.where(self.counterparts == np.arange(len(points)), np.inf, np.linalg.norm(points - points[self.counterparts], axis=1))
        if before is None:
            return now
        forgotten = CROSSING * (seconds - before.seconds) / MEMORY
        return np.minimum(now, before.apart + forgotten)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the L landmarks."""
        return self.tracker.body.landmark_names

    @cached_property
    def _limbs_of_joints(self) -> list[int]:
        return [LIMBS.index(limb_of(name)) for name in self.names]

    @cached_property
    def counterparts(self) -> NDArray[np.int64]:
        """Index of each joint's counterpart on the other side (L,); its own without one."""
        return np.array(other_side(self.names))

    @property
    def _limbs(self) -> Limbs:
        assert self.tracker.body.limbs is not None
        return self.tracker.body.limbs

    @cached_property
    def _radii(self) -> Array:
        return self._limbs.radii.mean((1, 2))

    @cached_property
    def _limb_of_parts(self) -> NDArray[np.int64]:
        return np.array([LIMBS.index(limb_of_part(part)) for part in self._limbs.parts])

    @cached_property
    def _surface_shares(self) -> Array:
        """Share of the body's surface that belongs to each of `LIMBS`, (5,)."""
        areas = np.bincount(self._limb_of_parts, self._radii * self._limbs.lengths, minlength=len(LIMBS))
        return areas / areas.sum()


def _along_axes(columns: dict[str, Array]) -> dict[str, Array]:
    """Components (L,) as they are along each of the three axes, (L, 3)."""
    return {name: np.repeat(values[:, None], 3, axis=1) for name, values in columns.items()}


@kernel
def _look_up(points, limbs, T, lens, mask, seen, out):  # pragma: no cover
    """Count the points (P, 3) of each limb that are in the picture into `seen` (5,), and those outside the mask (H, W) into `out` (5,)."""
    for p in range(limbs.size):
        x, y = pixel_nearest(T, lens, points[p, 0], points[p, 1], points[p, 2])
        if 0 <= x < mask.shape[1] and 0 <= y < mask.shape[0]:
            seen[limbs[p]] += 1
            out[limbs[p]] += not mask[y, x]


def kind_of(masks: Sequence[Mask | None], keypoints: KeypointEvidence | None) -> str:
    """The calibrated model of doubt by what is seen: `multiview`, `pair` of two cameras, `keypoints`, `keypoints_one` of one camera, or
    `both`."""
    if keypoints is None:
        return "pair" if len(masks) == 2 else "multiview"
    if any(mask is not None for mask in masks):
        return "both"
    return "keypoints" if keypoints.cameras > 1 else "keypoints_one"


def count_still(before: Before | None, masks: Sequence[Mask | None]) -> int:
    """Number of frames for which the silhouette of some camera with a person has not changed."""
    if before is None:
        return 0
    same = (now is not None and last is not None and now.any() and same_silhouette(now, last) for now, last in zip(masks, before.masks))
    return before.still + 1 if any(same) else 0
