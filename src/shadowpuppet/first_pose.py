"""A pose from one silhouette and no earlier pose: coarse poses are tried, part after part."""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.likelihood import Observation, PartialCost
from shadowpuppet.rasterize import Picture
from shadowpuppet.skeleton import Skeleton

ARM_PARTS = ("upper_arm", "forearm", "hand")
GOOD = 40
"""So many of the coarse arms that were tried, the best, are worth beginning a filter's particles around."""


@cache
def coarse_arms() -> Array:
    """Arms (K, 4), rad, all over their range: abduction, forward, roll, flexion. A straight arm has no roll. Made once, read-only."""
    bent = [(roll, flexion) for roll in (-80, -40, 0, 45, 90) for flexion in (45, 90, 130)]
    arms = np.radians([(*shoulder, *elbow) for shoulder in product((0, 20, 45, 70, 90, 110, 135, 165), (0, 40, 80))
                       for elbow in ((0, 5), *bent)])  # fmt: skip
    arms.setflags(write=False)
    return arms


def arm_parts(picture: Picture, side: str) -> list[str]:
    """Names of an arm's parts that the body has."""
    return [part for part in dict.fromkeys(picture.body.parts) if part in {f"{side}_{name}" for name in ARM_PARTS}]


def arm_dofs(skeleton: Skeleton, side: str) -> NDArray[np.int64]:
    """Indices of an arm's DOF, in the order of `coarse_arms`."""
    return np.flatnonzero([name.startswith(side) for name in skeleton.dof_names])


class FirstPose(NamedTuple):
    """What the search found."""

    pose: Array
    """The best pose, of shape (D,)."""
    cost: float
    """Its cost, pixels."""
    arms: dict[str, Array]
    """For each side all arms tried, (K, 4), the best first."""


def search(picture: Picture, mask: NDArray[np.bool_]) -> FirstPose:
    """The upright pose and the coarse arms of least cost (eq. 2) in a mask (H, W); legs do not count.

    The torso is moved sideways with no arms drawn, then each arm is tried with the other not drawn, and once more with it.
    """
    skeleton = picture.body.skeleton
    hidden = {side: arm_parts(picture, side) for side in SIDES}
    sideways = skeleton.dof_indices(["torso_y"])
    poses = np.zeros((161, len(skeleton.dofs)))
    poses[:, sideways[0]] = np.linspace(-1, 1, 161) * _half_width(picture)
    torso = PartialCost(picture, sideways, hidden=sum(hidden.values(), []))
    pose = poses[np.argmin(torso.costs(Observation.without_legs(mask, picture, poses[80]), poses[80])(poses))]
    observation = Observation.without_legs(mask, picture, pose)
    library = coarse_arms()
    arms: dict[str, Array] = {}
    least = np.inf
    for side, other in (("left", "right"), ("right", "left"), ("left", "right")):
        dofs = arm_dofs(skeleton, side)
        poses = np.repeat(pose[None], len(library), axis=0)
        poses[:, dofs] = library
        drawn = PartialCost(picture, dofs, hidden=() if other in arms else hidden[other])
        costs = drawn.costs(observation, pose)(poses)
        ranked = np.argsort(costs, kind="stable")
        arms[side], pose, least = library[ranked], poses[ranked[0]], float(costs[ranked[0]])
    return FirstPose(pose, least, arms)


def _half_width(picture: Picture) -> float:
    """Half of what the camera sees at the body's distance, metres."""
    return abs(float(picture.T_camera_base[2, 3])) * picture.camera.size[0] / 2 / picture.camera.matrix[0, 0]
