"""Time offsets between films, from the motion of silhouettes alone.

A plane through two camera centres touches the person for both cameras at the same time (`epipolar_tangency`). So its angle about the
baseline is a signal that both films show, and the shift that aligns the two signals is their time offset. A camera that was moved a
little changes its signal by a nearly constant angle, which is removed: this separates time from place.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.agreement import plain_values
from shadowpuppet.calibration.epipolar_tangency import tangent_angles
from shadowpuppet.calibration.silhouettes import Outline, Row, outlines_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array

MIN_COMMON_SETS = 24
"""Least number of sets that two signals must share."""
TRIM_PERCENTILE = 80
"""Percentile up to which differences are averaged: the greatest come from limbs missing in one silhouette."""
MAX_RESIDUAL_SHARE = 0.6
"""Two signals give an offset if at most this share of their median difference is left at the best shift."""
LEAST_MOTION = 2.0
"""Least standard deviation (robust) of a signal, pixels: the sway of a person at rest stays below, and the grid of the pixels, which is
alike in no two pictures, then biases a shift by most of a frame."""
LEAST_SCORE = 2.0
"""Standard errors by which two signals must be more alike, at their best shift, than chance makes them at the best of all shifts tried."""
OUTLIER, STEPS = 4.0, 3
"""Differences of two signals over this many robust standard deviations are left out; steps of a shift to fractions of a set."""
PARTS, FEW_PARTS = 8, 1.33
"""Parts of the film whose pulls on a shift are compared, and the factor on the variance for their small number (Student's t over
normal)."""
APART, APART_WEIGHT = 0.1, 4.0
"""Standard deviation, sets, by which shifts of one recording are assumed to differ beyond their noise, as tangents touch one limb before
one camera and another before the next; and how many measured differences that counts for. Chosen on made recordings
(benchmarks/coverage_of_check.py)."""
LONE_PAIR = 2.0
"""Sets by which the half-width is widened (in squares) of a film whose offset one pair of cameras alone tells: that pair's tangents may be
wrong in all of the film, as those of a man who balances, whose arms and trunk sway apart."""
FAR = 3.0
"""Residuals count up to this many standard deviations: a limb that one silhouette lacks."""
MIN_OFFSET, MIN_OFFSET_MISPLACED, SPREAD_FACTOR = 0.5, 1.5, 1.5
"""Least offset, in sets, of a film that is late; the same for a camera that disagrees about places, so that its time is less certain;
least ratio of the offset to the half-width of its 90 % interval."""
SOLVER_ROUNDS = 30
"""Rounds of iteratively reweighted least squares for all cameras."""


@dataclass(frozen=True, kw_only=True)
class TimeOffsets:
    """Time offsets of films against most of the others; plain values."""

    names: tuple[str, ...]
    """Names of the cameras."""
    frames: tuple[float | None, ...]
    """Sets by which each film is late (negative: early); None if its silhouettes move too little to tell."""
    spread: tuple[float | None, ...]
    """Half-width of each offset's 90 % interval, sets: from the noise of the signals, and from how pairs and tangents differ."""
    pairs: tuple[tuple[float | None, ...], ...]
    """Sets by which the second film of a pair is later than the first; None if unknown."""


class _Shift(NamedTuple):
    """Time offset of two cameras by one of their tangents."""

    first: int
    second: int
    sets: float
    """By which the second camera's film is later."""
    variance: float
    """From the signals' noise, sets squared."""


def time_offsets(cameras: Sequence[Camera], rows: Sequence[Row]) -> TimeOffsets:
    """Time offset of each film, from consecutive sets of silhouettes."""
    most = min(len(rows) - MIN_COMMON_SETS, len(rows) // 2)
    outlines = [outlines_of(cameras, row) for row in rows]
    signals = ((i, j, tangent_signals(cameras, outlines, i, j)) for i, j in combinations(range(len(cameras)), 2) if most > 0)
    shifts = [found for i, j, both in signals for side in both.swapaxes(0, 1) if (found := _compared(i, j, side, most)) is not None]
    late, spread = _solved(len(cameras), shifts)
    table = np.full((len(cameras), len(cameras)), np.nan)
    for i, j in {shift[:2] for shift in shifts}:
        own = [shift for shift in shifts if shift[:2] == (i, j)]
        table[i, j] = np.average([shift.sets for shift in own], weights=[1 / shift.variance for shift in own])
        table[j, i] = -table[i, j]
    return TimeOffsets(names=tuple(camera.name for camera in cameras), frames=plain_values(late), spread=plain_values(spread),
                       pairs=tuple(map(plain_values, table)))


def certain_offsets(offsets: TimeOffsets, misplaced: Collection[str] = ()) -> list[float]:
    """Certain time offsets of the films, in sets; 0 for uncertain ones. `misplaced`: names of cameras that disagree about places."""
    limits = [max(MIN_OFFSET_MISPLACED if name in misplaced else MIN_OFFSET, SPREAD_FACTOR * (spread or 0.0))
              for name, spread in zip(offsets.names, offsets.spread)]
    return [late if late is not None and abs(late) > limit else 0.0 for late, limit in zip(offsets.frames, limits)]


def delays_in_words(frames: Mapping[str, float]) -> str:
    """By how many frames each film is late, by camera."""
    return ", ".join(f"{name} {abs(value):.1f} frames {'late' if value > 0 else 'early'}" for name, value in frames.items())


def tangent_signals(cameras: Sequence[Camera], outlines: Sequence[Sequence[Outline | None]], i: int, j: int) -> Array:
    """Signals (2 cameras, 2 tangents, F sets): angles of the outermost tangent planes of cameras i and j, scaled to pixels; NaN if none."""
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


def _compared(i: int, j: int, signals: Array, most: int) -> _Shift | None:
    """Time offset of two cameras: the shift at which their signals (2, F) differ least; None if there is no distinct minimum."""
    shifts = np.arange(-most, most + 1)
    cost = np.array([_difference(signals, s) for s in shifts.tolist()])
    if np.isfinite(cost).sum() < 5:
        return None
    median, k = float(np.nanmedian(cost)), int(np.nanargmin(cost))
    if not 0 < k < len(cost) - 1 or not np.isfinite(cost[k - 1 : k + 2]).all() or cost[k] > MAX_RESIDUAL_SHARE * median:
        return None
    return _refined(i, j, signals, int(shifts[k])) if _is_alike(signals, int(shifts[k]), most) else None


def _is_alike(signals: Array, shift: int, most: int) -> bool:
    """Whether signals (2, F) move, and are more alike at a shift than the best of all shifts up to `most` makes them by chance."""
    a, b = _overlapping(signals, shift)
    both = np.isfinite(a) & np.isfinite(b)
    if both.sum() < MIN_COMMON_SETS:
        return False
    a, b = a[both] - np.median(a[both]), b[both] - np.median(b[both])
    if min(1.4826 * float(np.median(np.abs(each))) for each in (a, b)) < LEAST_MOTION:
        return False
    off = np.abs(a - b - np.median(a - b))
    kept = off <= np.percentile(off, TRIM_PERCENTILE)
    count = kept.sum() * _independent(_memory(a) * _memory(b))
    likeness = float(np.corrcoef(a[kept], b[kept])[0, 1])
    tries = max(2.0, count * 2 * most / len(a))
    score = np.arctanh(np.clip(likeness, -0.999999, 0.999999)) * np.sqrt(max(count - 1.0, 0.0))
    return bool(score > np.sqrt(2 * np.log(tries)) + LEAST_SCORE)


def _refined(i: int, j: int, signals: Array, shift: int) -> _Shift | None:
    """The offset near a shift of signals (2, F) by least squares, without limbs that are missing at times; its variance from the noise that
    is left, and from how parts of the film differ. None if it runs away."""
    first, second = signals
    at, where = np.arange(len(first), dtype=float), np.flatnonzero(np.isfinite(second))
    there = np.isfinite(second).astype(float)
    sets, variance = float(shift), np.nan
    for _ in range(STEPS):
        later = np.where(np.interp(at + sets, at, there, 0, 0) > 0.999, np.interp(at + sets, where, second[where]), np.nan)
        known = np.isfinite(first) & np.isfinite(later)
        if known.sum() < MIN_COMMON_SETS:
            return None
        a, b = first[known], later[known]
        off = np.abs(a - b - np.median(a - b))
        kept = off <= max(OUTLIER * 1.4826 * float(np.median(off)), 0.2)
        slope = np.gradient((a + b) / 2)
        slope = np.clip(slope, *np.percentile(slope, (2, 98)))[kept]
        left = (a - b)[kept] - float((a - b)[kept].mean())
        information = float(slope @ slope)
        if information <= 0:
            return None
        sets += float(slope @ left) / information
        noise = max(float(left.var()), 0.05**2) / _independent(_memory(left) * _memory(slope))
        pulls = np.bincount(np.flatnonzero(kept) * PARTS // len(a), slope * left, PARTS)
        parts = FEW_PARTS * PARTS / (PARTS - 1) * float(pulls @ pulls) / information
        variance = max(noise / 4, parts) / information  # a few parts may agree by chance
    return _Shift(i, j, sets, variance) if abs(sets - shift) < 1.5 else None


def _memory(signal: Array) -> float:
    """Correlation of a signal (F,) with itself one set later; 0 to 0.99."""
    signal = signal - signal.mean()
    power = float(signal @ signal)
    return float(np.clip(signal[1:] @ signal[:-1] / power, 0.0, 0.99)) if power > 0 else 0.99


def _independent(memory: float) -> float:
    """Share of a signal's samples that are as good as independent."""
    return (1 - memory) / (1 + memory)


def _overlapping(signals: Array, shift: int) -> tuple[Array, Array]:
    """The parts (F - |shift|,) of two signals (2, F) that are left if the second is taken `shift` sets later."""
    F = signals.shape[1]
    return signals[0, max(0, -shift) : F - max(0, shift)], signals[1, max(0, shift) : F + min(0, shift)]


def _difference(signals: Array, shift: int) -> float:
    """Trimmed mean difference of two signals (2, F), the second taken `shift` sets later, without its constant part."""
    a, b = _overlapping(signals, shift)
    off = (a - b)[np.isfinite(a - b)]
    if len(off) < MIN_COMMON_SETS:
        return np.nan
    return float(np.sort(np.abs(off - np.median(off)))[: max(1, len(off) * TRIM_PERCENTILE // 100)].mean())


def _solved(count: int, shifts: Sequence[_Shift]) -> tuple[Array, Array]:
    """Sets (C,) by which each film is late against most others, and the half-widths (C,) of their 90 % intervals; NaN where unknown.

    Robust least squares; shifts differ by their noise and by as much more as they are seen to (a random effect with a prior).
    """
    from scipy.stats import t

    late, spread = np.full(count, np.nan), np.full(count, np.nan)
    films, used = _linked(count, shifts)
    if not used:
        return late, spread
    A = np.zeros((len(used), count))
    for n, shift in enumerate(used):
        A[n, [shift.first, shift.second]] = -1, 1
    A, b, noise = A[:, films], np.array([shift.sets for shift in used]), np.array([shift.variance for shift in used])
    freedom = APART_WEIGHT + max(len(used) - len(films) + 1, 0)
    apart, found, weights = APART**2, np.zeros(len(films)), 1 / (noise + APART**2)
    for n in range(SOLVER_ROUNDS):
        found = np.linalg.pinv(A.T @ (weights[:, None] * A)) @ (A.T @ (weights * b))
        off = np.abs(A @ found - b)
        if n < SOLVER_ROUNDS // 2:  # least absolute deviations: where most agree
            weights = 1 / np.sqrt(noise + APART**2) / np.maximum(off, 0.05)
            continue
        usual = np.maximum(noise + APART**2, (1.4826 * float(np.median(off))) ** 2)
        beyond = np.maximum(np.minimum(off**2, FAR**2 * usual) - noise, 0)
        apart = (APART_WEIGHT * APART**2 + float(beyond.sum())) / freedom
        weights = 1 / (noise + apart) / (1 + (off / FAR) ** 2 / (noise + apart))
    covariance = np.linalg.pinv(A.T @ (weights[:, None] * A))
    alone = [len({shift.first + shift.second - n for shift in used if n in shift[:2]}) == 1 for n in films]
    judges = [k for k, lone in enumerate(alone) if not lone] or list(range(len(films)))  # what one pair tells moves no other film
    middle = 0 if len(films) == 2 else sorted(judges, key=lambda k: found[k])[(len(judges) - 1) // 2]
    variance = np.diag(covariance) + covariance[middle, middle] - 2 * covariance[middle]
    late[films] = found - found[middle]
    widths = t.ppf(0.95, freedom) * np.sqrt(np.maximum(variance, covariance[middle, middle]))
    spread[films] = np.hypot(widths, LONE_PAIR * np.array(alone))
    return late, spread


def _linked(count: int, shifts: Sequence[_Shift]) -> tuple[list[int], list[_Shift]]:
    """The largest group of films whose offsets can be compared, in order, and the shifts between them."""
    from scipy.sparse import csr_array
    from scipy.sparse.csgraph import connected_components

    links = csr_array((np.ones(len(shifts)), np.array([shift[:2] for shift in shifts], int).reshape(-1, 2).T), shape=(count, count))
    _, number = connected_components(links, directed=False)
    group = np.flatnonzero(number == np.bincount(number).argmax()).tolist()
    return group, [shift for shift in shifts if shift.first in group]
