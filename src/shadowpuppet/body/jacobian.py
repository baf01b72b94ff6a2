"""Forward kinematics of one pose with its Jacobian: the joints' transforms, and the screw of each degree of freedom.

A DOF moves a point x by omega x (x - c) = (omega, c x omega) . (x x n, n) along a direction n; (omega, c x omega) is its screw. All
derivatives at a pose are dot products of screws with six sums over the points (Featherstone 2008, "Rigid Body Dynamics Algorithms",
2.2).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.forward_kinematics import TRANSLATION, VECTOR
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel

MAX_STEP = 0.5
"""Largest change of a DOF (rad or m) in one iteration of a refinement."""
SMALL_ANGLE = 1e-4
"""Below this length (rad) a rotation vector's series is used."""


class Chain(NamedTuple):
    """A skeleton as arrays for these kernels."""

    parents: NDArray[np.int64]
    """Parent of each joint, -1 for a root, of shape (J,)."""
    offsets: Array
    """Position in the parent's frame, metres, of shape (J, 3)."""
    first: NDArray[np.int64]
    """First DOF of each joint, and D at the end, of shape (J + 1,)."""
    owners: NDArray[np.int64]
    """Joint of each DOF, of shape (D,)."""
    axes: NDArray[np.int64]
    """Axis of each DOF, of shape (D,)."""
    signs: Array
    """Of shape (D,)."""
    kinds: NDArray[np.int64]
    """`TRANSLATION`, `ROTATION` or `VECTOR` of `forward_kinematics`, of shape (D,)."""
    low: Array
    """Limits, of shape (D,)."""
    high: Array
    """Of shape (D,)."""


def make_chain(skeleton: Skeleton) -> Chain:
    """The arrays of a skeleton without couplings."""
    parents, first, axes, signs, kinds, *_ = skeleton.tree
    owners = np.repeat(np.arange(len(parents)), np.diff(first))
    return Chain(parents, np.ascontiguousarray(skeleton.offsets[0]), first, owners, axes, signs, kinds, *skeleton.limits)


@kernel
def exponential(x, y, z, R, J):  # pragma: no cover
    """Rotation (3, 3) of a rotation vector, and its left Jacobian (3, 3): exp(v + d) = exp(J d) exp(v) for small d."""
    square = x * x + y * y + z * z
    angle = np.sqrt(square)
    if angle < SMALL_ANGLE:
        a, b, c = 1 - square / 6, 0.5 - square / 24, 1 / 6 - square / 120
    else:
        a, b, c = np.sin(angle) / angle, (1 - np.cos(angle)) / square, (angle - np.sin(angle)) / (square * angle)
    v = (x, y, z)
    for i in range(3):
        for j in range(3):
            R[i, j] = b * v[i] * v[j]
            J[i, j] = c * v[i] * v[j]
        R[i, i] += 1 - b * square
        J[i, i] += 1 - c * square
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        R[k, j] += a * v[i]
        R[j, k] -= a * v[i]
        J[k, j] += b * v[i]
        J[j, k] -= b * v[i]


@kernel
def place_one(pose, chain, T, screws, work):  # pragma: no cover
    """Transforms T (J, 3, 4) of one pose (D,), and the screws (D, 6) of its DOF: (omega, c x omega), or (0, axis) of a translation. Work
    array: (3, 3, 3)."""
    R, J, turned = work[0], work[1], work[2]
    for j in range(chain.parents.size):
        parent, own = chain.parents[j], T[j]
        for r in range(3):
            for c in range(4):
                own[r, c] = T[parent, r, c] if parent >= 0 else (1.0 if r == c else 0.0)
        for r in range(3):
            own[r, 3] += own[r, 0] * chain.offsets[j, 0] + own[r, 1] * chain.offsets[j, 1] + own[r, 2] * chain.offsets[j, 2]
        d = chain.first[j]
        while d < chain.first[j + 1]:
            axis, sign = chain.axes[d], chain.signs[d]
            if chain.kinds[d] == VECTOR:
                exponential(pose[d], pose[d + 1], pose[d + 2], R, J)
                for i in range(3):
                    for r in range(3):
                        screws[d + i, r] = own[r, 0] * J[0, i] + own[r, 1] * J[1, i] + own[r, 2] * J[2, i]
                        turned[r, i] = own[r, 0] * R[0, i] + own[r, 1] * R[1, i] + own[r, 2] * R[2, i]
                    _set_moment(screws[d + i], own)
                for r in range(3):
                    for c in range(3):
                        own[r, c] = turned[r, c]
                d += 3
                continue
            for r in range(3):
                screws[d, r] = 0.0 if chain.kinds[d] == TRANSLATION else sign * own[r, axis]
                screws[d, 3 + r] = sign * own[r, axis]
            if chain.kinds[d] == TRANSLATION:
                for r in range(3):
                    own[r, 3] += sign * own[r, axis] * pose[d]
            else:
                _set_moment(screws[d], own)
                a, b, sine, cosine = (axis + 1) % 3, (axis + 2) % 3, np.sin(sign * pose[d]), np.cos(pose[d])
                for r in range(3):
                    u, v = own[r, a], own[r, b]
                    own[r, a], own[r, b] = cosine * u + sine * v, cosine * v - sine * u
            d += 1


@kernel
def _set_moment(screw, T):  # pragma: no cover
    """The moment, the second half, of a rotation's screw (6,) about the origin of T (3, 4)."""
    x, y, z = T[0, 3], T[1, 3], T[2, 3]
    screw[3], screw[4], screw[5] = y * screw[2] - z * screw[1], z * screw[0] - x * screw[2], x * screw[1] - y * screw[0]
