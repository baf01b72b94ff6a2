"""Time offsets between films by flashes of light that all cameras see: a photographer's flash, or a lamp switched on for a moment.

A flash is a rise of the light in a great part of the picture that is over within a quarter of a second. Exposure that is regulated, clouds
and lamps that stay on are none; what lights a small part, such as a screen, is none either.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from shadowpuppet.calibration.clock_offset import ClockOffsets, PairOffset, offsets_of_pairs
from shadowpuppet.geometry import Array

AROUND, LONGEST = 1.0, 0.25
"""Seconds, around a frame, whose median is the light without flash; greatest length of a flash."""
LIT = 0.35
"""Share of the picture that a flash lights at least: one that falls into two frames of a rolling shutter lights a part of each."""
LEAST_RISE, STANDOUT = 0.06, 8.0
"""Least rise of the light over that without flash, and over the robust standard deviation of all rises."""
DARK = 16.0
"""Grey levels added to the light before rises are compared: noise of dark pictures is none."""
SHARED = 2 / 3
"""Least share of the flashes of either film, while both run, that the other one has as well."""
IN_STEP = 1.2
"""Greatest difference, in frames, of a flash's moments in two films."""


class Light(NamedTuple):
    """Light of a film's frames."""

    times: Array
    """Times (N,) on the recording's clock, seconds."""
    parts: Array
    """Mean grey levels (N, B), 0 to 255, of parts of the picture of one size."""

    @property
    def interval(self) -> float:
        """Median time from frame to frame, seconds; NaN for a single frame."""
        return float(np.median(np.diff(self.times))) if len(self.times) > 1 else np.nan


def flash_offsets(names: Sequence[str], lights: Sequence[Light]) -> ClockOffsets:
    """Offsets of films, `names` of the cameras, by the flashes that they share."""
    seen, pairs = [flashes(light) for light in lights], list[PairOffset]()
    for i, j in combinations(range(len(names)), 2):
        frame = max(lights[i].interval, lights[j].interval)
        found = shared_shift(seen[i], seen[j], frame, _span(lights[i]), _span(lights[j]))
        if found is not None:
            shift, number = found
            # a flash comes at any moment of a frame, in both films: the difference of two uniform errors
            pairs.append(PairOffset(i, j, shift, frame / np.sqrt(6 * number)))
    return offsets_of_pairs("flashes", names, pairs)


def flashes(light: Light) -> Array:
    """Times (F,) of the first frames that flashes light."""
    if len(light.times) < 3:
        return np.zeros(0)
    width = 2 * round(0.5 * AROUND / light.interval) + 1
    usual = median_filter(light.parts, (width, 1), mode="nearest")
    rise = np.quantile((light.parts - usual) / (usual + DARK), 1 - LIT, axis=1)
    usual_rise = np.median(rise)
    noise = 1.4826 * float(np.median(np.abs(rise - usual_rise)))
    bright = np.flatnonzero(rise > max(LEAST_RISE, usual_rise + STANDOUT * noise))
    runs = np.split(bright, np.flatnonzero(np.diff(bright) > 1) + 1)
    whole = [run for run in runs if len(run) and run[0] > 0 and run[-1] < len(rise) - 1]
    brief = [run for run in whole if light.times[run[-1] + 1] - light.times[run[0]] <= LONGEST + 1e-6]
    return np.array([light.times[run[0]] for run in brief])


def shared_shift(first: Array, second: Array, frame: float, of_first: tuple[float, float],
                 of_second: tuple[float, float]) -> tuple[float, int] | None:
    """Seconds by which flashes come later in the second film, and how many tell so; None if they do not tell.

    Args:
        first, second: times of the flashes (F,), seconds.
        frame: time from frame to frame, seconds.
        of_first, of_second: begin and end of the films, seconds.
    """
    if not len(first) or not len(second):
        return None
    apart = second[None, :] - first[:, None]
    shifts = np.unique(np.round(apart.ravel(), 6))
    counts = np.array([_matched(apart, shift, frame).sum() for shift in shifts])
    best = shifts[counts == counts.max()]
    if np.ptp(best) > 2 * IN_STEP * frame:
        return None  # several shifts explain as much
    matched = _matched(apart, float(np.median(best)), frame)
    shift, number = float(np.mean(apart[matched])), int(matched.sum())
    begin, end = max(of_first[0], of_second[0] - shift), min(of_first[1], of_second[1] - shift)
    common = [int(((times >= begin - frame) & (times <= end + frame)).sum()) for times in (first, second - shift)]
    return (shift, number) if number >= SHARED * max(common) else None


def _matched(apart: Array, shift: float, frame: float) -> NDArray[np.bool_]:
    """Which pairs of flashes, `apart` (F, G) seconds, are the same one at a shift: each has one partner at most."""
    off = np.abs(apart - shift)
    return (off <= IN_STEP * frame) & (off == off.min(0, keepdims=True)) & (off == off.min(1, keepdims=True))


def _span(light: Light) -> tuple[float, float]:
    return (float(light.times[0]), float(light.times[-1])) if len(light.times) else (0.0, 0.0)
