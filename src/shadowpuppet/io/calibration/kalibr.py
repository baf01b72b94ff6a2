"""Reads Kalibr's camera chain, camchain.yaml: each camera's place relative to the one before; the world frame is the first camera's."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np

from shadowpuppet.errors import CalibrationError, shown
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.draft import Draft, Drafts, numbers_of, text_of
from shadowpuppet.io.calibration.keys import unknown_keys

CAMERA = re.compile(r"^(cam\d+):\s*$", re.MULTILINE)
"""The line with which a camera begins."""
DISTORTIONS = {"radtan": False, "equidistant": True, "none": False}
"""Models of distortion that OpenCV's are equal to, and whether they are its fisheye model."""
KNOWN = ("camera_model", "distortion_model", "distortion_coeffs", "intrinsics", "resolution", "T_cn_cnm1",
         "cam_overlaps", "rostopic", "T_cam_imu")
"""Keys of a camera; the last three are not used."""
NUMBER = re.compile(r"[\s\[\],\d.+-]")
"""The beginning of a line of numbers."""


def read_kalibr(path: Path) -> Drafts:
    """Cameras of a chain. Raises `CalibrationError`."""
    parts = CAMERA.split(text_of(path))
    drafts, T, unused = [], np.eye(4), list[str]()
    for name, text in zip(parts[1::2], parts[2::2]):
        values = _values(text)
        where = f"[{name}]: "
        model, lens = values.get("camera_model", ""), values.get("distortion_model", "none")
        if model != "pinhole" or lens not in DISTORTIONS:
            raise CalibrationError(f"{path}: {where}camera_model and distortion_model: found {shown(model)} and {shown(lens)}, expected "
                                   f"pinhole and one of {', '.join(DISTORTIONS)}")
        fx, fy, cx, cy = _numbers(path, where, values, "intrinsics", 4)
        if drafts:
            T = _numbers(path, where, values, "T_cn_cnm1", 16).reshape(4, 4) @ T
        distortion = np.zeros(4) if lens == "none" else _numbers(path, where, values, "distortion_coeffs", 4)
        unused += unknown_keys(f"{path}: {where}", {key: value for key, value in values.items() if key and not NUMBER.match(key)}, KNOWN)
        drafts.append(Draft(name=name, matrix=np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), distortion=distortion, T=T,
                            size=_numbers(path, where, values, "resolution", 2).tolist(), fisheye=DISTORTIONS[lens], where=where))
    return Drafts(tuple(drafts), "m", ("the world frame is that of Kalibr's first camera: say what is up with --up",), tuple(unused))


def _values(text: str) -> dict[str, str]:
    """Texts by key; lists in brackets or with dashes become their numbers with commas between."""
    found: dict[str, list[str]] = {}
    key = ""
    for line in text.splitlines():
        stated, colon, value = line.strip().partition(":")
        if colon:
            key = stated.strip()
            found[key] = []
        found.setdefault(key, []).append(value if colon else line)
    return {key: re.sub(r"(?<![\w.])-(?=[\s\[])|[\[\]]", " ", " ".join(lines)).strip() for key, lines in found.items()}


def _numbers(path: Path, where: str, values: dict[str, str], key: str, count: int) -> Array:
    found = numbers_of(values.get(key), (count,))
    if found is None:
        raise CalibrationError(f"{path}: {where}{key}: found {shown(values.get(key, 'nothing'))}, expected {count} finite numbers")
    return found
