"""What the cameras of a frame set see of one person's landmarks: a ray to each keypoint, and how far off it may be."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.geometry import Array, unit
from shadowpuppet.tracking.keypoints.definitions import Landmarks

SCALE = 0.009
"""Scale (m) of a detector's errors across the view, beside a landmark's definition: of MediaPipe on a made film, Student-t."""
OUTLYING, DOUBTED = 0.02, 0.6
"""Probability that a keypoint of confidence 1 is on something else, as another person's or behind the body; and how much greater it is at
confidence 0."""

NEAR = 0.1
"""Distance (m) from a body's landmark to a ray that leads to it: four scales at a distance of 4 m."""


class Sights(NamedTuple):
    """M rays to landmarks of one person, world, metres."""

    origins: Array
    """The cameras' centres, of shape (M, 3)."""
    rays: Array
    """Unit vectors, of shape (M, 3)."""
    across: Array
    """Two unit vectors at right angles to each ray and to each other, of shape (M, 2, 3)."""
    landmarks: NDArray[np.int64]
    """Index among the body's `Landmarks`, of shape (M,)."""
    cameras: NDArray[np.int64]
    """Index of the camera, of shape (M,)."""
    squares: Array
    """Squared scale of the distance from ray to landmark, of shape (M,)."""
    outlying: Array
    """Probability that the ray leads to something else, of shape (M,)."""

    def without(self, camera: int) -> Sights:
        """Those of the other cameras."""
        return self.only(self.cameras != camera)

    def only(self, chosen: NDArray[np.bool_]) -> Sights:
        """Those chosen, (M,)."""
        return Sights(self.origins[chosen], self.rays[chosen], self.across[chosen], self.landmarks[chosen], self.cameras[chosen],
                      self.squares[chosen], self.outlying[chosen])

    def squares_from(self, points: Array, landmarks: Landmarks) -> Array:
        """Squared distances (M,) of the rays from places (K, 3) of the landmarks, each from the nearer of both sides'."""
        places = points[np.stack([self.landmarks, landmarks.mirrored[self.landmarks]])] - self.origins
        return (np.einsum("smi,mji->smj", places, self.across) ** 2).sum(2).min(0)

    def support(self, points: Array, landmarks: Landmarks) -> float:
        """Share of the keypoints, by their confidence, that lie near landmarks at places (K, 3), on whichever side; NaN without any."""
        sure = 1 - self.outlying
        return float((sure * (self.squares_from(points, landmarks) < NEAR**2)).sum() / sure.sum()) if len(sure) else np.nan

    @property
    def size(self) -> int:
        """Number of cameras up to the last one with a ray."""
        return int(self.cameras.max(initial=-1)) + 1


NO_SIGHTS = Sights(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros((0, 2, 3)), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0),
                   np.zeros(0))
"""Without keypoints."""


def sights_of(cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None], people: Sequence[int | None], landmarks: Landmarks,
              middle: Array) -> Sights:
    """The rays to one person: in each camera's keypoints, pixels of its pictures, the person of an index, None for none. `middle` (3,):
    about where that person is. Keypoints outside a picture are guesses of the detector and are left out."""
    found = list[Sights]()
    for n, (camera, each, person) in enumerate(zip(cameras, keypoints, people)):
        if each is None or person is None:
            continue
        known = [(each.names.index(name), k) for k, name in enumerate(landmarks.names) if name in each.names]
        columns, rows = (np.array(values, np.int64) for values in zip(*known)) if known else np.zeros((2, 0), np.int64)
        xy, confidence = each.xy[person, columns], each.confidence[person, columns].clip(0, 1)
        inside = is_inside(camera, xy) & (confidence > 0)
        rows, xy, confidence = rows[inside], xy[inside], confidence[inside]
        rays, number = unit(camera.rays(xy) @ camera.T_camera_world[:3, :3]), len(rows)
        pixel = float(np.linalg.norm(middle - camera.centre)) / float(camera.matrix[0, 0])
        squares = (SCALE**2 + landmarks.deviations[rows] ** 2 + pixel**2) * (3 - 2 * confidence) ** 2
        found.append(Sights(np.repeat(camera.centre[None], number, 0), rays, _across(rays), rows, np.full(number, n), squares,
                            OUTLYING + DOUBTED * (1 - confidence)))
    return Sights(*map(np.concatenate, zip(*found, strict=True))) if found else NO_SIGHTS


def is_inside(camera: Camera, xy: Array) -> NDArray[np.bool_]:
    """Whether pixels (..., 2) are in a camera's picture; those that are not known are not."""
    return np.asarray(((xy > -0.5) & (xy < np.array(camera.size) - 0.5)).all(-1))


def _across(rays: Array) -> Array:
    """Two unit vectors (M, 2, 3) at right angles to unit vectors (M, 3) and to each other."""
    one = unit(np.cross(rays, np.eye(3)[np.abs(rays).argmin(1)]))
    return np.stack([one, np.cross(rays, one)], 1)
