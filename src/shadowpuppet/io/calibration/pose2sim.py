"""Reads calibrations in TOML: the schema of Pose2Sim, Anipose (aniposelib), FreeMoCap and Caliscope's export, and Caliscope's own.

Each camera has a section: `name`, `size` (width, height), `matrix` (3 x 3), `distortions`, `rotation` (Rodrigues vector, world to
camera, or a 3 x 3 matrix), `translation`, `fisheye`. Caliscope's own file (camera_array.toml) has its sections below `cameras`, by number.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, choices
from shadowpuppet.geometry import Array, rigid, rotation_from_vector, vector_from_rotation
from shadowpuppet.io.calibration.draft import Draft, Drafts
from shadowpuppet.io.calibration.keys import LENS_KEYS, UNIT_KEYS, is_fisheye, stated_unit, unknown_keys
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import read_toml

FIELDS = ("size", "matrix", "distortions", "rotation", "translation")
"""Required in a camera's section. Defaults: `name` is the section's, `fisheye` false."""
KNOWN = (*FIELDS, "name", "fisheye", "oriented", "ignore", "port", "cam_id", "rotation_count")
"""Keys that are read."""
IGNORED = ("backend", "error", "exposure", "grid_count", "verified_resolutions", "verbosity", "world_orientation", "world_position")
"""Keys of other programs that do not change where a camera sees a point, or repeat its rotation and translation."""
ASIDE = ("board", "capture", "charuco", "date", "metadata", "version")
"""Sections of other programs that are no cameras."""
BARE_KEY = r"[A-Za-z0-9_-]+"
"""Section titles without quotes."""
SQUARES = {"mm": (5.0, 500.0), "m": (0.005, 0.5)}
"""Plausible sizes of a board's squares in each unit; FreeMoCap's first versions store the number that their user entered,
without a unit."""


def read_tables(path: Path) -> Drafts:
    """Cameras of a TOML file. Raises `CalibrationError` with the section and field if something is missing or impossible."""
    data = read_toml(path, CalibrationError)
    unit = stated_unit(f"{path}: ", [data, *([data["metadata"]] if isinstance(data.get("metadata"), dict) else [])])
    nested = data.get("cameras")
    if isinstance(nested, dict) and nested and all(isinstance(table, dict) for table in nested.values()):
        found = _caliscope(path, nested)
        return found._replace(unit=unit, unused=(*unknown_keys(f"{path}: ", data, ("cameras", *ASIDE, UNIT_KEYS)), *found.unused))
    sections = {title: table for title, table in data.items() if isinstance(table, dict) and any(key in table for key in FIELDS)}
    if not sections:
        raise CalibrationError(f"{path}: no camera in it, expected a section for each, such as [cam1], with {', '.join(FIELDS)}")
    board_unit, notes = _freemocap(data)
    unused = [*unknown_keys(f"{path}: ", data, (*sections, *ASIDE, UNIT_KEYS, re.compile(r"board\..*"))), *_unused(path, sections)]
    drafts = tuple(_draft(path, title, table, table.get("name", title)) for title, table in sections.items())
    return Drafts(drafts, unit or board_unit, notes, tuple(unused))


def _unused(path: Path, sections: dict[str, dict[str, Any]]) -> list[str]:
    """Keys of the cameras' sections that are not known."""
    return [key for title, table in sections.items() for key in unknown_keys(f"{path}: [{title}]: ", table, (*KNOWN, *IGNORED, LENS_KEYS))]


def _caliscope(path: Path, cameras: dict[str, dict[str, Any]]) -> Drafts:
    """Cameras with extrinsics that are not ignored, named as Caliscope's films and export: cam_0, cam_1, ..."""
    def name(number: str, table: dict[str, Any]) -> str:
        return table.get("name") or (f"port_{number}" if "port" in table and "cam_id" not in table else f"cam_{number}")

    aside = [number for number, table in cameras.items() if table.get("ignore") is True]
    bare = [number for number, table in cameras.items() if number not in aside and not {"rotation", "translation"} <= set(table)]
    used = {number: table for number, table in cameras.items() if number not in aside + bare}
    if not used:
        raise CalibrationError(f"{path}: found {len(cameras)} cameras, none with a rotation and translation: Caliscope has calibrated "
                               "lenses only; finish its extrinsic calibration")
    notes = [f"{why}, left out: {choices(map(str, numbers))}" for why, numbers in (("set aside in Caliscope", aside), ("not placed", bare))
             if numbers]
    drafts = [_draft(path, f"cameras.{number}", table, name(number, table)) for number, table in used.items()]
    if turned := [draft.name for draft in drafts if draft.turns]:
        notes.append(f"shown turned in Caliscope (rotation_count), so that the films are not upright: {choices(turned)}; up = \"cameras\" "
                     "reckons with it")
    unused = _unused(path, {f"cameras.{number}": table for number, table in used.items()})
    return Drafts(tuple(drafts), None, tuple(notes), tuple(unused))


def _freemocap(data: dict[str, Any]) -> tuple[str | None, tuple[str, ...]]:
    """The unit, None if unknown, and remarks, from the size of the squares on FreeMoCap's board: `board.square_length_mm`, whose unit is
    that of the cameras, or `metadata.charuco_square_size` of its first versions, a number without a unit."""
    metadata = data.get("metadata")
    within = [table for table in (metadata, data) if isinstance(table, dict)]
    lengths = [table["board"].get("square_length_mm") for table in within if isinstance(table.get("board"), dict)]
    lengths += [table.get("board.square_length_mm") for table in within]
    length = next((length for length in lengths if _is_number(length)), None)
    if length is not None:
        return "mm", (f"FreeMoCap's, with squares of {length:g} mm",)
    square = metadata.get("charuco_square_size") if isinstance(metadata, dict) else None
    if not _is_number(square):
        return None, ()
    for unit, (least, most) in SQUARES.items():
        if least <= square <= most:
            return unit, (f"FreeMoCap's, with squares of {square:g} {unit}",)
    return None, (f"FreeMoCap's, with squares of {square:g}: in which unit, it does not say",)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e300  # greater integers are no floats


def _draft(path: Path, title: str, table: dict[str, Any], name: object) -> Draft:
    try:
        check_name(name)
        missing = [key for key in FIELDS if key not in table]
        for key in ("fisheye", "oriented"):
            if not isinstance(table.get(key, True), bool):
                raise CalibrationError(f"{key}: found {table[key]!r}, expected true or false")
        if missing:
            unknown = [key for key in table if key not in KNOWN]
            found = f"; found {shorten(unknown)}, which {'is' if len(unknown) == 1 else 'are'} not known" if unknown else ""
            raise CalibrationError(f"{', '.join(missing)}: missing, expected {', '.join(FIELDS)}{found}")
        size, matrix = numbers_in(table, "size", [(2,)]), numbers_in(table, "matrix", [(3, 3)])
        T = rigid(_rotation(table), _flat(table, "translation", [(3,)]))
        return Draft(str(name), matrix, _flat(table, "distortions"), T, size.tolist(), is_fisheye("", table),
                     table.get("oriented", True), f"[{title}]: ", _turns(table))
    except CalibrationError as error:
        raise CalibrationError(f"{path}: [{title}]: {error}") from None


def _turns(table: dict[str, Any]) -> int:
    """Caliscope's `rotation_count`: quarter turns clockwise by which it shows the pictures."""
    turns = table.get("rotation_count", 0)
    if isinstance(turns, bool) or not isinstance(turns, int) or abs(turns) > 3:
        raise CalibrationError(f"rotation_count: found {_short(turns)}, expected a whole number of quarter turns, from -3 to 3")
    return turns


def check_name(name: object) -> None:
    """Raise `CalibrationError` if `name` cannot be a camera's name, which is also the name of its film."""
    if not isinstance(name, str) or not name.strip(" .") or not name.isprintable() or "/" in name or "\\" in name:
        raise CalibrationError(f"name: found {_short(repr(name))}, expected a word that can be a file's name")


def _rotation(table: dict[str, Any]) -> Array:
    rotation = _flat(table, "rotation", [(3,), (3, 3)])
    if rotation.shape == (3, 3):
        return rotation
    angle = float(np.linalg.norm(rotation))
    if angle > 2 * math.pi + 1e-6:
        raise CalibrationError(f"rotation: found a vector of length {angle:g}, expected radians, at most a full turn: "
                               "are these degrees?")
    return rotation_from_vector(rotation)


def _flat(table: dict[str, Any], key: str, shapes: list[tuple[int, ...]] | None = None) -> Array:
    """As `numbers_in`, but also accepts a nested row or column, as OpenCV returns them."""
    value = table[key]
    if isinstance(value, list) and len(value) == 1 and isinstance(value[0], list):
        value = value[0]
    elif isinstance(value, list) and value and all(isinstance(row, list) and len(row) == 1 for row in value):
        value = [row[0] for row in value]
    return numbers_in({key: value}, key, shapes)


def numbers_in(table: dict[str, Any], key: str, shapes: list[tuple[int, ...]] | None = None) -> Array:
    """A field's finite numbers, of one of `shapes`, or a vector of any length. Raises `CalibrationError`."""
    value = table[key]
    expected = " or ".join(" x ".join(map(str, s)) for s in shapes) + " finite numbers" if shapes else "a row of finite numbers"
    expected = "a finite number" if shapes == [()] else expected
    try:
        array = np.array(value, float) if _is_numeric(value) else None
    except (ValueError, OverflowError):  # rows of unequal length, a whole number of 400 digits
        array = None
    fits = array is not None and (array.shape in shapes if shapes else array.ndim == 1) and bool(np.isfinite(array).all())
    if array is None or not fits:
        raise CalibrationError(f"{key}: found {_short(value)}, expected {expected}")
    return array


def _is_numeric(value: object) -> bool:
    if isinstance(value, list):
        return all(map(_is_numeric, value))
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _short(value: object) -> str:
    text = str(value)
    return text if len(text) <= 120 else text[:117] + "..."


def tables_text(cameras: Iterable[Camera]) -> str:
    """The content of a TOML file for `read_tables`, Pose2Sim and Anipose; metres."""
    return "\n".join(map(_section, cameras))


def _section(camera: Camera) -> str:
    """A camera's section, one value per line; JSON's printable strings and finite numbers are valid TOML."""
    distortions = camera.distortion.tolist()
    if not camera.fisheye:  # without trailing zeros
        distortions = distortions[: 8 if any(distortions[5:]) else 5 if distortions[4] else 4]
    values = {"name": camera.name, "size": list(camera.size), "matrix": camera.matrix.tolist(), "distortions": distortions,
              "rotation": vector_from_rotation(camera.T_camera_world[:3, :3]).tolist(),
              "translation": camera.T_camera_world[:3, 3].tolist(), "fisheye": camera.fisheye}
    values |= {} if camera.oriented else {"oriented": False}
    title = camera.name if re.fullmatch(BARE_KEY, camera.name) else json.dumps(camera.name, ensure_ascii=False)
    return f"[{title}]\n" + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items())
