"""Rotation of a camera since it was calibrated, and its displacement, estimated from the silhouettes of all cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shadowpuppet.calibration.silhouettes import Row
from shadowpuppet.calibration.solve.tangency_bundle import hulls_of, pairs_of, place_by_outlines, signed_distances
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array, rigid, rotation_from_vector, vector_from_rotation
from shadowpuppet.io.intervals import HALF_WIDTH

PUSHED_ANGLE, PUSHED_PLACE = np.radians(10.0), 0.15
"""Standard deviations of a pushed tripod's rotation (rad) and displacement (m) along each axis."""
OUTLIER_PIXELS = 1.0
"""Scale (pixels) of the soft L1 loss: some tangents belong to a limb that is missing in a silhouette."""
NUDGE = 1e-4
"""Step of numerical derivatives, rad."""
SHARED_PIXELS, SHARED_WEIGHT, HIDDEN, PUSHED_FACTOR = 0.6, 4.0, 5.0, 3.0
"""Standard deviation, pixels, of the error that all silhouettes of a camera share on one side, and how many measured ones that counts for;
factor on the squares of those, as half of the others' errors turns the camera along and is not seen; factor on the standard deviations of a
pushed tripod's rotation. Chosen on made faults (benchmarks/coverage_of_check.py)."""


@dataclass(frozen=True, kw_only=True)
class RotationError:
    """A camera's rotation since its calibration, and how much better the tangents agree with it; plain values."""

    right: float
    down: float
    clockwise: float
    """Rotation vector of the camera, degrees: to its right, down, and about its axis as seen from behind."""
    before: float
    after: float
    """Median distance of its tangents from the others', pixels, as calibrated and as rotated."""
    spread: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Half-widths of the 90 % intervals of `right`, `down` and `clockwise`, degrees: from how parts of the film differ, and from errors
    that all outlines of a camera share."""
    moved: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Displacement of its centre in the world, metres."""

    @property
    def degrees(self) -> float:
        """Angle of the whole rotation, degrees."""
        return float(np.linalg.norm([self.right, self.down, self.clockwise]))

    @property
    def certain(self) -> bool:
        """Whether any of the rotations is beyond its interval."""
        return any(abs(value) > width for value, width in zip((self.right, self.down, self.clockwise), self.spread))

    @property
    def distance(self) -> float:
        """Length of the displacement, metres."""
        return float(np.linalg.norm(self.moved))

    def of(self, camera: Camera) -> Camera:
        """The camera with this rotation and displacement applied."""
        turned = _rotated(camera, np.radians([self.down, -self.right, -self.clockwise]))
        R = turned.T_camera_world[:3, :3]
        return replace(turned, T_camera_world=rigid(R, -R @ (camera.centre + self.moved)))


def estimate_rotation_error(cameras: Sequence[Camera], rows: Sequence[Row], n: int) -> RotationError | None:
    """The rotation of camera `n` that brings its silhouettes' tangents nearest to the others'; None with fewer than two others.

    Its position is assumed to be correct: for a camera that was moved, the rotation is the one that explains the move best.
    """
    from scipy.optimize import least_squares

    hulls = [hulls_of(camera, [row[k] for row in rows]) for k, camera in enumerate(cameras)]
    pairs = [pair for pair in pairs_of(hulls) if n in pair[:2]]
    if len(pairs) < 2:
        return None

    def distances(vector: Array) -> Array:
        """Of tangents by set, pair of cameras and side, of shape (F, K, 2), pixels."""
        turned = [_rotated(camera, vector) if k == n else camera for k, camera in enumerate(cameras)]
        values = np.full((len(rows), len(pairs), 2), np.nan)
        for k, pair in enumerate(pairs):
            values[pair.sets, k] = signed_distances(turned, hulls, pair)
        return values

    start = distances(np.zeros(3))
    if np.isfinite(start).sum() < 3:
        return None
    best = least_squares(lambda v: np.nan_to_num(distances(v), nan=0.0).ravel(), np.zeros(3), loss="soft_l1",
                         f_scale=OUTLIER_PIXELS, x_scale=0.02, diff_step=1e-3, max_nfev=40).x
    left = distances(best)
    slopes = np.stack([(distances(best + step) - left) / NUDGE for step in NUDGE * np.eye(3)], -1)
    return _error_of(best, np.zeros(3), np.nanmedian(np.abs(start)), np.nanmedian(np.abs(left)), _half_widths(left, slopes))


def _half_widths(left: Array, slopes: Array) -> Array:
    """Half-widths (3,) of the 90 % intervals of a rotation vector, rad, from the distances (F sets, K cameras, 2 sides) that it leaves,
    pixels, and their slopes (F, K, 2, 3).

    A "sandwich": the pull of each set differs, as far as silhouettes err by chance; and each side of each other camera may err in all sets
    alike, as silhouettes and the other cameras' places do. How far, the means over sets tell, which a rotation alone would leave at 0.
    """
    from scipy.stats import t

    known = np.isfinite(left) & np.isfinite(slopes).all(-1)
    r, J = np.where(known, left, 0.0), np.where(known[..., None], slopes, 0.0)
    weighted = J * (known / np.sqrt(1 + (r / OUTLIER_PIXELS) ** 2))[..., None]
    H = np.einsum("fksa,fksb->ab", weighted, J)
    pulls, shared = np.einsum("fksa,fks->fa", weighted, r), weighted.sum(0).reshape(-1, 3)
    sets = int(known.any((1, 2)).sum())
    if sets < 2 or np.linalg.matrix_rank(H, tol=1e-9 * max(float(np.trace(H)), 1e-12)) < 3:
        return np.full(3, np.inf)
    seen = known.any(0)
    means = r.sum(0)[seen] / known.sum(0)[seen]
    freedom = SHARED_WEIGHT + max(len(means) - 3, 0)
    alike = (SHARED_WEIGHT * SHARED_PIXELS**2 + HIDDEN * float(means @ means)) / freedom
    spread = pulls.T @ pulls * sets / (sets - 1) + alike * shared.T @ shared
    inverse = np.linalg.inv(H)
    return float(t.ppf(0.95, freedom)) * np.sqrt(np.diag(inverse @ spread @ inverse))


def estimate_place_error(cameras: Sequence[Camera], rows: Sequence[Row], n: int) -> RotationError | None:
    """The rotation and displacement of camera `n`, as of a tripod that was pushed, that bring its tangents nearest to the others'; None
    with too few tangents, or fewer than two others."""
    if len(cameras) < 3:
        return None
    try:
        fit = place_by_outlines(cameras, rows, [n], rough=(PUSHED_ANGLE, PUSHED_PLACE))
    except CalibrationError:
        return None
    before, now = cameras[n], fit.cameras[n]
    turn = vector_from_rotation(now.T_camera_world[:3, :3] @ before.T_camera_world[:3, :3].T)
    return _error_of(turn, now.centre - before.centre, fit.before[n], fit.after[n], HALF_WIDTH * PUSHED_FACTOR * fit.turn_sd[n])


def _error_of(turn: Array, moved: Array, before: float, after: float, widths: Array) -> RotationError:
    """Of a rotation vector (3,) along a camera's axes, rad, with half-widths (3,), and a displacement (3,), metres."""
    (x, y, z), (dx, dy, dz), (by_x, by_y, by_z) = np.degrees(turn).tolist(), moved.tolist(), np.degrees(widths).tolist()
    return RotationError(right=-y, down=x, clockwise=-z, spread=(by_y, by_x, by_z), moved=(dx, dy, dz), before=float(before),
                         after=float(after))


def _rotated(camera: Camera, vector: Array) -> Camera:
    return replace(camera, T_camera_world=rigid(rotation_from_vector(vector), np.zeros(3)) @ camera.T_camera_world)
