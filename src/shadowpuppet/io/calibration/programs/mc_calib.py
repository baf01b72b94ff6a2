"""Reads MC-Calib's calibrated_cameras_data.yml: a table `camera_<number>` each, with the pose from the camera to the reference camera."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import numpy as np

from shadowpuppet.errors import CalibrationError, choices, shown
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.io.calibration.draft import Draft, Drafts
from shadowpuppet.io.calibration.keys import unknown_keys

CAMERA = re.compile(r"camera_\d+")
FIELDS = ("camera_matrix", "distortion_vector", "distortion_type", "camera_group", "img_width", "img_height", "camera_pose_matrix")
"""Keys of a camera, all required."""
LENSES = {0: False, 1: True}
"""Whether a `distortion_type` is OpenCV's fisheye: Brown's, Kannala's."""


def is_mc_calib(values: dict[str, Any]) -> bool:
    """Whether a file's entries are MC-Calib's."""
    return any(CAMERA.fullmatch(key) and isinstance(value, dict) and "camera_matrix" in value for key, value in values.items())


def read_mc_calib(values: dict[str, Any]) -> Drafts:
    """Cameras of a file's entries. Raises `CalibrationError` with camera and field."""
    cameras = {key: value for key, value in values.items() if CAMERA.fullmatch(key) and isinstance(value, dict)}
    unused = list(unknown_keys("", values, ("nb_camera", *cameras)))
    for name, table in cameras.items():
        unused += unknown_keys(f"camera {name!r}: ", table, FIELDS)
        if missing := [key for key in FIELDS if table.get(key) is None]:
            raise CalibrationError(f"camera {name!r}: {', '.join(missing)}: missing, expected {', '.join(FIELDS)}")
    groups = {shown(table["camera_group"]) for table in cameras.values()}
    if len(groups) > 1:
        raise CalibrationError(f"camera_group: found {choices(groups)}, expected one group: the places of two groups are not known to each "
                               "other")
    notes = ("the world frame is that of MC-Calib's reference camera: say what is up with --up",)
    return Drafts(tuple(_drafts(cameras)), None, notes, tuple(unused))


def _drafts(cameras: dict[str, dict[str, Any]]) -> Iterator[Draft]:
    for name, table in cameras.items():
        where = f"camera {name!r}: "
        if table["distortion_type"] not in LENSES:
            raise CalibrationError(f"{where}distortion_type: found {shown(table['distortion_type'])}, expected 0 (Brown) or 1 (Kannala)")
        matrix, pose = _matrix(where, table, "camera_matrix", 3), _matrix(where, table, "camera_pose_matrix", 4)
        if not np.allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-4):
            raise CalibrationError(f"{where}camera_pose_matrix: found {np.round(pose[:3, :3], 4).tolist()}, expected a rotation")
        fisheye, lens = LENSES[table["distortion_type"]], np.ravel(table["distortion_vector"])
        lens = lens[:4] if fisheye and not lens[4:].any() else lens
        yield Draft(name, matrix, lens, inverse(pose), (table["img_width"], table["img_height"]), fisheye, where=where)


def _matrix(where: str, table: dict[str, Any], key: str, side: int) -> Array:
    value = table[key]
    if not isinstance(value, np.ndarray) or value.shape != (side, side):
        raise CalibrationError(f"{where}{key}: found {shown(value)[:80]}, expected {side} x {side} finite numbers")
    return value
