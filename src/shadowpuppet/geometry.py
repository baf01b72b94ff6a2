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
    """Rotation vector (3,), radians, of a rotation matrix (3, 3); the inverse of `rotation_from_vector`."""
    import cv2

    return cv2.Rodrigues(np.asarray(R, float))[0].ravel()


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
