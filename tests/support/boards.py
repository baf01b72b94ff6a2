"""Views of a board simulated corner by corner: no pictures, so that tests take milliseconds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.boards.board import Board, board_from, board_text
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.calibration.boards.printing import rectangles
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, inverse, rigid, rotation_about, rotation_from_vector

BOARD = board_from("charuco 7x5", 0.11)
SIZE = (1280, 720)
FLOOR = rigid(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
"""Board to world of a board on the floor."""


def ring(count: int, radius: float = 3.2, spread: float = 2 * np.pi) -> list[Camera]:
    """Cameras that look at the middle of a room."""
    cameras = []
    for n in range(count):
        angle = spread * n / count
        place = np.array([radius * np.cos(angle), radius * np.sin(angle), 1.4 + 0.3 * (n % 3)])
        z = (np.array([0, 0, 0.9]) - place) / np.linalg.norm(np.array([0, 0, 0.9]) - place)
        x = np.cross(z, [0, 0, 1])
        x /= np.linalg.norm(x)
        R = np.array([x, np.cross(z, x), z])
        K = np.array([[900.0 + 20 * n, 0, 640], [0, 905.0 + 20 * n, 355], [0, 0, 1]])
        cameras.append(Camera(f"cam{n + 1}", SIZE, K, np.array([-0.1, 0.05, 0, 0]), rigid(R, -R @ place)))
    return cameras


def view_of(camera: Camera, T_world_board: Array, rng: np.random.Generator, noise: float = 0.1, time: float = 0.0, board: Board = BOARD,
            two_sided: bool = False) -> View | None:
    """The view of a board at a pose (4, 4) in the world; None if it is turned away (unless both sides have the pattern) or out of view."""
    T = camera.T_camera_world @ T_world_board
    if T[:3, 2] @ T[:3, 3] <= 0.25 * np.linalg.norm(T[:3, 3]):
        if not two_sided or T[:3, 2] @ T[:3, 3] > -0.25 * np.linalg.norm(T[:3, 3]):
            return None
        T = T @ np.diag([-1.0, 1.0, -1.0, 1.0])  # the other side
    pixels = replace(camera, T_camera_world=T).project(board.points)
    good = np.isfinite(pixels).all(1) & (pixels > 0).all(1) & (pixels < np.array(camera.size) - 1).all(1)
    ids = np.flatnonzero(good)
    return View(time, ids, pixels[ids] + noise * rng.normal(size=(len(ids), 2)), 0.4) if len(ids) >= 8 else None


def shown(camera: Camera, rng: np.random.Generator, count: int = 50, tilt: float = 45.0, distances: tuple[float, float] = (0.8, 2.5),
          noise: float = 0.1) -> list[View]:
    """Views of a board shown to one camera: over the whole picture, near and far, tilted."""
    views, lens = [], replace(camera, T_camera_world=np.eye(4))
    while len(views) < count:
        pixel = rng.uniform(0, 1, 2) * camera.size
        axis = rng.normal(size=2)
        axis *= np.radians(tilt) * rng.uniform(0.3, 1) / np.linalg.norm(axis)
        ray = lens.rays(pixel[None])[0]
        T = rigid(rotation_from_vector([*axis, rng.uniform(-0.3, 0.3)]), ray / np.linalg.norm(ray) * rng.uniform(*distances))
        view = view_of(lens, T, rng, noise, 0.25 * len(views))
        if view is not None:
            views.append(view)
    return views


def carried(t: float) -> Array:
    """Board to world (4, 4) of a board carried about, at a time in seconds."""
    place = [0.7 * np.sin(0.5 * t), 0.7 * np.cos(0.37 * t), 1.1 + 0.4 * np.sin(0.9 * t)]
    upright = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    R = rotation_about([0, 0, 1], 0.45 * t) @ upright @ rotation_from_vector([0.5 * np.sin(1.3 * t), 0, 0.4 * np.cos(1.1 * t)])
    return rigid(R, place)


def moments(cameras: list[Camera], rng: np.random.Generator, count: int = 100, step: float = 0.3, noise: float = 0.1,
            delays: tuple[float, ...] = (), two_sided: bool = False) -> tuple[list[dict[int, View]], list[dict[int, Array]]]:
    """Views by moment and camera of the carried board, and velocities of their corners, pixels/s; films late by `delays` seconds."""
    views, speeds = [], []
    for k in range(count):
        found, moving = {}, {}
        for n, camera in enumerate(cameras):
            t = k * step - (delays[n] if delays else 0.0)
            view = view_of(camera, carried(t), rng, noise, k * step, two_sided=two_sided)
            later = view_of(camera, carried(t + 1 / 30), np.random.default_rng(0), 0.0, two_sided=two_sided)
            if view is not None and later is not None and len(later.ids) == len(view.ids):
                exact = view_of(camera, carried(t), np.random.default_rng(0), 0.0, two_sided=two_sided)
                assert exact is not None
                found[n], moving[n] = view, 30 * (later.pixels - exact.pixels)
        views.append(found)
        speeds.append(moving)
    return views, speeds


def drawn(camera: Camera, T_world_board: Array, board: Board = BOARD, mirrored: bool = False) -> NDArray[np.uint8]:
    """The picture (H, W) of a board as a camera without distortion sees it from its front."""
    texels = 800.0  # of which cells of markers have whole numbers
    wide, high = (round((side + 0.06) * texels) for side in board.size)
    print_ = np.full((high, wide), 230, np.uint8)
    for x, y, w, h in rectangles(board):
        a, b, c, d = (round((v + 0.03) * texels) for v in (x, y, x + w, y + h))
        print_[b:d, a:c] = 20
    T = camera.T_camera_world @ T_world_board
    texel = np.array([[1 / texels, 0, (0.5 - wide / 2) / texels], [0, 1 / texels, (0.5 - high / 2) / texels], [0, 0, 1]])
    H = camera.matrix @ np.column_stack([T[:3, 0], T[:3, 1], T[:3, 3]]) @ texel
    ground = np.full(camera.size[::-1], 120, np.uint8)
    image = cv2.warpPerspective(print_, H, camera.size, dst=ground, flags=cv2.INTER_AREA, borderMode=cv2.BORDER_TRANSPARENT)
    image = np.asarray(cv2.GaussianBlur(image, (0, 0), 0.7), np.uint8)
    return np.ascontiguousarray(image[:, ::-1]) if mirrored else image


def pictured(folder: Path, cameras: list[Camera], count: int = 10, mirrored: bool = False, inverted: bool = False,
             board: Board = BOARD) -> Path:
    """A session of pictures in a folder: cameras without distortion in a narrow arc that see the front of a board, printed `inverted` or
    not."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "board.toml").write_text(board_text(board))
    rng = np.random.default_rng(1)

    def write(kind: str, camera: Camera, poses: list[Array]) -> None:
        for n, T in enumerate(poses):
            place = folder / kind / camera.name
            place.mkdir(parents=True, exist_ok=True)
            image = drawn(camera, T, board, mirrored)
            cv2.imwrite(str(place / f"{n:02}.png"), ~image if inverted else image)

    middle = np.mean([camera.centre for camera in cameras], axis=0)
    poses = []
    for _ in range(count):  # toward the cameras' middle, tilted
        place = np.array([*rng.uniform(-0.5, 0.5, 2), rng.uniform(0.7, 1.2)])
        z = (place - middle) / np.linalg.norm(place - middle)
        x = np.cross([0, 0, -1.0], z)
        x /= np.linalg.norm(x)
        R = np.column_stack([x, np.cross(z, x), z]) @ rotation_from_vector(rng.uniform(-0.5, 0.5, 3))
        poses.append(rigid(R, place))
    for camera in cameras:
        write("extrinsics", camera, poses)
        write("floor", camera, [FLOOR])
        own = inverse(camera.T_camera_world)
        near = []
        for n in range(14):
            tilt = 0.75 * np.array([np.cos(2.4 * n), np.sin(2.4 * n), 0.2])
            near.append(own @ rigid(rotation_from_vector(tilt), [0.35 * np.cos(1.7 * n), 0.25 * np.sin(1.7 * n), 1.1 + 0.1 * (n % 5)]))
        write("intrinsics", camera, near)
    return folder
