"""Time offsets between films, from the motion of silhouettes alone.

A plane through two camera centres touches the person for both cameras at the same time (`epipolar_tangency`). So its angle about the
baseline is a signal that both films show, and the shift that aligns the two signals is their time offset. A camera that was moved a
little changes its signal by a nearly constant angle, which is removed: this separates time from place.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.agreement import plain_values
from shadowpuppet.calibration.clock_offset import QUANTILE
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
NOISE_FACTOR = 1.56
"""Factor on the variance from noise: the trimmed minimum is less exact than least squares would be; chosen on simulated signals, of whose
true shifts the intervals then hold 86 to 91 %."""
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
    """Half-width of each offset's 90 % interval, sets: from the noise of the signals, and from how the camera's pairs differ."""
    pairs: tuple[tuple[float | None, ...], ...]
    """Sets by which the second film of a pair is later than the first; None if unknown."""


@dataclass(frozen=True, eq=False)
class _Pair:
    """Time offset of two cameras."""

    first: int
    second: int
    shift: float
    """Sets by which the second camera's film is later."""
    weight: float
    variance: float = 0.0
    """Of the shift, from the signals' noise, sets squared."""


def time_offsets(cameras: Sequence[Camera], rows: Sequence[Row]) -> TimeOffsets:
    """Time offset of each film, from consecutive sets of silhouettes."""
    most = min(len(rows) - MIN_COMMON_SETS, len(rows) // 2)
    outlines = [outlines_of(cameras, row) for row in rows]
    pairs = [pair for i, j in combinations(range(len(cameras)), 2)
             if most > 0 and (pair := _compared(i, j, tangent_signals(cameras, outlines, i, j), most)) is not None]
    late, known = _solved(len(cameras), pairs)
    table = np.full((len(cameras), len(cameras)), np.nan)
    deviations: list[list[float]] = [[] for _ in cameras]
    variances: list[list[float]] = [[] for _ in cameras]
    for pair in pairs:
        table[pair.first, pair.second], table[pair.second, pair.first] = pair.shift, -pair.shift
        for n in (pair.first, pair.second):
            deviations[n].append(abs(late[pair.second] - late[pair.first] - pair.shift))
            variances[n].append(pair.variance)
    spread = np.array([_half_width(off, own) if off else np.nan for off, own in zip(deviations, variances)])
    return TimeOffsets(names=tuple(camera.name for camera in cameras), frames=plain_values(np.where(known, late, np.nan)),
                       spread=plain_values(spread), pairs=tuple(map(plain_values, table)))


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


def _half_width(deviations: Sequence[float], variances: Sequence[float]) -> float:
    """Half-width of a camera's 90 % interval, sets. Noise of its own silhouettes is in all of its pairs: more than two add nothing."""
    noise = float(np.median(variances)) / min(len(variances), 2)
    between = (1.4826 * float(np.median(deviations))) ** 2 / len(deviations)
    return QUANTILE * float(np.sqrt(noise + between))


def _compared(i: int, j: int, signals: Array, most: int) -> _Pair | None:
    """Time offset of two cameras: the shift at which their signals differ least; None if there is no distinct minimum."""
    shifts = np.arange(-most, most + 1)
    cost = np.array([_difference(signals, s) for s in shifts.tolist()])
    if np.isfinite(cost).sum() < 5:
        return None
    median, k = float(np.nanmedian(cost)), int(np.nanargmin(cost))
    if not 0 < k < len(cost) - 1 or not np.isfinite(cost[k - 1 : k + 2]).all() or cost[k] > MAX_RESIDUAL_SHARE * median:
        return None
    before, least, after = cost[k - 1 : k + 2]
    rise = max(before, after) - least
    variance = _variance(signals, int(shifts[k]), most)
    if rise <= 0 or variance is None:
        return None
    return _Pair(i, j, float(shifts[k] + 0.5 * (before - after) / rise), float((rise / max(least, 0.05)) ** 2), variance)


def _variance(signals: Array, shift: int, most: int) -> float | None:
    """Variance of a shift, sets squared, by the signals' slopes and the noise that is left at it; None if nothing moves, or the signals
    (2, 2, F) are no more alike than the best of all shifts up to `most` makes them by chance."""
    information, alike = 0.0, False
    for a, b in zip(*_overlapping(signals, shift)):
        both = np.isfinite(a) & np.isfinite(b)
        if both.sum() < MIN_COMMON_SETS:
            continue
        a, b = a[both] - np.median(a[both]), b[both] - np.median(b[both])
        kept = np.abs(a - b - np.median(a - b)) <= np.percentile(np.abs(a - b - np.median(a - b)), TRIM_PERCENTILE)
        size = min(1.4826 * float(np.median(np.abs(each))) for each in (a, b))
        if size < LEAST_MOTION:
            continue
        left = (a - b)[kept]
        count = len(left) * _independent(_memory(a) * _memory(b))
        likeness = float(np.corrcoef(a[kept], b[kept])[0, 1])
        tries = max(2.0, count * 2 * most / len(a))
        score = np.arctanh(np.clip(likeness, -0.999999, 0.999999)) * np.sqrt(max(count - 1.0, 0.0))
        alike |= bool(score > np.sqrt(2 * np.log(tries)) + LEAST_SCORE)
        slope = np.gradient((a + b) / 2)
        noise = max(float(left.var()), 0.05**2) / _independent(_memory(left))
        information += float((np.clip(slope, *np.percentile(slope, (2, 98))) ** 2).sum()) / noise
    return NOISE_FACTOR / information if alike and information > 0 else None


def _memory(signal: Array) -> float:
    """Correlation of a signal (F,) with itself one set later; 0 to 0.99."""
    signal = signal - signal.mean()
    power = float(signal @ signal)
    return float(np.clip(signal[1:] @ signal[:-1] / power, 0.0, 0.99)) if power > 0 else 0.99


def _independent(memory: float) -> float:
    """Share of a signal's samples that are as good as independent."""
    return (1 - memory) / (1 + memory)


def _overlapping(signals: Array, shift: int) -> tuple[Array, Array]:
    """The parts (2, F - |shift|) of two signals (2, 2, F) that are left if the second is taken `shift` sets later."""
    F = signals.shape[2]
    return signals[0, :, max(0, -shift) : F - max(0, shift)], signals[1, :, max(0, shift) : F + min(0, shift)]


def _difference(signals: Array, shift: int) -> float:
    """Trimmed mean difference of two signals (2, 2, F), the second taken `shift` sets later, without its constant part."""
    a, b = _overlapping(signals, shift)
    total, tangents = 0.0, 0
    for d in a - b:
        d = d[np.isfinite(d)]
        if len(d) >= MIN_COMMON_SETS:
            d = np.sort(np.abs(d - np.median(d)))[: max(1, len(d) * TRIM_PERCENTILE // 100)]
            total, tangents = total + float(d.mean()), tangents + 1
    return total / tangents if tangents else np.nan


def _solved(count: int, pairs: Sequence[_Pair]) -> tuple[Array, NDArray[np.bool_]]:
    """Sets (C,) by which each film is late against most others (least absolute deviations), and whether each is known (C,)."""
    late, known = np.zeros(count), np.zeros(count, bool)
    for pair in pairs:
        known[[pair.first, pair.second]] = True
    weights = np.array([pair.weight for pair in pairs])
    for _ in range(SOLVER_ROUNDS if pairs else 0):
        A, b = np.zeros((len(pairs) + 1, count)), np.zeros(len(pairs) + 1)
        for n, (pair, weight) in enumerate(zip(pairs, np.sqrt(weights))):
            A[n, [pair.first, pair.second]], b[n] = (-weight, weight), weight * pair.shift
        A[-1] = 1e-3  # fixes the common shift, which the pairs leave open
        late = np.asarray(np.linalg.lstsq(A, b, rcond=None)[0], float)
        off = np.array([abs(late[pair.second] - late[pair.first] - pair.shift) for pair in pairs])
        weights = np.array([pair.weight for pair in pairs]) / np.maximum(off, 0.05)
    if known.sum() == 2:
        return late - late[np.argmax(known)], known  # the second film's offset against the first's
    return late - (np.sort(late[known])[(known.sum() - 1) // 2] if known.any() else 0.0), known
