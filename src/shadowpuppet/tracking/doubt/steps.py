"""Change from frame to frame: steps of the joints, pictures that do not change."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array

CONSTANT = 0.015
"""The constant component of doubt, metres: bodies differ in where their joints are."""
PACE = 1 / 15
"""Time (s) in which a step is measured."""
STILL_ALLOWED, STILL_UNIT = 2, 15
"""Frames that may repeat a silhouette, and the number of further ones after which a joint may be off by its lever."""


FROZEN_FRAMES, FROZEN_SECONDS = 4, 0.25
"""Frames and time from which on a silhouette that is the same is a frozen picture's: conversion to a higher frame rate repeats fewer."""
SAME = 1e-3
"""Share of the silhouette that may differ in a frozen picture, which a codec encodes anew now and then. A person who stands still, and the
noise at the outline, change some five times as much."""


class Earlier(Protocol):
    """A frame before."""

    @property
    def seconds(self) -> float:
        """Its time."""
        ...

    @property
    def points(self) -> Array:
        """Its joints (L, 3), metres."""
        ...


def steps(points: Array, seconds: float, before: Earlier | None) -> Array:
    """Distance (L,) of joints (L, 3) from those before, metres in the time `PACE`."""
    if before is None or seconds <= before.seconds:
        return np.zeros(len(points))
    return np.linalg.norm(points - before.points, axis=1) * (PACE / (seconds - before.seconds))


def stillness(frames: int) -> float:
    """Share of its lever by which a joint may be off after so many frames with the same silhouette, 0 to 2."""
    return min(max(frames - STILL_ALLOWED, 0) / STILL_UNIT, 2.0)


def same_silhouette(one: Mask, other: Mask) -> bool:
    """Whether two masks (H, W) are of the same picture, up to what a codec changes."""
    return one.shape == other.shape and bool(np.count_nonzero(one ^ other) <= SAME * np.count_nonzero(other))


def is_frozen(frames: int, seconds: float) -> bool:
    """Whether a silhouette that has been the same for some frames and seconds is a frozen picture's."""
    return frames >= FROZEN_FRAMES and seconds >= FROZEN_SECONDS
