"""Writes and reads the 90 % intervals of a run's joints, intervals.csv: one row for each joint of a frame whose accuracy is stated."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import Table, csv_line, read_table
from shadowpuppet.motion.motion import MotionFrame

HALF_WIDTH = 1.645
"""Half the width of a 90 % interval, in standard deviations."""
BOUNDS = ("x_low", "x_high", "y_low", "y_high", "z_low", "z_high")
"""Columns of bounds; no joint's columns are named so."""
HEADER = ("time", "joint", *BOUNDS)


class Intervals(NamedTuple):
    """Bounds of joints over time: each of a joint's coordinates is between them with a probability of 90 %."""

    times: Array
    """Seconds, of shape (T,)."""
    names: tuple[str, ...]
    """Joint names, J of them."""
    low: Array
    """World, metres, of shape (T, J, 3); not a number where none is stated."""
    high: Array
    """Likewise."""


class IntervalWriter:
    """Makes the lines of a table of intervals."""

    def __init__(self, names: Iterable[str]) -> None:
        """`names`: of the joints, J of them."""
        numbers = ",".join(["%.6f"] * len(BOUNDS))
        self._cells = [f"{csv_line([name])[:-1].replace('%', '%%')},{numbers}\n" for name in names]

    def header(self) -> str:
        """The first line."""
        return csv_line(HEADER)

    def lines(self, frame: MotionFrame) -> str:
        """The lines of a frame as `MotionBuilder.append` returns it; none of joints without a standard deviation."""
        joints, reach = np.asarray(frame.joints), HALF_WIDTH * np.asarray(frame.joint_sd)
        bounds = np.stack([joints - reach, joints + reach], 2).reshape(-1, len(BOUNDS))
        stated = np.flatnonzero(np.isfinite(bounds).all(1))
        if not len(stated):
            return ""
        template = "".join(f"{frame.time:.6f},{self._cells[j]}" for j in stated)
        return template % tuple(bounds[stated].ravel().tolist())


def read_intervals(path: str | Path, cut: bool = False) -> Intervals:
    """Read a run's intervals.csv. Raises `FormatError`, naming file and line, if something is malformed.

    `cut`: ignore a last line without a line end, as the run may have been killed.
    """
    table = read_table(Path(path), cut)
    bounds, joints, every = table.numbers(BOUNDS), np.array(table.texts("joint"), str), table.numbers(["time"])[:, 0]
    _check(table, every, joints, bounds)
    times, frame = np.unique(every, return_inverse=True)
    names = tuple(dict.fromkeys(joints.tolist()))
    placed = np.full((len(times), len(names), len(BOUNDS)), np.nan)
    placed[frame.ravel(), [names.index(name) for name in joints]] = bounds
    return Intervals(times, names, placed[..., 0::2], placed[..., 1::2])


def _check(table: Table, times: Array, joints: np.ndarray, bounds: Array) -> None:
    """Raise `FormatError` for the first row with an impossible time or bound, or of a joint that was there before."""
    seen = set[tuple[float, str]]()
    for n, (line, time, joint) in enumerate(zip(table.lines, times.tolist(), joints.tolist())):
        where = f"{table.path}: line {line}"
        if time != time or (n and time < times[n - 1]):
            raise FormatError(f"{where}, column 'time': found {'no number' if time != time else f'{time:g}'}, expected seconds that do "
                              "not decrease")
        if (time, joint) in seen:
            raise FormatError(f"{where}, column 'joint': found {joint!r} twice at {time:g} s, expected each joint once")
        seen.add((time, joint))
        for k in np.flatnonzero(bounds[n, 0::2] > bounds[n, 1::2]):
            (low, high), (least, greatest) = BOUNDS[2 * k : 2 * k + 2], bounds[n, 2 * k : 2 * k + 2]
            raise FormatError(f"{where}, column {low!r}: found {least:g}, expected at most the {greatest:g} of {high!r}")
