"""Which way a person faces, by keypoints: the log odds of the best pose one way against the best that faces the other way.

Silhouettes hardly tell front from back, and a cost added to theirs does not change that: one pixel in a hundred counts for more than all
keypoints. So the front is decided by the keypoints alone, where they are certain.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array

CERTAIN = 6.0
"""Log odds from which on a front is known, 400 to 1: one camera whose keypoints are turned round does not reach it, two that agree do."""


class KeypointFront(NamedTuple):
    """The front that keypoints show."""

    heading: float
    """Of the best pose, rad."""
    odds: float
    """Log odds against the other way, 0 or more."""

    @property
    def is_certain(self) -> bool:
        """Whether the front is known."""
        return self.odds > CERTAIN


def front_of(headings: Array, surprises: Array) -> KeypointFront | None:
    """The front, of poses' headings (n,), rad, and the surprise (n,) of the keypoints given each, nats; None without poses, and no odds
    where all of them face one way."""
    if not len(headings):
        return None
    best = int(surprises.argmin())
    other = surprises[np.cos(headings - headings[best]) < 0]
    return KeypointFront(float(headings[best]), float(other.min() - surprises[best]) if len(other) else 0.0)
