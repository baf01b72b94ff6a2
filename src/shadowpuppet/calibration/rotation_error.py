"""By how much a camera was turned since it was calibrated, as the others' silhouettes have it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shadowpuppet.calibration.epipolar_tangency import tangent_angles
from shadowpuppet.calibration.silhouettes import Outline, Row, outlines_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, rigid, rotation_from_vector

OUTLIER_PIXELS = 1.0
"""Pixels from which on a difference counts less than in proportion (soft L1): some tangents are those of a limb that is missing."""


@dataclass(frozen=True, kw_only=True)
class RotationError:
    """A turn that makes a camera agree better; plain values."""

    right: float
    down: float
    clockwise: float
    """By how many degrees the camera was turned to its right, down, and about its axis as seen from behind: a rotation vector."""
    before: float
    after: float
    """Pixels, median, between its tangents and the others', as calibrated and turned."""

    @property
    def degrees(self) -> float:
        """In all."""
        return float(np.linalg.norm([self.right, self.down, self.clockwise]))

    def of(self, camera: Camera) -> Camera:
        """The camera as it stands now."""
        return _rotated(camera, np.radians([self.down, -self.right, -self.clockwise]))


def estimate_rotation_error(cameras: Sequence[Camera], rows: Sequence[Row], n: int) -> RotationError | None:
    """The turn of camera `n` that brings its silhouettes' tangents nearest to the others', over sets of masks (H, W) by camera.

    None where there are not two others to tell it by. Its place is taken as right: a camera that was carried off is found to be turned
    by what comes nearest.
    """
    from scipy.optimize import least_squares

    outlines = [outlines_of(cameras, row) for row in rows]
    others = [k for k in range(len(cameras)) if k != n and any(row[n] is not None and row[k] is not None for row in outlines)]
    if len(others) < 2:
        return None

    def off(vector: Array) -> Array:
        camera, values = _rotated(cameras[n], vector), list[float]()
        for row in outlines:
            for k in others:
                own, other, found = row[n], row[k], None
                if own is not None and other is not None:
                    found = tangent_angles((camera, cameras[k]), (_rotated_outline(own, cameras[n], camera), other))
                values += [np.nan] * 2 if found is None else ((found.angles[0] - found.angles[1]) * found.levers).tolist()
        return np.array(values)

    start = off(np.zeros(3))
    if np.isfinite(start).sum() < 3:
        return None
    best = least_squares(lambda v: np.nan_to_num(off(v), nan=0.0), np.zeros(3), loss="soft_l1",
                         f_scale=OUTLIER_PIXELS, x_scale=0.02, diff_step=1e-3, max_nfev=40).x
    x, y, z = np.degrees(best)
    return RotationError(right=float(-y), down=float(x), clockwise=float(-z), before=float(np.nanmedian(np.abs(start))),
                after=float(np.nanmedian(np.abs(off(best)))))


def _rotated_outline(outline: Outline, before: Camera, after: Camera) -> Outline:
    """What a camera sees, once it is known to be turned."""
    return outline._replace(rays=outline.rays @ before.T_camera_world[:3, :3].T @ after.T_camera_world[:3, :3])


def _rotated(camera: Camera, vector: Array) -> Camera:
    return replace(camera, T_camera_world=rigid(rotation_from_vector(vector), np.zeros(3)) @ camera.T_camera_world)
