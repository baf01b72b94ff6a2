"""Times at a constant rate, which some files have instead of times."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array

NEAR = 0.2
"""Share of a step by which a frame may lie off its place: films' times are rounded to milliseconds, cameras' tremble."""
MOST = 10_000_000
"""Frames; so many make no motion."""
ALONE = 30.0
"""Frames/s of one frame."""


class Steady(NamedTuple):
    """Times that are a step apart, and the frames that belong to them."""

    rate: float
    """Frames/s."""
    times: Array
    """Seconds, of shape (K,)."""
    frames: NDArray[np.int64] | None
    """The frame of each time (K,), -1 where there is none; None: frames lie between, and values must be found anew."""


def steady(times: ArrayLike) -> Steady:
    """Times a step apart that go through frames at times (T,), seconds: those of a film with frames missing, or of their median step.

    Raises `ShadowPuppetError` where there is no frame, or far too many would be missing.
    """
    times = np.asarray(times, float)
    if len(times) < 2:
        if not len(times):
            raise ShadowPuppetError("found no frame, expected one at least")
        return Steady(ALONE, times, np.zeros(1, np.int64))
    steps = np.diff(times)
    step = float(np.median(steps))
    if (times[-1] - times[0]) / step > MOST:
        raise ShadowPuppetError(f"times: found {times[-1] - times[0]:g} s in steps of {step:g} s, expected at most {MOST} of them")
    numbers = np.concatenate([[0], np.cumsum(np.round(steps / step))])
    slope, start = np.polyfit(numbers, times, 1) if numbers[-1] > 0 else (step, times[0])
    if (np.diff(numbers) > 0).all() and (np.abs(start + slope * numbers - times) <= NEAR * slope).all():
        frames = np.full(int(numbers[-1]) + 1, -1)
        frames[numbers.astype(int)] = np.arange(len(times))
        return Steady(_rounded(1 / slope), times[0] + slope * np.arange(len(frames)), frames)
    count = int((times[-1] - times[0]) / step + 1 + NEAR)
    return Steady(_rounded(1 / step), np.minimum(times[0] + step * np.arange(count), times[-1]), None)


def _rounded(rate: float) -> float:
    """A rate as it was meant, where it is nearly that of films: 29.97 for 29.97003."""
    return float(f"{rate:.6g}")
