"""Landmarks of MediaPipe Pose as our joints in the world: of one camera turned, of several triangulated and smoothed."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, unit
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.metrics import LIMB_JOINTS
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.tracking.smoothing.butterworth import filtered

LANDMARKS = dict(zip(LIMB_JOINTS, (11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28)))
"""MediaPipe's number of each joint; its left is the person's."""
SEEN = 0.5
"""Least visibility of a landmark that is used, the middle of its range."""
ANGLE = 0.02
"""Angle (rad) between a camera's ray and the joint within which both agree: 1.3 cm at the distance of an arm's length, 8 cm at 4 m."""
ROUNDS = 10
"""Number of weighted solutions after the best pair of cameras."""
LONGEST_GAP = 0.5
"""Seconds over which an unknown joint is interpolated, as in our own runs."""
CUTOFF = 6.0
"""Cut-off of the smoothing, Hz."""


def one_camera(camera: Camera, times: Array, world: Array) -> JointTable:
    """MediaPipe's own metres (T, 33, 3), which are about the hips along the camera's axes, turned into the world."""
    return JointTable(times, LIMB_JOINTS, world[:, list(LANDMARKS.values())] @ camera.T_camera_world[:3, :3])


def several_cameras(cameras: Sequence[Camera], times: Array, pixels: Array, visibility: Array) -> JointTable:
    """Joints of C cameras' landmarks, pixels (C, T, 33, 2) and visibility (C, T, 33): triangulated, short gaps filled, smoothed."""
    chosen = list(LANDMARKS.values())
    seen = (visibility[..., chosen] >= SEEN) & np.isfinite(pixels[..., chosen, 0])
    points = triangulated(cameras, pixels[:, :, chosen], np.where(seen, visibility[..., chosen], 0.0))
    step = float(np.median(np.diff(times)))
    smooth = filtered(times, points, min(CUTOFF, 0.4 / step))  # below half the frame rate
    for joint, unknown in enumerate(np.isnan(points[..., 0]).T):
        for begin, end in true_runs(unknown):
            if (end - begin) * step > LONGEST_GAP:
                smooth[begin:end, joint] = np.nan
    return JointTable(times, LIMB_JOINTS, smooth)


def triangulated(cameras: Sequence[Camera], pixels: Array, weights: Array) -> Array:
    """Points (..., 3), world, metres, seen at pixels (C, ..., 2) with weights (C, ...), 0 where unseen; not a number where no two cameras
    see them.

    Begins with the two cameras' point that most cameras agree with, each by its weight and its angle over `ANGLE`; then weighted least
    squares, in which a ray that is far off does not count (Geman and McClure's weights).
    """
    centres = np.array([camera.centre for camera in cameras])
    rays = np.stack([unit(camera.rays(np.nan_to_num(seen)) @ camera.T_camera_world[:3, :3]) for camera, seen in zip(cameras, pixels)])
    best, least = np.full((*weights.shape[1:], 3), np.nan), np.full(weights.shape[1:], np.inf)
    for pair in map(list, combinations(range(len(cameras)), 2)):
        point = _solved(centres[pair], rays[pair], np.ones_like(weights[pair]))
        squares = _angles(point, centres, rays) ** 2
        cost = (weights * squares / (squares + ANGLE**2)).sum(0)
        better = (weights[pair] > 0).all(0) & (cost < least)
        best[better], least[better] = point[better], cost[better]
    known = np.isfinite(least)
    centres, rays, weights, point = centres, rays[:, known], weights[:, known], best[known]
    for _ in range(ROUNDS):
        away = np.linalg.norm(point - centres[:, None], axis=-1)
        trust = weights / (1 + (_angles(point, centres, rays) / ANGLE) ** 2) ** 2
        point = _solved(centres, rays, trust / away**2)
    best[known] = point
    return best


def _angles(points: Array, centres: Array, rays: Array) -> Array:
    """Angles (C, ...), rad, between rays (C, ..., 3) from centres (C, 3) and points (..., 3)."""
    towards = points - centres.reshape(len(centres), *[1] * (rays.ndim - 2), 3)
    return np.arctan2(np.linalg.norm(np.cross(towards, rays), axis=-1), (towards * rays).sum(-1))


def _solved(centres: Array, rays: Array, weights: Array) -> Array:
    """Points (..., 3) with the least weighted squares of distances to rays (C, ..., 3) from centres (C, 3)."""
    across = weights[..., None, None] * (np.eye(3) - rays[..., None] * rays[..., None, :])
    shifted = np.einsum("c...ij,cj->...i", across, centres)
    return np.linalg.solve(across.sum(0) + 1e-12 * np.eye(3), shifted[..., None])[..., 0]
