"""Writes and reads the 90 % intervals of a run's joints and the other places where they may be, intervals.csv.

A row for each joint of a frame whose accuracy is stated, with mode 0: the estimate, and bounds between which the joint is with 90 %,
whatever its mode. After it a row for each other place that the pictures allow (an arm before or behind the body may look the same): mode 1,
2, ..., without bounds. Rows of one limb with the same time and mode belong to one posture. Weights of a joint's rows add up to 1.
"""

from __future__ import annotations

from collections.abc import Iterable
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import Table, csv_line, read_table
from shadowpuppet.motion.motion import Mode, MotionFrame

HALF_WIDTH = 1.645
"""Half the width of a 90 % interval, in standard deviations."""
PLACE = ("weight", "x", "y", "z")
BOUNDS = ("x_low", "x_high", "y_low", "y_high", "z_low", "z_high")
"""Columns of bounds; no joint's columns are named so."""
MOST_MODES = 100
"""Number of modes that a file may have: more is no file of intervals."""
HEADER = ("time", "joint", "mode", *PLACE, *BOUNDS)


class Intervals(NamedTuple):
    """Joints over time: bounds of their coordinates, each with a probability of 90 %, and the M places where they may be."""

    times: Array
    """Seconds, of shape (T,)."""
    names: tuple[str, ...]
    """Joint names, J of them."""
    low: Array
    """World, metres, of shape (T, J, 3); not a number where none is stated."""
    high: Array
    """Likewise."""
    weights: Array
    """Probability of each place, of shape (T, J, M); 0 where there is none."""
    places: Array
    """World, metres, of shape (T, J, M, 3), the estimate first; not a number where there is none."""


class IntervalWriter:
    """Makes the lines of a table of intervals."""

    def __init__(self, names: Iterable[str]) -> None:
        """`names`: of the joints, J of them."""
        cells = [csv_line([name])[:-1].replace("%", "%%") for name in names]
        self._estimate = [f"{cell},0,%.3f,{','.join(['%.6f'] * 9)}\n" for cell in cells]
        self._other = [f"{cell},%d,%.3f,%.6f,%.6f,%.6f{',' * len(BOUNDS)}\n" for cell in cells]

    def header(self) -> str:
        """The first line."""
        return csv_line(HEADER)

    def lines(self, frame: MotionFrame) -> str:
        """The lines of a frame as `MotionBuilder.append` returns it; none of joints without a standard deviation."""
        joints, reach = np.asarray(frame.joints), HALF_WIDTH * np.asarray(frame.joint_sd)
        bounds = np.stack([joints - reach, joints + reach], 2).reshape(-1, len(BOUNDS))
        others, time = _by_joint(frame.modes), f"{frame.time:.6f},"
        template, values = "", list[float]()
        for j in np.flatnonzero(np.isfinite(bounds).all(1)).tolist():
            own = others.get(j, [])
            template += time + self._estimate[j] + "".join(time + self._other[j] for _ in own)
            values += [1 - sum(weight for _, weight, _ in own), *joints[j].tolist(), *bounds[j].tolist()]
            for mode, weight, place in own:
                values += [mode, weight, *place]
        return template % tuple(values)


def _by_joint(modes: Iterable[Mode]) -> dict[int, list[tuple[int, float, list[float]]]]:
    """Number, weight and place (3,) of the other places of each joint, by its index; numbers count from 1 in each limb."""
    found = dict[int, list[tuple[int, float, list[float]]]]()
    for _, own in groupby(modes, key=lambda each: each.limb):
        for number, mode in enumerate(own, 1):
            for j in np.flatnonzero(np.isfinite(mode.joints).all(1)).tolist():
                found.setdefault(j, []).append((number, mode.weight, mode.joints[j].tolist()))
    return found


def read_intervals(path: str | Path, cut: bool = False) -> Intervals:
    """Read a run's intervals.csv. Raises `FormatError`, naming file and line, if something is malformed.

    `cut`: ignore a last line without a line end, as the run may have been killed.
    """
    table = read_table(Path(path), cut)
    bounds, joints, every = table.numbers(BOUNDS), np.array(table.texts("joint"), str), table.numbers(["time"])[:, 0]
    modes, places = table.numbers(["mode"])[:, 0], table.numbers(PLACE)
    _check(table, every, joints, modes, bounds)
    _check_weights(table, places[:, 0])
    times, frame = np.unique(every, return_inverse=True)
    names, number = tuple(dict.fromkeys(joints.tolist())), int(modes.max(initial=0)) + 1
    where = frame.ravel(), [names.index(name) for name in joints], modes.astype(int)
    placed = np.full((len(times), len(names), number, len(PLACE) + len(BOUNDS)), np.nan)
    placed[where] = np.concatenate([places, bounds], axis=1)
    low, high = placed[:, :, 0, len(PLACE) :: 2], placed[:, :, 0, len(PLACE) + 1 :: 2]
    return Intervals(times, names, low, high, np.nan_to_num(placed[..., 0]), placed[..., 1 : len(PLACE)])


def _check_weights(table: Table, weights: Array) -> None:
    """Raise `FormatError` for the first row whose weight (R,) is no probability."""
    for n in np.flatnonzero(~((weights >= 0) & (weights <= 1))):
        found = "nothing" if np.isnan(weights[n]) else f"{weights[n]:g}"
        raise FormatError(f"{table.path}: line {table.lines[n]}, column 'weight': found {found}, expected 0 to 1")


def _check(table: Table, times: Array, joints: np.ndarray, modes: Array, bounds: Array) -> None:
    """Raise `FormatError` for the first row with an impossible time, mode or bound, or of a joint's mode that was there before."""
    seen = set[tuple[float, str, float]]()
    for n, (line, time, joint, mode) in enumerate(zip(table.lines, times.tolist(), joints.tolist(), modes.tolist())):
        where = f"{table.path}: line {line}"
        if time != time or (n and time < times[n - 1]):
            raise FormatError(f"{where}, column 'time': found {'no number' if time != time else f'{time:g}'}, expected seconds that do "
                              "not decrease")
        if mode not in range(MOST_MODES):
            raise FormatError(f"{where}, column 'mode': found {'no number' if mode != mode else f'{mode:g}'}, expected 0 for the estimate, "
                              "1, 2, ... for other places")
        if (time, joint, mode) in seen:
            raise FormatError(f"{where}, column 'joint': found mode {mode:g} of {joint!r} twice at {time:g} s, expected each once")
        seen.add((time, joint, mode))
        for k in np.flatnonzero(bounds[n, 0::2] > bounds[n, 1::2]):
            (low, high), (least, greatest) = BOUNDS[2 * k : 2 * k + 2], bounds[n, 2 * k : 2 * k + 2]
            raise FormatError(f"{where}, column {low!r}: found {least:g}, expected at most the {greatest:g} of {high!r}")
