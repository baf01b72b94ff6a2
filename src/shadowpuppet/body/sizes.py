"""A person's named sizes: the 18 of Liu 2011, and those of whole bodies."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import ShadowPuppetError, choices, shown
from shadowpuppet.geometry import Array

HEIGHTS, DISTANCES = (0.5, 2.5), (0.2, 30.0)
"""Possible heights of a person and distances from the camera, metres."""


def is_within(value: object, limits: tuple[float, float]) -> bool:
    """Whether a value is a number within limits."""
    return isinstance(value, (int, float, np.integer)) and not isinstance(value, bool) and bool(limits[0] <= value <= limits[1])


def expected_metres(value: object, limits: tuple[float, float]) -> str:
    """The end of an error message: the range in metres, and a hint if the value would fit in centimetres."""
    hint = ""
    if isinstance(value, (int, float, np.integer)) and is_within(value, (100 * limits[0], 100 * limits[1])):
        hint = f" ({value:g} cm are {value / 100:g})"
    return f"expected {limits[0]:g} to {limits[1]:g} metres{hint}"


MIN_SIZE, MAX_SIZE = 0.005, 2.0
"""Range of a size, metres; offsets may be smaller."""


@dataclass(frozen=True)
class Sizes:
    """Named sizes, metres; left and right share values. Raises `ShadowPuppetError` for impossible values."""

    def __post_init__(self) -> None:
        """Check every size."""
        for field in fields(self):
            value, least = getattr(self, field.name), -0.2 if field.name in self.offsets() else MIN_SIZE
            if not least <= value <= MAX_SIZE:
                raise ShadowPuppetError(f"size {field.name}: found {shown(value)}, expected {least} to {MAX_SIZE} metres")

    @classmethod
    def offsets(cls) -> tuple[str, ...]:
        """Names of sizes that may be zero or negative."""
        return ()

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """All names, in order."""
        return tuple(field.name for field in fields(cls))

    @classmethod
    def from_mapping(cls, values: Mapping[str, float], source: str = "sizes") -> Self:
        """Sizes from named values. Raises `ShadowPuppetError` for missing or unknown names."""
        unknown, missing = set(values) - set(cls.names()), set(cls.names()) - set(values)
        if unknown or missing:
            what = f"unknown {choices(unknown)}" if unknown else f"missing {choices(missing)}"
            raise ShadowPuppetError(f"{source}: {what}; the sizes are: {choices(cls.names())}")
        for name, value in values.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)) or abs(value) > sys.float_info.max:
                raise ShadowPuppetError(f"{source}: {name}: found {shown(value)}, expected a number of metres")
        return cls(**{name: float(value) for name, value in values.items()})

    @classmethod
    def from_array(cls, values: ArrayLike) -> Self:
        """Sizes from an array in the order of `names`."""
        return cls(*(float(v) for v in np.asarray(values)))

    def to_array(self) -> Array:
        """The sizes as an array in the order of `names`."""
        return np.array([getattr(self, name) for name in self.names()])

    def with_values(self, **values: float) -> Self:
        """A copy with some sizes replaced."""
        return replace(self, **values)


@dataclass(frozen=True)
class CardboxSizes(Sizes):
    """The 18 sizes a1..a18 of Liu 2011, Fig. 2, metres; left and right share values."""

    head_width: float
    head_height: float
    neck_gap: float
    shoulder_width: float
    """Width of the torso's top."""
    torso_bottom_width: float
    torso_height: float
    waist_width: float
    waist_height: float
    head_depth: float
    torso_top_depth: float
    torso_bottom_depth: float
    waist_depth: float
    upper_arm_length: float
    upper_arm_width: float
    forearm_length: float
    """From the elbow to the end of the fist (or of the fingers, if the hands are open)."""
    elbow_width: float
    """Width of the forearm at the elbow."""
    hand_width: float
    """Width of the forearm at the hand."""
    shoulder_inset: float
    """From the torso's edge inward to the shoulder joint."""

    @classmethod
    def offsets(cls) -> tuple[str, ...]:
        """Gaps and insets."""
        return "neck_gap", "shoulder_inset"


SUBSETS = {"O1": CardboxSizes.names()[:8], "O2": CardboxSizes.names()[8:12], "O3": CardboxSizes.names()[12:]}
"""The three groups in which Algorithm 1 estimates the sizes: front view, side view, arms."""


@dataclass(frozen=True)
class BoneSizes(Sizes):
    """Positions of a whole body's joints, metres; the person stands upright, X forward, Z up."""

    hip_distance: float
    """Between the hip joints."""
    hip_drop: float
    """From the pelvis down to the hip joints."""
    hip_forward: float
    """From the pelvis forward to the hip joints."""
    neck_length: float
    """From the base of the neck up to the base of the skull."""
    head_forward: float
    """From the base of the neck forward to the base of the skull."""
    head_height: float
    """From the base of the skull up to the crown."""
    shoulder_distance: float
    """Between the shoulder joints."""
    shoulder_drop: float
    """From the base of the neck down to the shoulder joints."""
    shoulder_forward: float
    """From the base of the neck forward to the shoulder joints."""
    upper_arm_length: float
    """From shoulder to elbow."""
    forearm_length: float
    """From elbow to wrist."""
    hand_point: float
    """From the wrist to the base of the fingers, the landmark `*_hand`."""
    hand_length: float
    """From the wrist to the end of a relaxed hand."""
    thigh_length: float
    """From hip to knee."""
    shank_length: float
    """From knee to ankle."""
    ankle_height: float
    """From the ankle joint to the sole."""

    @classmethod
    def offsets(cls) -> tuple[str, ...]:
        """Distances between joints that may have either sign."""
        return "hip_drop", "hip_forward", "head_forward", "shoulder_drop", "shoulder_forward", "hand_point"


@dataclass(frozen=True)
class CylinderSizes(BoneSizes):
    """Sizes of `cylinders`: the bones, and one width for each part."""

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
    """Sizes of `anatomical`: the bones, and widths (girth / pi for round limbs)."""

    lumbar_height: float
    """From the pelvis up to the joint of the chest."""
    thorax_height: float
    """From the joint of the chest up to the base of the neck."""
    foot_length: float
    """From heel to toes."""
    toe_out: float
    """Lateral offset of the toes from straight ahead of the ankle."""
    pelvis_width: float
    """At the hips."""
    pelvis_depth: float
    waist_width: float
    """At the chest's joint."""
    waist_depth: float
    chest_width: float
    """Below the armpits, without arms."""
    chest_depth: float
    shoulder_thickness: float
    """Of the trunk at the shoulder joints, vertically and front to back."""
    neck_width: float
    head_width: float
    head_depth: float
    upper_arm_width: float
    """At the shoulder; mean of both directions, as for all limbs."""
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
        """The bones' offsets, and `toe_out`: toes may point inward."""
        return *super().offsets(), "toe_out"
