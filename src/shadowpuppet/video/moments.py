"""Moments of a film as users write them: `3.5` seconds, or `120f`, frame 120."""

from __future__ import annotations

import re
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import SettingsError

MOMENT = re.compile(r"(\d+(?:\.\d+)?|\.\d+)(s|f)?")
LONGEST = 1e6
"""Greatest number in a moment."""


class Moment(NamedTuple):
    """A point in time of a film or of a motion."""

    number: float
    in_frames: bool
    """Whether `number` counts frames, from 0; else seconds."""

    def seconds(self, rate: float) -> float:
        """Seconds after time 0, for frames at `rate` frames/s. Raises `ValueError` for frames if the rate is not known."""
        if not self.in_frames:
            return self.number
        if not np.isfinite(rate):
            raise ValueError("the film does not state its frames/s, so that frames cannot be counted; give seconds")
        return self.number / rate


def read_moment(text: object) -> Moment:
    """A moment from a number of seconds, or from text: `3.5` or `3.5s` are seconds, `120f` is frame 120. Raises `ValueError`."""
    found = MOMENT.fullmatch(str(text).strip()) if not isinstance(text, bool) else None
    if found is None or float(found[1]) > LONGEST or (found[2] == "f" and "." in found[1]):
        raise ValueError(f"expected seconds such as 3.5, or frames such as 120f, up to {LONGEST:g}")
    return Moment(float(found[1]), found[2] == "f")


def span_of(start: str | None, end: str | None, rate: float, length: float) -> tuple[float, float]:
    """Begin and end in seconds of a span of a film of `length` seconds and `rate` frames/s; 0 and infinity for None.

    A length that is not finite is unknown. Raises `SettingsError` if the span holds no moment of the film.
    """
    begin = 0.0 if start is None else _seconds("start", start, rate)
    stop = np.inf if end is None else _seconds("end", end, rate)
    if not begin < stop:
        raise SettingsError(f"end: found {end}, {stop:g} s, expected a moment after the start, {begin:g} s")
    if begin >= length:
        raise SettingsError(f"start: found {start}, {begin:g} s, expected a moment before the film's end, {length:.3f} s")
    return begin, stop


def _seconds(name: str, text: str, rate: float) -> float:
    try:
        return read_moment(text).seconds(rate)
    except ValueError as error:
        raise SettingsError(f"{name}: found {text}; {error}") from None


def moment_text(value: object) -> str:
    """A moment as text, checked by `read_moment`. Raises `ValueError`."""
    moment = read_moment(value)
    return f"{moment.number:.0f}f" if moment.in_frames else f"{moment.number:.9g}"
