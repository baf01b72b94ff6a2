"""The camera: OpenCV's pinhole or fisheye model with distortion, and its pose in the world."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array, inverse, rigid, transform

MAX_DISTORTION = 1e6
"""Bound of plausible distortion coefficients."""
REACH_STEPS = 1000
"""Angles off the optical axis at which a lens' formula is checked."""
AT_ONCE = 4096
"""Points that OpenCV projects at once: it also makes 30 derivatives of each, which for many points take longer to store than to compute."""


@dataclass(frozen=True, eq=False)
class Camera:
    """A calibrated camera. Axes follow OpenCV: x right, y down, z forward; pixel centres are at integers. Raises `CalibrationError`,
    naming the camera and the field, for impossible values."""

    name: str
    size: tuple[int, int]
    """Width and height, pixels."""
    matrix: Array
    """Intrinsics, of shape (3, 3), pixels."""
    distortion: Array = field(default_factory=lambda: np.zeros(4))
    """k1 k2 p1 p2 [k3 [k4 k5 k6]] of OpenCV's model, of shape (4,), (5,) or (8,); k1..k4 of its fisheye model."""
    T_camera_world: Array = field(default_factory=lambda: np.eye(4))
    """World to camera, of shape (4, 4), metres: X_camera = R X_world + t."""
    fisheye: bool = False
    oriented: bool = True
    """Whether `T_camera_world` was measured; False if only the field of view is known (`from_fov`)."""

    def __post_init__(self) -> None:
        """Check every field and convert it to its shape."""
        numbers, check = self._numbers, self._check
        size = numbers("size", self.size, (2,))
        check(bool((size >= 1).all() and (size % 1 == 0).all()), "size", size.tolist(), "two positive whole numbers of pixels")
        matrix = numbers("matrix", self.matrix, (3, 3))
        check(matrix[0, 0] > 0 and matrix[1, 1] > 0, "matrix", np.diag(matrix)[:2].tolist(), "positive focal lengths")
        skew = [float(matrix[0, 1]), float(matrix[1, 0])]
        check(max(map(abs, skew)) < 1e-6 * matrix[0, 0], "matrix", f"skew {skew}", "none (OpenCV's model has no skew)")
        check(bool(np.allclose(matrix[2], [0, 0, 1])), "matrix", matrix[2].tolist(), "a last row of 0 0 1")
        distortion = numbers("distortions", self.distortion)
        allowed = (4,) if self.fisheye else (0, 4, 5, 8)
        check(distortion.size in allowed, "distortions", f"{distortion.size} numbers", " or ".join(map(str, allowed)))
        check(bool((np.abs(distortion) < MAX_DISTORTION).all()), "distortions", distortion.tolist(), f"numbers under {MAX_DISTORTION:g}")
        distortion = distortion if self.fisheye else np.pad(distortion, (0, 8 - distortion.size))
        T = numbers("rotation and translation", self.T_camera_world, (4, 4))
        R = T[:3, :3]
        turns = bool((np.abs(R) < 2).all()) and np.allclose(R @ R.T, np.eye(3), atol=1e-4) and np.linalg.det(R) > 0
        check(turns, "rotation", np.round(R, 4).tolist(), "an orthonormal, right-handed matrix")
        values = {"size": (int(size[0]), int(size[1])), "matrix": matrix, "distortion": distortion, "T_camera_world": T}
        for name, value in values.items():
            object.__setattr__(self, name, value)

    def _check(self, good: bool, what: str, found: object, expected: str) -> None:
        if not good:
            raise CalibrationError(f"camera {self.name!r}: {what}: found {found}, expected {expected}")

    def _numbers(self, what: str, value: object, shape: tuple[int, ...] | None = None) -> Array:
        expected = f"{' x '.join(map(str, shape))} finite numbers" if shape else "finite numbers"
        try:
            array = np.array(value, float)
        except (TypeError, ValueError, OverflowError):
            self._check(False, what, repr(value), expected)
            raise
        array = array if shape else array.ravel()
        self._check(array.shape == (shape or array.shape) and bool(np.isfinite(array).all()), what, array.tolist(), expected)
        return array

    @property
    def fov(self) -> float:
        """Horizontal field of view, rad, without lens distortion."""
        return float(2 * np.arctan(self.size[0] / 2 / self.matrix[0, 0]))

    @property
    def lens_measured(self) -> bool:
        """Whether more of the lens is known than its field of view: distortion, or a centre beside the picture's (`from_fov`)."""
        return bool(np.any(self.distortion)) or not np.allclose(self.matrix[:2, 2], (np.array(self.size) - 1) / 2)

    @classmethod
    def from_fov(cls, size: tuple[int, int], fov: float, name: str = "cam", pixel: float = 1.0) -> Camera:
        """A level camera at the world's origin, known only by its horizontal field of view (radians) and the width of its pixels over their
        height. The world is the camera's own: x to its right, y along the optical axis, z up."""
        if not 0 < fov < np.pi:
            raise CalibrationError(f"camera {name!r}: fov: found {np.degrees(fov):g} degrees, expected between 0 and 180")
        focal = size[0] / (2 * np.tan(fov / 2))
        matrix = np.array([[focal, 0, (size[0] - 1) / 2], [0, focal * pixel, (size[1] - 1) / 2], [0, 0, 1]])
        level = rigid([[1, 0, 0], [0, 0, -1], [0, 1, 0]], np.zeros(3))
        return cls(name, size, matrix, T_camera_world=level, oriented=False)

    @property
    def centre(self) -> Array:
        """The camera's position in the world, of shape (3,), metres."""
        return inverse(self.T_camera_world)[:3, 3]

    def project(self, points_world: ArrayLike) -> Array:
        """Pixels (..., 2) of world points (..., 3); not a number for points at or behind the camera. Points beyond the lens's `reach`
        are extrapolated in proportion, as in `projection`: distortion polynomials, fitted inside the picture, turn back there and would
        map points far outside into it."""
        points = transform(self.T_camera_world, points_world)
        flat = points.reshape(-1, 3)
        ahead = flat[:, 2] > 1e-9
        seen = flat if ahead.all() else flat[ahead]
        pixels = self._extended(seen[:, :2] / seen[:, 2:])
        if seen is not flat:
            everywhere = np.full((len(flat), 2), np.nan)
            everywhere[ahead] = pixels
            pixels = everywhere
        return pixels.reshape(*points.shape[:-1], 2)

    def _extended(self, xy: Array) -> Array:
        """Pixels (N, 2) of points (N, 2) on the plane z = 1, extrapolated beyond the `reach`."""
        if not np.isfinite(self.reach):
            return self._bent(xy)
        beyond = np.maximum(np.linalg.norm(xy, axis=1, keepdims=True) / self.reach, 1.0)
        within, centre = self._bent(xy / beyond), self.matrix[:2, 2]
        return np.where(beyond > 1, (within - centre) * beyond + centre, within)

    def _bent(self, xy: Array) -> Array:
        """Pixels (N, 2) of points (N, 2) on the plane z = 1, by OpenCV's formulas without bounds."""
        import cv2

        if not len(xy):
            return np.zeros((0, 2))  # OpenCV refuses none
        points, still = np.concatenate([xy, np.ones((len(xy), 1))], 1)[:, None], np.zeros(3)
        project = cv2.fisheye.projectPoints if self.fisheye else cv2.projectPoints
        parts = (points[n : n + AT_ONCE] for n in range(0, len(points), AT_ONCE))
        pixels = [np.asarray(project(part, still, still, self.matrix, self.distortion)[0], float).reshape(-1, 2) for part in parts]
        return np.concatenate(pixels)

    @cached_property
    def reach(self) -> float:
        """Radius on the plane z = 1 up to which the lens' formula increases; infinite if it does everywhere."""
        if not (self.fisheye or self.distortion.any()):
            return np.inf
        radii = np.tan(np.arange(REACH_STEPS) * np.pi / 2 / REACH_STEPS)
        outward = np.diff(self._bent(np.stack([radii, np.zeros(REACH_STEPS)], 1))[:, 0]) > 0
        return np.inf if outward.all() else float(radii[max(int(np.argmin(outward)), 1)])

    def rays(self, pixels: ArrayLike) -> Array:
        """Directions (..., 3) in the camera's frame, z = 1, of pixels (..., 2): the inverse of `project` up to depth."""
        import cv2

        pixels = np.ascontiguousarray(pixels, float)  # OpenCV's fisheye reads others wrongly
        flat = pixels.reshape(-1, 1, 2)
        if not flat.size:
            return np.zeros((*pixels.shape[:-1], 3))
        if self.fisheye:
            xy = cv2.fisheye.undistortPoints(flat, self.matrix, self.distortion)
        else:
            stop = (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 100, 1e-12)
            undistort = getattr(cv2, "undistortPointsIter", cv2.undistortPoints)  # OpenCV 4's name, and 5's
            xy = undistort(flat, self.matrix, self.distortion, R=None, P=None, criteria=stop)
        xy = np.asarray(xy, float).reshape(-1, 2)
        return np.concatenate([xy, np.ones((len(xy), 1))], 1).reshape(*pixels.shape[:-1], 3)

    def thinned(self, step: int) -> Camera:
        """The camera of pictures that keep every `step`-th pixel of every `step`-th row."""
        width, height = self.size
        return replace(self, size=(-(-width // step), -(-height // step)), matrix=np.diag([1 / step, 1 / step, 1.0]) @ self.matrix)

    def resized(self, size: tuple[int, int]) -> Camera:
        """The same camera for pictures scaled to `size` (pixel centres stay at integers, so the principal point moves by halves)."""
        sx, sy = size[0] / self.size[0], size[1] / self.size[1]
        matrix = self.matrix.copy()
        matrix[0] *= sx
        matrix[1] *= sy
        matrix[0, 2] += (sx - 1) / 2
        matrix[1, 2] += (sy - 1) / 2
        return replace(self, size=(int(size[0]), int(size[1])), matrix=matrix)
