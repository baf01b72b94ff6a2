"""Limbs and groups of joints, for which doubt is stated."""

from __future__ import annotations

from shadowpuppet.body.skeleton import SIDES

LIMBS = ("trunk", "left_arm", "right_arm", "left_leg", "right_leg")
"""Limbs with a status of their own: an arm is shoulder to hand, a leg hip to foot, the trunk is the rest."""
ARM, LEG = ("shoulder", "elbow", "wrist", "hand", "fist"), ("hip", "knee", "ankle")
GROUPS = {"pelvis": ("pelvis",), "neck": ("neck", "head"), "shoulder": ("shoulder",), "elbow": ("elbow",), "hand": ("wrist", "hand", "fist"),
          "hip": ("hip",), "knee": ("knee",), "ankle": ("ankle",)}
"""Groups of joints that share their factors of doubt; left and right are alike."""
_GROUP_OF = {joint: group for group, joints in GROUPS.items() for joint in joints}
LEG_PARTS = ("thigh", "shank", "foot", "upper_leg", "lower_leg")
LEVER = {"shoulder": 0.15, "elbow": 0.3, "wrist": 0.55, "hand": 0.6, "fist": 0.7, "hip": 0.15, "knee": 0.4, "ankle": 0.8}
"""Distance (m) by which a joint may be off if nothing is known of its limb's direction."""
TRUNK_LEVER = 0.3


def limb_of(joint: str) -> str:
    """The limb that a joint, such as `left_elbow`, belongs to."""
    side, _, name = joint.partition("_")
    return f"{side}_arm" if name in ARM else f"{side}_leg" if name in LEG else "trunk"


def group_of(joint: str) -> str:
    """The group that a joint belongs to."""
    return _GROUP_OF[joint.rpartition("_")[2]]


def lever_of(joint: str) -> float:
    """The joint's lever (m)."""
    return LEVER.get(joint.partition("_")[2], TRUNK_LEVER)


def limb_of_part(part: str) -> str:
    """The limb that a part of a body's shape, such as `left_forearm`, belongs to."""
    side, _, name = part.partition("_")
    if side not in SIDES or not name:
        return "trunk"
    return f"{side}_leg" if name in LEG_PARTS else f"{side}_arm"
