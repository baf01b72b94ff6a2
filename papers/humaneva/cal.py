"""Reads HumanEva's calibrations (.cal): numbers of Bouguet's toolbox, `Xc = R X + T` in millimetres, one camera per file, no picture
sizes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError, warn
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration.draft import Draft, text_of

NUMBERS = 22
"""Count of numbers in a .cal file: fc 2, cc 2, alpha 1, kc 5, R 9, T 3."""
ROWS = 480
"""Rows of HumanEva's pictures, used for the effect of a skew if the size is unknown."""


def read_cal(path: Path, name: str, size: tuple[int, int]) -> Camera:
    """Read a camera from a .cal file. Raises `CalibrationError`."""
    draft = draft_of(path, name, size)
    assert draft.T is not None
    try:
        return Camera(name, size, np.array(draft.matrix), np.array(draft.distortion), rigid(draft.T[:3, :3], draft.T[:3, 3] / 1000))
    except CalibrationError as error:
        raise CalibrationError(f"{path}: {error}") from None


def draft_of(path: Path, name: str, size: tuple[int, int] | None = None) -> Draft:
    """The camera of a .cal file, lengths in millimetres. Raises `CalibrationError`."""
    try:
        values = np.array(text_of(path).split(), float)
    except ValueError:
        values = np.full(1, np.nan)
    if len(values) < NUMBERS or not np.isfinite(values).all():
        raise CalibrationError(f"{path}: expected {NUMBERS} numbers (fc, cc, alpha, kc, R row by row, T), found something else")
    fc, cc, alpha, kc, R, T = np.split(values[:NUMBERS], np.cumsum([2, 2, 1, 5, 9]))
    skew = abs(float(alpha[0])) * (size[1] if size is not None else ROWS) / 2
    if skew > 1:
        raise CalibrationError(f"{path}: alpha: found {alpha[0]:g}, a skew of up to {skew:.4g} pixels, expected none")
    if skew > 0.01:
        warn(f"{path}: alpha: found {alpha[0]:g}, a skew, which cameras have not here: left out, up to {skew:.2f} pixels")
    matrix = np.array([[fc[0], 0, cc[0]], [0, fc[1], cc[1]], [0, 0, 1]])
    return Draft(name, matrix, kc, rigid(R.reshape(3, 3), T), size)
