"""Reads COLMAP's text export: cameras.txt and images.txt; a camera for each picture, named after it or after its folder.

COLMAP's pixel centres are at halves, here at whole numbers. A reconstruction has no scale: its lengths are in a unit of its own.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.errors import CalibrationError, choices, shown
from shadowpuppet.geometry import Array, rigid, rotation_from_quaternion
from shadowpuppet.io.calibration.draft import Draft, Drafts, numbers_of, text_of

MODELS = {"SIMPLE_PINHOLE": 3, "PINHOLE": 4, "SIMPLE_RADIAL": 4, "RADIAL": 5, "OPENCV": 8, "OPENCV_FISHEYE": 8, "FULL_OPENCV": 12}
"""Models of lenses with their number of parameters."""
ONE_FOCAL = ("SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL")


def is_colmap(path: Path) -> bool:
    """Whether a folder, or the file cameras.txt or images.txt in it, is COLMAP's export."""
    folder = path if path.is_dir() else path.parent
    return (path.is_dir() or path.name in ("cameras.txt", "images.txt")) and all((folder / name).is_file()
                                                                                 for name in ("cameras.txt", "images.txt"))


def read_colmap(path: Path) -> Drafts:
    """Cameras of a folder with cameras.txt and images.txt. Raises `CalibrationError`."""
    folder = path if path.is_dir() else path.parent
    lenses = _lenses(folder / "cameras.txt")
    drafts: dict[str, Draft] = {}
    file = folder / "images.txt"
    lines = [(n, line.split()) for n, line in enumerate(text_of(file).splitlines(), 1) if line.strip() and line.lstrip()[0] != "#"]
    for n, cells in lines:
        if len(cells) < 10 or "." not in cells[-1]:
            continue  # a line of points
        pose = numbers_of(" ".join(cells[1:8]), (7,))
        lens = lenses.get(cells[8])
        if pose is None:
            raise CalibrationError(f"{file}, line {n}: found {shown(' '.join(cells[:9]))}, expected IMAGE_ID QW QX QY QZ TX TY TZ "
                                   "CAMERA_ID NAME")
        if lens is None:
            raise CalibrationError(f"{file}, line {n}: found the camera {shown(cells[8])}, cameras.txt has {choices(lenses)}")
        picture = Path(" ".join(cells[9:]).replace("\\", "/"))
        name = picture.parent.name or picture.stem
        if name not in drafts:
            size, matrix, distortion, fisheye = lens
            drafts[name] = Draft(name=name, matrix=matrix, distortion=distortion, T=_pose(file, n, pose), size=size, fisheye=fisheye)
    if not drafts:
        raise CalibrationError(f"{file}: found no picture in it, expected lines of IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME")
    note = "COLMAP's lengths are in a unit of its own: multiply the translations by the person's true height over the height in `check`"
    return Drafts(tuple(drafts.values()), None, (note,))


def _lenses(file: Path) -> dict[str, tuple[list[float], Array, Array, bool]]:
    """Size, matrix (3, 3), distortion (K,) and whether a fisheye, by the camera's number."""
    out = {}
    for n, line in enumerate(text_of(file).splitlines(), 1):
        cells = line.split()
        if not cells or cells[0].startswith("#"):
            continue
        model = cells[1] if len(cells) > 1 else ""
        if model not in MODELS:
            raise CalibrationError(f"{file}, line {n}: found the model {shown(model)}, expected one of {choices(MODELS)}")
        numbers = numbers_of(" ".join(cells[2:]), (2 + MODELS[model],))
        if numbers is None:
            raise CalibrationError(f"{file}, line {n}: found {len(cells) - 2} values, expected width, height and {MODELS[model]} "
                                   "parameters")
        fx, *rest = numbers[2:]
        fy, cx, cy, *lens = (fx, *rest) if model in ONE_FOCAL else rest
        matrix = np.array([[fx, 0, cx - 0.5], [0, fy, cy - 0.5], [0, 0, 1]])
        distortion = np.pad(np.array(lens, float), (0, max(0, 4 - len(lens))))
        out[cells[0]] = (numbers[:2].tolist(), matrix, distortion, model == "OPENCV_FISHEYE")
    return out


def _pose(file: Path, n: int, pose: Array) -> Array:
    length = float(np.linalg.norm(pose[:4]))
    if not 0.9 < length < 1.1:
        raise CalibrationError(f"{file}, line {n}: found the quaternion {pose[:4].tolist()}, expected one of length 1")
    return rigid(rotation_from_quaternion(np.roll(pose[:4], -1) / length), pose[4:])
