"""Change from frame to frame: steps of the joints, pictures that do not change."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from shadowpuppet.geometry import Array

CONSTANT = 0.015
"""The constant component of doubt, metres: bodies differ in where their joints are."""
PACE = 1 / 15
"""Time (s) in which a step is measured."""
STILL_ALLOWED, STILL_UNIT = 2, 15
"""Frames that may repeat a silhouette, and the number of further ones after which a joint may be off by its lever."""


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
    """Factor of the joints' levers, 0 to 2, after a number of frames with the same silhouette."""
    return min(max(frames - STILL_ALLOWED, 0) / STILL_UNIT, 2.0)
