"""Reads JARVIS' files, one a camera: OpenCV's YAML with K and R transposed, as in MATLAB, and T in millimetres."""

from __future__ import annotations

from typing import Any

import numpy as np

from shadowpuppet.io.calibration.keys import is_transposed

MATRIX, ROTATION, UNIT = "intrinsicMatrix", "R", "mm"


def is_jarvis(values: dict[str, Any]) -> bool:
    """Whether a file's entries are those of JARVIS."""
    matrix, R = (values.get(key) for key in (MATRIX, ROTATION))
    square = all(isinstance(value, np.ndarray) and value.shape == (3, 3) for value in (matrix, R))
    return square and is_transposed(np.asarray(matrix))


def untransposed(values: dict[str, Any]) -> dict[str, Any]:
    """The entries with K and R as in OpenCV."""
    return {**values, MATRIX: values[MATRIX].T, ROTATION: values[ROTATION].T}
