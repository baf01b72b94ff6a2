"""Rough places of cameras, as one writes them down: where each stands, what it looks at, and its field of view."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import CalibrationError, did_you_mean
from shadowpuppet.geometry import Array, rigid, unit
from shadowpuppet.io.calibration.draft import Draft, Drafts
from shadowpuppet.io.calibration.pose2sim import check_name, numbers_in
from shadowpuppet.io.files.text import read_toml

ROUGH_NAME = "rough.toml"
"""Name of a recording's file of this kind, which counts before its calibration."""
FIELDS = ("at", "toward", "fov")
SECTION = re.compile(r"^\s*toward\s*=", re.MULTILINE)
STEEPEST = 0.999
"""Greatest sine of a camera's tilt: the horizontal of one that looks straight up or down is not known."""


def is_rough(text: str) -> bool:
    """Whether a file's text is of this kind."""
    return SECTION.search(text) is not None


def read_rough(path: Path) -> Drafts:
    """Cameras from sections with `at` and `toward` (places in metres, z up), `fov` (degrees, across the picture) and, where no film states
    it, `size` (pixels). They are level: their rows are horizontal. Raises `CalibrationError` with section and field."""
    data = read_toml(path, CalibrationError)
    sections = {title: table for title, table in data.items() if isinstance(table, dict)}
    notes = ("rough places: in a recording, `shadowpuppet calibrate RECORDING --from-person` makes a calibration of them",)
    return Drafts(tuple(_draft(path, title, table) for title, table in sections.items()), "m", notes)


def _draft(path: Path, title: str, table: dict[str, Any]) -> Draft:
    try:
        check_name(title)
        known = (*FIELDS, "size")
        if unknown := next((key for key in table if key not in known), None):
            raise CalibrationError(f"{unknown}: no such value; possible are {', '.join(known)}{did_you_mean(unknown, known)}")
        if missing := [key for key in FIELDS if key not in table]:
            raise CalibrationError(f"{', '.join(missing)}: missing, expected {', '.join(FIELDS)}")
        at, toward = (numbers_in(table, key, [(3,)]) for key in ("at", "toward"))
        size = numbers_in(table, "size", [(2,)]).tolist() if "size" in table else None
        fov = float(numbers_in(table, "fov", [()]))
        if not 0 < fov < 180:
            raise CalibrationError(f"fov: found {fov:g} degrees, expected between 0 and 180")
        return Draft(title, None, np.zeros(4), _looking(at, toward), size, fov=np.radians(fov), where=f"[{title}]: ")
    except CalibrationError as error:
        raise CalibrationError(f"{path}: [{title}]: {error}") from None


def _looking(at: Array, toward: Array) -> Array:
    """World to camera (4, 4) of a level camera at a place that looks toward another."""
    if np.linalg.norm(toward - at) < 1e-6:
        raise CalibrationError(f"toward: found {toward.tolist()}, the place of the camera itself, expected what it looks at")
    ahead = unit(toward - at)
    if abs(ahead[2]) > STEEPEST:
        raise CalibrationError(f"toward: found {toward.tolist()}, straight {'above' if ahead[2] > 0 else 'below'} the camera, expected a "
                               "place aside: else it is not known which way the picture is turned")
    right = unit(np.cross(ahead, [0.0, 0.0, 1.0]))
    R = np.array([right, np.cross(ahead, right), ahead])
    return rigid(R, -R @ at)
