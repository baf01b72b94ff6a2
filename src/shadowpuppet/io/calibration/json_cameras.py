"""Reads calibrations in JSON of any layout: every object with an intrinsic matrix, or fx, fy, cx, cy, is a camera.

So written by CMU Panoptic (centimetres, -y up), by scripts around OpenCV and Blender, and by multi-camera rigs. Rotations are matrices
(3 x 3) or vectors, translations or 3 x 4 and 4 x 4 matrices take the world to the camera; `camera_to_world` and `c2w` the other way.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import CalibrationError, shown
from shadowpuppet.geometry import Array, inverse, rigid, rotation_from_vector
from shadowpuppet.io.calibration.draft import Draft, Drafts, text_of
from shadowpuppet.io.calibration.keys import LENS_KEYS, UNIT_KEYS, is_fisheye, stated_unit, unknown_keys
from shadowpuppet.io.calibration.programs.multical import is_multical, with_poses
from shadowpuppet.io.calibration.programs.transforms import is_transforms, read_transforms

NAMES = {
    "matrix": "k|camera_?matrix|intrinsic_?matrix|intrinsics?|matrix|mtx|k_?matrix",
    "distortion": "d|dist|dist_?coefs?|dist_?coeffs?|distortion|distortions|distortion_?coefficients|distortion_?coeffs",
    "rotation": "r|rot|rotation|rotation_?matrix|rvec|rotation_?vector|rmat|r_?matrix",
    "translation": "t|trans|translation|tvec|translation_?vector|t_?vec",
    "placed": "rt|extrinsics?|extrinsic_?matrix|world_?to_?cam(era)?|w2c|t_camera_world|pose_?matrix",
    "inverse": "cam(era)?_?to_?world|c2w|t_world_camera",
    "size": "resolution|image_?size|img_?size|size|imsize", "width": "w|width|image_?width", "height": "h|height|image_?height",
    "name": "name|id|camera|camera_?name|cam_?id|serial|label",
    "fx": "fx|fl_x", "fy": "fy|fl_y", "cx": "cx", "cy": "cy",
}
"""Programs' names for a camera's parameters."""
PATTERNS = {kind: re.compile(names, re.IGNORECASE) for kind, names in NAMES.items()}
PARTS = re.compile("intrinsics?|extrinsics?|calibration|lens|pose|params?|parameters", re.IGNORECASE)
"""Tables within a camera's."""
IGNORED = re.compile("calibDataSource|cameras?|rig|version|date|time|timestamp|created|comment|description|notes?|type|panel|node|rms|"
                     "error|(mean_?|avg_?)?(reprojection_?)?error|(re)?projection_?errors?|rmse|model|lens|camera_?type", re.IGNORECASE)
"""Keys that do not say where a camera sees a point; a lens' model is found by `is_fisheye`."""
KNOWN = (*PATTERNS.values(), PARTS, IGNORED, LENS_KEYS, UNIT_KEYS)
DEPTH = 12
"""Greatest depth at which cameras are looked for."""
MOST_CAMERAS = 1000
PANOPTIC = "calibDataSource"
"""A key of CMU Panoptic's files."""


def read_json(path: Path) -> Drafts:
    """Cameras of a JSON file. Raises `CalibrationError`."""
    try:
        values = json.loads(text_of(path))
    except RecursionError:
        raise CalibrationError(f"{path}: found JSON nested too deeply for a calibration") from None
    except ValueError as error:
        raise CalibrationError(f"{path}: found no JSON ({error}), expected a calibration") from None
    try:
        if is_transforms(values):
            return read_transforms(values)
        multical = is_multical(values)
        values = with_poses(values) if multical else values
        around, drafts, inside = _around(values, 0), [], list[str]()
        tables = list(islice(_tables(values, path.stem, 0), MOST_CAMERAS + 1))
        unit = stated_unit("", [around, *(_flat(table) for _, table in tables)])
    except CalibrationError as error:
        raise CalibrationError(f"{path}: {error}") from None
    for name, table in tables:
        if len(drafts) == MOST_CAMERAS:
            raise CalibrationError(f"{path}: found over {MOST_CAMERAS} cameras")
        inside += unknown_keys(f"{path}: camera {shown(name)}: ", _flat(table) | _left_out(table), KNOWN)
        drafts.append(_draft(path, name, table))
    if not drafts:
        raise CalibrationError(f"{path}: found no camera in it, expected objects with K (or fx, fy, cx, cy), R or rvec, t, and distortion")
    panoptic = isinstance(values, dict) and PANOPTIC in values
    notes = ("lengths are CMU Panoptic's centimetres, and its -y is up: use --up=-y",) if panoptic else ()
    notes += ("the world frame is that of multical's first camera: say what is up with --up",) if multical else ()
    unused = (*unknown_keys(f"{path}: ", around, KNOWN), *inside)
    return Drafts(tuple(drafts), unit or ("cm" if panoptic else None), notes, unused)


def mentions_cameras(path: Path) -> bool:
    """Whether a JSON file holds a camera's intrinsics, so that it is meant as a calibration."""
    try:
        values = json.loads(text_of(path))
        return is_transforms(values) or next(_tables(values, "", 0), None) is not None
    except (CalibrationError, ValueError, RecursionError):
        return False


def _tables(value: Any, name: str, depth: int) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Objects with intrinsics, and their names by the keys above them."""
    if depth > DEPTH:
        return
    if isinstance(value, dict):
        if _is_camera(value):
            yield name, value
            return
        for key, inner in value.items():
            yield from _tables(inner, str(key), depth + 1)
    elif isinstance(value, list) and any(isinstance(inner, dict | list) for inner in value):
        for n, inner in enumerate(value):
            yield from _tables(inner, f"cam{n + 1}", depth + 1)


def _is_camera(table: Mapping[str, Any]) -> bool:
    inner = _flat(table)
    matrix = _find(inner, "matrix")
    stated = matrix is not None and not isinstance(matrix, dict | str)
    return stated or all(_find(inner, key) is not None for key in ("fx", "fy", "cx", "cy"))


def _flat(table: Mapping[str, Any]) -> dict[str, Any]:
    """The table with the entries of its tables `intrinsics` and `extrinsics`, and the like."""
    out = {key: value for key, value in table.items() if not isinstance(value, dict)}
    for key, value in table.items():
        if isinstance(value, dict) and PARTS.fullmatch(key):
            out |= {inner: held for inner, held in value.items() if inner not in out and not isinstance(held, dict)}
    return out


def _left_out(table: Mapping[str, Any]) -> dict[str, Any]:
    """The tables within a camera's that `_flat` leaves out."""
    parts = [table, *(value for key, value in table.items() if isinstance(value, dict) and PARTS.fullmatch(key))]
    return {key: value for part in parts for key, value in part.items() if isinstance(value, dict) and not PARTS.fullmatch(key)}


def _around(value: Any, depth: int) -> dict[str, Any]:
    """The entries around the cameras in which no camera is."""
    if depth > DEPTH or (isinstance(value, dict) and _is_camera(value)):
        return {}
    out: dict[str, Any] = {}
    for key, inner in value.items() if isinstance(value, dict) else (("", inner) for inner in value) if isinstance(value, list) else ():
        if next(_tables(inner, key, depth + 1), None) is not None:
            out |= _around(inner, depth + 1)
        elif key:
            out[key] = inner
    return out


def _find(table: Mapping[str, Any], kind: str) -> Any:
    return next((value for key, value in table.items() if PATTERNS[kind].fullmatch(key) and value is not None), None)


def _draft(path: Path, key: str, table: Mapping[str, Any]) -> Draft:
    flat = _flat(table)
    stated = _find(flat, "name")
    name = str(stated) if isinstance(stated, str | int) and not isinstance(stated, bool) and str(stated) else key
    where = f"{path}: camera {shown(name)}"

    def numbers(kind: str, *counts: int) -> Array | None:
        value = _find(flat, kind)
        if value is None:
            return None
        try:
            array = np.array(value, float).ravel()
        except (TypeError, ValueError, OverflowError):
            raise CalibrationError(f"{where}: {kind}: found {shown(value)}, expected numbers") from None
        if len(array) not in counts or not np.isfinite(array).all():
            raise CalibrationError(f"{where}: {kind}: found {len(array)} values, expected {' or '.join(map(str, counts))} finite numbers")
        return array

    matrix = numbers("matrix", 9, 4)
    if matrix is not None and len(matrix) == 4 and np.ndim(_find(flat, "matrix")) != 1:
        raise CalibrationError(f"{where}: matrix: found {shown(_find(flat, 'matrix'))}, expected 3 x 3 numbers, or fx, fy, cx, cy")
    if matrix is None or len(matrix) == 4:
        single = [part for k in ("fx", "fy", "cx", "cy") if (part := numbers(k, 1)) is not None]
        parts = matrix if matrix is not None else np.concatenate(single)
        matrix = np.array([parts[0], 0, parts[2], 0, parts[1], parts[3], 0, 0, 1])
    distortion = numbers("distortion", 0, 1, 2, 4, 5, 8, 12, 14)
    size, width, height = numbers("size", 2, 3), numbers("width", 1), numbers("height", 1)
    if size is None and width is not None and height is not None:
        size = np.array([width[0], height[0]])
    return Draft(name=name, matrix=matrix.reshape(3, 3), distortion=distortion if distortion is not None else np.zeros(4),
                 T=_pose(where, numbers("placed", 12, 16), numbers("inverse", 12, 16), numbers("rotation", 3, 9),
                         numbers("translation", 3)),
                 size=None if size is None else size[:2].tolist(), fisheye=is_fisheye(f"{where}: ", flat),
                 oriented=any(_find(flat, kind) is not None for kind in ("placed", "inverse", "rotation")))  # fmt: skip


def _pose(where: str, placed: Array | None, reverse: Array | None, rotation: Array | None, translation: Array | None) -> Array | None:
    """World to camera (4, 4) of whatever is stated; None if nothing is."""
    for whole, turned in ((placed, False), (reverse, True)):
        if whole is not None:
            T = np.vstack([whole.reshape(-1, 4)[:3], [0, 0, 0, 1.0]])
            if turned and abs(np.linalg.det(T[:3, :3])) < 1e-6:
                raise CalibrationError(f"{where}: rotation: found {np.round(T[:3, :3], 4).tolist()}, expected a rotation")
            return inverse(T) if turned else T
    if rotation is None and translation is None:
        return None
    if rotation is None or translation is None:
        raise CalibrationError(f"{where}: found {'a translation' if rotation is None else 'a rotation'} only, expected both or neither")
    if len(rotation) == 3 and np.linalg.norm(rotation) > 100:
        raise CalibrationError(f"{where}: rotation: found {rotation.tolist()}, expected a rotation vector in radians")
    return rigid(rotation_from_vector(rotation) if len(rotation) == 3 else rotation.reshape(3, 3), translation)
