"""Poses of a body nearest to smoothed points and orientations: bones keep their lengths, joints their limits."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array

Points = Callable[[Array], Array]
"""From poses (N, D) to points (N, L, 3), metres."""
LEVER = 0.05
"""Distance (m) at which an error of orientation counts as one of position."""
ROUNDS, SETTLED = 6, 1e-4
"""Gauss-Newton steps at most, and the step (rad or m) below which no more are made."""
DAMPING, MAX_STEP = 1e-7, 0.3
"""Damping (m^2) of a step, and its bound (rad or m)."""
DERIVATIVE, CHUNK = 1e-6, 200
"""Step of the derivatives, and number of frames at once."""


class Markers(NamedTuple):
    """What poses are compared by."""

    points: Array
    """Of shape (T, L, 3), metres."""
    axes: Array
    """Axes of the joints' frames, of shape (T, 3 J, 3), no unit."""


def markers(skeleton: Skeleton, points: Points, poses: Array) -> Markers:
    """Those of poses (T, D)."""
    turned = skeleton.forward(poses)[..., :3]
    return Markers(points(poses), np.swapaxes(turned, 2, 3).reshape(len(poses), -1, 3))


def nearest_poses(skeleton: Skeleton, points: Points, poses: Array, wanted: Markers, free: NDArray[np.bool_]) -> Array:
    """Poses (T, D) near given ones whose markers are nearest to the wanted ones, within the joints' limits. Only `free` (D,) degrees of
    freedom change."""
    chunks = [slice(begin, begin + CHUNK) for begin in range(0, len(poses), CHUNK)]
    found = [_nearest(skeleton, points, poses[rows], Markers(wanted.points[rows], wanted.axes[rows]), free) for rows in chunks]
    return np.concatenate(found) if found else poses


def derivatives(skeleton: Skeleton, points: Points, poses: Array, which: NDArray[np.int64]) -> tuple[Array, Array]:
    """Markers (T, R) of poses (T, D) in a row, axes without unit, and their derivatives (T, F, R) by the F degrees of freedom `which`."""
    found = [_derivatives(skeleton, points, poses[begin : begin + CHUNK], which) for begin in range(0, len(poses), CHUNK)]
    return np.concatenate([at for at, _ in found]), np.concatenate([J for _, J in found])


def _derivatives(skeleton: Skeleton, points: Points, poses: Array, which: NDArray[np.int64]) -> tuple[Array, Array]:
    moved = np.concatenate([poses[:, None], poses[:, None] + DERIVATIVE * np.eye(poses.shape[1])[which]], 1)
    at = in_a_row(markers(skeleton, points, moved.reshape(-1, poses.shape[1]))).reshape(len(poses), len(which) + 1, -1)
    return at[:, 0], (at[:, 1:] - at[:, :1]) / DERIVATIVE


def at_limits(poses: Array, downhill: Array, which: NDArray[np.int64], low: Array, high: Array) -> NDArray[np.bool_]:
    """Which of the degrees of freedom `which` (T, F) are at a limit and would move beyond it; `downhill` (T, F): their way."""
    own, low, high = poses[:, which], low[..., which], high[..., which]
    return ((own <= low) & (downhill < 0)) | ((own >= high) & (downhill > 0))


def _nearest(skeleton: Skeleton, points: Points, poses: Array, wanted: Markers, free: NDArray[np.bool_]) -> Array:
    low, high = skeleton.limits
    low, high = np.minimum(low, poses), np.maximum(high, poses)  # a filter without limits may be beyond them
    which, target = np.flatnonzero(free), in_a_row(wanted)
    weight = np.repeat([1.0, LEVER**2], [wanted.points[0].size, wanted.axes[0].size])
    for _ in range(ROUNDS):
        at, J = _derivatives(skeleton, points, poses, which)
        downhill = (J @ (weight * (target - at))[..., None])[..., 0]
        held = at_limits(poses, downhill, which, low, high)
        J[held], downhill[held] = 0, 0
        step = np.linalg.solve((J * weight) @ np.swapaxes(J, 1, 2) + DAMPING * np.eye(len(which)), downhill[..., None])[..., 0]
        before, poses = poses, poses.copy()
        poses[:, which] += np.clip(step, -MAX_STEP, MAX_STEP)
        poses = np.clip(poses, low, high)
        if np.abs(poses - before).max() < SETTLED:
            break
    return poses


def in_a_row(found: Markers) -> Array:
    """All coordinates (T, R) of points and axes."""
    return np.concatenate([found.points.reshape(len(found.points), -1), found.axes.reshape(len(found.axes), -1)], 1)
