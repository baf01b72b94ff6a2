"""Cameras as stated in a calibration file, before unit, up direction and sizes are resolved."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import COMMA
from shadowpuppet.io.files.text import TOML_LIMIT, read_limited


@dataclass(frozen=True, eq=False)
class Draft:
    """A camera in a calibration file: lengths in the file's unit, all else as in `Camera`."""

    name: str
    matrix: object
    """Intrinsics, (3, 3), pixels; None where `fov` is stated."""
    distortion: object
    """Distortion coefficients in OpenCV's order."""
    T: Array | None
    """World to camera, (4, 4), translation in the file's unit; None if the file has the lens only."""
    size: Sequence[float] | None = None
    """Width and height, pixels; None if not stated."""
    fisheye: bool = False
    oriented: bool = True
    where: str = ""
    """Prefix of messages about it, for example `[cam1]: `."""
    turns: int = 0
    """Quarter turns clockwise by which its pictures stand upright."""
    fov: float | None = None
    """Horizontal field of view, radians, of a lens that is known by that alone."""


class Drafts(NamedTuple):
    """The content of a calibration file."""

    drafts: tuple[Draft, ...]
    unit: str | None = None
    """Unit of lengths, m, cm or mm, if the format or file states it."""
    notes: tuple[str, ...] = ()
    """Remarks for the user, a sentence each."""
    unused: tuple[str, ...] = ()
    """Keys of the file that are not used and that the user should know of (`keys.unknown_keys`)."""


def text_of(path: Path) -> str:
    """The text of a calibration file. Raises `CalibrationError` if it cannot be read, is too long or no text."""
    text = read_limited(path, TOML_LIMIT, CalibrationError, "a calibration file", "a calibration")
    if "\0" in text:
        raise CalibrationError(f"{path}: found a zero byte at position {text.index(chr(0))}, expected a text file")
    return text


def numbers_of(text: str | None, counts: Sequence[int]) -> Array | None:
    """Finite numbers (n,) from text separated by blanks or commas, or with decimal commas; None for other text, if n is not in `counts`, or
    if commas between digits may be either."""
    words = (text or "").split()
    parts = (text or "").replace(",", " ").split()
    cells = [word.rstrip(",") for word in words]
    if any(map(COMMA.fullmatch, cells)) and all(cell.count(",") < 2 for cell in cells):
        listed = (len(words) == 1 or cells != words) and len(parts) in counts
        if listed and len(words) in counts:
            return None
        parts = parts if listed else [cell.replace(",", ".") for cell in cells]
    try:
        values = np.array(parts, float)
    except ValueError:
        return None
    return values if len(values) in counts and bool(np.isfinite(values).all()) else None
