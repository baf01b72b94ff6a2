"""Bundle adjustment: places of cameras, poses of a board, delays of films and lenses at once, robust and sparse.

Minimises reprojection errors under Huber's loss by Levenberg's and Marquardt's method, with analytic derivatives (lenses by OpenCV).
Increments of poses act from the left, R <- exp(w) R and t <- t + d, so that no parametrisation of rotations has a singularity. A delay
moves the corners along their measured velocities, which are pictures' own: time is solved to fractions of a frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_array, csr_array, diags_array
from scipy.sparse.linalg import splu

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array, rigid, rotation_from_vector
from shadowpuppet.threads import one_blas_thread

HUBER = 1.5
"""Residual, in robust standard deviations, from which on an observation counts less."""
MAX_STEPS, TOLERANCE = 60, 1e-9
"""Greatest number of steps, and the relative decrease of the cost that ends them."""
LEAST_SCALE = 0.02
"""Least standard deviation assumed of a corner, pixels."""


class Observations(NamedTuple):
    """Corners of boards seen by cameras."""

    camera: NDArray[np.int64]
    """Indices of cameras, of shape (M,)."""
    board: NDArray[np.int64]
    """Indices of board poses, of shape (M,)."""
    points: Array
    """Corners in the board's frame, of shape (M, 3), metres."""
    pixels: Array
    """Of shape (M, 2)."""
    velocities: Array
    """Velocities in the picture, of shape (M, 2), pixels/s; 0 where unknown or at rest."""


@dataclass(frozen=True, eq=False)
class Bundle:
    """What is solved for, with first values."""

    cameras: tuple[Camera, ...]
    boards: Array
    """Board to world, of shape (B, 4, 4), metres."""
    delays: Array
    """Seconds by which each camera's film is late, of shape (C,)."""


class Free(NamedTuple):
    """What may change."""

    places: Sequence[bool]
    """Of each camera."""
    boards: Sequence[bool] | NDArray[np.bool_]
    """Of each board pose."""
    delays: Sequence[bool]
    """Of each camera's film."""
    lenses: Sequence[bool]
    """Of each camera: focal lengths, principal point, and the coefficients of distortion that are not 0."""


class Solved(NamedTuple):
    """The result."""

    bundle: Bundle
    residuals: Array
    """Reprojection errors, measured less predicted, of shape (M, 2), pixels."""
    scale: float
    """Robust standard deviation of a residual's component, pixels."""
    place_sd: Array
    """Standard deviations of the cameras' centres, of shape (C,), metres: root of the trace; 0 where fixed."""
    angle_sd: Array
    """The same of orientations, of shape (C,), radians."""
    delay_sd: Array
    """The same of delays, of shape (C,), seconds."""
    lens_sd: Array
    """Relative standard deviations of focal lengths, of shape (C,)."""


class _Columns(NamedTuple):
    """First column of each free block; -1 for fixed ones."""

    places: NDArray[np.int64]
    boards: NDArray[np.int64]
    delays: NDArray[np.int64]
    lenses: NDArray[np.int64]
    coefficients: list[NDArray[np.int64]]
    """Columns of OpenCV's lens derivatives (fx, fy, cx, cy, coefficients) that are free, by camera."""
    shared: int
    """Columns that are not boards': the first ones."""
    total: int
    """Number of columns."""


def adjust(start: Bundle, seen: Observations, free: Free) -> Solved:
    """Solve a bundle. Raises `CalibrationError` if a board is behind a camera that sees it."""
    with one_blas_thread():  # matrices are small: threads would wait for each other
        return _adjusted(start, seen, free)


def _adjusted(start: Bundle, seen: Observations, free: Free) -> Solved:
    columns = _columns(start, free)
    residuals, jacobian = _linearised(start, seen, columns)
    if not np.isfinite(residuals).all():
        raise CalibrationError("a board is behind a camera that sees it: the first guess of the places is wrong")
    bundle, damping = start, 1e-3
    scale = _scale(residuals)
    cost = _cost(residuals, scale)
    for _ in range(MAX_STEPS if columns.total else 0):
        H, g = _normal(jacobian, residuals, scale)
        stepped, new = False, cost
        for _ in range(12):
            step = splu((H + damping * diags_array(np.maximum(H.diagonal(), 1e-12))).tocsc()).solve(g)
            tried = _moved(bundle, step, columns)
            off, jac = _linearised(tried, seen, columns)
            new = _cost(off, scale) if np.isfinite(off).all() else np.inf
            if new < cost:
                bundle, residuals, jacobian, damping, stepped = tried, off, jac, max(damping / 10, 1e-12), True
                break
            damping *= 10
        if not stepped:
            break
        gain, scale = (cost - new) / cost, _scale(residuals)
        cost = _cost(residuals, scale)
        if gain < TOLERANCE:
            break
    return _result(bundle, residuals, jacobian, scale, columns)


def _result(bundle: Bundle, residuals: Array, jacobian: csr_array, scale: float, columns: _Columns) -> Solved:
    C = len(bundle.cameras)
    place, angle, delay, lens = np.zeros(C), np.zeros(C), np.zeros(C), np.zeros(C)
    if columns.total:
        H, _ = _normal(jacobian, residuals, scale)
        covariance = _covariance(H, columns)
        for c, camera in enumerate(bundle.cameras):
            if (k := columns.places[c]) >= 0:
                # centre = -R' t: with R <- exp(w) R and t <- t + d it moves by -R' (d + t x w)
                t = camera.T_camera_world[:3, 3]
                G = np.concatenate([_cross(t[None])[0], np.eye(3)], axis=1)
                block = covariance[k : k + 6, k : k + 6]
                place[c], angle[c] = np.sqrt(np.trace(G @ block @ G.T)), np.sqrt(np.trace(block[:3, :3]))
            if (k := columns.delays[c]) >= 0:
                delay[c] = np.sqrt(covariance[k, k])
            if (k := columns.lenses[c]) >= 0:
                lens[c] = np.sqrt(covariance[k, k]) / camera.matrix[0, 0]
    return Solved(bundle, residuals, scale, place, angle, delay, lens)


def _columns(bundle: Bundle, free: Free) -> _Columns:
    at = 0

    def numbered(flags: Sequence[bool] | NDArray[np.bool_], sizes: Sequence[int]) -> NDArray[np.int64]:
        nonlocal at
        out = np.full(len(flags), -1, np.int64)
        for n, (flag, size) in enumerate(zip(flags, sizes)):
            if flag:
                out[n], at = at, at + size
        return out

    coefficients = [np.concatenate([np.arange(4), 4 + np.flatnonzero(camera.distortion)]) for camera in bundle.cameras]
    C, B = len(bundle.cameras), len(bundle.boards)
    places, delays = numbered(free.places, [6] * C), numbered(free.delays, [1] * C)
    lenses, shared = numbered(free.lenses, list(map(len, coefficients))), at
    return _Columns(places, numbered(free.boards, [6] * B), delays, lenses, coefficients, shared, at)


def _linearised(bundle: Bundle, seen: Observations, columns: _Columns) -> tuple[Array, csr_array]:
    """Residuals (M, 2) and the sparse derivatives (2 M, P) of the predictions."""
    M = len(seen.camera)
    out = np.full((M, 2), np.nan)
    R_b, t_b = bundle.boards[:, :3, :3], bundle.boards[:, :3, 3]
    turned = np.einsum("mij,mj->mi", R_b[seen.board], seen.points)
    world = turned + t_b[seen.board]
    values, rows, cols = list[Array](), list[NDArray[np.int64]](), list[NDArray[np.int64]]()

    def put(which: NDArray[np.int64], first: NDArray[np.int64], block: Array) -> None:
        """Derivatives (m, 2, p) of observations `which` with respect to columns that begin at `first`."""
        good = first >= 0
        if good.any():
            r = 2 * which[good, None, None] + np.arange(2)[None, :, None]
            c = first[good, None, None] + np.arange(block.shape[2])
            shape = (int(good.sum()), 2, block.shape[2])
            values.append(block[good].ravel())
            rows.append(np.broadcast_to(r, shape).ravel())
            cols.append(np.broadcast_to(c, shape).ravel())

    for n, camera in enumerate(bundle.cameras):
        which = np.flatnonzero(seen.camera == n)
        if not len(which):
            continue
        R, t = camera.T_camera_world[:3, :3], camera.T_camera_world[:3, 3]
        rotated = world[which] @ R.T
        points = rotated + t
        if (points[:, 2] < 1e-6).any():
            return out, csr_array((2 * M, columns.total))
        pixels, by_point, by_lens = projected(camera, points)
        out[which] = seen.pixels[which] - pixels - bundle.delays[n] * -seen.velocities[which]
        same = np.full(len(which), 0)
        put(which, same + columns.places[n], np.concatenate([by_point @ -_cross(rotated), by_point], axis=2))
        by_world = by_point @ R
        put(which, columns.boards[seen.board[which]], np.concatenate([by_world @ -_cross(turned[which]), by_world], axis=2))
        put(which, same + columns.delays[n], -seen.velocities[which][:, :, None])
        put(which, same + columns.lenses[n], by_lens[:, :, columns.coefficients[n]])
    if not columns.total:
        return out, csr_array((2 * M, 0))
    table = csr_array((np.concatenate(values), (np.concatenate(rows), np.concatenate(cols))), shape=(2 * M, columns.total))
    return out, table


def projected(camera: Camera, points: Array) -> tuple[Array, Array, Array]:
    """Pixels (M, 2) of points (M, 3) in the camera's frame, and their derivatives by the points (M, 2, 3) and by fx, fy, cx, cy and the
    coefficients of distortion (M, 2, 4 + K)."""
    import cv2

    zero = np.zeros(3)
    flat = np.ascontiguousarray(points, float).reshape(-1, 1, 3)
    if camera.fisheye:
        pixels, table = cv2.fisheye.projectPoints(flat, zero, zero, camera.matrix, camera.distortion)
        order = [*range(8)], slice(11, 14)  # f, c, k, rotation, translation, skew
    else:
        pixels, table = cv2.projectPoints(flat, zero, zero, camera.matrix, camera.distortion)
        order = [*range(6, 10 + camera.distortion.size)], slice(3, 6)  # rotation, translation, f, c, k
    table = np.asarray(table, float).reshape(len(points), 2, -1)
    return np.asarray(pixels, float).reshape(-1, 2), table[:, :, order[1]], table[:, :, order[0]]


def _moved(bundle: Bundle, step: Array, columns: _Columns) -> Bundle:
    cameras, boards, delays = list(bundle.cameras), bundle.boards.copy(), bundle.delays.copy()
    for n, camera in enumerate(cameras):
        if (k := columns.places[n]) >= 0:
            cameras[n] = replace(camera, T_camera_world=_pushed(camera.T_camera_world, step[k : k + 6]))
        if (k := columns.delays[n]) >= 0:
            delays[n] += step[k]
        if (k := columns.lenses[n]) >= 0:
            which = columns.coefficients[n]
            delta = np.zeros(4 + camera.distortion.size)
            delta[which] = step[k : k + len(which)]
            matrix = camera.matrix.copy()
            matrix[[0, 1, 0, 1], [0, 1, 2, 2]] += delta[:4]
            if matrix[0, 0] > 0 and matrix[1, 1] > 0:
                cameras[n] = replace(cameras[n], matrix=matrix, distortion=camera.distortion + delta[4:])
    for b in np.flatnonzero(columns.boards >= 0):
        k = columns.boards[b]
        boards[b] = _pushed(boards[b], step[k : k + 6])
    return Bundle(tuple(cameras), boards, delays)


def _pushed(T: Array, step: Array) -> Array:
    return rigid(rotation_from_vector(step[:3]) @ T[:3, :3], T[:3, 3] + step[3:])


def _cross(vectors: Array) -> Array:
    """Matrices (M, 3, 3) of the cross products with vectors (M, 3)."""
    out = np.zeros((len(vectors), 3, 3))
    x, y, z = vectors.T
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -z, y, -x
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = z, -y, x
    return out


def _scale(residuals: Array) -> float:
    """Robust standard deviation of a component: from the median length, which for a normal law is 1.1774 of them."""
    return max(float(np.median(np.linalg.norm(residuals, axis=1))) / 1.1774, LEAST_SCALE)


def _cost(residuals: Array, scale: float) -> float:
    size = np.linalg.norm(residuals, axis=1) / scale
    return float(np.where(size <= HUBER, size**2, 2 * HUBER * size - HUBER**2).sum())


def _normal(jacobian: csr_array, residuals: Array, scale: float) -> tuple[csc_array, Array]:
    size = np.linalg.norm(residuals, axis=1) / scale
    weights = np.repeat(np.where(size <= HUBER, 1.0, HUBER / np.maximum(size, 1e-12)), 2) / scale**2
    weighted = jacobian.multiply(weights[:, None])
    return (weighted.T @ jacobian).tocsc(), np.asarray(weighted.T @ residuals.ravel(), float)


def _covariance(H: csc_array, columns: _Columns) -> Array:
    """Covariance of the columns that are not boards', which are taken out (Schur's complement); immense where the observations say
    nothing. Eigenvalues below what rounding leaves, negative ones among them, count as that much: such directions are unknown, not sure.
    """
    first, rounding = columns.shared, columns.total * float(np.finfo(float).eps)
    S = H[:first, :first].toarray()
    size = np.sqrt(S.diagonal())  # each column in units of its own, before the boards are taken out: rounding is relative to that
    size[size == 0] = 1
    try:
        if first < columns.total:
            S = S - H[:first, first:] @ splu(H[first:, first:]).solve(H[first:, :first].toarray())
        values, vectors = np.linalg.eigh(S / np.outer(size, size))
    except (RuntimeError, np.linalg.LinAlgError):  # singular
        return np.eye(first) / rounding
    spread = vectors / size[:, None]
    return np.asarray(spread / np.maximum(values, rounding) @ spread.T, float)
