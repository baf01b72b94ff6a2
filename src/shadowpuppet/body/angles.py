"""Rotations of joints to the values of their degrees of freedom."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.body.skeleton import AXES, Dof
from shadowpuppet.geometry import Array, euler_angles, smoothest_path, unit


def rotation_angles(rotations: Array, dofs: Sequence[Dof]) -> Array:
    """Values (N, 3) of three DOF that make rotations (N, 3, 3): the possible triple that exceeds the limits least."""
    candidates, low, high = _candidates(rotations, dofs)
    return candidates[np.arange(len(candidates)), _excess(candidates, low, high).argmin(1)]


def angles_over_time(rotations: Array, dofs: Sequence[Dof]) -> Array:
    """Values (T, 3) of three DOF that make rotations (T, 3, 3): the smoothest path that keeps near the limits."""
    candidates, low, high = _candidates(rotations, dofs)
    free = ~np.isfinite(low)
    values = smoothest_path(candidates, _excess(candidates, low, high), wraps=free)
    values[:, free] = np.unwrap(values[:, free], axis=0)
    return values


def _candidates(rotations: Array, dofs: Sequence[Dof]) -> tuple[Array, Array, Array]:
    """Both triples of values (N, 2, 3) that make rotations (N, 3, 3), each angle within half a turn of its limits' middle; and the
    limits."""
    from scipy.spatial.transform import Rotation

    low, high = np.array([dof.low for dof in dofs]), np.array([dof.high for dof in dofs])
    if dofs[0].kind == "vector":
        v = Rotation.from_matrix(rotations).as_rotvec()
        other = v - 2 * np.pi * unit(np.where(np.linalg.norm(v, axis=1, keepdims=True) > 1e-9, v, [0, 0, 1e-9]))
        return np.stack([v, other], 1), low, high
    signs, free = np.array([AXES[dof.axis][1] for dof in dofs]), ~np.isfinite(low)
    first = euler_angles(rotations, [AXES[dof.axis][0] for dof in dofs])
    both = np.stack([first, first * [1, -1, 1] + np.pi], 1) * signs
    centre = np.where(free, 0.0, (np.where(free, 0, low) + np.where(free, 0, high)) / 2)
    return centre + (both - centre + np.pi) % (2 * np.pi) - np.pi, low, high


def _excess(candidates: Array, low: Array, high: Array) -> Array:
    """Squared excess (N, K) of candidates (N, K, 3) over the limits, and a small preference for small angles."""
    over = np.maximum(low - candidates, 0) + np.maximum(candidates - high, 0)
    return (np.where(np.isfinite(over), over, 0) ** 2).sum(2) + 1e-6 * (candidates**2).sum(2)
