"""Named sizes of the whole person: the bones that both whole bodies share, and the thickness of each."""

from __future__ import annotations

from dataclasses import dataclass

from shadowpuppet.body.sizes import CardboxSizes, Sizes
from shadowpuppet.errors import ShadowPuppetError, choices


@dataclass(frozen=True)
class BoneSizes(Sizes):
    """Where the joints of a whole body lie, metres; the person stands upright, X forward, Z up."""

    hip_distance: float
    """Between the hips' joints."""
    hip_drop: float
    """From the pelvis down to the hips' joints."""
    hip_forward: float
    """From the pelvis forward to the hips' joints."""
    neck_length: float
    """From the base of the neck up to the base of the skull."""
    head_forward: float
    """From the base of the neck forward to the base of the skull."""
    head_height: float
    """From the base of the skull up to the crown."""
    shoulder_distance: float
    """Between the shoulders' joints."""
    shoulder_drop: float
    """From the base of the neck down to the shoulders' joints."""
    shoulder_forward: float
    """From the base of the neck forward to the shoulders' joints."""
    upper_arm_length: float
    """From shoulder to elbow."""
    forearm_length: float
    """From elbow to wrist."""
    hand_point: float
    """From the wrist to the base of the fingers, the point `*_hand`."""
    hand_length: float
    """From the wrist to the end of a hand at ease."""
    thigh_length: float
    """From hip to knee."""
    shank_length: float
    """From knee to ankle."""
    ankle_height: float
    """From the ankle's joint to the sole."""

    @classmethod
    def offsets(cls) -> tuple[str, ...]:
        """Distances of a joint from another that may lie on either side."""
        return "hip_drop", "hip_forward", "head_forward", "shoulder_drop", "shoulder_forward", "hand_point"


@dataclass(frozen=True)
class CylinderSizes(BoneSizes):
    """Sizes of `cylinders`: the bones, and a thickness for every part, which is the same all along."""

    trunk_height: float
    """From the pelvis to the base of the neck."""
    trunk_width: float
    trunk_depth: float
    head_width: float
    upper_arm_width: float
    forearm_width: float
    thigh_width: float
    shank_width: float


@dataclass(frozen=True)
class AnatomicalSizes(BoneSizes):
    """Sizes of `anatomical`: the bones, and widths (girths over pi where a limb is round)."""

    lumbar_height: float
    """From the pelvis up to the joint of the chest."""
    thorax_height: float
    """From the joint of the chest up to the base of the neck."""
    foot_length: float
    """From heel to toes."""
    toe_out: float
    """How far out the toes lie of what is straight ahead of the ankle."""
    pelvis_width: float
    """At the hips."""
    pelvis_depth: float
    waist_width: float
    """At the chest's joint."""
    waist_depth: float
    chest_width: float
    """Under the armpits, arms left out."""
    chest_depth: float
    shoulder_thickness: float
    """Of the trunk at the shoulders' joints, up and down and to front and back."""
    neck_width: float
    head_width: float
    head_depth: float
    upper_arm_width: float
    """At the shoulder, mean of both directions, as with all limbs."""
    elbow_width: float
    forearm_width: float
    """At its thickest."""
    wrist_width: float
    hand_width: float
    """At the knuckles."""
    thigh_width: float
    """At the hip."""
    knee_width: float
    calf_width: float
    ankle_width: float
    foot_width: float

    @classmethod
    def offsets(cls) -> tuple[str, ...]:
        """As of the bones; toes may point inward."""
        return *super().offsets(), "toe_out"


KINDS: dict[str, type[Sizes]] = {
    **dict.fromkeys(("rounded", "cardbox", "boxes"), CardboxSizes),
    "anatomical": AnatomicalSizes,
    "cylinders": CylinderSizes,
}
"""The sizes that each body is made from."""
WHOLE = ("anatomical", "cylinders")
"""Bodies of the whole person, which stand in the world."""


def sizes_kind(name: str) -> type[Sizes]:
    """The sizes that a body is made from. Raises `ShadowPuppetError` with the names there are."""
    if name not in KINDS:
        raise ShadowPuppetError(f"unknown body {name!r}; there are: {choices(KINDS)}")
    return KINDS[name]


def kind_of(sizes: Sizes) -> str:
    """Name of a body that is made from such sizes; of several the first."""
    return next(name for name, kind in KINDS.items() if isinstance(sizes, kind))
