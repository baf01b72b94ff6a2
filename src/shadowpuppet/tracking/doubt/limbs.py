"""Groups of joints that share their factors of doubt, and the parts of bodies' shapes that belong to each limb."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import doubtful_joints, doubtful_limbs, joints_of_limbs

GROUPS = {"pelvis": ("pelvis",), "neck": ("neck", "head"), "shoulder": ("shoulder",), "elbow": ("elbow",),
          "hand": ("wrist", "hand", "fist"), "hip": ("hip",), "knee": ("knee",), "ankle": ("ankle",),
          "sole": ("heel", "toe")}
"""Groups of joints that share their factors of doubt; left and right are alike."""
_GROUP_OF = {joint: group for group, joints in GROUPS.items() for joint in joints}
LEG_PARTS = ("thigh", "shank", "foot", "upper_leg", "lower_leg")
LEVER = {"shoulder": 0.15, "elbow": 0.3, "wrist": 0.55, "hand": 0.6, "fist": 0.7, "hip": 0.15, "knee": 0.4, "ankle": 0.8,
         "heel": 0.8, "toe": 0.8}
"""Distance (m) by which a joint may be off if nothing is known of its limb's direction."""
TRUNK_LEVER = 0.3


def group_of(joint: str) -> str:
    """The group that a joint belongs to."""
    return _GROUP_OF[joint.rpartition("_")[2]]


def lever_of(joint: str) -> float:
    """The joint's lever (m)."""
    return LEVER.get(joint.partition("_")[2], TRUNK_LEVER)


@cache
def levers_of(joints: tuple[str, ...]) -> Array:
    """The joints' levers (L,), metres. Not to be changed: kept for the next call."""
    return np.array([lever_of(joint) for joint in joints])


def limb_of_part(part: str) -> str:
    """The limb that a part of a body's shape, such as `left_forearm`, belongs to; a shoulder moves with the trunk."""
    side, _, name = part.partition("_")
    if side not in SIDES or name in ("", "shoulder"):
        return "trunk"
    return f"{side}_leg" if name in LEG_PARTS else f"{side}_arm"


def beyond(limits: Mapping[str, float], joints: Sequence[str], sd: Array) -> NDArray[np.bool_]:
    """Whether a joint of each limb (..., limbs), by the deviations (..., L, 3), metres, of `joints`, is off by more than the limit (m) for
    limbs of its kind, all axes together; what is not a number is."""
    radius = np.sqrt((sd**2).sum(-1))
    limbs = joints_of_limbs(tuple(joints)).items()
    return np.stack([~(radius[..., own].max(-1) <= limits[limb.rpartition("_")[2]]) for limb, own in limbs], -1)


def doubtful_names(body: Body, statuses: Sequence[str] | None) -> frozenset[str]:
    """Names of the landmarks and shape parts of a body's limbs of a status of `DOUBTFUL`, which are drawn dashed. `statuses`: one
    for each limb of the body; None: all vouched for."""
    limbs = doubtful_limbs(body.landmark_names, statuses)
    return doubtful_joints(body.landmark_names, statuses) | {part for part in body.parts if limb_of_part(part) in limbs}
