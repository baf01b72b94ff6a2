"""Time offsets between films by their clocks: what each film states itself, by timecode or by its sound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal, NamedTuple

import numpy as np
from scipy.constants import day

from shadowpuppet.io.intervals import HALF_WIDTH

LEAST_RESIDUAL = 0.002
"""Seconds below which the residual of a pair's offset does not count."""


@dataclass(frozen=True, kw_only=True)
class ClockOffsets:
    """Time offsets of films; plain values."""

    by: Literal["timecode", "sound"]
    names: tuple[str, ...]
    """Names of the cameras."""
    seconds: tuple[float | None, ...]
    """By which each film is late (negative: early): what happens comes that much later on its clock than on most others'; None if
    unknown."""
    spread: tuple[float | None, ...]
    """Half-width of the 90 % interval, seconds: of sound its way to the cameras and how the pairs differ; of timecode half a frame."""

    @property
    def known(self) -> bool:
        """Whether any film's offset is."""
        return any(each is not None for each in self.seconds)


def timecode_offsets(names: Sequence[str], timecodes: Sequence[float | None], starts: Sequence[float], rate: float) -> ClockOffsets | None:
    """Offsets of films by their timecodes.

    Args:
        names: of the cameras.
        timecodes: of each film's first picture, seconds of the day; None for films without.
        starts: seconds into each film at which the recording begins.
        rate: frames/s of the films.

    Returns None if fewer than two films have a timecode, or if all have the same: cameras whose clock is not set begin each film alike.
    """
    known = [code for code in timecodes if code is not None]
    if len(set(known)) < 2:
        return None
    first = known[0]
    turned = [None if code is None else (code - first + day / 2) % day - day / 2 for code in timecodes]  # films over midnight
    late = [None if code is None else -code - start for code, start in zip(turned, starts)]
    middle = float(np.median([each for each in late if each is not None]))
    return ClockOffsets(by="timecode", names=tuple(names), seconds=tuple(None if each is None else each - middle for each in late),
                        spread=tuple(None if each is None else 0.5 / rate for each in late))


class PairOffset(NamedTuple):
    """Seconds by which what happens comes later in the second of two films, by their numbers, and the standard deviation of that."""

    first: int
    second: int
    seconds: float
    deviation: float


def offsets_of_pairs(names: Sequence[str], pairs: Sequence[PairOffset]) -> ClockOffsets:
    """Offsets by sound with a median of zero that leave the least sum of absolute residuals of the pairs' offsets."""
    count, stated = len(names), sorted({film for pair in pairs for film in (pair.first, pair.second)})
    seconds: list[float | None] = [None] * count
    spread: list[float | None] = [None] * count
    if not stated:
        return ClockOffsets(by="sound", names=tuple(names), seconds=tuple(seconds), spread=tuple(spread))
    rows, target = np.zeros((len(pairs), count)), np.array([pair.seconds for pair in pairs])
    for n, pair in enumerate(pairs):
        rows[n, pair.first], rows[n, pair.second] = -1, 1
    weights, late = np.ones(len(pairs)), np.zeros(count)
    for _ in range(20):  # iteratively reweighted least squares
        late = np.linalg.lstsq(rows * weights[:, None], target * weights, rcond=None)[0]
        weights = 1 / np.sqrt(np.maximum(np.abs(rows @ late - target), LEAST_RESIDUAL))
    late -= np.median(late[stated])
    off = np.abs(rows @ late - target)
    for film in stated:
        own = [n for n, pair in enumerate(pairs) if film in (pair.first, pair.second)]
        deviation = np.hypot(np.median([pairs[n].deviation for n in own]), np.median(off[own]))
        seconds[film], spread[film] = round(float(late[film]), 4), round(HALF_WIDTH * float(deviation), 4)
    return ClockOffsets(by="sound", names=tuple(names), seconds=tuple(seconds), spread=tuple(spread))
