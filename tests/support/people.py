"""Cameras, bodies, pictures and poses that the tests of the core share."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.body.upper_body import BODIES
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.geometry import Array

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
