"""Short gaps of a motion: which are bridged, and how far a bridged frame may be off."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.motion import ROUNDING
from shadowpuppet.tracking.smoothing.fixed_interval import LEAST, PACE

FASTEST = 8.0
"""Mean speed (m/s) of a joint over a gap above which the gap is not bridged: the person before and after cannot both be right."""
STRAY = 0.25
"""Factor of the bow, half the acceleration times the times to both ends, by which a bridged joint may stray; on made recordings the
intervals cover as without gaps."""


def bridged(times: Array, joints: Array, longest: float) -> NDArray[np.bool_]:
    """Whether a frame (T,) is in a gap between known frames that lasts at most `longest` seconds, from its first frame to the next known.

    `joints`: (T, J, 3), metres, not a number in unknown frames; times (T,), seconds.
    """
    known = np.asarray(np.isfinite(joints).all((1, 2)))
    out = np.zeros(len(times), bool)
    for begin, end in true_runs(~known):
        if begin == 0 or end == len(times) or times[end] - times[begin] > longest + ROUNDING:
            continue
        moved = np.linalg.norm(joints[end] - joints[begin - 1], axis=1).max()
        out[begin:end] = moved <= FASTEST * (times[end] - times[begin - 1])
    return out


def stray(times: Array, joints: Array, inside: NDArray[np.bool_]) -> Array:
    """Deviations (T, J), metres, along each axis, of joints (T, J, 3) that were bridged in the frames `inside` (T,); 0 elsewhere."""
    out = np.zeros(joints.shape[:2])
    for begin, end in true_runs(inside):
        first, last = times[begin - 1], times[end]
        before, after = max(begin - 2, 0), min(end + 1, len(times) - 1)
        speed = np.linalg.norm(joints[after] - joints[before], axis=1) / max(times[after] - times[before], 1e-9)
        acceleration = np.hypot(LEAST, PACE * speed)
        arc = 0.5 * (times[begin:end] - first) * (last - times[begin:end])
        out[begin:end] = STRAY * arc[:, None] * acceleration
    return out
