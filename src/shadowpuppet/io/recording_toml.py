"""Reads recording.toml: what is known of a recording beside its films."""

from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from shadowpuppet.body.sizes import expected_metres, is_within
from shadowpuppet.errors import RecordingError, choices
from shadowpuppet.io.files.text import read_toml
from shadowpuppet.names import composed
from shadowpuppet.video import camera_number

KEYS = ("subject", "rate", "duration", "calibration", "unit", "up", "truth", "training", "start", "video", "background", "masks",
        "keypoints")
"""Keys of recording.toml."""


class RecordingNotes:
    """The content of recording.toml; empty if there is none. Everything raises `RecordingError`, naming the key."""

    def __init__(self, folder: Path) -> None:
        """Read a recording folder's file, if there is one."""
        self.folder, self.path = folder, folder / "recording.toml"
        self.data = read_toml(self.path, RecordingError) if self.path.exists() else {}
        self._check_keys(self.data, KEYS, "")
        self._check_keys(self.table("subject"), ("height", "distance"), "subject.")

    def _check_keys(self, table: dict[str, Any], known: Iterable[str], prefix: str) -> None:
        unknown = set(table) - set(known)
        if unknown:
            raise RecordingError(f"{self.path}: found the key {prefix}{min(unknown)}; keys known there: {choices(known)}")

    def table(self, key: str) -> dict[str, Any]:
        """A table, empty if it is missing."""
        value = self.data.get(key, {})
        if not isinstance(value, dict):
            raise RecordingError(f"{self.path}: {key}: found {value!r}, expected a table [{key}]")
        return value

    def number(self, key: str, limits: tuple[float, float], unit: str, table: str = "") -> float | None:
        """A number within limits, of a table or of the file itself; None if it is missing."""
        value = (self.table(table) if table else self.data).get(key)
        if value is None:
            return None
        if not is_within(value, limits):
            expected = expected_metres(value, limits) if unit == "metres" else f"expected {limits[0]:g} to {limits[1]:g} {unit}"
            raise RecordingError(f"{self.path}: {'start.' if table == 'start' else ''}{key}: found {value!r}, {expected}")
        return float(value)

    def choice(self, key: str, known: Iterable[str]) -> str | None:
        """One of some words; None if it is missing."""
        value = self.data.get(key)
        if value is not None and value not in list(known):
            raise RecordingError(f"{self.path}: {key}: found {value!r}, expected one of {', '.join(known)}")
        return value

    def file(self, key: str) -> Path | None:
        """An existing file; None if none is named."""
        return self._existing(key, self.data[key]) if key in self.data else None

    def source(self, kind: str, camera: str) -> Path | int | str:
        """A camera's film, background, masks or keypoints; a live camera may be named as a film."""
        value = self.table(kind)[camera]
        live = not isinstance(value, bool) and isinstance(value, (int, str)) and camera_number(value) is not None
        return value if live and kind == "video" else self._existing(f"{kind}.{camera}", value)

    def _existing(self, key: str, value: object) -> Path:
        path = _spelled_as_there(self.folder / value) if isinstance(value, str) else None
        if path is None or not os.path.exists(path):  # unlike that of `Path`, false for an impossible name
            raise RecordingError(f"{self.path}: {key}: found {value!r}, expected the path of an existing file, from this folder")
        return path


def _spelled_as_there(path: Path) -> Path:
    """The path of an existing file whose name, or a folder's above it, may be composed in another way; the same path if there is none."""
    if os.path.exists(path) or path.parent == path:
        return path
    folder = _spelled_as_there(path.parent)
    inside = folder.iterdir() if os.path.isdir(folder) else ()
    return next((each for each in inside if composed(each.name) == composed(path.name)), path)
