"""A small synthetic recording with several cameras: a walking person of ellipsoids in front of a noisy wall."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from solids import Ellipsoid, ring, seen_by

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.video import write_frames

SIZE, RATE, FRAMES = (160, 120), 10.0, 24
CAMERAS = 4


def cameras(count: int = CAMERAS, size: tuple[int, int] = SIZE, **more) -> list[Camera]:
    """Cameras in a ring around a person at the origin."""
    made = ring(count, radius=3.0, height=0.6, size=size, focal=0.85 * size[0], **more)
    T = np.eye(4)
    T[2, 3] = -0.9  # the person stands on the floor, z = 0
    return [replace(camera, T_camera_world=camera.T_camera_world @ T) for camera in made]


def scaled(camera: Camera, factor: float) -> Camera:
    """The camera with its translation in another unit."""
    T = camera.T_camera_world.copy()
    T[:3, 3] *= factor
    return replace(camera, T_camera_world=T)


def place(n: int) -> np.ndarray:
    """Position (3,) of the person's centre in frame `n`, metres, on a curve that no time shift maps to itself."""
    t = n / RATE
    return np.array([0.5 * np.sin(1.9 * t), 0.6 * np.cos(1.3 * t) - 0.4, 0.9 + 0.05 * np.sin(5 * t)])


def person(n: int) -> list[Ellipsoid]:
    x, y, z = place(n)
    swing = 0.2 * np.sin(6 * n / RATE)
    return [Ellipsoid((x, y, z + 0.1), (0.15, 0.2, 0.45)), Ellipsoid((x, y, z + 0.7), (0.1, 0.09, 0.13)),
            Ellipsoid((x + swing, y + 0.1, z - 0.45), (0.08, 0.08, 0.45)), Ellipsoid((x - swing, y - 0.1, z - 0.45), (0.08, 0.08, 0.45)),
            Ellipsoid((x + 0.2 + swing, y + 0.28, z + 0.2), (0.3, 0.06, 0.06))]  # fmt: skip


def masks(made: Sequence[Camera], frames: int = FRAMES, first: int = 0) -> list[list[Mask]]:
    """Exact silhouettes by frame and camera."""
    return [[seen_by(camera, person(first + n)) for camera in made] for n in range(frames)]


def shifted(seen: Sequence[Sequence[Mask]], late: Sequence[int], frames: int = 50) -> list[list[Mask]]:
    """Silhouettes of films that begin late by a number of frames each, at most ten."""
    return [[seen[10 + f - steps][k] for k, steps in enumerate(late)] for f in range(frames)]


def moved(camera: Camera, right: float = 0.0, down: float = 0.0, clockwise: float = 0.0) -> Camera:
    """The calibration of a camera that was turned by these angles (degrees) afterwards."""
    vector = -np.radians([down, -right, -clockwise])
    return replace(camera, T_camera_world=rigid(rotation_from_vector(vector), np.zeros(3)) @ camera.T_camera_world)


def write(folder: Path, made: Sequence[Camera] | None = None, seen: Sequence[Sequence[Mask]] | None = None) -> Path:
    """Write a recording folder with films, backgrounds, masks and calibration; returns it."""
    made = made or cameras()
    seen = masks(made) if seen is None else seen
    for kind in ("video", "background", "masks"):
        (folder / kind).mkdir(parents=True)
    write_calibration(folder / "calibration.toml", made)
    for k, camera in enumerate(made):
        rng = np.random.default_rng(k)
        wall = cv2.GaussianBlur(rng.normal(150, 60, (*camera.size[::-1], 3)), (0, 0), 5)

        def shot(mask: Mask, wall=wall, rng=rng) -> np.ndarray:
            picture = np.where(mask[..., None], (140, 40, 30), wall) + rng.normal(0, 1.2, wall.shape)
            return np.clip(picture, 0, 255).astype(np.uint8)

        with write_frames(folder / "background" / f"{camera.name}.mp4", RATE) as film:
            for _ in range(5):
                film.write(shot(np.zeros(camera.size[::-1], bool)))
        with (write_frames(folder / "video" / f"{camera.name}.mp4", RATE) as film,
              write_frames(folder / "masks" / f"{camera.name}.mkv", RATE, lossless=True) as exact):  # fmt: skip
            for row in seen:
                film.write(shot(row[k]))
                exact.write(row[k].astype(np.uint8) * 255)
    return folder
