"""One camera that suddenly contradicts the others: late, bumped, or its silhouette broken. The body fits none of them well then, and may be
lost in the few frames until the cause is known; without that camera it goes on as before."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.frozen import LEAST
from shadowpuppet.tracking.recovery import OVERLAP_DROP

GAIN = 0.03
"""Least gain of the others' mean overlap without the odd camera; and the fall of a camera's own overlap below the usual one from which on
it may be that one: the body may have followed the wrong camera, and left a good one. One must have fallen by `OVERLAP_DROP`."""
ADAPT, ADAPT_ODD = 0.1, 0.03
"""Weight of a frame in the usual overlap, and that of a frame in which the camera is the odd one: in the end it is heard again."""


def suspects(usual: Array, now: Array) -> list[int]:
    """Cameras whose overlap has fallen, if one has fallen far. `usual`, `now`: overlaps (C,), NaN where there is none."""
    if usual.shape != now.shape or np.isfinite(now).sum() <= LEAST:
        return []
    fall = np.nan_to_num(usual - now, nan=0.0)
    return np.flatnonzero(fall > GAIN).tolist() if fall.max() > OVERLAP_DROP else []


def odd_one(usual: Array, now: Array, without: Mapping[int, Array]) -> int | None:
    """The one of the suspects without which the other cameras fit best, if they fit better than with it, and it does not fit then either;
    None if there is none. Overlaps (C,): the usual ones, those of all cameras together, and those of the body fitted without each."""
    def gain(odd: int) -> float:
        return float(np.nanmean(np.delete(without[odd] - usual, odd)))

    best = max(without, key=gain, default=None)
    if best is None or not usual[best] - without[best][best] > OVERLAP_DROP:
        return None
    return best if np.nanmean(np.delete(without[best] - now, best)) > GAIN else None


def adapted(usual: Array, now: Array, odd: int | None) -> Array:
    """The usual overlaps (C,) after another frame's."""
    if usual.shape != now.shape:
        return now
    weight = np.full(len(now), ADAPT)
    if odd is not None:
        weight[odd] = ADAPT_ODD
    return np.where(np.isfinite(usual) & np.isfinite(now), usual + weight * (now - usual), np.where(np.isfinite(now), now, usual))
