"""The height of the floor, from where feet stand still."""

from __future__ import annotations

import numpy as np

from shadowpuppet.geometry import Array

SLOW = 0.3
"""Speed (m/s) below which a point of a sole may stand."""
LOWEST, BAND = 10, 0.03
"""Percentile of the heights of slow points that is near the floor, and the distance (m) from it of those that stand on it."""
FEWEST = 5
"""Number of slow points from which on a floor is found."""


def floor_height(heights: Array, speeds: Array) -> float:
    """Height (m) of the floor under points of soles, from their heights (T, P), metres, and speeds (T, P), m/s: the median of those that
    stand lowest. One level floor, without steps; NaN if nothing stands."""
    slow = heights[(speeds < SLOW) & np.isfinite(heights)]
    if len(slow) < FEWEST:
        return np.nan
    return float(np.median(slow[np.abs(slow - np.percentile(slow, LOWEST)) < BAND]))
