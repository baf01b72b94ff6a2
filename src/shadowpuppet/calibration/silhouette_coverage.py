"""Consistency of silhouettes: every viewing ray of an outline must meet the silhouettes of all other cameras, and by how much it misses.

With three cameras this reveals an error that the tangents of two cannot: a shift along the baseline.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.silhouettes import Outline, Row, outlines_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array

RAYS_PER_OUTLINE, DEPTHS_PER_RAY = 24, 32
"""Number of outline pixels tested, and of places along the ray of each."""
DEPTH_RANGE = 0.3
"""Range of these places in front of and behind the person's middle, over its distance."""
COVERAGE_PERCENTILE = 75
"""Percentile over an outline's rays: a misdirected camera errs along a whole side of it, a limb missing in another camera affects fewer."""


def pixels_beyond(cameras: Sequence[Camera], row: Row) -> Array:
    """Pixels by which the other cameras' silhouettes would have to grow for each camera's outline to fit, in one set.

    Of shape (C, C + 1). Row k: the outline of camera k; column w: without camera w; the last column leaves out no camera. NaN if fewer
    than two other cameras see the person.
    """
    outlines = outlines_of(cameras, row)
    out, middle = np.full((len(cameras), len(cameras) + 1), np.nan), triangulated_centre(cameras, outlines)
    for k, outline in enumerate(outlines):
        firm = np.flatnonzero(outline.firm) if outline is not None else []
        if outline is None or middle is None or len(firm) < RAYS_PER_OUTLINE:
            continue
        rays = outline.rays[firm[np.linspace(0, len(firm) - 1, RAYS_PER_OUTLINE).astype(int)]]
        depth = np.linalg.norm(middle - cameras[k].centre) * np.linspace(1 - DEPTH_RANGE, 1 + DEPTH_RANGE, DEPTHS_PER_RAY)
        places = cameras[k].centre + rays[:, None] * depth[:, None]
        others = {n: other for n, other in enumerate(row) if n != k and other is not None}
        if len(others) > 1:
            away = np.zeros((len(cameras), *places.shape[:2]))  # 0 in a silhouette, and if a camera does not see the place
            for n, other in others.items():
                away[n] = _sampled(other.distance, cameras[n].project(places))
            out[k] = _percentiles(away)
    return out


def triangulated_centre(cameras: Sequence[Camera], outlines: Sequence[Outline | None]) -> Array | None:
    """The point (3,) nearest to the rays through the outlines' middles; None for fewer than two outlines."""
    A, b, count = np.zeros((3, 3)), np.zeros(3), 0
    for camera, outline in zip(cameras, outlines):
        if outline is not None:
            ray = outline.rays.mean(0)
            across = np.eye(3) - np.outer(ray, ray) / (ray @ ray)
            A, b, count = A + across, b + across @ camera.centre, count + 1
    return np.asarray(np.linalg.solve(A, b), float) if count > 1 and np.linalg.cond(A) < 1e9 else None


def _sampled(distance: NDArray[np.float32], pixels: Array) -> Array:
    """Values at the nearest pixels (..., 2); 0 outside the picture, where nothing is known."""
    height, width = distance.shape
    x, y = np.moveaxis(np.rint(np.clip(np.nan_to_num(pixels, nan=-9), -9, 1e6)).astype(int), -1, 0)
    inside = (x >= 0) & (y >= 0) & (x < width) & (y < height)
    return np.where(inside, distance[np.clip(y, 0, height - 1), np.clip(x, 0, width - 1)], 0.0)


def _percentiles(away: Array) -> Array:
    """Percentile over rays (P) of the least over depths (Z) of the greatest distance over cameras (C); of shape (C + 1,).

    away: distances (C, P, Z). Entry w of the result leaves out camera w; the last leaves out none.
    """
    order = np.sort(away, axis=0)
    most, next_most, which = order[-1], order[-2], away.argmax(0)
    without = [np.where(which == n, next_most, most) for n in range(len(away))]
    return np.array([np.percentile(each.min(1), COVERAGE_PERCENTILE) for each in (*without, most)])
