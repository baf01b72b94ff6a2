"""Rotations as three turns about axes, one after another: the angles over time, without jumps where there need be none."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.geometry import Array, rotation_about

ORDERS = ("ZXY", "ZYX", "XYZ", "XZY", "YXZ", "YZX")
"""Axes of the three turns; the first is what most programs write."""
CLEAR = np.radians(25.0)
"""As long as the middle turn keeps so far from a quarter, the first order will do."""
SINGULAR = 1e-7
"""Cosine of the middle turn under which the other two are one and the same."""


def continuous_angles(rotations: Array, order: str, limits: ArrayLike | None = None) -> Array:
    """Angles (T, 3), rad, of turns about the axes of `order` that make rotations (T, 3, 3), each about the axes as turned by those before.

    Every rotation is made by two triples, and by more of whole turns: the path of least steps is taken, so that angles may pass half a
    turn; of such paths the one that strays least from `limits` (3, 2), rad, where they are given.
    """
    axes = ["XYZ".index(axis) for axis in order]
    low, high = np.reshape([-np.pi, np.pi] * 3 if limits is None else limits, (3, 2)).T
    middle = (low + high) / 2
    first = three_turns(rotations, axes)
    both = middle + (np.stack([first, first * [1, -1, 1] + np.pi], 1) - middle + np.pi) % (2 * np.pi) - np.pi
    over = np.maximum(low - both, 0) + np.maximum(both - high, 0)
    angles = branch(both, (over**2).sum(2) + 1e-6 * (both**2).sum(2), wraps=np.ones(3, bool))
    angles = np.unwrap(_kept(rotations, angles, axes), axis=0)
    return angles - 2 * np.pi * np.round((np.median(angles, axis=0) - middle) / (2 * np.pi))


def clear_order(rotations: Array) -> str:
    """The first of `ORDERS` where it is far from singular in all rotations (T, 3, 3); else the one that stays farthest."""
    room = [np.pi / 2 - float(np.abs(three_turns(rotations, ["XYZ".index(axis) for axis in order])[:, 1]).max()) for order in ORDERS]
    return ORDERS[0] if room[0] >= CLEAR else ORDERS[int(np.argmax(room))]


def three_turns(R: Array, axes: Sequence[int]) -> Array:
    """Angles (N, 3) of turns about three different axes, one after another, that make rotations (N, 3, 3); the second within a quarter.

    Where the second is a quarter, the first and the third are one and the same, and the first is none.
    """
    i, j, k = axes
    e = 1 if (j - i) % 3 == 1 else -1
    second = np.arcsin(np.clip(e * R[:, i, k], -1, 1))
    first, third = np.arctan2(-e * R[:, j, k], R[:, k, k]), np.arctan2(-e * R[:, i, j], R[:, i, i])
    single = _singular(R, axes)
    third = np.where(single, np.arctan2(e * R[:, j, i], R[:, j, j]), third)
    return np.stack([np.where(single, 0.0, first), second, third], 1)


def branch(candidates: Array, own: Array, wraps: NDArray[np.bool_]) -> Array:
    """Of candidates (T, K, 3) the path (T, 3) of least squared steps and least costs of their own (T, K) (Viterbi 1967)."""
    steps = candidates[1:, None, :] - candidates[:-1, :, None]
    steps = np.where(wraps, (steps + np.pi) % (2 * np.pi) - np.pi, steps)
    between = (steps**2).sum(3)
    cost, came = own[0], np.zeros(candidates.shape[:2], np.int64)
    for t in range(1, len(candidates)):
        total = cost[:, None] + between[t - 1]
        came[t] = total.argmin(0)
        cost = total.min(0) + own[t]
    path = np.empty(len(candidates), np.int64)
    path[-1] = cost.argmin()
    for t in range(len(candidates) - 1, 0, -1):
        path[t - 1] = came[t, path[t]]
    return candidates[np.arange(len(path)), path]


def _singular(R: Array, axes: Sequence[int]) -> NDArray[np.bool_]:
    return np.hypot(R[:, axes[0], axes[0]], R[:, axes[0], axes[1]]) < SINGULAR


def _kept(rotations: Array, angles: Array, axes: Sequence[int]) -> Array:
    """Angles (T, 3) whose first stays what it was where it is one with the third, and could be anything."""
    i, j, _ = axes
    e, angles = 1 if (j - i) % 3 == 1 else -1, angles.copy()
    for t in np.flatnonzero(_singular(rotations, axes)):
        if t:
            rest = rotation_about(np.eye(3)[i], angles[t - 1, 0]).T @ rotations[t]
            angles[t] = angles[t - 1, 0], np.arcsin(np.clip(e * rest[i, axes[2]], -1, 1)), np.arctan2(e * rest[j, i], rest[j, j])
    return angles
