"""Time offsets between films by their clocks: what each film states itself, by timecode or by its sound."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

DAY = 86400.0
"""Seconds after which timecodes begin again."""


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
    """Half-width of the 90 % interval, seconds: of sound its way to the cameras, and how the pairs differ; of timecode half a frame."""


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
    turned = [None if code is None else (code - first + DAY / 2) % DAY - DAY / 2 for code in timecodes]  # films over midnight
    late = [None if code is None else -code - start for code, start in zip(turned, starts)]
    middle = float(np.median([each for each in late if each is not None]))
    return ClockOffsets(by="timecode", names=tuple(names), seconds=tuple(None if each is None else each - middle for each in late),
                        spread=tuple(None if each is None else 0.5 / rate for each in late))
