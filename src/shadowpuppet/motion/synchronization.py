"""Joint tables at common times, and the offset between two clocks."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import JointTable

MAX_GAP = 1.5
"""Largest gap, in steps, that is interpolated."""
NEAREST_WITHIN = 0.1
"""A frame this near (in steps) is used as it is if nothing can be interpolated, so that rounded times lose no frames at the ends."""
DENSER_TRUTH = 0.75
"""If the truth's step is less than this times the run's, the truth is interpolated, not the run."""
MIN_SHARED, MIN_SPEEDS = 0.5, 12
"""Share of the shorter motion's speeds that must overlap at an offset, and their minimum number."""
SPEED_SPAN = 0.25
"""Time (s) over which a speed is measured: over one frame it would be mostly jitter."""
STANDS_OUT = 0.7
"""An offset is accepted if its speed error is less than this times the median of the other offsets' errors."""
OTHER_OFFSET, RIVAL_FACTOR, RIVAL_MARGIN = 0.3, 1.15, 0.01
"""Offsets this far apart (s) are different; one is a rival if its error is below `RIVAL_FACTOR` times the best plus `RIVAL_MARGIN`
(m/s)."""


def match(times: ArrayLike, truth_times: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """For each time of the truth (T,) the index of the nearest of `times` (increasing), and whether it is within half a step. The step
    is the truth's median one; a truth of one frame accepts any."""
    times, truth_times = np.asarray(times, float), np.asarray(truth_times, float)
    index = nearest(times, truth_times)
    return index, np.abs(times[index] - truth_times) <= 0.5 * step_of(truth_times) + 1e-9


def step_of(times: ArrayLike) -> float:
    """The median time between frames, seconds; infinite for fewer than two."""
    times = np.asarray(times, float)
    return float(np.median(np.diff(times))) if len(times) > 1 else np.inf


def at_times(table: JointTable, times: ArrayLike) -> JointTable:
    """A table's joints at other times (T,), seconds, increasing, by linear interpolation. Not a number if a neighbouring frame lacks
    the joint, if the two are more than 1.5 steps apart, and beyond the ends, where a frame within a tenth of a step is used."""
    times, own, places = np.asarray(times, float), table.times, table.positions
    if len(own) == 0:
        return JointTable(times, table.names, np.full((len(times), *places.shape[1:]), np.nan))
    after = np.clip(np.searchsorted(own, times), 1, max(len(own) - 1, 1))
    before, after = after - 1, np.minimum(after, len(own) - 1)
    span = own[after] - own[before]
    share = np.divide(times - own[before], span, out=np.zeros(len(times)), where=span > 0)
    usable = (span > 0) & (span <= MAX_GAP * step_of(own)) & (share >= 0) & (share <= 1)
    weight = np.where(usable, share, 0)[:, None, None]
    found = np.where(usable[:, None, None], (1 - weight) * places[before] + weight * places[after], np.nan)
    closest = nearest(own, times)
    near = np.abs(own[closest] - times) <= (NEAREST_WITHIN * step_of(own) if len(own) > 1 else 1e-6)
    return JointTable(times, table.names, np.where(near[:, None, None] & ~np.isfinite(found), places[closest], found))


def at_common_times(run: JointTable, truth: JointTable) -> tuple[JointTable, JointTable]:
    """Both tables at the same times: the truth's, or the run's if the truth has more frames a second. Where the run has no frames the
    truth's times remain, thinned to the run's rate, so that left-out frames count as lost."""
    slow = step_of(run.times)
    if len(run.times) == 0 or not step_of(truth.times) < DENSER_TRUTH * slow < np.inf:
        return at_times(run, truth.times), truth
    margin = NEAREST_WITHIN * step_of(truth.times)
    within = (run.times >= truth.times[0] - margin) & (run.times <= truth.times[-1] + margin)
    alone = truth.times[np.abs(run.times[nearest(run.times, truth.times)] - truth.times) > MAX_GAP / 2 * slow]
    thinned = alone[np.unique(np.floor((alone - alone[:1]) / slow + 1e-6), return_index=True)[1]]
    times = np.sort(np.concatenate([run.times[within], thinned]))
    return at_times(run, times), at_times(truth, times)


class Offset(NamedTuple):
    """Offset between two clocks."""

    seconds: float
    """To be added to the truth's times."""
    error: float
    """Root mean square difference of the joints' speeds with this offset, m/s."""
    before: float
    """The same without any offset; not a number if the motions do not overlap then."""
    rival: float | None
    """Another offset that fits nearly as well, as in periodic motion; None if there is none."""


def find_offset(run: JointTable, truth: JointTable) -> Offset:
    """The offset to add to the truth's times so that joints have equal speeds at equal times; the worlds may differ. It minimises the
    mean square difference of the shared joints' speeds, over offsets at which half of the shorter motion overlaps, refined between
    steps; among equally good ones it is the smallest. Raises `ShadowPuppetError` if no offset stands out."""
    names = [name for name in run.names if name in truth.names]
    ours, theirs = run.select(names), truth.select(names)
    step = max(step_of(run.times), step_of(truth.times))
    if not names or not np.isfinite(step):
        raise ShadowPuppetError("sync: found no joint that run and truth share in two frames or more, so the clocks cannot be compared")
    lags, errors = _by_lag(*(_speeds(table, _steps(table, step)) for table in (ours, theirs)))
    if not np.isfinite(errors).any():
        raise ShadowPuppetError(f"sync: run and truth share fewer than {MIN_SPEEDS} speeds at every offset, so the clocks cannot be "
                                "compared")
    offsets = run.times[0] - truth.times[0] + lags * step
    good = RIVAL_FACTOR * np.nanmin(errors) + RIVAL_MARGIN
    smallest = np.nanmin(np.abs(offsets[errors <= good]))
    best = int(np.nanargmin(np.where(np.abs(offsets) <= smallest + OTHER_OFFSET, errors, np.nan)))
    elsewhere = np.where(np.abs(offsets - offsets[best]) > OTHER_OFFSET, errors, np.nan)
    usual = np.nanmedian(elsewhere) if np.isfinite(elsewhere).any() else np.inf
    if not errors[best] < STANDS_OUT * usual:
        raise ShadowPuppetError(f"sync: the best offset, {offsets[best]:.3f} s, leaves {errors[best]:.3f} m/s of speed error, the usual "
                                f"one {usual:.3f}: none stands out; give --offset")
    tried = offsets[best] + step * np.linspace(-1, 1, 41)
    around = np.array([speed_error(ours, theirs, float(seconds)) for seconds in tried])
    seconds = float(tried[np.nanargmin(around)]) if np.isfinite(around).any() else float(offsets[best])
    rival = int(np.nanargmin(elsewhere)) if np.isfinite(elsewhere).any() else best
    close = rival != best and errors[rival] <= good
    return Offset(seconds, speed_error(ours, theirs, seconds), speed_error(ours, theirs, 0.0), float(offsets[rival]) if close else None)


def speed_error(run: JointTable, truth: JointTable, offset: float) -> float:
    """Root mean square difference of speeds, m/s, with `offset` seconds added to the truth's times; not a number without overlap."""
    times = _steps(run, max(step_of(run.times), step_of(truth.times)))
    off = _speeds(run, times) - _speeds(truth, times - offset)
    off = off[np.isfinite(off)]
    return float(np.sqrt((off**2).mean())) if len(off) else np.nan


def _steps(table: JointTable, step: float) -> Array:
    """Times from a table's first to its last in steps of `step`."""
    return table.times[0] + step * np.arange(int((table.times[-1] - table.times[0]) / step + 1e-6) + 1)


def _speeds(table: JointTable, times: Array) -> Array:
    """Speeds (T, J), m/s, over `SPEED_SPAN` around each time."""
    before, after = (at_times(table, times + sign * SPEED_SPAN / 2).positions for sign in (-1, 1))
    return np.linalg.norm(after - before, axis=2) / SPEED_SPAN


def _by_lag(ours: Array, theirs: Array) -> tuple[NDArray[np.int64], Array]:
    """Lags (L,), the steps by which `theirs` begins later, and the root mean square difference at each, by correlations in Fourier
    space."""
    from scipy.signal import correlate

    a, b, known_a, known_b = np.nan_to_num(ours), np.nan_to_num(theirs), np.isfinite(ours).astype(float), np.isfinite(theirs).astype(float)

    def total(x: Array, y: Array) -> Array:
        return np.sum([correlate(x[:, j], y[:, j], method="fft") for j in range(x.shape[1])], axis=0)

    count = np.round(total(known_a, known_b))
    squares = total(a**2, known_b) - 2 * total(a, b) + total(known_a, b**2)
    enough = count >= max(MIN_SPEEDS, MIN_SHARED * min(known_a.sum(), known_b.sum()))
    errors = np.sqrt(np.maximum(squares, 0) / np.maximum(count, 1))
    return np.arange(len(count)) - (len(theirs) - 1), np.where(enough, errors, np.nan)


def nearest(times: NDArray[Any], wanted: NDArray[Any]) -> NDArray[np.int64]:
    """Index of the nearest of `times` (increasing) to each wanted one; the earlier of two equally near."""
    after = np.clip(np.searchsorted(times, wanted), 1, max(len(times) - 1, 1))
    before, after = after - 1, np.minimum(after, len(times) - 1)
    return np.where(np.abs(times[before] - wanted) <= np.abs(times[after] - wanted), before, after)
