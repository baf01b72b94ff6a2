"""A person's named sizes: the 18 of Liu 2011."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Self

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import ShadowPuppetError, choices, shown
from shadowpuppet.geometry import Array

HEIGHTS, DISTANCES = (0.5, 2.5), (0.2, 30.0)
"""What a person's height, and the distance from the camera, can be; metres."""


def is_within(value: object, limits: tuple[float, float]) -> bool:
    """Whether something is a number within limits."""
    return isinstance(value, (int, float, np.integer)) and not isinstance(value, bool) and bool(limits[0] <= value <= limits[1])


def expected_metres(value: object, limits: tuple[float, float]) -> str:
    """What is possible in place of a value, for messages; what would be possible in centimetres is told in metres."""
    hint = f" ({value:g} cm are {value / 100:g})" if isinstance(value, (int, float, np.integer)) and is_within(value / 100, limits) else ""
    return f"expected {limits[0]:g} to {limits[1]:g} metres{hint}"


LEAST, MOST = 0.005, 2.0
"""What a size can be, metres; offsets can be less."""


@dataclass(frozen=True)
class Sizes:
    """Named sizes, metres; left and right share values. Raises `ShadowPuppetError` for values that no person has."""

    def __post_init__(self) -> None:
        """Check every size."""
        for field in fields(self):
            value, least = getattr(self, field.name), -0.2 if field.name in self.offsets() else LEAST
            if not least <= value <= MOST:
                raise ShadowPuppetError(f"size {field.name}: found {shown(value)}, expected {least} to {MOST} metres")

    @classmethod
    def offsets(cls) -> tuple[str, ...]:
        """Names of those that may be nothing, or negative."""
        return ()

    @classmethod
    def names(cls) -> tuple[str, ...]:
        """The names, in their order."""
        return tuple(field.name for field in fields(cls))

    @classmethod
    def from_mapping(cls, values: Mapping[str, float], source: str = "sizes") -> Self:
        """Sizes from named values. Raises `ShadowPuppetError` for names missing or unknown."""
        unknown, missing = set(values) - set(cls.names()), set(cls.names()) - set(values)
        if unknown or missing:
            what = f"unknown {choices(unknown)}" if unknown else f"missing {choices(missing)}"
            raise ShadowPuppetError(f"{source}: {what}; the sizes are: {choices(cls.names())}")
        for name, value in values.items():
            if isinstance(value, bool) or not isinstance(value, (int, float)):
                raise ShadowPuppetError(f"{source}: {name}: found {shown(value)}, expected a number of metres")
        return cls(**{name: float(value) for name, value in values.items()})

    @classmethod
    def from_array(cls, values: ArrayLike) -> Self:
        """Sizes from an array, in the order of `names`."""
        return cls(*(float(v) for v in np.asarray(values)))

    def to_array(self) -> Array:
        """The sizes as an array, in the order of `names`."""
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
    """From the elbow to the end of the fist (or of the fingers, where the hands are open)."""
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
