"""Cameras, bodies, pictures and poses that the tests of the core share."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.body.models import MODELS
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import Picture, place, polygon_bits
from shadowpuppet.geometry import Array

BODIES = {name: model.make for name, model in MODELS.items() if model.sizes is CardboxSizes}
"""Upper bodies."""
SIZES = sizes_from_height(1.75)
LENSES = {
    "pinhole": {},
    "distorted": {"distortion": [-0.09, 0.05, 0.0004, -0.0003]},
    "rational": {"distortion": [-0.3, 0.12, 0, 0, 0, 0.05, 0.02, 0.01]},
    "fisheye": {"distortion": [-0.02, 0.01, 0.001, 0.0], "fisheye": True},
    "equidistant": {"distortion": [0.0] * 4, "fisheye": True},
}


def camera(size: tuple[int, int] = (160, 120), lens: str = "pinhole", focal: float = 0.87) -> Camera:
    """A level camera; `focal` in widths of the picture, the axis through the middle."""
    K = np.array([[focal * size[0], 0, (size[0] - 1) / 2], [0, focal * size[0], (size[1] - 1) / 2], [0, 0, 1]])
    return Camera("cam", size, K, oriented=False, **LENSES[lens])


def picture(body: str = "cardbox", cam: Camera | None = None, distance: float = 2.5, elevation: float = -0.1,
            sizes: CardboxSizes = SIZES) -> Picture:
    cam = cam or camera()
    return Picture(BODIES[body](sizes), cam, place(cam, distance, elevation))


def random_poses(rng: np.random.Generator, skeleton: Skeleton, number: int) -> Array:
    """Poses (N, D) all over the limits, shifts within 30 cm."""
    bound = np.array([0.3 if dof.kind == "translation" else 4.0 for dof in skeleton.dofs])
    low, high = np.clip(skeleton.limits, -bound, bound)
    return rng.uniform(low, high, (number, len(bound)))


def shapes_of(body: Body, *parts: str) -> np.ndarray:
    """Indices of the shapes of some parts."""
    assert set(parts) <= set(body.parts)
    return np.array([i for i, part in enumerate(body.parts) if part in parts], np.int64)


def draw_polygon(corners, size: tuple[int, int]) -> np.ndarray:
    """One convex polygon of corners (K, 2), pixels, drawn into an empty mask (H, W)."""
    return unpack(polygon_bits(corners, size), size[0])
