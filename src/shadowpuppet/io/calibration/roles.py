"""Which cameras of a motion capture system make films: those with a film in the recording around the calibration, or made for films."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from shadowpuppet.io.calibration._xml import Entry
from shadowpuppet.names import composed
from shadowpuppet.video import FILM_SUFFIXES

FOR_FILMS = re.compile("video|hybrid", re.IGNORECASE)
"""Kinds of cameras that make films; others do, too, if their program is set so."""


def of_films(path: Path, cameras: Sequence[Entry], kind: str) -> list[Entry]:
    """The cameras of a calibration file that have a film beside it or in the recording around it, and those made for films by their
    attribute `kind`; all if there is neither."""
    there = _filmed(path)
    return [entry for entry in cameras
            if composed(entry.camera) in there or FOR_FILMS.search(entry.element.get(kind, ""))] or list(cameras)


def _filmed(path: Path) -> set[str]:
    """Names of the films, and of folders of pictures, in the recording in which a calibration lies."""
    folder = path.parent.parent if path.parent.name.lower() == "calibration" else path.parent
    names = set[str]()
    for place in (folder, folder / "video", folder / "videos"):
        inside = list(place.iterdir()) if place.is_dir() else []
        names |= {each.stem for each in inside if each.suffix.lower() in FILM_SUFFIXES}
        names |= {each.name for each in inside if place != folder and each.is_dir()}
    return set(map(composed, names))
