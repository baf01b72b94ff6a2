"""What a calibration file tells of its cameras, before units, the way up and sizes are settled."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import TOML_LIMIT, read_limited


@dataclass(frozen=True, eq=False)
class Draft:
    """One camera of a file; lengths in the file's unit, everything else as `Camera` has it."""

    name: str
    matrix: object
    """Intrinsics, (3, 3), pixels."""
    distortion: object
    """As OpenCV has it."""
    T: Array | None
    """World to camera, (4, 4), its translation in the file's unit; None where the file tells of the lens alone."""
    size: Sequence[float] | None = None
    """Width and height, pixels; None where the file does not tell."""
    fisheye: bool = False
    oriented: bool = True
    where: str = ""
    """What messages about it begin with, such as `[cam1]: `."""


class Found(NamedTuple):
    """What a calibration file holds."""

    drafts: tuple[Draft, ...]
    unit: str | None = None
    """What its lengths are in, where the format or the file itself says so: m, cm or mm."""
    notes: tuple[str, ...] = ()
    """What a user should know of how it was read, a sentence each."""


def text_of(path: Path) -> str:
    """A calibration file's text. Raises `CalibrationError` where it cannot be read, is too long or no text."""
    text = read_limited(path, TOML_LIMIT, CalibrationError, "a calibration file", "a calibration")
    if "\0" in text:
        raise CalibrationError(f"{path}: found a zero byte at position {text.index(chr(0))}, expected a text file")
    return text


def numbers_of(text: str | None, counts: Sequence[int]) -> Array | None:
    """Finite numbers with blanks or commas between; None where these are none, or not so many."""
    try:
        values = np.array((text or "").replace(",", " ").split(), float)
    except ValueError:
        return None
    return values if len(values) in counts and bool(np.isfinite(values).all()) else None
