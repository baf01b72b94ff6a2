"""Epipolar tangency: the outermost planes through two camera centres that touch the silhouettes must be the same for both cameras.

After Wong & Cipolla 2001, "Structure and motion from silhouettes". Distances are in pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.silhouettes import Outline, Row, outlines_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, unit

MAX_ANGULAR_EXTENT = 2.6
"""Greatest angle (rad) of a silhouette about the baseline: beyond it, the baseline runs through or along the person."""


def tangent_distances(cameras: Sequence[Camera], rows: Sequence[Row]) -> Array:
    """Median distance (C, C) of the tangents of every two cameras over sets, pixels; NaN where there is none."""
    out = np.full((len(cameras), len(cameras)), np.nan)
    outlines = [outlines_of(cameras, row) for row in rows]
    for i, j in combinations(range(len(cameras)), 2):
        pairs = [(row[i], row[j]) for row in outlines]
        values = np.array([_apart(cameras[i], a, cameras[j], b) for a, b in pairs if a is not None and b is not None]).ravel()
        values = values[np.isfinite(values)]
        out[i, j] = out[j, i] = np.median(values) if len(values) else np.nan
    return out


class Tangents(NamedTuple):
    """The outermost planes through two camera centres that touch their silhouettes."""

    angles: Array
    """Angles about the baseline, of shape (2 cameras, 2 planes), radians; NaN at a picture's border."""
    levers: Array
    """Pixels per radian, of shape (2 planes,)."""
    lever: float
    """Mean of `levers`."""
    reference: Array
    """Direction of angle 0, of shape (3,)."""


def tangent_angles(cameras: tuple[Camera, Camera], outlines: tuple[Outline, Outline], reference: Array | None = None) -> Tangents | None:
    """The `Tangents` of two outlines; None if the cameras stand at one place or a silhouette surrounds the baseline.

    reference: direction (3,) of angle 0; by default the middle of both silhouettes.
    """
    line = cameras[1].centre - cameras[0].centre
    length = float(np.linalg.norm(line))
    if length < 1e-9:
        return None
    line = line / length
    aside = [outline.rays - (outline.rays @ line)[:, None] * line for outline in outlines]
    if reference is None:
        ahead = unit(aside[0].sum(0)) + unit(aside[1].sum(0))
        reference = unit(ahead if np.linalg.norm(ahead) > 1e-6 else aside[0].sum(0))
    angles = [np.arctan2(part @ np.cross(line, reference), part @ reference) for part in aside]
    if max(float(np.ptp(each)) for each in angles) > MAX_ANGULAR_EXTENT:
        return None
    focal = [float(np.diag(camera.matrix)[:2].mean()) for camera in cameras]
    out, levers = np.full((2, 2), np.nan), np.zeros(2)
    for n, pick in enumerate((np.argmin, np.argmax)):
        k = [int(pick(each)) for each in angles]
        levers[n] = float(np.mean([f * np.linalg.norm(part[at]) for f, part, at in zip(focal, aside, k)]))
        out[:, n] = [each[at] if outline.firm[at] else np.nan for each, outline, at in zip(angles, outlines, k)]
    return Tangents(out, levers, float(levers.mean()), reference)


def _apart(first: Camera, a: Outline, second: Camera, b: Outline) -> tuple[float, float]:
    """Distances (pixels) of both pairs of outermost tangents; NaN at the border, or if unknown."""
    found = tangent_angles((first, second), (a, b))
    if found is None:
        return np.nan, np.nan
    low, high = np.abs(found.angles[0] - found.angles[1]) * found.levers
    return float(low), float(high)
