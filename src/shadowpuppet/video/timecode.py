"""Reads the timecode of films (SMPTE ST 12-1) through PyAV: the time of day, counted in frames, that cameras write whose clocks are set."""

from __future__ import annotations

import re
from pathlib import Path

from shadowpuppet.video.container import opened

TIMECODE = re.compile(r"(\d{2}):(\d{2}):(\d{2})([:;.])(\d{1,3})")


def read_timecode(path: Path) -> float | None:
    """Timecode of a film's first picture, seconds; None if it has none, or one that cannot be.

    Raises `VideoError` if the film cannot be opened.
    """
    with opened(path) as (container, pictures):
        rate = pictures.average_rate
        notes = {key.lower(): text for each in (*container.streams, container) for key, text in each.metadata.items()}
    stated = notes.get("timecode")
    return None if stated is None or not rate else seconds_of(stated, float(rate))


def seconds_of(timecode: str, rate: float) -> float | None:
    """Seconds of a timecode such as 10:02:45:12 at `rate` frames/s; None if there is no such timecode. It counts frames as if the rate were
    whole; a mark other than the last colon means that the first frames of each minute but the tenth are not counted (drop frame)."""
    match = TIMECODE.fullmatch(timecode.strip())
    if match is None:
        return None
    hours, minutes, seconds, frames = (int(match[n]) for n in (1, 2, 3, 5))
    whole = round(rate)
    if hours > 23 or minutes > 59 or seconds > 59 or frames >= whole:
        return None
    count = ((hours * 60 + minutes) * 60 + seconds) * whole + frames
    if match[4] != ":":
        minutes += 60 * hours
        count -= round(whole / 15) * (minutes - minutes // 10)
    return count / rate
