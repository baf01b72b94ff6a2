"""What one camera's frame says about doubt: the components of the joints' variances, along the camera's axes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import unpack
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.doubt.limbs import LIMBS, lever_of, limb_of, limb_of_part
from shadowpuppet.tracking.doubt.steps import CONSTANT, steps, stillness
from shadowpuppet.tracking.doubt.variance import Components
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State

SAMPLES = 24
"""Number of poses drawn from the particles."""
TEMPERATURE = 100.0
"""A particle's weight falls to 1/e for this much more cost (pixels at 320 x 240): neighbouring pixels err together."""
SHORTENING = 0.02
"""Uncertainty (m) of a segment's length in the picture, from outline and body shape."""
THIN = 0.03
"""Half width of what an inaccurate outline may leave over, as a share of the root of the person's area."""
GOOD_MISFIT = 0.05
"""Share of the pixels that differ though the pose is right."""
REACH = 1.1
"""Radius about a limb's root, over the limb's length, in which unexplained silhouette may be this limb's."""
TRUNK_REACH = 1.0
"""The same about the neck for the trunk, metres."""
MOST_UNEXPLAINED = 2.0
"""Bound of the unexplained silhouette, over the limb's area."""


class Before(NamedTuple):
    """What the next frame needs of this one."""

    seconds: float
    points: Array
    """Landmarks (L, 3), camera's frame, metres."""
    mask: Mask
    """Silhouette (H, W)."""
    still: int
    """Number of frames for which it has been the same, pixel by pixel."""


@dataclass(frozen=True, eq=False)
class MonocularEvidence:
    """Components of doubt about the estimates of a `MonocularTracker`."""

    tracker: MonocularTracker

    def components(self, state: State, mask: Mask, seconds: float, before: Before | None) -> tuple[Components, Before]:
        """Lengths (L, 3), metres, by name, for the estimate of a mask (H, W) at a time (s); and what the next frame needs.

        Axes are the camera's: x right, y down, z forward. Of every joint there are: a constant; the particles' spread across and along
        the view; the distance in depth to its mirror image, which draws the same silhouette (an arm before or behind the body, the trunk
        turned to the left or right); the error of depth by foreshortening; of its limb, the hidden share, the silhouette near it that
        nothing explains, the share outside the silhouette and the share outside the picture, times the joint's lever; its last step; the
        misfit of the whole body; how long the silhouette has not changed; and the depth by which the trunk bows.
        """
        points = self.tracker.picture.points(state.pose[None])[0]
        at, lever = dict(zip(self.names, points)), self.levers
        still = before.still + 1 if before is not None and np.array_equal(before.mask, mask) else 0
        spread = self._spread(state, points)
        found = self._silhouettes(state.pose, at, mask) | {
            "constant": np.full(len(points), CONSTANT),
            "spread": np.sqrt((spread[:, :2] ** 2).mean(1)),
            "spread_depth": spread[:, 2],
            "mirrored": np.array([_mirrored(at, name) for name in self.names]),
            "foreshortened": np.array([_foreshortened(at, name) for name in self.names]),
            "turned": np.full(len(points), abs(at["left_shoulder"][2] - at["right_shoulder"][2])),
            "bowed": np.full(len(points), abs(at["neck"][2] - at["pelvis"][2])),
            "step": steps(points, seconds, before),
            "misfit": max(1 - state.overlap - GOOD_MISFIT, 0.0) * lever,
            "still": stillness(still) * lever,
        }
        return {name: np.repeat(values[:, None], 3, axis=1) for name, values in found.items()}, Before(seconds, points, mask, still)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the L landmarks."""
        return self.tracker.picture.body.landmark_names

    @cached_property
    def levers(self) -> Array:
        """The joints' levers (L,), metres."""
        return np.array([lever_of(name) for name in self.names])

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

    def _silhouettes(self, pose: Array, at: Mapping[str, Array], mask: Mask) -> dict[str, Array]:
        """Components (L,) from the drawn limbs of a pose (D,) and the mask (H, W); `at`: the joints in the camera's frame."""
        import cv2

        picture, width = self.tracker.picture, self.tracker.picture.camera.size[0]
        drawn = {limb: unpack(picture.draw(pose, parts), width) for limb, parts in self._parts.items()}
        times = np.add.reduce([limb.view(np.uint8) for limb in drawn.values()])
        body = times > 0
        counted = ~picture.legs(pose) if self.tracker.settings.ignore_legs else np.ones_like(body)
        square = np.ones((2 * max(1, round(THIN * float(np.sqrt(np.count_nonzero(body))))) + 1,) * 2, np.uint8)

        def thick(pixels: NDArray[np.bool_]) -> NDArray[np.bool_]:
            return cv2.morphologyEx(pixels.view(np.uint8), cv2.MORPH_OPEN, square).view(bool)

        rows, columns = np.nonzero(thick(mask & ~body & counted))
        outside, pixels = thick(body & ~mask & counted), self._pixels(at)
        shares = {}
        for limb, own in drawn.items():
            area = max(np.count_nonzero(own), 1)
            (x, y), reach = self._reach(limb, at, pixels)
            near = np.count_nonzero((columns - x) ** 2 + (rows - y) ** 2 < reach**2)
            shares[limb] = (np.count_nonzero(own & (times > 1)) / area, min(near / area, MOST_UNEXPLAINED),
                            np.count_nonzero(own & outside) / area, self._cut(limb, pixels))
        columns_of = np.array([shares.get(limb_of(name), (0.0,) * 4) for name in self.names]) * self.levers[:, None]
        return dict(zip(("hidden", "unexplained", "outside", "cut"), columns_of.T))

    def _pixels(self, at: Mapping[str, Array]) -> dict[str, Array]:
        """Pixel (2,) of each joint."""
        camera = self.tracker.picture.camera
        R, t = camera.T_camera_world[:3, :3], camera.T_camera_world[:3, 3]
        return dict(zip(at, camera.project((np.array(list(at.values())) - t) @ R)))

    def _reach(self, limb: str, at: Mapping[str, Array], pixels: Mapping[str, Array]) -> tuple[Array, float]:
        """Centre (2,) and radius, pixels, of the region in which a limb may be."""
        focal = float(self.tracker.picture.camera.matrix[0, 0])
        if limb == "trunk":
            return pixels["neck"], TRUNK_REACH * focal / at["neck"][2]
        joints = [name for name in self.names if limb_of(name) == limb]
        length = sum(float(np.linalg.norm(at[b] - at[a])) for a, b in zip(joints, joints[1:]))
        return pixels[joints[0]], REACH * length * focal / at[joints[0]][2]

    def _cut(self, limb: str, pixels: Mapping[str, Array]) -> float:
        """Share of a limb's joints outside the picture."""
        size = self.tracker.picture.camera.size
        joints = np.array([pixels[name] for name in self.names if limb_of(name) == limb])
        return float(1 - ((joints >= 0) & (joints < size)).all(1).mean())


CHAINS = {"elbow": ("shoulder", "elbow"), "wrist": ("shoulder", "elbow", "wrist"), "hand": ("shoulder", "elbow", "wrist"),
          "fist": ("shoulder", "elbow", "wrist"), "knee": ("hip", "knee"), "ankle": ("hip", "knee", "ankle")}
"""Joints from a limb's root on whose directions a joint's place depends."""


def _bones(at: Mapping[str, Array], joint: str) -> list[tuple[float, float]]:
    """Length (m) of each bone from the limb's root to a joint, and its part along the view through its end."""
    side, _, name = joint.partition("_")
    chain = [f"{side}_{each}" for each in CHAINS.get(name, ())]
    bones = [(at[b] - at[a], at[b] / np.linalg.norm(at[b])) for a, b in zip(chain, chain[1:])]
    return [(float(np.linalg.norm(bone)), float(bone @ view)) for bone, view in bones]


def _mirrored(at: Mapping[str, Array], joint: str) -> float:
    """How far in depth (m) a joint moves if the bones above it point as far to the front as they do to the back."""
    return float(np.sqrt(sum((2 * depth) ** 2 for _, depth in _bones(at, joint))))


def _foreshortened(at: Mapping[str, Array], joint: str) -> float:
    """Error of a joint's depth (m) if the bones above it look longer or shorter by `SHORTENING`; the shoulders' line is one of them."""
    if joint.partition("_")[0] not in SIDES:
        return 0.0
    across = at["left_shoulder"] - at["right_shoulder"]
    bones = [(float(np.linalg.norm(across)) / 2, float(across[2]) / 2), *_bones(at, joint)]
    return float(np.sqrt(sum(_depth_error(length, depth) ** 2 for length, depth in bones)))


def _depth_error(length: float, depth: float) -> float:
    seen = np.sqrt(max(length**2 - depth**2, 0.0))
    return float(min(seen * SHORTENING / max(abs(depth), 1e-6), np.sqrt(2 * length * SHORTENING)))
