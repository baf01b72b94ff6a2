"""Points from the rays of several cameras to them, with weights; a camera that contradicts the others does not count."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, unit

ANGLE = 0.02
"""Angle (rad) between a camera's ray and the joint within which both agree: 1.3 cm at the distance of an arm's length, 8 cm at 4 m."""
ROUNDS = 10
"""Number of weighted solutions after the best pair of cameras."""


def triangulated(cameras: Sequence[Camera], pixels: Array, weights: Array) -> Array:
    """Points (..., 3), world, metres, seen at pixels (C, ..., 2) with weights (C, ...), 0 where unseen; as `meeting_points`."""
    centres = np.array([camera.centre for camera in cameras])
    rays = np.stack([unit(camera.rays(np.nan_to_num(seen)) @ camera.T_camera_world[:3, :3]) for camera, seen in zip(cameras, pixels)])
    return meeting_points(centres, rays, weights)


def meeting_points(centres: Array, rays: Array, weights: Array) -> Array:
    """Points (..., 3) at which rays (C, ..., 3), unit vectors from centres (C, 3), meet, with weights (C, ...); not a number where fewer
    than two have weight.

    Begins with the two cameras' point that most cameras agree with, each by its weight and its angle over `ANGLE`; then weighted least
    squares, in which a ray that is far off does not count (Geman and McClure's weights).
    """
    best, least = np.full((*weights.shape[1:], 3), np.nan), np.full(weights.shape[1:], np.inf)
    for pair in map(list, combinations(range(len(centres)), 2)):
        point = _solved(centres[pair], rays[pair], np.ones_like(weights[pair]))
        squares = _angles(point, centres, rays) ** 2
        cost = (weights * squares / (squares + ANGLE**2)).sum(0)
        better = (weights[pair] > 0).all(0) & (cost < least)
        best[better], least[better] = point[better], cost[better]
    known = np.isfinite(least)
    rays, weights, point = rays[:, known], weights[:, known], best[known]
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
