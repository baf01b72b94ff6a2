"""Clips of motion prepared for learning: mirrored, and without gaps."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.motion import JointTable

OTHER_SIDE = {"left_": "right_", "right_": "left_"}


def mirrored(table: JointTable) -> JointTable:
    """The motion mirrored at the world's X axis: left and right change places, y changes its sign.

    Raises `ShadowPuppetError` if a joint of one side has no counterpart.
    """
    names = tuple(_other_side(name) for name in table.names)
    alone = [name for name, other in zip(table.names, names, strict=True) if other not in table.names]
    if alone:
        raise ShadowPuppetError(f"joint {alone[0]!r}: found no {_other_side(alone[0])!r} beside it, which a mirror needs")
    reflected = table.positions * (1, -1, 1)
    return JointTable(table.times, table.names, reflected[:, [table.names.index(name) for name in names]])


def without_gaps(values: ArrayLike, shortest: int = 2) -> list[Array]:
    """The runs of frames of a clip (T, D) without missing numbers, each of `shortest` frames or more."""
    values = np.asarray(values, float)
    return [values[start:end] for start, end in true_runs(np.isfinite(values).reshape(len(values), -1).all(1)) if end - start >= shortest]


def _other_side(name: str) -> str:
    for side, other in OTHER_SIDE.items():
        if name.startswith(side):
            return other + name.removeprefix(side)
    return name
