"""By how many frames each camera's film is late, from the motion of silhouettes alone.

Planes through two cameras that touch a silhouette touch it for both at the same time (`tangency`). So the angle of that plane about the
line from camera to camera is one signal, which both films show: what shifts them onto each other is the difference in time. A camera
that was moved a little changes such a signal by a nearly constant angle, which is taken off: time is told apart from place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.agreement import plain_values
from shadowpuppet.calibration.epipolar_tangency import tangent_angles
from shadowpuppet.calibration.silhouettes import Outline, Row, outlines_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array

MIN_COMMON_SETS = 24
"""Sets that two signals must have in common."""
TRIM_PERCENTILE = 80
"""Percentile of differences up to which they are averaged: a limb that is missing in one silhouette is not a difference in time."""
MAX_RESIDUAL_SHARE = 0.6
"""Two signals say something about time where no more than this of their usual difference is left at the best shift."""
SOLVER_ROUNDS = 30
"""Of the solution for all cameras, each with less weight on pairs that disagree."""


@dataclass(frozen=True, kw_only=True)
class TimeOffsets:
    """Frames by which films are late against most of the others; plain values."""

    names: tuple[str, ...]
    """Of the cameras."""
    frames: tuple[float | None, ...]
    """By how many sets each film is late (less than 0: early); None where nothing moves that tells."""
    spread: tuple[float | None, ...]
    """By how many sets a camera's pairs differ about that: how sure it is."""
    pairs: tuple[tuple[float | None, ...], ...]
    """By how many sets the film of the second of a pair is later than that of the first; None where it cannot be told."""


@dataclass(frozen=True, eq=False)
class _Pair:
    """What two cameras say of their times."""

    first: int
    second: int
    shift: float
    """Sets by which the second is later."""
    weight: float


def time_offsets(cameras: Sequence[Camera], rows: Sequence[Row]) -> TimeOffsets:
    """How late each film is, from outlines by set and camera, which follow one another; `most`: sets that are tried, to and fro."""
    most = min(len(rows) - MIN_COMMON_SETS, len(rows) // 2)
    outlines = [outlines_of(cameras, row) for row in rows]
    pairs = [pair for i, j in combinations(range(len(cameras)), 2)
             if most > 0 and (pair := _compared(i, j, tangent_signals(cameras, outlines, i, j), most)) is not None]
    late, known = _solved(len(cameras), pairs)
    table = np.full((len(cameras), len(cameras)), np.nan)
    off: list[list[float]] = [[] for _ in cameras]
    for pair in pairs:
        table[pair.first, pair.second], table[pair.second, pair.first] = pair.shift, -pair.shift
        for n in (pair.first, pair.second):
            off[n].append(abs(late[pair.second] - late[pair.first] - pair.shift))
    spread = np.array([np.median(values) if values else np.nan for values in off])
    return TimeOffsets(names=tuple(camera.name for camera in cameras), frames=plain_values(np.where(known, late, np.nan)),
                       spread=plain_values(spread), pairs=tuple(map(plain_values, table)))


def tangent_signals(cameras: Sequence[Camera], outlines: Sequence[Sequence[Outline | None]], i: int, j: int) -> Array:
    """Angles (2 cameras, 2 tangents, F sets) of the outermost planes through cameras i and j that touch their silhouettes, in pixels of
    the one that sees them smaller; not a number where there is none."""
    signals, reference = np.full((2, 2, len(outlines)), np.nan), None
    levers = []
    for f, row in enumerate(outlines):
        a, b = row[i], row[j]
        found = None if a is None or b is None else tangent_angles((cameras[i], cameras[j]), (a, b), reference)
        if found is not None:
            reference = found.reference if reference is None else reference
            signals[:, :, f] = found.angles
            levers.append(found.lever)
    return signals * (float(np.median(levers)) if levers else np.nan)


def _compared(i: int, j: int, signals: Array, most: int) -> _Pair | None:
    """The shift at which two cameras' signals differ least; None where none does markedly."""
    shifts = np.arange(-most, most + 1)
    cost = np.array([_difference(signals, s) for s in shifts.tolist()])
    if np.isfinite(cost).sum() < 5:
        return None
    usual, k = float(np.nanmedian(cost)), int(np.nanargmin(cost))
    if not 0 < k < len(cost) - 1 or not np.isfinite(cost[k - 1 : k + 2]).all() or cost[k] > MAX_RESIDUAL_SHARE * usual:
        return None
    before, least, after = cost[k - 1 : k + 2]
    rise = max(before, after) - least
    if rise <= 0:
        return None
    return _Pair(i, j, float(shifts[k] + 0.5 * (before - after) / rise), float((rise / max(least, 0.05)) ** 2))


def _difference(signals: Array, shift: int) -> float:
    """Mean difference of two signals (2, 2, F), the second taken so many sets later; constant ones are none."""
    F = signals.shape[2]
    a, b = signals[0, :, max(0, -shift) : F - max(0, shift)], signals[1, :, max(0, shift) : F + min(0, shift)]
    total, tangents = 0.0, 0
    for d in a - b:
        d = d[np.isfinite(d)]
        if len(d) >= MIN_COMMON_SETS:
            d = np.sort(np.abs(d - np.median(d)))[: max(1, len(d) * TRIM_PERCENTILE // 100)]
            total, tangents = total + float(d.mean()), tangents + 1
    return total / tangents if tangents else np.nan


def _solved(count: int, pairs: Sequence[_Pair]) -> tuple[Array, NDArray[np.bool_]]:
    """Sets (C,) by which each is late against most others, least absolute differences; and which of them are known (C,)."""
    late, known = np.zeros(count), np.zeros(count, bool)
    for pair in pairs:
        known[[pair.first, pair.second]] = True
    weights = np.array([pair.weight for pair in pairs])
    for _ in range(SOLVER_ROUNDS if pairs else 0):
        A, b = np.zeros((len(pairs) + 1, count)), np.zeros(len(pairs) + 1)
        for n, (pair, weight) in enumerate(zip(pairs, np.sqrt(weights))):
            A[n, [pair.first, pair.second]], b[n] = (-weight, weight), weight * pair.shift
        A[-1] = 1e-3  # all may be shifted together
        late = np.asarray(np.linalg.lstsq(A, b, rcond=None)[0], float)
        off = np.array([abs(late[pair.second] - late[pair.first] - pair.shift) for pair in pairs])
        weights = np.array([pair.weight for pair in pairs]) / np.maximum(off, 0.05)
    if known.sum() == 2:
        return late - late[np.argmax(known)], known  # the second against the first
    return late - (np.sort(late[known])[(known.sum() - 1) // 2] if known.any() else 0.0), known
