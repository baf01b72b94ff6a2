"""An animated skeleton whose bones keep their lengths, for formats and programs that let only the root move."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.motion.animation import Animation

STILL = 1e-3
"""Greatest change of position (m) relative to the parent of a joint that counts as not moving."""
CLEAR = 1e-5
"""Least root mean square movement (m) along a direction from which a pivot's place in it is found."""
FARTHEST = 2.0
"""Greatest distance of a pivot from the moving joint's mean place, in that place's distances from the parent."""
BASE = "_base"
"""Suffix of the names of joints at pivots."""


class ConstantBones(NamedTuple):
    """A skeleton with bones of constant length."""

    animation: Animation
    off: float
    """Greatest distance (m) of a joint, in its parent's axes, from where it was."""


def constant_bones(animation: Animation) -> ConstantBones:
    """The skeleton with every joint but the root at a constant offset, all frames being known.

    A joint that moves relative to its parent, as a shoulder does with the collar bone, hangs on a new joint before it, `<name>_base`, at
    the centre of the sphere on which it moves; that joint's rotation carries it.
    """
    names, parents, offsets = list[str](), list[int](), list[Array]()
    rotations, shifts, place, off = list[Array](), list[Array](), dict[int, int](), 0.0
    T = len(animation.times)

    def add(name: str, parent: int, offset: Array, turns: Array, places: Array) -> int:
        names.append(name)
        parents.append(parent)
        offsets.append(offset)
        rotations.append(turns)
        shifts.append(places)
        return len(names) - 1

    for n, name in enumerate(animation.names):
        offset, turns, places = animation.offsets[n], animation.rotations[:, n], animation.shifts[:, n]
        parent = place.get(animation.parents[n], -1)
        if n and np.abs(places - offset).max(initial=0.0) > STILL:
            offset = places.mean(0)  # files may have other offsets at rest
        if n and np.abs(places - offset).max(initial=0.0) > STILL:
            pivot = _pivot(places)
            carried, arm = _carried(places - pivot)
            parent = add(f"{name}{BASE}", parent, pivot, carried, np.tile(pivot, (T, 1)))
            off = max(off, float(np.linalg.norm(pivot + carried @ arm - places, axis=1).max()))
            offset, turns = arm, np.swapaxes(carried, 1, 2) @ turns
        elif n:
            off = max(off, float(np.linalg.norm(places - offset, axis=1).max(initial=0.0)))
        place[n] = add(name, parent, offset, turns, np.tile(offset, (T, 1)) if n else places)
    ends = {place[n]: end for n, end in animation.ends.items()}
    made = Animation(tuple(names), tuple(parents), np.array(offsets), ends, animation.times, np.stack(rotations, 1), np.stack(shifts, 1))
    return ConstantBones(made, off)


def _pivot(places: Array) -> Array:
    """The point (3,) whose distance to places (T, 3) varies least, by linear least squares; in directions in which they hardly move it is
    at the parent. It is the parent, too, if the places fix no point nearby."""
    moved = places - places.mean(0)
    squares = (places**2).sum(1)
    left, sizes, right = np.linalg.svd(2 * moved, full_matrices=False)
    clear = sizes > 2 * CLEAR * np.sqrt(len(places))
    pivot = right[clear].T @ ((left[:, clear].T @ (squares - squares.mean())) / sizes[clear])
    near = np.linalg.norm(pivot - places.mean(0)) <= FARTHEST * np.linalg.norm(places.mean(0))
    return pivot if near else np.zeros(3)


def _carried(arms: Array) -> tuple[Array, Array]:
    """Rotations (T, 3, 3) of least angle that carry one arm (3,), the mean of arms (T, 3), to their directions; and that arm."""
    lengths = np.linalg.norm(arms, axis=1, keepdims=True)
    directions = np.divide(arms, lengths, out=np.tile([1.0, 0.0, 0.0], (len(arms), 1)), where=lengths > 0)
    mean = directions.mean(0)
    mean = mean / np.linalg.norm(mean) if np.linalg.norm(mean) > 0 else directions[0]
    axes, cosines = np.cross(mean, directions), directions @ mean
    K = np.zeros((len(arms), 3, 3))
    K[:, [2, 0, 1], [1, 2, 0]], K[:, [1, 2, 0], [2, 0, 1]] = axes, -axes
    turns = np.eye(3) + K + K @ K / np.maximum(1 + cosines, 1e-9)[:, None, None]
    return turns, mean * float(lengths.mean())
