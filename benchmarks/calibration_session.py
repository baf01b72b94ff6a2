"""Films a calibration session with known truth and calibrates it: errors of lenses, places, floor and delays, and the time it takes.

Boards are drawn pixel by pixel through each camera's true lens (four samples a pixel), before a textured wall, with noise and H.264.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from smallest import parse

from shadowpuppet.calibration.boards.board import Board, board_from, board_text
from shadowpuppet.calibration.boards.printing import rectangles
from shadowpuppet.calibration.session import calibrate, open_session
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import align, inverse, rigid, rotation_about, rotation_from_vector
from shadowpuppet.video.writer import write_frames

TEXELS = 1000
"""Texture pixels per metre of board."""
GRAIN = 96
"""Pixels by which the noise is moved about at most."""
SHOWN_RATE = 10.0
"""Greatest frames/s of films of one camera alone, which are looked at four times a second."""
KNOTS = 3.0
"""Seconds between the places through which the board is carried: some 0.4 m/s."""
MARGIN = 0.02
"""White margin of the board, metres."""
LENSES = (((0.72, 0.722, 6, -5), (-0.12, 0.05, 0.0008, -0.0006)), ((0.70, 0.70, -4, 3), (-0.28, 0.11, 0.0, 0.0, -0.02)),
          ((0.95, 0.95, 0, 2), (0.04, -0.08)), ((0.80, 0.802, 3, 3), ()), ((0.45, 0.45, 2, -3), (-0.02, 0.004, -0.001, 0.0005)))
"""Focal lengths over the width and the principal point's distance from the middle, pixels of 1280; coefficients. The last: fisheye."""


def rig(count: int, size: tuple[int, int], fisheye: bool = False, arc: float = 360.0) -> list[Camera]:
    """Cameras of known lens on an arc (degrees) of 3.2 m."""
    cameras = []
    for n in range(count):
        (fx, fy, dx, dy), coefficients = LENSES[n % (5 if fisheye else 4)]
        wide, bent = fisheye and n % 5 == 4, np.zeros(4)
        bent[: len(coefficients)] = coefficients[:4]
        scale = size[0] / 1280
        K = np.array([[fx * size[0], 0, (size[0] - 1) / 2 + dx * scale], [0, fy * size[0], (size[1] - 1) / 2 + dy * scale], [0, 0, 1]])
        angle = np.radians(arc) * n / count + 0.2 * np.sin(3 * n)
        place = np.array([3.2 * np.cos(angle), 3.2 * np.sin(angle), 1.4 + 0.3 * (n % 3)])
        z = np.array([0, 0, 0.9]) - place
        z /= np.linalg.norm(z)
        x = np.cross(z, [0, 0, 1])
        x /= np.linalg.norm(x)
        R = np.array([x, np.cross(z, x), z])
        R = rotation_about([0, 0, 1], np.radians(2.0 * (n - 1))) @ R
        lens = np.array(coefficients) if not wide else bent
        cameras.append(Camera(f"cam{n + 1}", size, K, lens if len(lens) != 2 else bent, rigid(R, -R @ place), fisheye=wide))
    return cameras


def texture(board: Board) -> np.ndarray:
    """The printed board with its margin, of shape (H, W)."""
    k = TEXELS
    wide, high = (round((side + 2 * MARGIN) * k) for side in board.size)
    image = np.full((high, wide), 235, np.uint8)
    for x, y, w, h in rectangles(board):
        a, b, c, d = (round((v + MARGIN) * k) for v in (x, y, x + w, y + h))
        image[b:d, a:c] = 25
    return image


class Renderer:
    """Draws a board before a wall as one camera sees it."""

    def __init__(self, camera: Camera, board: Board, seed: int, noise: float = 2.0, two_sided: bool = False) -> None:
        """The wall is drawn from the seed; the board's back is grey, or has the pattern as well."""
        self.camera, self.board = camera, board
        self.rng = np.random.default_rng(seed)
        self.front, self.wall = texture(board), self._wall(camera.size)
        width, height = camera.size
        self.grain = self.rng.normal(0, noise, (height + GRAIN, width + GRAIN)).astype(np.float32)
        self.back = np.ascontiguousarray(self.front[:, ::-1]) if two_sided else np.full_like(self.front, 150)
        w, h = camera.size
        offsets = (np.arange(2) + 0.5) / 2 - 0.5
        x = (np.arange(w)[:, None] + offsets).ravel()
        y = (np.arange(h)[:, None] + offsets).ravel()
        self.rays = camera.rays(np.stack(np.meshgrid(x, y), -1)).astype(np.float32)

    def _wall(self, size: tuple[int, int]) -> np.ndarray:
        coarse = self.rng.uniform(60, 190, (size[1] // 40 + 2, size[0] // 40 + 2)).astype(np.float32)
        wall = cv2.resize(coarse, size, interpolation=cv2.INTER_CUBIC)
        for _ in range(12):
            a = self.rng.integers(0, size)
            cv2.rectangle(wall, [int(v) for v in a], [int(v) for v in a + 30], float(self.rng.uniform(20, 230)), -1)
        return np.clip(cv2.GaussianBlur(wall, (0, 0), 1.0), 0, 255)

    def frame(self, T: np.ndarray | None) -> np.ndarray:
        """The picture (H, W, 3) with the board at T (4, 4), board to camera."""
        image = self.wall.copy()
        if T is not None:
            corners = np.array([[sx * (self.board.size[0] / 2 + MARGIN), sy * (self.board.size[1] / 2 + MARGIN), 0]
                                for sx in (-1, 1) for sy in (-1, 1)])  # fmt: skip
            if ((corners @ T[:3, :3].T + T[:3, 3])[:, 2] > 0.05).all():
                self._draw(image, T)
        (x, y), (w, h) = self.rng.integers(0, GRAIN, 2), self.camera.size
        image = image + self.grain[y : y + h, x : x + w]  # moved about from frame to frame: drawing it anew takes most of the time
        return np.repeat(np.clip(image, 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)

    def _draw(self, image: np.ndarray, T: np.ndarray) -> None:
        window = self._window(T)
        H = np.linalg.inv(np.column_stack([T[:3, 0], T[:3, 1], T[:3, 3]]))  # ray -> board's x, y
        at = self.rays[window] @ H.T.astype(np.float32)
        with np.errstate(divide="ignore", invalid="ignore"):
            xy = at[..., :2] / at[..., 2:]
        half = (np.array(self.board.size) / 2 + MARGIN).astype(np.float32)
        inside = (np.abs(xy) < half).all(-1) & (at[..., 2] > 0)
        place = (np.where(inside[..., None], xy, 0) + half) * TEXELS - 0.5
        if not inside.any():
            return
        zoom = max(1.0, TEXELS * float(np.linalg.norm(T[:3, 3])) / self.camera.matrix[0, 0] / 2)
        side = self.front if float(T[:3, 2] @ T[:3, 3]) > 0 else self.back
        blurred = cv2.GaussianBlur(side, (0, 0), 0.4 * zoom) if zoom > 1.3 else side
        drawn = cv2.remap(blurred, place.astype(np.float32), None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        light = 0.75 + 0.25 * abs(float(T[2, 2]))
        shape = (inside.shape[0] // 2, 2, inside.shape[1] // 2, 2)
        share = inside.reshape(shape).mean((1, 3))
        value = (light * drawn * inside).reshape(shape).sum((1, 3)) / np.maximum(inside.reshape(shape).sum((1, 3)), 1)
        part = np.s_[window[0].start // 2 : window[0].stop // 2, window[1].start // 2 : window[1].stop // 2]
        image[part] = image[part] * (1 - share) + value * share

    def _window(self, T: np.ndarray) -> tuple[slice, slice]:
        """Samples among which the board is: rows and columns of `rays`."""
        w, h = (side / 2 + MARGIN for side in self.board.size)
        edge = np.linspace(-1, 1, 9)
        sides = ((edge, -1), (edge, 1), (-1, edge), (1, edge))
        outline = np.concatenate([np.stack([a * w + 0 * edge, b * h + 0 * edge], 1) for a, b in sides])
        pixels = replace(self.camera, T_camera_world=T).project(np.pad(outline, ((0, 0), (0, 1))))
        size = np.array(self.camera.size)
        if not np.isfinite(pixels).all():
            return slice(0, 2 * size[1]), slice(0, 2 * size[0])
        low = np.clip(np.floor(pixels.min(0)) - 3, 0, size).astype(int)
        high = np.clip(np.ceil(pixels.max(0)) + 4, low, size).astype(int)
        return slice(2 * low[1], 2 * high[1]), slice(2 * low[0], 2 * high[0])


def _smooth(rng: np.random.Generator, knots: np.ndarray, seconds: float) -> Callable[[float], np.ndarray]:
    from scipy.interpolate import CubicSpline

    return CubicSpline(np.linspace(-0.5, seconds + 0.5, len(knots)), knots)


def shown_to(camera: Camera, seconds: float, rng: np.random.Generator, tilt: float = 45.0, near: float = 0.35,
             far: float = 1.0) -> Callable[[float], np.ndarray]:
    """A board shown to one camera: moved over the picture, near and far, tilted to all sides; board to camera (4, 4) by time."""
    count = max(6, round(seconds / 1.2))
    w, h = camera.size
    pixels = np.stack([rng.uniform(0.05, 0.95, count) * w, rng.uniform(0.05, 0.95, count) * h], 1)
    axes = rng.normal(size=(count, 2))
    axes *= np.radians(rng.uniform(0.4, 1, (count, 1)) * tilt) / np.linalg.norm(axes, axis=1, keepdims=True)
    turn = rng.uniform(-0.4, 0.4, (count, 1))
    path = _smooth(rng, np.concatenate([pixels, axes, turn, rng.uniform(near, far, (count, 1))], 1), seconds)

    def pose(t: float) -> np.ndarray:
        u, v, a, b, c, z = path(t)
        ray = camera.rays(np.array([[np.clip(u, 0, w - 1), np.clip(v, 0, h - 1)]]))[0]
        ray = ray / np.linalg.norm(ray)
        return rigid(rotation_from_vector([a, b, c]), ray * z)

    return pose


def carried(seconds: float, rng: np.random.Generator) -> Callable[[float], np.ndarray]:
    """A board carried through the room, turned to all sides, its top up; board to world (4, 4) by time."""
    count = max(6, round(seconds / KNOTS))
    heading = np.linspace(0, 4 * np.pi, count)[:, None] + rng.uniform(-0.3, 0.3, (count, 1))
    place = np.concatenate([rng.uniform(-0.8, 0.8, (count, 2)), rng.uniform(0.6, 1.6, (count, 1))], 1)
    path = _smooth(rng, np.concatenate([place, heading, rng.uniform(-0.5, 0.5, (count, 2))], 1), seconds)

    def pose(t: float) -> np.ndarray:
        x, y, z, yaw, pitch, roll = path(t)
        upright = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])  # the board's y down, its reader looks along world y
        R = rotation_about([0, 0, 1], yaw) @ upright @ rotation_from_vector([pitch, 0, roll])
        return rigid(R, [x, y, z])

    return pose


def write_film(path: Path, renderer: Renderer, pose: Callable[[float], np.ndarray | None], seconds: float, rate: float,
               delay: float = 0.0) -> None:
    """A film whose frame at time t shows the world at t - delay."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with write_frames(path, rate, size=renderer.camera.size) as film:
        for n in range(max(1, round(seconds * rate))):
            film.write(renderer.frame(pose(n / rate - delay)))


def make_session(folder: Path, board: Board, cameras: list[Camera], seconds: float, rate: float, delays: list[float], seed: int = 1,
                 two_sided: bool = False) -> None:
    """Film a session into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "board.toml").write_text(board_text(board))
    path = carried(seconds, np.random.default_rng(seed))
    floor = rigid(np.diag([1.0, -1.0, -1.0]), np.zeros(3))
    for n, (camera, delay) in enumerate(zip(cameras, delays)):
        renderer = Renderer(camera, board, seed + n, two_sided=two_sided)
        shown = shown_to(camera, seconds, np.random.default_rng(seed + 100 + n))
        write_film(folder / "intrinsics" / f"{camera.name}.mp4", renderer, shown, seconds, min(rate, SHOWN_RATE))
        write_film(folder / "floor" / f"{camera.name}.mp4", renderer, lambda t, T=camera.T_camera_world: T @ floor, 1.0, rate)
        write_film(folder / "extrinsics" / f"{camera.name}.mp4", renderer, lambda t, T=camera.T_camera_world: T @ path(t), seconds, rate,
                   delay)


def errors(truth: list[Camera], found: list[Camera]) -> list[tuple[str, ...]]:
    """Rows of errors: focal lengths (%), principal point (pixels), picture (pixels), place (mm), direction (degrees), place (mm) within the
    rig, after one rigid motion of all cameras."""
    rows = []
    here, there = (np.array([camera.centre for camera in cameras]) for cameras in (found, truth))
    within = 1000 * np.linalg.norm(align(here, there).apply(here) - there, axis=1)
    for own, true, camera in zip(within, truth, found):
        focal = 100 * max(abs(camera.matrix[k, k] / true.matrix[k, k] - 1) for k in (0, 1))
        principal = float(np.linalg.norm((camera.matrix - true.matrix)[:2, 2]))
        w, h = true.size
        grid = np.stack(np.meshgrid(np.linspace(5, w - 6, 9), np.linspace(5, h - 6, 7)), -1).reshape(-1, 2)
        a, b = (c.rays(grid) / np.linalg.norm(c.rays(grid), axis=1, keepdims=True) for c in (true, camera))
        U, _, Vt = np.linalg.svd(a.T @ b)
        off = np.linalg.norm(a - b @ (U @ Vt).T, axis=1) * true.matrix[0, 0]
        T = camera.T_camera_world @ inverse(true.T_camera_world)
        place = 1000 * float(np.linalg.norm(camera.centre - true.centre))
        angle = float(np.degrees(np.arccos(np.clip((np.trace(T[:3, :3]) - 1) / 2, -1, 1))))
        rows.append((true.name, f"{focal:.2f}", f"{principal:.2f}", f"{np.sqrt((off**2).mean()):.2f}", f"{place:.1f}", f"{angle:.3f}",
                     f"{own:.1f}"))
    return rows


def main() -> None:
    """Film, calibrate, print errors."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--cameras", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--rate", type=float, default=30.0)
    parser.add_argument("--size", type=int, nargs=2, default=(1280, 720))
    parser.add_argument("--board", default="charuco 7x5")
    parser.add_argument("--square", type=float, default=0.11)
    parser.add_argument("--arc", type=float, default=360.0, help="degrees of the circle on which cameras stand")
    parser.add_argument("--fisheye", action="store_true", help="the fifth camera has a fisheye lens")
    parser.add_argument("--delays", type=float, nargs="*", default=(), help="delays of the films of the carried board, frames")
    parser.add_argument("--seed", type=int, default=1)
    args = parse(parser, lambda folder: [folder, "--cameras", 2, "--seconds", 4, "--rate", 8, "--size", 480, 360, "--square", 0.2,
                                          "--arc", 100])
    cameras, board = rig(args.cameras, tuple(args.size), args.fisheye, args.arc), board_from(args.board, args.square)
    delays = [*(d / args.rate for d in args.delays), *[0.0] * args.cameras][: args.cameras]
    if not (args.folder / "extrinsics" / f"cam{args.cameras}.mp4").exists():
        make_session(args.folder, board, cameras, args.seconds, args.rate, delays, args.seed)
    begun, busy = time.perf_counter(), time.process_time()
    found = calibrate(open_session(args.folder))
    took, busy = time.perf_counter() - begun, time.process_time() - busy
    print("camera  focal, %  principal, px  picture, px  place, mm  direction, deg  within the rig, mm")
    for row in errors(cameras, list(found.cameras)):
        print("  ".join(row))
    for fit in found.lenses:
        if fit is not None:
            print(f"{fit.camera.name}: {fit.model}, {fit.views} views, rms {fit.rms:.3f}, held out {fit.held_out:.3f}, focal sd "
                  f"{100 * fit.focal_sd:.2f} %, tilt {fit.tilt:.0f}, coverage {fit.coverage:.2f}")
    if found.placement is not None:
        solved = found.placement.solved
        print("late, frames:", np.round(solved.bundle.delays * args.rate, 3), "true", np.round(np.array(delays) * args.rate, 3))
        print("place sd, mm:", np.round(1000 * solved.place_sd, 2), "delay sd:", np.round(solved.delay_sd * args.rate, 3))
        print(f"scale {solved.scale:.3f} px, {len(found.placement.views)} views, {found.placement.left_out} left out")
    for sentence in (*found.notes, *found.advice):
        print("-", sentence)
    print(f"{took:.0f} s, {busy:.0f} s of processor time")


if __name__ == "__main__":
    main()
