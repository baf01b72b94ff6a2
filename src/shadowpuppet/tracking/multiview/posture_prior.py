"""What postures are usual: to begin with, to try beside others, and as a weak prior on what surface points do not tell, such as how a bend
is shared by pelvis and chest."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array

WIDER, LEAST = 1.5, 0.15
"""What training poses' deviations are multiplied by, and what they are at least (rad): others than those come."""
SEEN = ("left_", "right_")
"""Joints whose angles the surface shows well enough."""
BOUND = 9.0
"""No DOF counts for more than this, three deviations' worth (see `Skeleton.strain`)."""

ARMS = ((8, 5, 10), (0, 90, 0), (90, 10, 5), (170, 10, 10), (20, 20, 95), (-30, 20, 60))
"""An arm: flexion and abduction of the shoulder, flexion of the elbow, degrees."""
LEGS = (((3, 5), (3, 5), 0), ((25, 10), (-15, 20), 0), ((-15, 20), (25, 10), 0), ((85, 90), (85, 90), 25), ((70, 10), (70, 10), 60))
"""Flexion of the left hip and knee, of the right ones, and the pelvis' bow, degrees: standing, two strides, a squat, a bow."""


@dataclass(frozen=True, eq=False)
class Usual:
    """Rest and deviations of every DOF; infinite where nothing is usual."""

    rest: Array
    below: Array
    above: Array

    @classmethod
    def of(cls, skeleton: Skeleton, library: Array | None = None) -> Usual:
        """As the skeleton has it; angles but the heading as the poses of a `library` (L, D), such as training motion, have it."""
        rest, below, above = (np.array(each) for each in skeleton.rest_and_spread)
        if library is not None and len(library) > 1:
            known = np.isfinite(below)
            spread = np.maximum(WIDER * library.std(0), LEAST)
            rest, below, above = (np.where(known, new, old) for new, old in ((library.mean(0), rest), (spread, below), (spread, above)))
        seen = np.array([not dof.joint.startswith(SEEN) for dof in skeleton.dofs])
        return cls(rest, np.where(seen, below, np.inf), np.where(seen, above, np.inf))

    def strain(self, poses: Array) -> Array:
        """Squared deviations of poses (N, D), summed (N,), each DOF bounded."""
        squared = self._squared(poses)
        return (squared / (1 + squared / BOUND)).sum(1)

    def pull(self, pose: Array) -> Array:
        """Weights (D,) of squared distances from rest that make up the strain near a pose (D,), 1 / rad^2."""
        fade = 1 + self._squared(pose[None])[0] / BOUND
        return 1 / (np.where(pose < self.rest, self.below, self.above) * fade) ** 2

    def held(self, pose: Array, pull: float, weight: float) -> tuple[Array, Array]:
        """Where a pose (D,) is held that is pulled to itself, and by the `weight` of its strain to rest: centre and pull, each (D,)."""
        rest = weight * self.pull(pose)
        return (pull * pose + rest * self.rest) / (pull + rest + 1e-30), pull + rest

    def _squared(self, poses: Array) -> Array:
        off = poses - self.rest
        return (off / np.where(off < 0, self.below, self.above)) ** 2


def usual_postures(skeleton: Skeleton) -> Array:
    """Poses (L, D) to begin with where no other are known: each arm and the legs in every way."""
    return np.array([_posture(skeleton, both, legs) for both, legs in product(product(ARMS, ARMS), LEGS)])


def usual_arms(skeleton: Skeleton, side: str) -> dict[str, Array]:
    """An arm's degrees of freedom by name, and what each is in the usual postures, of shape (A,)."""
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
    """A limb's direction, in the angles that the skeleton has."""
    name = f"{side}_{joint}"
    if f"{name}_flexion" in skeleton.dof_names:
        return {f"{name}_flexion": flexion, f"{name}_abduction": abduction}
    return {f"{name}_x": abduction if side == "left" else -abduction, f"{name}_y": -flexion}
