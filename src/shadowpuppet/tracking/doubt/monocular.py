"""What one camera's frame says about doubt: the components of the joints' variances, along the camera's axes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import other_side
from shadowpuppet.body.upper_body import BOW
from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import LIMBS, joints_of_limbs, limb_of
from shadowpuppet.tracking.doubt.doubt import Doubt, Evidence, state_doubt
from shadowpuppet.tracking.doubt.limbs import levers_of, limb_of_part
from shadowpuppet.tracking.doubt.mirror import Mirrors
from shadowpuppet.tracking.doubt.steps import CONSTANT, DISTANCE, stillness
from shadowpuppet.tracking.doubt.variance import kind_before_one
from shadowpuppet.tracking.frozen import is_frozen, same_silhouette
from shadowpuppet.tracking.monocular.standing_place import standing_place
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State
from shadowpuppet.tracking.silhouette_cost import Landmarked
from shadowpuppet.tracking.unexplained import without

SAMPLES = 24
"""Number of poses drawn from the particles."""
TEMPERATURE = 100.0
"""A particle's weight falls to 1/e for this much more cost (pixels at 320 x 240): neighbouring pixels err together."""
THIN = 0.03
"""Half width of what an inaccurate outline may leave over, as a share of the root of the person's area."""
REACH = 1.1
"""Radius about a limb's root, over the limb's length, in which unexplained silhouette may be this limb's."""
TRUNK_REACH = 1.0
"""The same about the neck for the trunk, metres."""
MOST_UNEXPLAINED = 2.0
"""Bound of the unexplained silhouette, over the limb's area."""
BOWS_LOW = np.radians(75.0)
"""Bow of an upper body's trunk from which on it is not vouched for: the person may as well have come lower, as one who sits down, which a
body that keeps its height can only imitate so. The silhouette may fit all the same."""


class Before(NamedTuple):
    """What the next frame needs of this one."""

    mask: Mask
    """Silhouette (H, W)."""
    still: int
    """Number of frames for which it has been the same."""
    since: float
    """Time (s) of the first of them."""


@dataclass(frozen=True, eq=False)
class MonocularDoubt:
    """States doubt about the estimates of a `MonocularTracker`."""

    tracker: MonocularTracker

    def __call__(self, state: State, mask: Mask, seconds: float, before: Before | None) -> tuple[Doubt, Before]:
        """Doubt about the estimate of a mask (H, W) at a time (s); and what the next frame needs."""
        picture = self.tracker.picture
        evidence, now = self.evidence(state, mask, seconds, before)
        R = picture.camera.T_camera_world[:3, :3].T
        skeleton = picture.body.skeleton
        kind = kind_before_one(picture.body, keypoints=_keypoints_of(state) is not None)
        found = state_doubt(kind, evidence, self.names, skeleton, picture.points, state.pose, state.status, R)
        return (found._replace(limb_status=self._without_trunk(found.limb_status)) if self._bows_low(state.pose) else found), now

    def _bows_low(self, pose: Array) -> bool:
        """Whether the trunk of a pose (D,) bows over `BOWS_LOW`."""
        names = self.tracker.picture.body.skeleton.dof_names
        return BOW in names and bool(pose[names.index(BOW)] > BOWS_LOW)

    def _without_trunk(self, statuses: Sequence[str]) -> tuple[str, ...]:
        """The limbs' statuses with a trunk that is not vouched for."""
        return tuple("uncertain" if limb == "trunk" and status == "tracked" else status
                     for limb, status in zip(joints_of_limbs(self.names), statuses, strict=True))

    def evidence(self, state: State, mask: Mask, seconds: float, before: Before | None) -> tuple[Evidence, Before]:
        """What the frame shows about the accuracy of the estimate of a mask (H, W) at a time (s); and what the next frame needs.

        Axes are the camera's: x right, y down, z forward. Of every joint there are: a constant; the particles' spread across and along
        the view; the depth by which the trunk turns, and bows; of its limb, the hidden share, the silhouette near it that nothing explains,
        the share outside the silhouette and the share outside the picture, times the joint's lever, the hidden share of an arm times what
        does not match its colours, if they are known; how long the silhouette has not changed; the distances to
        the mirror images of each arm; and the error of the person's distance.
        """
        points = self.tracker.picture.points(state.pose[None])[0]
        at, lever = dict(zip(self.names, points)), levers_of(self.names)
        still = before.still + 1 if before is not None and same_silhouette(before.mask, mask) else 0
        spread = self._spread(state, points)
        # what is left out beside the body is no evidence for a pose, but one against the limbs near it
        known = state.observation if state.unexplained is None else None
        observation = self.tracker.observe(mask, state.pose) if known is None else known
        images = self._mirrors.images(state.pose, points, observation)
        shares = self._shares(state.pose, points, mask, unpack(observation.ignore, mask.shape[1]))
        arms, seen = None if state.observation is None else state.observation.arms, _keypoints_of(state)
        colours = {} if arms is None else self.tracker.arm_colours.mismatch(arms, state.pose)
        missed = {} if seen is None else seen.missed(state.pose)
        for limb, share in (*colours.items(), *missed.items()):  # an arm before the trunk is seen by its colours or a detector's joints
            hidden, unexplained, outside, cut = shares[limb]
            shares[limb] = (hidden * share, unexplained, outside, cut)
        columns = np.array([shares.get(limb_of(name), (0.0,) * 4) for name in self.names]) * lever[:, None]
        found = dict(zip(("hidden", "unexplained", "outside", "cut"), columns.T)) | {
            "constant": np.full(len(points), CONSTANT),
            "spread": np.sqrt((spread[:, :2] ** 2).mean(1)),
            "spread_depth": spread[:, 2],
            "turned": np.full(len(points), abs(at["left_shoulder"][2] - at["right_shoulder"][2])),
            "bowed": np.full(len(points), abs(at["neck"][2] - at["pelvis"][2])),
            "still": stillness(still) * lever,
        }
        components = {name: np.repeat(values[:, None], 3, axis=1) for name, values in found.items()}
        components["alternative"] = images.displacements(points)
        components["distance"] = points * (0, 0, DISTANCE)
        if self.tracker.picture.body.hem is None:
            components |= self._of_whole(state.pose, points, without(mask, state.unexplained))
        if seen is not None:
            components |= self._by_keypoints(missed, seen.against(state.pose), points)
        unseen = {limb: max(hidden, cut) for limb, (hidden, _, _, cut) in shares.items()}
        since = before.since if still and before is not None else seconds
        evidence = Evidence(components, unseen, is_frozen(still, seconds - since), self._mirrors.modes(points, images))
        return evidence, Before(mask, still, since)

    def _of_whole(self, pose: Array, points: Array, mask: Mask) -> dict[str, Array]:
        """Components (L, 3) of a whole body with landmarks `points` (L, 3): their distances from the other side's joints; and those of the
        pelvis from where it would be if the person stood upright in a mask (H, W), by stature and by the floor, or a metre of depth where
        the mask does not show their stature."""
        tracker, pelvis = self.tracker, self.names.index("pelvis")

        def off(floor: float | None) -> Array | None:
            stands = standing_place(tracker.picture, mask, floor, tracker.upright(pose))
            return None if stands is None else np.abs(tracker.picture.points(stands[None])[0, pelvis] - points[pelvis])

        nowhere, stature, floor = np.zeros(3), off(None), None if tracker.floor is None else off(tracker.floor)
        depth = np.array([0.0, 0, 1]) if stature is None else nowhere
        found = {"stature": nowhere if stature is None else stature, "no_stature": depth, "floor": nowhere if floor is None else floor}
        return {"swapped": np.abs(points - points[self._counterparts]),
                **{name: np.broadcast_to(length, points.shape) for name, length in found.items()}}

    def _by_keypoints(self, missed: Mapping[str, float], against: float, points: Array) -> dict[str, Array]:
        """Components (L, 3) of landmarks `points` (L, 3): the share `missed` of its limb's joints that no keypoint shows, times the joint's
        lever; and the distance from the other side's joint, times the root of the probability, of log odds `against`, that sides are
        exchanged."""
        turned = 1 / (1 + np.exp(-against))
        share = np.array([missed.get(limb_of(name), 1.0) for name in self.names]) * levers_of(self.names)
        return {"missed": np.repeat(share[:, None], 3, axis=1), "exchanged": np.sqrt(turned) * np.abs(points - points[self._counterparts])}

    @cached_property
    def _counterparts(self) -> list[int]:
        """Of each landmark the other side's; its own without."""
        return other_side(self.names)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the L landmarks."""
        return self.tracker.picture.body.landmark_names

    @cached_property
    def _mirrors(self) -> Mirrors:
        return Mirrors(self.tracker.picture)

    @cached_property
    def _parts(self) -> dict[str, NDArray[np.int64]]:
        """Indices of the shapes of each limb that the body has."""
        limbs = [limb_of_part(name) for name in self.tracker.picture.body.parts]
        return {limb: np.flatnonzero([own == limb for own in limbs]) for limb in LIMBS if limb in limbs}

    def _spread(self, state: State, points: Array) -> Array:
        """Root mean squared distance (L, 3) from the estimate's joints, `points`, to those of poses drawn from the particles."""
        poses, scale = np.repeat(state.pose[None], SAMPLES, axis=0), self.tracker.stages[0].scale
        for n, (stage, particles) in enumerate(zip(self.tracker.stages, state.particles)):
            weights = np.exp((particles.costs.min() - particles.costs) / (TEMPERATURE * scale))
            along = (np.arange(SAMPLES) + 0.5) / SAMPLES * weights.sum()
            drawn = np.searchsorted(np.cumsum(weights), along).clip(0, len(weights) - 1)
            poses[:, stage.dofs] = particles.poses[np.random.default_rng(n).permutation(drawn)]  # stages are independent
        return np.sqrt(((self.tracker.picture.points(poses) - points) ** 2).mean(0))

    def _shares(self, pose: Array, points: Array, mask: Mask, ignored: Mask) -> dict[str, tuple[float, float, float, float]]:
        """Of each limb, drawn in a pose (D,), the share that is hidden before or behind others, the silhouette near it that nothing
        explains over its area, and the shares outside the mask (H, W) and outside the picture. `points` (L, 3): the joints in the
        camera's frame; `ignored` (H, W): pixels that do not count."""
        import cv2

        picture, width = self.tracker.picture, self.tracker.picture.camera.size[0]
        drawn = {limb: unpack(picture.draw(pose, parts), width) for limb, parts in self._parts.items()}
        times = np.add.reduce([limb.view(np.uint8) for limb in drawn.values()])
        body = times > 0
        counted = ~ignored
        square = np.ones((2 * max(1, round(THIN * float(np.sqrt(np.count_nonzero(body))))) + 1,) * 2, np.uint8)

        def thick(pixels: NDArray[np.bool_]) -> NDArray[np.bool_]:
            return cv2.morphologyEx(pixels.view(np.uint8), cv2.MORPH_OPEN, square).view(bool)

        rows, columns = np.nonzero(thick(mask & ~body & counted))
        outside = thick(body & ~mask & counted)
        R, t = picture.camera.T_camera_world[:3, :3], picture.camera.T_camera_world[:3, 3]
        pixels = picture.camera.project((points - t) @ R)
        cut = ~np.asarray(((pixels >= 0) & (pixels < picture.camera.size)).all(1))
        shares = {}
        for limb, own in drawn.items():
            area = max(np.count_nonzero(own), 1)
            (x, y), reach = self._reach(limb, points, pixels)
            near = np.count_nonzero((columns - x) ** 2 + (rows - y) ** 2 < reach**2)
            shares[limb] = (np.count_nonzero(own & (times > 1)) / area, min(near / area, MOST_UNEXPLAINED),
                            np.count_nonzero(own & outside) / area, float(cut[joints_of_limbs(self.names)[limb]].mean()))
        return shares

    def _reach(self, limb: str, points: Array, pixels: Array) -> tuple[Array, float]:
        """Centre (2,) and radius, pixels, of the region in which a limb may be."""
        focal, own = float(self.tracker.picture.camera.matrix[0, 0]), joints_of_limbs(self.names)[limb]
        root = self.names.index("neck") if limb == "trunk" else own[0]
        length = TRUNK_REACH if limb == "trunk" else REACH * float(np.sqrt((np.diff(points[own], axis=0) ** 2).sum(1)).sum())
        return pixels[root], length * focal / points[root, 2]


def _keypoints_of(state: State) -> Landmarked | None:
    """The keypoints of a state's frame, if there are any."""
    return None if state.observation is None else state.observation.keypoints
