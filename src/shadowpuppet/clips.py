"""Clips of motion made ready to learn from: mirrored, at another frame rate, without gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion import JointTable

SIDES = {"left_": "right_", "right_": "left_"}
FIT = 1e-6
"""Share of a step by which the last new time may lie past the end, for rounding's sake."""


def mirrored(table: JointTable) -> JointTable:
    """The motion as a mirror shows it that stands along the world's X axis: left is right, and y has the other sign.

    Raises `ShadowPuppetError` where a joint has a side and its counterpart is missing.
    """
    names = tuple(_other_side(name) for name in table.names)
    alone = [name for name, other in zip(table.names, names, strict=True) if other not in table.names]
    if alone:
        raise ShadowPuppetError(f"joint {alone[0]!r}: found no {_other_side(alone[0])!r} beside it, which a mirror needs")
    reflected = table.positions * (1, -1, 1)
    return JointTable(table.times, table.names, reflected[:, [table.names.index(name) for name in names]])


def resampled(times: ArrayLike, values: ArrayLike, rate: float) -> tuple[Array, Array]:
    """Times (K,), a step of 1 / rate apart from the first on, and the values (K, ...) there of values (T, ...) at times (T,), seconds.

    By cubic splines through what is known; not a number where either neighbour in time is none. Angles must have been unwrapped.
    Nothing is smoothed: what is faster than half the new rate is not taken out. Raises `ShadowPuppetError`.
    """
    times, values = np.asarray(times, float), np.asarray(values, float)
    if times.ndim != 1 or not len(times) or len(times) != len(values) or not (np.diff(times) > 0).all() or not np.isfinite(times).all():
        raise ShadowPuppetError(f"times: found {times.shape} for values {values.shape}, expected a finite, increasing one for each value")
    if not 0 < rate < np.inf:
        raise ShadowPuppetError(f"rate: found {rate}, expected frames a second, more than zero")
    steps = np.arange(int((times[-1] - times[0]) * rate + 1 + FIT))
    wanted = np.minimum(times[0] + steps / rate, times[-1])
    columns = [_interpolated(times, column, wanted) for column in values.reshape(len(times), -1).T]
    return wanted, np.reshape(np.transpose(columns), (len(wanted), *values.shape[1:]))


def resampled_table(table: JointTable, rate: float) -> JointTable:
    """Joints at another frame rate; see `resampled`."""
    times, positions = resampled(table.times, table.positions, rate)
    return JointTable(times, table.names, positions)


def without_gaps(values: ArrayLike, shortest: int = 2) -> list[Array]:
    """The parts of a clip (T, D) in which every number is known, those of `shortest` frames or more."""
    values = np.asarray(values, float)
    return [values[start:end] for start, end in _runs(np.isfinite(values).reshape(len(values), -1).all(1)) if end - start >= shortest]


def _interpolated(times: Array, values: Array, wanted: Array) -> Array:
    """Values (T,) at wanted times (K,): a spline for each run of known ones."""
    from scipy.interpolate import make_interp_spline

    out = np.full(len(wanted), np.nan)
    for start, end in _runs(np.isfinite(values)):
        inside = (wanted >= times[start]) & (wanted <= times[end - 1])
        if inside.any():
            spline = make_interp_spline(times[start:end], values[start:end], k=min(3, end - start - 1))
            out[inside] = spline(wanted[inside])
    return out


def _runs(known: ArrayLike) -> list[tuple[int, int]]:
    """Starts and ends of the runs of what is true in (T,)."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], np.asarray(known, bool), [False]]).astype(int)))
    return [(int(start), int(end)) for start, end in edges.reshape(-1, 2)]


def _other_side(name: str) -> str:
    for side, other in SIDES.items():
        if name.startswith(side):
            return other + name.removeprefix(side)
    return name
