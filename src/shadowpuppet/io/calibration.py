"""Calibration files: the TOML schema that Pose2Sim, Anipose and Caliscope share."""

from __future__ import annotations

import json
import math
import os
import re
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.camera import Camera
from shadowpuppet.errors import CalibrationError, ShadowPuppetError
from shadowpuppet.geometry import Array, rigid, rotation_from_vector, vector_from_rotation

FIELDS = ("size", "matrix", "distortions", "rotation", "translation")
"""What a camera's section must have; `name` is the section's own where it is missing, `fisheye` false."""

FILE_LIMIT = 10_000_000
"""Bytes; no calibration is longer, and a film given by mistake is not read."""
BARE_KEY = r"[A-Za-z0-9_-]+"
"""Section titles that TOML takes without quotes."""
FARTHEST = 100.0
"""Metres; a camera farther from the world's origin was measured in millimetres."""


def read_calibration(path: str | Path) -> tuple[Camera, ...]:
    """Cameras of a calibration file, in its order.

    A section a camera: `name`, `size` (width, height), `matrix` (3 x 3), `distortions`, `rotation` (Rodrigues vector, world to
    camera, or a 3 x 3 matrix), `translation` (metres), `fisheye`. Other keys and sections are other programs' and skipped.
    Raises `CalibrationError` with the file, section and field where something is missing or cannot be a camera's.
    """
    data = read_toml(path, CalibrationError)
    sections = {title: table for title, table in data.items() if isinstance(table, dict) and any(key in table for key in FIELDS)}
    if not sections:
        raise CalibrationError(f"{path}: no camera in it, expected a section for each, such as [cam1], with {', '.join(FIELDS)}")
    cameras: dict[str, Camera] = {}
    for title, table in sections.items():
        try:
            camera = _camera(title, table)
            if camera.name in cameras:
                raise CalibrationError(f"name: found {camera.name!r}, which another section has; every camera needs its own")
        except CalibrationError as error:
            raise CalibrationError(f"{path}: [{title}]: {error}") from None
        cameras[camera.name] = camera
    return tuple(cameras.values())


def write_calibration(path: str | Path, cameras: Iterable[Camera]) -> None:
    """Write cameras so that `read_calibration` gives them back. Raises `CalibrationError` where the file cannot be written."""
    path, sections = Path(path), {}
    for camera in cameras:
        _check_name(camera.name)
        if camera.name in sections:
            raise CalibrationError(f"{path}: two cameras are called {camera.name!r}; every camera needs its own name")
        sections[camera.name] = _section(camera)
    text = "\n".join(sections.values())
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_text(text, "utf-8")
        os.replace(part, path)
    except OSError as error:
        raise CalibrationError(f"{path}: cannot be written ({error.strerror})") from None


def read_toml(path: str | Path, error: type[ShadowPuppetError]) -> dict[str, Any]:
    """A TOML file's tables; a file that is missing, too large or no TOML raises `error` in a sentence."""
    path = Path(path)
    try:
        if path.stat().st_size > FILE_LIMIT:
            raise error(f"{path}: found {path.stat().st_size} bytes, expected a TOML file of at most {FILE_LIMIT}")
        return tomllib.loads(path.read_text("utf-8-sig"))
    except OSError as problem:
        raise error(f"{path}: cannot be read ({(problem.strerror or 'unknown reason').lower()})") from None
    except UnicodeDecodeError as problem:
        raise error(f"{path}: found bytes that are no text at position {problem.start}, expected a TOML file") from None
    except (ValueError, RecursionError) as problem:
        raise error(f"{path}: not valid TOML: {problem}") from None


def _camera(title: str, table: dict[str, Any]) -> Camera:
    name, fisheye, oriented = table.get("name", title), table.get("fisheye", False), table.get("oriented", True)
    _check_name(name)
    for key, value in (("fisheye", fisheye), ("oriented", oriented)):
        if not isinstance(value, bool):
            raise CalibrationError(f"{key}: found {value!r}, expected true or false")
    missing = [key for key in FIELDS if key not in table]
    if missing:
        raise CalibrationError(f"{', '.join(missing)}: missing, expected {', '.join(FIELDS)}")
    size, matrix = _numbers(table, "size", [(2,)]), _numbers(table, "matrix", [(3, 3)])
    distortions = _numbers(table, "distortions")
    return Camera(name, (size[0], size[1]), matrix, distortions, rigid(_rotation(table), _translation(table)), fisheye, oriented)


def _check_name(name: object) -> None:
    # A camera's name is that of its film, too.
    if not isinstance(name, str) or not name.strip(" .") or not name.isprintable() or "/" in name or "\\" in name:
        raise CalibrationError(f"name: found {name!r}, expected a word that can be a file's name")


def _rotation(table: dict[str, Any]) -> Array:
    rotation = _numbers(table, "rotation", [(3,), (3, 3)])
    if rotation.shape == (3, 3):
        return rotation
    angle = float(np.linalg.norm(rotation))
    if angle > 2 * math.pi + 1e-6:
        raise CalibrationError(f"rotation: found a vector of length {angle:g}, expected radians, at most a full turn: "
                               "are these degrees?")
    return rotation_from_vector(rotation)


def _translation(table: dict[str, Any]) -> Array:
    translation = _numbers(table, "translation", [(3,)])
    distance = float(np.linalg.norm(translation))
    if distance > FARTHEST:
        raise CalibrationError(f"translation: found {translation.tolist()}, {distance:g} long, expected at most {FARTHEST:g} "
                               "metres; it is probably in millimetres: divide it by 1000")
    return translation


def _numbers(table: dict[str, Any], key: str, shapes: list[tuple[int, ...]] | None = None) -> Array:
    """The finite numbers of a field, of one of the `shapes`, or any number of them in a row."""
    value = table[key]
    expected = " or ".join(" x ".join(map(str, s)) for s in shapes) + " finite numbers" if shapes else "a row of finite numbers"
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


def _section(camera: Camera) -> str:
    """A camera's section; a value a line, where JSON's spelling of printable words and finite numbers is TOML's, too."""
    distortions = camera.distortion.tolist()
    if not camera.fisheye:  # only as many as there are
        distortions = distortions[: 8 if any(distortions[5:]) else 5 if distortions[4] else 4]
    values = {"name": camera.name, "size": list(camera.size), "matrix": camera.matrix.tolist(), "distortions": distortions,
              "rotation": vector_from_rotation(camera.T_camera_world[:3, :3]).tolist(),
              "translation": camera.T_camera_world[:3, 3].tolist(), "fisheye": camera.fisheye}
    values |= {} if camera.oriented else {"oriented": False}
    title = camera.name if re.fullmatch(BARE_KEY, camera.name) else json.dumps(camera.name, ensure_ascii=False)
    return f"[{title}]\n" + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in values.items())
