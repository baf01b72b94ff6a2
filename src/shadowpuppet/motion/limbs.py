"""The limbs of a body by the names of its joints."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

LIMBS = ("trunk", "left_arm", "right_arm", "left_leg", "right_leg")
"""Limbs that have a status of their own: an arm is shoulder to hand, a leg hip to foot, the trunk is the rest."""
DOUBTFUL = ("uncertain", "predicted")
"""Statuses of a limb that keeps its place without being vouched for."""
ARM, LEG = ("shoulder", "elbow", "wrist", "hand", "fist"), ("hip", "knee", "ankle", "heel", "toe")


@cache
def limb_of(joint: str) -> str:
    """The limb that a joint, such as `left_elbow`, belongs to."""
    side, _, name = joint.partition("_")
    return f"{side}_arm" if name in ARM else f"{side}_leg" if name in LEG else "trunk"


def limbs_of(joints: Iterable[str]) -> tuple[str, ...]:
    """The limbs to which joints belong, in the order of `LIMBS`."""
    found = set(map(limb_of, joints))
    return tuple(limb for limb in LIMBS if limb in found)


@cache
def joints_of_limbs(joints: tuple[str, ...]) -> dict[str, list[int]]:
    """Indices of the joints of each of `limbs_of(joints)`. Not to be changed: kept for the next call."""
    return {limb: [n for n, joint in enumerate(joints) if limb_of(joint) == limb] for limb in limbs_of(joints)}


def doubtful_limbs(joints: Iterable[str], statuses: Iterable[str] | None) -> list[str]:
    """The limbs of joints whose status is one of `DOUBTFUL`. `statuses`: one for each of `limbs_of(joints)`; None: all vouched for."""
    return [limb for limb, status in zip(limbs_of(joints), () if statuses is None else statuses) if status in DOUBTFUL]


def limbs_in_words(limbs: Iterable[str]) -> str:
    """Limbs in words, left and right together: `trunk, both arms`."""
    there = list(limbs)
    words = [f"both {limb.removeprefix('left_')}s" if limb.startswith("left_") and limb.replace("left", "right") in there else limb
             for limb in there if not (limb.startswith("right_") and limb.replace("right", "left") in there)]
    return ", ".join(words).replace("_", " ")


def status_in_words(status: str, joints: Iterable[str], statuses: Iterable[str] | None) -> str:
    """A frame's status, and which limbs of a body with these joints are doubtful; `statuses` as in `doubtful_limbs`."""
    doubtful = limbs_in_words(doubtful_limbs(joints, statuses))
    return f"{status}, {doubtful} doubtful" if doubtful else status


def doubtful_joints(joints: Iterable[str], statuses: Iterable[str] | None) -> frozenset[str]:
    """Those of joints that belong to `doubtful_limbs`."""
    joints = tuple(joints)
    doubtful = doubtful_limbs(joints, statuses)
    return frozenset(joint for joint in joints if limb_of(joint) in doubtful)
