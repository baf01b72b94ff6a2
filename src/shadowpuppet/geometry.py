"""Rotations and rigid transforms, batched over leading axes."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def rotation_about(axis: ArrayLike, angle: ArrayLike) -> Array:
    """Rotation matrices (..., 3, 3) about one unit `axis` (3,) by `angle` (...) radians (Rodrigues' formula)."""
    x, y, z = np.asarray(axis, float)
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    angle = np.asarray(angle, float)[..., None, None]
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * (K @ K)


def rotation_from_vector(vector: ArrayLike) -> Array:
    """Rotation matrix (3, 3) of a rotation vector (3,), radians (the `rotation` of a calibration file)."""
    vector = np.asarray(vector, float)
    angle = float(np.linalg.norm(vector))
    return np.eye(3) if angle == 0 else rotation_about(vector / angle, angle)


def vector_from_rotation(R: ArrayLike) -> Array:
    """Rotation vector (3,), radians, at most pi long, of a rotation matrix (3, 3); the inverse of `rotation_from_vector`.

    By the quaternion that fits best (Bar-Itzhack 2000), which is exact near half a turn, too, where sines vanish.
    """
    (a, b, c), (d, e, f), (g, h, i) = np.asarray(R, float)
    K = np.array([[a - e - i, b + d, c + g, h - f], [b + d, e - a - i, f + h, c - g], [c + g, f + h, i - a - e, d - b],
                  [h - f, c - g, d - b, a + e + i]])
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    vector = np.array([x, y, z]) * (1 if w >= 0 else -1)
    sine = np.linalg.norm(vector)
    return np.zeros(3) if sine == 0 else vector * (2 * np.arctan2(sine, abs(w)) / sine)


def rigid(R: ArrayLike, t: ArrayLike) -> Array:
    """Homogeneous transforms (..., 4, 4) from rotations (..., 3, 3) and translations (..., 3)."""
    R, t = np.asarray(R, float), np.asarray(t, float)
    T = np.zeros((*np.broadcast_shapes(R.shape[:-2], t.shape[:-1]), 4, 4))
    T[..., :3, :3], T[..., :3, 3], T[..., 3, 3] = R, t, 1
    return T


def inverse(T: ArrayLike) -> Array:
    """Inverse of rigid transforms (..., 4, 4)."""
    T = np.asarray(T, float)
    Rt = np.swapaxes(T[..., :3, :3], -1, -2)
    return rigid(Rt, -(Rt @ T[..., :3, 3:])[..., 0])


def transform(T: ArrayLike, points: ArrayLike) -> Array:
    """Points (..., 3) moved by one rigid transform (4, 4)."""
    T, points = np.asarray(T, float), np.asarray(points, float)
    return points @ T[:3, :3].T + T[:3, 3]
