"""Reads calibrations that are rows of numbers without names: KRT files (Multiface, CMU) and BioCV's .calib.

    KRT    for each camera: its name, K (3 x 3), distortion (a row), world to camera (3 x 4)
    BioCV  a file for each camera: width, height, K (3 x 3), world to camera (4 x 4), distortion (a row); millimetres
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.errors import CalibrationError, shown
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.draft import Draft, Drafts, numbers_of, text_of
from shadowpuppet.video import FILM_SUFFIXES

KRT_ROWS = (3, 3, 3, 0, 4, 4, 4)
"""Numbers in each row of a camera in a KRT file, after its name; 0: any number of distortion coefficients."""
COEFFICIENTS = (1, 2, 4, 5, 8)
"""Possible numbers of distortion coefficients; one or two are radial."""


def read_krt(path: Path) -> Drafts:
    """Cameras of a KRT file. Raises `CalibrationError`."""
    lines = [(n, line.split()) for n, line in enumerate(text_of(path).splitlines(), 1) if line.strip()]
    step, drafts = len(KRT_ROWS) + 1, []
    for at in range(0, len(lines), step):
        name, block = " ".join(lines[at][1]), lines[at + 1 : at + step]
        rows = [_row(path, *line, count) for line, count in zip(block, KRT_ROWS)]
        if len(rows) < len(KRT_ROWS):
            raise CalibrationError(f"{path}, line {lines[-1][0]}: the file ends within camera {shown(name)}, expected eight rows: its "
                                   "name, K (3 x 3), distortion, and world to camera (3 x 4)")
        drafts.append(Draft(name=name, matrix=np.array(rows[:3]), distortion=_coefficients(rows[3]), T=_placed(np.array(rows[4:]))))
    if not drafts:
        raise CalibrationError(f"{path}: found no camera in it, expected its name and seven rows of numbers for each")
    return Drafts(tuple(drafts))


def read_biocv(path: Path) -> Drafts:
    """The camera of a .calib file, or those of a folder, named after the files. Raises `CalibrationError`."""
    return Drafts(tuple(map(_biocv_camera, sorted(path.glob("*.calib")) if path.is_dir() else [path])), "mm")


def _biocv_camera(path: Path) -> Draft:
    values = numbers_of(text_of(path), tuple(2 + 9 + 16 + count for count in COEFFICIENTS))
    if values is None:
        raise CalibrationError(f"{path}: found other than finite numbers, or not as many as in BioCV's files: width, height, K (3 x 3), "
                               f"world to camera (4 x 4), and {', '.join(map(str, COEFFICIENTS))} distortion coefficients")
    name = path.stem
    for ending in FILM_SUFFIXES:
        name = name.removesuffix(ending)
    size, matrix, placed, lens = np.split(values, np.cumsum([2, 9, 16]))
    return Draft(name=name, matrix=matrix.reshape(3, 3), distortion=_coefficients(lens), T=placed.reshape(4, 4), size=size.tolist())


def _row(path: Path, line: int, cells: list[str], count: int) -> Array:
    counts = (count,) if count else COEFFICIENTS
    found = numbers_of(" ".join(cells), counts)
    if found is None:
        expected = " or ".join(map(str, counts))
        raise CalibrationError(f"{path}, line {line}: found {shown(' '.join(cells))}, expected {expected} finite numbers")
    return found


def _coefficients(values: Array) -> Array:
    return np.pad(values, (0, max(0, 4 - len(values))))


def _placed(rows: Array) -> Array:
    """World to camera (4, 4) from its first three rows."""
    return np.vstack([rows, [0, 0, 0, 1]])
