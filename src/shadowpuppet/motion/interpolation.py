"""Motion at a constant rate: uniform sampling times of a film, and resampling by splines."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import ROUNDING, JointTable

FRAME_TOLERANCE = 0.2
"""Share of a step by which a frame may lie off a uniform time: films' times are rounded to milliseconds, cameras' jitter."""
MAX_FRAMES = 10_000_000
"""Upper bound of the number of frames."""
ROUNDED_TIME = 1e-9
"""Greatest error of a number for a time, seconds."""
MOST_ROUNDED = 0.02
"""Greatest share by which a fitted rate may differ from the nominal one: two times of a film rounded to milliseconds have 1%."""


class UniformSampling(NamedTuple):
    """Uniformly spaced times, and the frames at them."""

    rate: float
    """Frames/s."""
    times: Array
    """Seconds, of shape (K,)."""
    frames: NDArray[np.int64] | None
    """The frame at each time (K,), -1 where it is missing; None if frames lie between the times and values must be interpolated."""


def uniform_sampling(times: ArrayLike) -> UniformSampling:
    """Uniform times for frames at times (T,), seconds: if the frames lie on uniform times, some possibly without a frame, these; else
    times in steps of their median. Raises `ShadowPuppetError` without any frame, or if far too many would be missing."""
    times = np.asarray(times, float)
    if len(times) < 2:
        if not len(times):
            raise ShadowPuppetError("found no frame, expected one at least")
        return UniformSampling(30.0, times, np.zeros(1, np.int64))  # any rate is right for a single frame
    steps = np.diff(times)
    step = float(np.median(steps))
    if (times[-1] - times[0]) / step > MAX_FRAMES:
        raise ShadowPuppetError(f"times: found {times[-1] - times[0]:g} s in steps of {step:g} s, expected at most {MAX_FRAMES} of them")
    numbers = np.concatenate([[0], np.cumsum(np.round(steps / step))])
    slope, start = np.polyfit(numbers, times, 1) if numbers[-1] > 0 else (step, times[0])
    if (np.diff(numbers) > 0).all() and (np.abs(start + slope * numbers - times) <= FRAME_TOLERANCE * slope).all():
        frames = np.full(int(numbers[-1]) + 1, -1)
        frames[numbers.astype(int)] = np.arange(len(times))
        return UniformSampling(_rounded(_nominal(times, numbers, float(1 / slope))), times[0] + slope * np.arange(len(frames)), frames)
    count = int((times[-1] - times[0]) / step + 1 + FRAME_TOLERANCE)
    return UniformSampling(_rounded(1 / step), np.minimum(times[0] + step * np.arange(count), times[-1]), None)


def rate_of(times: ArrayLike) -> float:
    """Frames/s of frames at times (T,), seconds, T at least 2: of uniform times, some possibly without a frame, else by the median step."""
    try:
        return uniform_sampling(times).rate
    except ShadowPuppetError:
        return _rounded(1 / float(np.median(np.diff(np.asarray(times, float)))))


@np.errstate(over="ignore")
def _nominal(times: Array, numbers: Array, rate: float) -> float:
    """The rate that a camera states (30, 29.97, 12.5) if frames of these `numbers` (T,) have it within the rounding of their times (T,);
    else `rate`, the fitted one."""
    if not np.isfinite([2 * rate, 1e9 * times[-1], 1e9 * times[0]]).all():
        return rate
    if abs(2 * rate - round(2 * rate)) < 1e-6 * rate:
        return round(2 * rate) / 2
    digits = next((n for n in range(9) if np.abs(times.round(n) - times).max() < ROUNDED_TIME), 9)
    for candidate in (float(round(rate)), round(rate * 1.001) / 1.001):  # 1.001: of NTSC's films
        if candidate and abs(candidate / rate - 1) < MOST_ROUNDED and np.ptp(times - numbers / candidate) <= 10.0**-digits + ROUNDED_TIME:
            return candidate
    return rate


def _rounded(rate: float) -> float:
    """A rate to six digits: 29.97 for 29.97003."""
    return float(f"{rate:.6g}")


END_TOLERANCE = 1e-6
"""Share of a step by which the last new time may exceed the end, to allow for rounding."""


def resample(times: ArrayLike, values: ArrayLike, rate: float) -> tuple[Array, Array]:
    """Values (T, ...) at times (T,), seconds, resampled at `rate`: new times (K,), from the first on, and values (K, ...). Cubic splines
    through runs of known values; not a number between unknown ones. Angles must be unwrapped. Frequencies above half the new rate are
    not filtered out. Raises `ShadowPuppetError` for invalid times or an invalid rate."""
    times, values = np.asarray(times, float), np.asarray(values, float)
    if times.ndim != 1 or not len(times) or len(times) != len(values) or not (np.diff(times) > 0).all() or not np.isfinite(times).all():
        raise ShadowPuppetError(f"times: found {times.shape} for values {values.shape}, expected a finite, increasing one for each value")
    if not 0 < rate < np.inf:
        raise ShadowPuppetError(f"rate: found {rate}, expected frames a second, more than zero")
    steps = np.arange(int((times[-1] - times[0]) * rate + 1 + END_TOLERANCE))
    wanted = np.minimum(times[0] + steps / rate, times[-1])
    columns = [_interpolated(times, column, wanted) for column in values.reshape(len(times), -1).T]
    return wanted, np.reshape(np.transpose(columns), (len(wanted), *values.shape[1:]))


def resample_table(table: JointTable, rate: float) -> JointTable:
    """A joint table at another frame rate; see `resample`."""
    times, positions = resample(table.times, table.positions, rate)
    return JointTable(times, table.names, positions)


def _interpolated(times: Array, values: Array, wanted: Array) -> Array:
    """Values (T,) at wanted times (K,), by one spline for each run of known values."""
    from scipy.interpolate import make_interp_spline

    out = np.full(len(wanted), np.nan)
    for start, end in true_runs(np.isfinite(values)):
        inside = (wanted >= times[start]) & (wanted <= times[end - 1])
        if inside.any():
            spline = make_interp_spline(times[start:end], values[start:end], k=min(3, end - start - 1))
            out[inside] = spline(wanted[inside])
    return out


def filled(times: ArrayLike, values: ArrayLike) -> Array:
    """Values (T, ...) at times (T,), seconds, with a straight line through unknown ones, and the nearest known one at the ends."""
    times, values = np.asarray(times, float), np.asarray(values, float)
    out = values.reshape(len(times), -1).copy()
    for column in out.T:
        unknown = np.isnan(column)
        if unknown.any() and not unknown.all():
            column[unknown] = np.interp(times[unknown], times[~unknown], column[~unknown])
    return out.reshape(values.shape)


def true_runs(known: ArrayLike) -> list[tuple[int, int]]:
    """Starts and ends of the runs of true values in (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.asarray(known, bool), [False]]).astype(int)))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def sums_about(times: Array, values: ArrayLike, reach: float) -> Array:
    """Sums (T, ...) of values (T, ...) over the frames within `reach` of each of `times` (T,), seconds."""
    values = np.asarray(values)
    sums = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, 0)])
    first, last = (np.searchsorted(times, times + side * (reach + ROUNDING)) for side in (-1, 1))
    return sums[last] - sums[first]
