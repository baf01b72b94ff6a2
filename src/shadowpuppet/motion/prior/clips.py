"""Clips of motion made ready to learn from: mirrored, at another frame rate, without gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.motion import JointTable

SIDES = {"left_": "right_", "right_": "left_"}


def mirrored(table: JointTable) -> JointTable:
    """The motion as a mirror shows it that stands along the world's X axis: left is right, and y has the other sign.

    Raises `ShadowPuppetError` where a joint has a side and its counterpart is missing.
    """
    names = tuple(_other_side(name) for name in table.names)
    alone = [name for name, other in zip(table.names, names, strict=True) if other not in table.names]
    if alone:
        raise ShadowPuppetError(f"joint {alone[0]!r}: found no {_other_side(alone[0])!r} beside it, which a mirror needs")
    reflected = table.positions * (1, -1, 1)
    return JointTable(table.times, table.names, reflected[:, [table.names.index(name) for name in names]])


def without_gaps(values: ArrayLike, shortest: int = 2) -> list[Array]:
    """The parts of a clip (T, D) in which every number is known, those of `shortest` frames or more."""
    values = np.asarray(values, float)
    return [values[start:end] for start, end in true_runs(np.isfinite(values).reshape(len(values), -1).all(1)) if end - start >= shortest]


def _other_side(name: str) -> str:
    for side, other in SIDES.items():
        if name.startswith(side):
            return other + name.removeprefix(side)
    return name
