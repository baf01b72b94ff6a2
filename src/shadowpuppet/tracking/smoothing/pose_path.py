"""The likeliest path of poses: smooth in space, near what was measured, bones of constant length.

Points that are smoothed one by one (`fixed_interval`) are no pose of the body, and the nearest poses may turn suddenly, as when an arm
straightens. So the same cost is minimised over the poses of all frames: Gauss-Newton steps, whose equations are banded.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.smoothing.projection import MAX_STEP, Points, at_limits, derivatives

STEPS, LEAST_GAIN = 10, 1e-3
"""Steps at most, and the share of the cost by which a step must lower it for another to follow."""
FIRST_DAMPING, MOST_DAMPING = 1e-3, 1e3
"""Damping, as a share of the equations' diagonal."""
STIFFNESS = 1e-3
"""Added to the diagonal (1 / rad^2 or 1 / m^2)."""
REACH = 3
"""Greatest distance, in frames, of poses that are coupled."""


class PathCost(NamedTuple):
    """What a path of markers (T, R), metres or no unit, costs: sum(precision (z - measured)^2) + sum((third difference)^2 / variance), and
    sum(still (first difference)^2) for what stands."""

    measured: Array
    """Of shape (T, R)."""
    precision: Array
    """Of shape (T, R)."""
    third: Array
    """Coefficients of the third differences, of shape (T - 3, 4)."""
    variance: Array
    """Of the third differences, of shape (T - 3, R)."""
    still: Array | None = None
    """Precision of the steps from frame to frame, of shape (T - 1, R); None: nothing stands."""

    def __call__(self, at: Array) -> float:
        """The cost of markers (T, R)."""
        slid = 0.0 if self.still is None else (self.still * np.diff(at, axis=0) ** 2).sum()
        return float((self.precision * (at - self.measured) ** 2).sum() + (self.jerk(at) ** 2 / self.variance).sum() + slid)

    def jerk(self, at: Array) -> Array:
        """Third differences (T - 3, R) of markers (T, R)."""
        return sum(self.third[:, k, None] * at[k : len(at) - 3 + k] for k in range(4))  # pyright: ignore[reportReturnType]

    def downhill(self, at: Array) -> Array:
        """Half the negative gradient (T, R) at markers (T, R)."""
        out, jerk = self.precision * (self.measured - at), self.jerk(at) / self.variance
        for k in range(4):
            out[k : len(at) - 3 + k] -= self.third[:, k, None] * jerk
        if self.still is not None:
            slid = self.still * np.diff(at, axis=0)
            out[:-1] += slid
            out[1:] -= slid
        return out

    def curvature(self, apart: int) -> Array:
        """Half the second derivatives (T - apart, R) by markers `apart` frames apart."""
        out = self.precision.copy() if apart == 0 else np.zeros((len(self.measured) - apart, self.measured.shape[1]))
        for k in range(4 - apart):
            out[k : k + len(self.third)] += (self.third[:, k] * self.third[:, k + apart])[:, None] / self.variance
        if self.still is not None and apart == 0:
            out[:-1] += self.still
            out[1:] += self.still
        elif self.still is not None and apart == 1:
            out -= self.still
        return out


def likeliest_poses(skeleton: Skeleton, points: Points, poses: Array, cost: PathCost, free: NDArray[np.bool_],
                    steps: int = STEPS) -> Array:
    """Poses (T, D) of least cost near given ones, within the joints' limits, after `steps` at most. Only `free` (D,) degrees of freedom
    change."""
    low, high = skeleton.limits
    low, high = np.minimum(low, poses), np.maximum(high, poses)
    which, damping = np.flatnonzero(free), FIRST_DAMPING
    if not len(which):
        return poses
    at, J = derivatives(skeleton, points, poses, which)
    best = cost(at)
    for _ in range(steps):
        downhill = (J @ cost.downhill(at)[..., None])[..., 0]
        J[at_limits(poses, downhill, which, low, high)] = 0
        new = poses.copy()
        new[:, which] += np.clip(_step(J, cost, at, damping), -MAX_STEP, MAX_STEP)
        new = np.clip(new, low, high)
        new_at, new_J = derivatives(skeleton, points, new, which)
        gain = best - cost(new_at)
        if gain < 0:
            damping *= 10
            if damping > MOST_DAMPING:
                break
            continue
        poses, at, J, best, damping = new, new_at, new_J, best - gain, damping / 5
        if gain <= LEAST_GAIN * best:
            break
    return poses


def _step(J: Array, cost: PathCost, at: Array, damping: float) -> Array:
    """The step (T, F) of F degrees of freedom; `J` (T, F, R): derivatives of the markers `at` (T, R)."""
    blocks = [(J[: len(J) - k] * cost.curvature(k)[:, None]) @ np.swapaxes(J[k:], 1, 2) for k in range(REACH + 1)]
    diagonal = np.einsum("tff->tf", blocks[0])
    diagonal += damping * diagonal + STIFFNESS
    return solve_banded(blocks, (J @ cost.downhill(at)[..., None])[..., 0])


def solve_banded(blocks: Sequence[Array], right: Array) -> Array:
    """Solution (T, F) of a symmetric positive definite system whose blocks k frames apart, k from 0 to `REACH`, are `blocks[k]`
    (T - k, F, F), and whose right-hand side is `right` (T, F). `REACH` frames at a time make it block tridiagonal (Thomas' algorithm)."""
    T, F = right.shape
    count, size = -(-T // REACH), REACH * F
    own, next_, rest = np.zeros((count, REACH, F, REACH, F)), np.zeros((count, REACH, F, REACH, F)), np.zeros((count * REACH, F))
    rest[:T] = right
    for k, block in enumerate(blocks):
        for a in range(REACH):
            mine, b = block[a::REACH], a + k
            if b < REACH:
                own[: len(mine), a, :, b] = mine
                own[: len(mine), b, :, a] = np.swapaxes(mine, 1, 2)
            else:
                next_[: len(mine), a, :, b - REACH] = mine
    for t in range(T, count * REACH):  # frames beyond the end stand alone
        own[-1, t % REACH, :, t % REACH] = np.eye(F)
    A, B, r = own.reshape(count, size, size), next_.reshape(count, size, size), rest.reshape(count, size)
    solved = []
    for i in range(count):
        both = np.linalg.solve(A[i], np.concatenate([B[i], r[i, :, None]], 1))
        solved.append(both)
        if i + 1 < count:
            A[i + 1] -= B[i].T @ both[:, :size]
            r[i + 1] -= B[i].T @ both[:, size]
    out = np.empty((count, size))
    for i in range(count - 1, -1, -1):
        out[i] = solved[i][:, size] - (solved[i][:, :size] @ out[i + 1] if i + 1 < count else 0.0)
    return out.reshape(-1, F)[:T]
