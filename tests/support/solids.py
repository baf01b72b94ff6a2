"""Solids with exact silhouettes: a pixel is set if its ray hits a solid, without contours or projected surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array, rigid


@dataclass(frozen=True)
class Ellipsoid:
    centre: tuple[float, float, float]
    radii: tuple[float, float, float]

    def hit(self, origin: Array, directions: Array) -> Mask:
        o, d = (origin - self.centre) / self.radii, directions / self.radii
        return (d @ o) ** 2 - (d * d).sum(-1) * (o @ o - 1) > 0

    def holds(self, points: Array) -> Mask:
        return (((points - self.centre) / self.radii) ** 2).sum(-1) <= 1

    def distance(self, points: Array) -> Array:
        """Signed distance to the surface, m: first order, exact for a sphere."""
        q = (points - self.centre) / self.radii
        size = np.linalg.norm(q, axis=-1)
        return (size - 1) * size / np.linalg.norm(q / self.radii, axis=-1)

    def normals(self, points: Array) -> Array:
        n = (points - self.centre) / np.square(self.radii)
        return n / np.linalg.norm(n, axis=-1, keepdims=True)

    def samples(self, rng: np.random.Generator, count: int) -> Array:
        v = rng.normal(size=(count, 3))
        return self.centre + self.radii * v / np.linalg.norm(v, axis=1, keepdims=True)


@dataclass(frozen=True)
class Box:
    centre: tuple[float, float, float]
    halves: tuple[float, float, float]

    def hit(self, origin: Array, directions: Array) -> Mask:
        with np.errstate(divide="ignore"):
            a, b = ((np.array(self.centre) + sign * np.array(self.halves) - origin) / directions for sign in (-1, 1))
        near, far = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
        return (near < far) & (far > 0)

    def distance(self, points: Array) -> Array:
        q = np.abs(points - self.centre) - self.halves
        return np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(-1), 0)

    def samples(self, rng: np.random.Generator, count: int) -> Array:
        v = rng.uniform(-1, 1, (count, 3))
        face = rng.integers(0, 3, count)
        v[np.arange(count), face] = np.sign(v[np.arange(count), face])
        return np.array(self.centre) + self.halves * v


def looking(place: ArrayLike, at: ArrayLike = (0, 0, 0), size: tuple[int, int] = (320, 240), focal: float = 280.0,
            distortion: Sequence[float] = (), fisheye: bool = False, name: str = "cam") -> Camera:
    """A level camera at a position (3,), looking at another, metres, world Z up."""
    place = np.asarray(place, float)
    z = np.asarray(at, float) - place
    z /= np.linalg.norm(z)
    x = np.cross(z, (0, 0, 1) if abs(z[2]) < 0.99 else (0, 1, 0))
    x /= np.linalg.norm(x)
    R = np.stack([x, np.cross(z, x), z])
    matrix = np.array([[focal, 0, (size[0] - 1) / 2 + 3.3], [0, focal, (size[1] - 1) / 2 - 2.1], [0, 0, 1]])
    return Camera(name, size, matrix, np.array([*distortion] or np.zeros(4)), rigid(R, -R @ place), fisheye)


def ring(count: int, radius: float = 2.5, height: float = 0.5, turn: float = 0.3, **more) -> list[Camera]:
    """Cameras around the origin, alternating between higher and lower."""
    angles = turn + np.arange(count) * 2 * np.pi / count
    places = [(radius * np.cos(a), radius * np.sin(a), height * (1 + k % 2)) for k, a in enumerate(angles)]
    return [looking(place, name=f"cam{k + 1}", **more) for k, place in enumerate(places)]


def seen_by(camera: Camera, solids: Sequence[Ellipsoid | Box]) -> Mask:
    """The exact silhouette (H, W)."""
    y, x = np.mgrid[: camera.size[1], : camera.size[0]]
    rays = camera.rays(np.stack([x, y], -1)) @ camera.T_camera_world[:3, :3]
    return np.any([solid.hit(camera.centre, rays) for solid in solids], 0)


def masks_of(cameras: Sequence[Camera], *solids: Ellipsoid | Box) -> list[Mask]:
    return [seen_by(camera, solids) for camera in cameras]

