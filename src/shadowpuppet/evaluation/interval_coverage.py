"""Coverage of the intervals implied by the stated standard deviations."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from shadowpuppet.geometry import Array

LEVELS = {"50": 0.6744897501960817, "90": 1.6448536269514722, "95": 1.959963984540054}
"""Half widths, in standard deviations, of a normal distribution's central intervals, by their percentage."""


def coverage(delta: Array, sd: Array, names: Sequence[str]) -> dict[str, Any] | None:
    """Shares of errors `delta` (T, J, 3) within the intervals of their standard deviations `sd` (T, J, 3), metres, of all joints and each.

    Each axis of a joint in a frame counts, if both are known. `rms_z`: root mean square of error over standard deviation; 1 if these are
    right, greater if they are too small. Errors of neighbouring frames correlate, so short runs are inconclusive. None if no standard
    deviation is stated.
    """
    stated = np.isfinite(delta) & np.isfinite(sd) & (sd > 0)
    if not stated.any():
        return None
    z = np.where(stated, np.abs(delta) / np.where(stated, sd, 1), np.nan)
    joints = {name: _shares(z[:, j], sd[:, j]) for j, name in enumerate(names) if stated[:, j].any()}
    return {**_shares(z, sd), "joints": joints}


def rank_histogram(delta: Array, sd: Array, bins: int = 10) -> Array:
    """Share (bins,) of the true values in each of as many parts of their stated distributions, all equally likely if these are right.

    The probability integral transform (Dawid 1984), for normal distributions: of errors `delta` (N,), truth less estimate, and their
    standard deviations `sd` (N,). Raised at the ends: too narrow; in the middle: too wide; on one side: the estimates are off to the other.
    """
    from scipy.stats import norm

    places = norm.cdf(delta / sd)
    return np.histogram(places, np.linspace(0, 1, bins + 1))[0] / max(len(places), 1)


def _shares(z: Array, sd: Array) -> dict[str, float]:
    known = np.isfinite(z)
    values = z[known]
    return {"count": int(known.sum()), **{f"within_{level}": float((values <= width).mean()) for level, width in LEVELS.items()},
            "rms_z": float(np.sqrt((values**2).mean())), "sd_mean_mm": float(1000 * sd[known].mean())}
