"""Whether stated standard deviations are honest: how often the truth lies within the intervals that they promise."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from shadowpuppet.geometry import Array

LEVELS = {"50": 0.6744897501960817, "90": 1.6448536269514722, "95": 1.959963984540054}
"""Half the width of a normal distribution's central intervals that hold so many percent, in standard deviations."""


def coverage(delta: Array, sd: Array, names: Sequence[str]) -> dict[str, Any] | None:
    """Shares of errors `delta` (T, J, 3), metres, that lie within the intervals of their standard deviations `sd` (T, J, 3), for all joints
    and each.

    An axis of a joint in a frame counts as one, where both are known. `rms_z` is the root mean square of error by standard deviation: 1
    where these are right, more where they promise too much. Neighbouring frames err alike, so that short runs tell little. None where no
    standard deviation is stated.
    """
    stated = np.isfinite(delta) & np.isfinite(sd) & (sd > 0)
    if not stated.any():
        return None
    z = np.where(stated, np.abs(delta) / np.where(stated, sd, 1), np.nan)
    joints = {name: _shares(z[:, j], sd[:, j]) for j, name in enumerate(names) if stated[:, j].any()}
    return {**_shares(z, sd), "joints": joints}


def _shares(z: Array, sd: Array) -> dict[str, float]:
    known = np.isfinite(z)
    values = z[known]
    return {"count": int(known.sum()), **{f"within_{level}": float((values <= width).mean()) for level, width in LEVELS.items()},
            "rms_z": float(np.sqrt((values**2).mean())), "sd_mean_mm": float(1000 * sd[known].mean())}
