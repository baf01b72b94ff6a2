"""Usual postures: initial poses of a search, and a weak prior on angles that surface points hardly determine (as of pelvis and chest)."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array

INFLATION, MIN_DEVIATION = 1.5, 0.15
"""Factor and minimum (rad) of the training poses' standard deviations; test poses vary more."""
OBSERVED_JOINTS = ("left_", "right_")
"""Prefixes of joints whose angles the surface shows well enough; they have no prior."""
UNSHOWN = ("_ankle_inversion",)
"""Ends of the names of their DOF that it does not show: a foot's roll hardly changes the hull."""
ANKLES = "_ankle_flexion"
"""End of the names of the ankles' DOF that raise and lower the toes."""
MAX_PENALTY = 9.0
"""Bound of each DOF's penalty: that of three standard deviations (see `Skeleton.posture_penalty`)."""

ARMS = ((8, 5, 10), (0, 90, 0), (90, 10, 5), (170, 10, 10), (20, 20, 95), (-30, 20, 60))
"""Usual arms: shoulder flexion and abduction, elbow flexion, degrees."""
LEGS = (((3, 5), (3, 5), 0), ((25, 10), (-15, 20), 0), ((-15, 20), (25, 10), 0), ((85, 90), (85, 90), 25), ((70, 10), (70, 10), 60),
        ((88, 85), (88, 85), 0), ((0, 90), (0, 90), 0), ((5, 5), (5, 5), -90), ((5, 5), (5, 5), 90))
"""Usual legs: flexion of left hip and knee, of right hip and knee, bow of the pelvis, degrees: standing, two strides, a squat, a bow;
seated, kneeling, lying on the back and on the front."""


class Rest(NamedTuple):
    """Some DOF as they are at rest."""

    dofs: NDArray[np.int64]
    """Their indices (K,)."""
    rest: Array
    """Values (K,), rad."""
    below: Array
    above: Array
    """Deviations (K,) below and above them, rad."""


@dataclass(frozen=True, eq=False)
class PosturePrior:
    """Rest values of the DOF, and deviations below and above them, each of shape (D,); infinite for DOF without a prior."""

    rest: Array
    below: Array
    above: Array
    ankles: Rest
    """Of the ankles' flexions: the feet of people who stand are level."""

    @classmethod
    def of(cls, skeleton: Skeleton, library: Array | None = None) -> PosturePrior:
        """The skeleton's own prior; with a `library` of poses (L, D), such as training motion, rest and deviations are the library's."""
        rest, below, above = (np.array(each) for each in skeleton.rest_and_spread)
        if library is not None and len(library) > 1:
            known = np.isfinite(below)
            spread = np.maximum(INFLATION * library.std(0), MIN_DEVIATION)
            rest, below, above = (np.where(known, new, old) for new, old in ((library.mean(0), rest), (spread, below), (spread, above)))
        constrained = np.array([not dof.joint.startswith(OBSERVED_JOINTS) or dof.name.endswith(UNSHOWN) for dof in skeleton.dofs])
        ends = [n for n, dof in enumerate(skeleton.dofs) if dof.name.endswith(ANKLES)]
        ankles = Rest(np.array(ends, np.int64), *(np.array(each)[ends] for each in skeleton.rest_and_spread))
        return cls(rest, np.where(constrained, below, np.inf), np.where(constrained, above, np.inf), ankles)

    def rarity_of_feet(self, poses: Array) -> Array:
        """How rare the flexions of both ankles are among people (N,), of poses (N, D), as minus a log density: half the squared deviations,
        each bounded."""
        squared = _squared(poses[:, self.ankles.dofs], *self.ankles[1:])
        return 0.5 * (squared / (1 + squared / MAX_PENALTY)).sum(1)

    def penalty(self, poses: Array) -> Array:
        """Penalty (N,) of poses (N, D): squared deviations from rest in units of the prior's, each bounded, summed over the DOF."""
        squared = self._squared(poses)
        return (squared / (1 + squared / MAX_PENALTY)).sum(1)

    def pull(self, pose: Array) -> Array:
        """Weights (D,), 1 / rad^2, of the squared distances from rest that approximate the penalty near a pose (D,)."""
        fade = 1 + self._squared(pose[None])[0] / MAX_PENALTY
        return 1 / (np.where(pose < self.rest, self.below, self.above) * fade) ** 2

    def quadratic(self, pose: Array, pull: float, weight: float) -> tuple[Array, Array]:
        """Centre (D,) and weights (D,) of a quadratic cost: `pull` toward a pose (D,), plus `weight` times the penalty, toward rest."""
        rest = weight * self.pull(pose)
        return (pull * pose + rest * self.rest) / (pull + rest + 1e-30), pull + rest

    def _squared(self, poses: Array) -> Array:
        return _squared(poses, self.rest, self.below, self.above)


def _squared(values: Array, rest: Array, below: Array, above: Array) -> Array:
    """Squared deviations (N, D) of values (N, D) from rest, in units of those below and above it (D,)."""
    off = values - rest
    return (off / np.where(off < 0, below, above)) ** 2


def usual_postures(skeleton: Skeleton) -> Array:
    """Initial poses (L, D) of a search: all combinations of `ARMS`, left and right, and `LEGS`."""
    return np.array([_posture(skeleton, both, legs) for both, legs in product(product(ARMS, ARMS), LEGS)])


def usual_arms(skeleton: Skeleton, side: str) -> dict[str, Array]:
    """Values (A,) of each of an arm's DOF, by name, in the usual postures."""
    poses = np.array([skeleton.clamp(skeleton.pose(**_arm(skeleton, side, arm))) for arm in ARMS])
    names = [dof.name for dof in skeleton.dofs if dof.joint in (f"{side}_shoulder", f"{side}_elbow")]
    return {name: poses[:, d] for name, d in zip(names, skeleton.dof_indices(names))}


def _posture(skeleton: Skeleton, arms: tuple, legs: tuple) -> Array:
    angles = {"root_bow": float(np.radians(legs[2]))}
    for side, arm, (hip, knee) in zip(("left", "right"), arms, np.radians(legs[:2]).tolist(), strict=True):
        angles |= _arm(skeleton, side, arm) | _swing(skeleton, side, "hip", hip, 0.05) | {f"{side}_knee_flexion": knee}
    return skeleton.clamp(skeleton.pose(**angles))


def _arm(skeleton: Skeleton, side: str, arm: tuple[float, float, float]) -> dict[str, float]:
    flexion, abduction, elbow = np.radians(arm).tolist()
    return _swing(skeleton, side, "shoulder", flexion, abduction) | {f"{side}_elbow_flexion": elbow}


def _swing(skeleton: Skeleton, side: str, joint: str, flexion: float, abduction: float) -> dict[str, float]:
    """Flexion and abduction of a limb (rad) as the skeleton's own angles."""
    name = f"{side}_{joint}"
    if f"{name}_flexion" in skeleton.dof_names:
        return {f"{name}_flexion": flexion, f"{name}_abduction": abduction}
    return {f"{name}_x": abduction if side == "left" else -abduction, f"{name}_y": -flexion}
