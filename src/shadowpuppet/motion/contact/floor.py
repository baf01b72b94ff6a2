"""The height of the floor, from where feet stand still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.geometry import Array

SLOW = 0.3
"""Speed (m/s) below which a point of a sole may stand."""
LOWEST, BAND = 10, 0.03
"""Percentile of the heights of slow points that is near the floor, and the distance (m) from it of those that stand on it."""
LOWEST_SHARE = 2
"""Percentile of the heights of the lowest foot over a film that counts as the lowest: single frames are wrong."""
FEWEST = 5
"""Number of slow points from which on a floor is found."""


def floor_height(heights: Array, speeds: Array) -> float:
    """Height (m) of the floor under points of soles, from their heights (T, P), metres, and speeds (T, P), m/s: the median of those that
    stand lowest. One level floor, without steps; NaN if nothing stands."""
    slow = heights[(speeds < SLOW) & np.isfinite(heights)]
    if len(slow) < FEWEST:
        return np.nan
    lowest = slow[np.abs(slow - np.percentile(slow, LOWEST)).argmin()]
    return float(np.median(slow[np.abs(slow - lowest) < BAND]))


def under_feet(names: Sequence[str], positions: Array, legs: float) -> float:
    """Height (m) of the floor under a person before a camera whose height is unknown: that of the lowest foot over the film, of joints
    (T, J, 3), metres; of a body without feet it is `legs` (m) below the pelvis. NaN if nothing is known."""
    feet = [n for ending in ("_heel", "_toe", "_ankle") for n, name in enumerate(names) if name.endswith(ending)]
    heights = positions[:, feet, 2] if feet else positions[:, [names.index("pelvis")], 2] - legs
    heights = np.where(np.isfinite(heights), heights, np.inf).min(axis=1)
    known = heights[np.isfinite(heights)]
    return float(np.percentile(known, LOWEST_SHARE)) if len(known) else np.nan
