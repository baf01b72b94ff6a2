"""The one rate of films that are in step by number, whatever rates they state."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from shadowpuppet.errors import warn
from shadowpuppet.video import open_frames
from shadowpuppet.video.film import is_steady
from shadowpuppet.video.images import in_folder

LIKE, APART = 0.1, 0.5
"""Greatest relative difference of the rates of films in step by number, and least number of frames by which these rates part them."""


def shared_rate(recording: Path, sources: Sequence[object]) -> float | None:
    """The rate (frames/s) of all films of a recording, if they are paired by number and not by their own times; None otherwise.

    Programs that record several cameras in step write what each camera measured as its rate: films of equal numbers of frames and slightly
    different, steady rates are in step by number, with a warning. Folders of pictures without times have the rate of steady films beside
    them. Raises `VideoError`.
    """
    paths = [each for each in sources if isinstance(each, Path)]
    untimed = {path for path in paths if path.is_dir() and in_folder(path)[2]}
    films = [path for path in paths if path.is_file()]
    if len(sources) < 2 or not films or len(films) + len(untimed) < len(sources):
        return None
    opened = [open_frames(path) for path in films]
    rates, number = sorted(film.rate for film in opened), opened[0].count
    rate, differ = rates[(len(rates) - 1) // 2], 1 - rates[0] / rates[-1]
    if not number or any(film.count != number for film in opened) or not 0 <= differ <= LIKE:
        return None
    part = number * differ >= APART
    if not (part or untimed) or not all(map(is_steady, films)):
        return None
    if part:
        warn(f"{recording}: the films have {number} frames each at {rates[0]:.4g} to {rates[-1]:.4g} frames/s: they are taken to be in "
             f"step by number, at {rate:.4g} frames/s; if they are not, say in [start] of recording.toml when each began")
    for folder in sorted(untimed):
        if (found := len(in_folder(folder)[0])) != number:
            warn(f"{folder}: found {found} pictures without timestamps.txt beside films of {number} frames: they are taken at the films' "
                 f"{rate:.4g} frames/s")
    return rate
