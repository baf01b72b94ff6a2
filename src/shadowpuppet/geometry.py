"""Geometry of space, batched over leading axes: rotations, rigid transforms, alignment of points, Euler angles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


def unit(vectors: Array) -> Array:
    """Vectors (..., 3) scaled to length one; not a number for zero vectors."""
    with np.errstate(invalid="ignore", divide="ignore"):
        return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


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


def rotation_from_quaternion(quaternion: ArrayLike) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion x, y, z, w."""
    x, y, z, w = np.asarray(quaternion, float)
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


def vector_from_rotation(R: ArrayLike) -> Array:
    """Rotation vector (3,), radians, at most pi long, of a rotation matrix (3, 3); the inverse of `rotation_from_vector`. Uses the
    best-fitting quaternion (Bar-Itzhack 2000), which stays exact near half a turn, where sines vanish."""
    (a, b, c), (d, e, f), (g, h, i) = np.asarray(R, float)
    K = np.array([[a - e - i, b + d, c + g, h - f], [b + d, e - a - i, f + h, c - g], [c + g, f + h, i - a - e, d - b],
                  [h - f, c - g, d - b, a + e + i]])
    x, y, z, w = np.linalg.eigh(K)[1][:, -1]
    vector = np.array([x, y, z]) * (1 if w >= 0 else -1)
    sine = np.linalg.norm(vector)
    return np.zeros(3) if sine == 0 else vector * (2 * np.arctan2(sine, abs(w)) / sine)


def shortest_rotation(start: ArrayLike, end: ArrayLike, least: float) -> Array:
    """Rotations (..., 3, 3) of least angle from unit vectors (..., 3) to others; `least`: of 1 + cosine, which vanishes at half a turn."""
    start, end = np.broadcast_arrays(np.asarray(start, float), np.asarray(end, float))
    axis, cosine = np.cross(start, end), (start * end).sum(-1)
    K = np.zeros((*axis.shape, 3))
    K[..., [2, 0, 1], [1, 2, 0]], K[..., [1, 2, 0], [2, 0, 1]] = axis, -axis
    return np.eye(3) + K + K @ K / np.maximum(1 + cosine, least)[..., None, None]


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


MIN_POINTS = 3
"""Smallest number of points that determine a rotation."""


class Alignment(NamedTuple):
    """A similarity transform: `scale * rotation @ point + translation`."""

    rotation: Array
    """Of shape (..., 3, 3)."""
    translation: Array
    """Of shape (..., 3)."""
    scale: Array
    """Of shape (...)."""

    @property
    def matrix(self) -> Array:
        """The rigid transform (..., 4, 4), without the scale."""
        return rigid(self.rotation, self.translation)

    def apply(self, points: ArrayLike) -> Array:
        """Points (..., P, 3), transformed."""
        moved = np.asarray(points, float) @ np.swapaxes(self.rotation, -1, -2)
        return self.scale[..., None, None] * moved + self.translation[..., None, :]


def align(points: ArrayLike, targets: ArrayLike, scaled: bool = False) -> Alignment:
    """The rotation, translation and, if `scaled`, scale that bring points (..., P, 3) nearest to targets, by least squares (Kabsch
    1976). Leading axes are aligned independently. Pairs that are not finite are left out; with fewer than three left the result is not a
    number. The rotation is never a reflection."""
    points, targets = np.asarray(points, float), np.asarray(targets, float)
    known = (np.isfinite(points) & np.isfinite(targets)).all(-1, keepdims=True)
    count = known.sum(-2)
    middles = [np.where(known, each, 0).sum(-2) / np.maximum(count, 1) for each in (points, targets)]
    a, b = (np.where(known, each - middle[..., None, :], 0) for each, middle in zip((points, targets), middles))
    U, S, Vt = np.linalg.svd(np.swapaxes(b, -1, -2) @ a)
    signs = np.ones(S.shape)
    signs[..., 2] = np.where(np.linalg.det(U @ Vt) < 0, -1, 1)
    R = (U * signs[..., None, :]) @ Vt
    spread = (a**2).sum((-1, -2))
    scale = np.divide((S * signs).sum(-1), spread, out=np.ones(spread.shape), where=spread > 0) if scaled else np.ones(spread.shape)
    few = count[..., 0] < MIN_POINTS
    scale = np.where(few, np.nan, scale)
    return Alignment(R, middles[1] - scale[..., None] * (R @ middles[0][..., None])[..., 0], scale)


ORDERS = ("ZXY", "ZYX", "XYZ", "XZY", "YXZ", "YZX")
"""Orders of the three axes; the first is what most programs write."""
MIN_MARGIN = np.radians(25.0)
"""The first order is used if its middle angle stays this far (rad) from a quarter turn."""
GIMBAL_COSINE = 1e-7
"""Cosine of the middle angle below which the first and third axes coincide (gimbal lock)."""


def euler_angles(R: Array, axes: Sequence[int]) -> Array:
    """Angles (N, 3), rad, about three different axes, each as turned by those before, that make rotations (N, 3, 3). The middle angle is
    within a quarter turn. In gimbal lock the first angle is zero."""
    i, j, k = axes
    e = 1 if (j - i) % 3 == 1 else -1
    second = np.arcsin(np.clip(e * R[:, i, k], -1, 1))
    first, third = np.arctan2(-e * R[:, j, k], R[:, k, k]), np.arctan2(-e * R[:, i, j], R[:, i, i])
    single = _singular(R, axes)
    third = np.where(single, np.arctan2(e * R[:, j, i], R[:, j, j]), third)
    return np.stack([np.where(single, 0.0, first), second, third], 1)


def _singular(R: Array, axes: Sequence[int]) -> NDArray[np.bool_]:
    return np.hypot(R[:, axes[0], axes[0]], R[:, axes[0], axes[1]]) < GIMBAL_COSINE


def evenly_spread(length: int, most: int) -> NDArray[np.int64]:
    """Indices, at most `most`, spread evenly over a sequence from its first element to its last."""
    return np.unique(np.linspace(0, length - 1, most).astype(np.int64))


def continuous_angles(rotations: Array, order: str, limits: ArrayLike | None = None) -> Array:
    """Euler angles (T, 3), rad, in `order` that make rotations (T, 3, 3) and change least from frame to frame. Two triples of angles,
    and any whole turns, make each rotation. The path of least steps is taken, so angles may pass half a turn; of equal paths the one
    that exceeds `limits` (3, 2), rad, least."""
    axes = ["XYZ".index(axis) for axis in order]
    low, high = np.reshape([-np.pi, np.pi] * 3 if limits is None else limits, (3, 2)).T
    middle = (low + high) / 2
    first = euler_angles(rotations, axes)
    both = middle + (np.stack([first, first * [1, -1, 1] + np.pi], 1) - middle + np.pi) % (2 * np.pi) - np.pi
    over = np.maximum(low - both, 0) + np.maximum(both - high, 0)
    angles = smoothest_path(both, (over**2).sum(2) + 1e-6 * (both**2).sum(2), wraps=np.ones(3, bool))
    angles = np.unwrap(_through_gimbal_lock(rotations, angles, axes), axis=0)
    return angles - 2 * np.pi * np.round((np.median(angles, axis=0) - middle) / (2 * np.pi))


def _through_gimbal_lock(rotations: Array, angles: Array, axes: Sequence[int]) -> Array:
    """Angles (T, 3) that keep the last frame's first angle in gimbal lock, where any value would do."""
    i, j, _ = axes
    e, angles = 1 if (j - i) % 3 == 1 else -1, angles.copy()
    for t in np.flatnonzero(_singular(rotations, axes)):
        if t:
            rest = rotation_about(np.eye(3)[i], angles[t - 1, 0]).T @ rotations[t]
            angles[t] = angles[t - 1, 0], np.arcsin(np.clip(e * rest[i, axes[2]], -1, 1)), np.arctan2(e * rest[j, i], rest[j, j])
    return angles


def clear_order(rotations: Array) -> str:
    """The first of `ORDERS` if it keeps clear of gimbal lock in all rotations (T, 3, 3), else the order that stays farthest from it."""
    room = [np.pi / 2 - float(np.abs(euler_angles(rotations, ["XYZ".index(axis) for axis in order])[:, 1]).max()) for order in ORDERS]
    return ORDERS[0] if room[0] >= MIN_MARGIN else ORDERS[int(np.argmax(room))]


def wrapped(angles: Array) -> Array:
    """Angles (...), radians, wrapped to [-pi, pi)."""
    return (np.asarray(angles, float) + np.pi) % (2 * np.pi) - np.pi


def smoothest_path(candidates: Array, own: Array, wraps: NDArray[np.bool_]) -> Array:
    """The path (T, 3) through candidates (T, K, 3) of least squared steps plus own costs (T, K) (Viterbi 1967). `wraps` (3,): which axes
    are periodic."""
    steps = candidates[1:, None, :] - candidates[:-1, :, None]
    steps = np.where(wraps, wrapped(steps), steps)
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
