"""The room: textured walls and floor, lamps, soft shadows of people, and the camera's exposure and noise."""

from __future__ import annotations

import copy
import itertools
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.synthetic import walls
from shadowpuppet.synthetic.furniture import Furniture
from shadowpuppet.synthetic.person.kinematics import PosedBody
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.spec import Scene

SHADOW_PARTS = (
    ("pelvis", "neck", 0.13),
    ("neck", "head", 0.09),
    ("left_shoulder", "right_shoulder", 0.06),
    *(
        (f"{side}_{a}", f"{side}_{b}", radius)
        for side in ("left", "right")
        for a, b, radius in (("shoulder", "elbow", 0.05), ("elbow", "wrist", 0.04), ("hip", "knee", 0.08), ("knee", "ankle", 0.055))
    ),
)
"""Shadow casters: round sticks between two joints, and their radius (m)."""

SHADOW_CELL = 4
"""Cell size (pixels) of the grid on which the soft shadows are computed."""


class Room:
    """A floor at z = 0, four walls, one of them behind the person, their texture, and two lamps; all drawn from `rng`."""

    def __init__(self, camera: Camera, rng: np.random.Generator, shadow: float, least: float = 0.0, background: walls.WallStyle = "room",
                 arrangements: Sequence[Furniture] = (Furniture(()),)) -> None:
        """shadow: darkness of shadows, 0 to 1; least: least distance of the wall behind the person, metres; arrangements: obstacles whose
        shadows are drawn, a picture for each.
        """
        self.camera, self.shadow = camera, shadow
        self.distance = max(rng.uniform(1.2, 3.5), least)
        side = rng.choice([-1, 1])
        key = np.array([side * rng.uniform(0.2, 0.7), -rng.uniform(0.5, 0.9), rng.uniform(0.5, 1.0)])
        fill = np.array([-side * rng.uniform(0.4, 0.9), -rng.uniform(0.3, 0.8), rng.uniform(0.1, 0.4)])
        self.lights = np.zeros((3, 4))
        self.lights[0, :3], self.lights[1, :3] = key / np.linalg.norm(key), fill / np.linalg.norm(fill)
        self.lights[:, 3] = rng.uniform(0.45, 0.6), rng.uniform(0.12, 0.22), rng.uniform(0.45, 0.6)
        self.wall_colour = walls.wall_colour(copy.deepcopy(rng))
        self.pictures = self._paint(rng, background, arrangements)
        """The empty room with the shadows of each arrangement, (H, W, 3) each, RGB, 0 to 1."""
        across = np.cross(self.lights[0, :3], [0.0, 0.0, 1.0])
        across /= np.linalg.norm(across)
        self._from_lamp = np.stack([across, np.cross(self.lights[0, :3], across), self.lights[0, :3]], 1)
        coarse = np.stack(np.meshgrid(*(np.arange(-(-n // SHADOW_CELL)) for n in camera.size)), -1)
        self._seen = self._points(SHADOW_CELL * coarse + (SHADOW_CELL - 1) / 2)[0] @ self._from_lamp

    def _points(self, pixels: ArrayLike) -> tuple[Array, Array]:
        """Points (..., 3) where the rays of pixels (..., 2) meet floor or wall, and places (...) along the walls, metres."""
        eye, ray = self.camera.centre, self.camera.rays(pixels) @ inverse(self.camera.T_camera_world)[:3, :3].T
        half = max(self.distance, 6.0, 1.2 * float(np.hypot(*eye[:2])))
        ends = [(0, half, 20.0), (0, -half, -20.0), (1, self.distance, 0.0), (1, -half, 40.0), (2, 0.0, 0.0)]
        with np.errstate(divide="ignore", invalid="ignore"):
            away = np.stack([(end - eye[axis]) / ray[..., axis] for axis, end, _ in ends])
        away[~(away > 0)] = np.inf
        met = away.argmin(0)
        points = eye + np.take_along_axis(away, met[None], 0)[0][..., None] * ray
        along = np.where(met < 2, points[..., 1], points[..., 0]) + np.array([start for *_, start in ends])[met]
        return points, along

    def _paint(self, rng: np.random.Generator, background: walls.WallStyle, arrangements: Sequence[Furniture]) -> list[Array]:
        """Pictures of the empty room (H, W, 3), RGB, 0 to 1, one for each arrangement; each pixel is the mean of four rays."""
        width, height = self.camera.size
        grid = np.stack(np.meshgrid(np.arange(2 * width), np.arange(2 * height)), -1) / 2.0 - 0.25
        points, along = self._points(grid)
        wall = walls.paint_wall(background, along, points[..., 2], rng)
        floor = walls.paint_floor(background, points[..., 0], points[..., 1], rng)
        picture = np.where(points[..., 2:] < 1e-9, floor, wall)
        picture *= 0.78 + 0.22 * np.exp(-((points[..., :1] - 0.5) ** 2 + (points[..., 2:] - 1.8) ** 2) / 6)
        shaded = [picture * (1 - self.shadow * _shadows(furniture, points, self.lights[0, :3])) if furniture else picture
                  for furniture in arrangements]
        return [one.reshape(height, 2, width, 2, 3).mean((1, 3)) for one in shaded]

    def shaded(self, picture: Array, figure: PosedBody, index: int, *others: PosedBody) -> Array:
        """One of the room's pictures (H, W, 3) with the shadows of the figure and of `others`."""
        import cv2

        if self.shadow == 0:
            return picture
        light = 1 - self.shadow * self._shade([figure.joints[index], *(other.joints[index] for other in others)])
        width, height = self.camera.size
        return (
            picture
            * cv2.resize(light, (SHADOW_CELL * light.shape[1], SHADOW_CELL * light.shape[0]), interpolation=cv2.INTER_LINEAR)[
                :height, :width, None
            ]
        )

    def _shade(self, people: list[Array]) -> Array:
        """Share of the key lamp that is hidden, 0 to 1, on the coarse grid; people: joints (17, 3) of each.

        The lamp is distant: projected along its direction, points of floor and wall and sticks become points and lines of a plane. The
        edge softens with the distance between stick and shadow.
        """
        clear = np.ones(self._seen.shape[:2])
        for joints, (a, b, radius) in itertools.product(people, SHADOW_PARTS):
            start, end = (joints[JOINTS.index(name)] @ self._from_lamp for name in (a, b))
            along = end - start
            t = np.clip(((self._seen - start)[..., :2] @ along[:2]) / max(along[:2] @ along[:2], 1e-9), 0, 1)
            off = self._seen - start - t[..., None] * along
            soft = 0.03 + 0.15 * np.abs(off[..., 2])
            gap = (np.hypot(off[..., 0], off[..., 1]) - radius) / soft
            clear *= 1 - np.clip(0.5 - 0.5 * gap, 0, 1) ** 2 * (3 - 2 * np.clip(0.5 - 0.5 * gap, 0, 1)) * (off[..., 2] < 0)
        return 1 - clear


def _shadows(furniture: Furniture, points: Array, lamp: Array) -> Array:
    """Share of the key lamp (2H, 2W, 1), in direction `lamp`, that obstacles hide from points (2H, 2W, 3), with soft edges."""
    import cv2

    return np.asarray(cv2.GaussianBlur(furniture.shades(points, lamp).astype(float), (0, 0), 2.0), float)[..., None]


def lamp_brightness(scene: Scene, seconds: float, length: float) -> float:
    """Relative brightness of the lamps `seconds` after the film's first frame; negative in the film of the empty scene.

    length: of the film, seconds, over which `scene.drift` builds up, slowly at both ends.
    """
    share = np.clip(seconds / max(length, 1e-9), 0, 1)
    drift = scene.drift * (0.5 - 0.5 * np.cos(np.pi * share))
    return float((1 + drift) * (1 + scene.flicker * np.sin(2 * np.pi * scene.flicker_hz * seconds)))


def expose(picture: Array, noise: float, rng: np.random.Generator) -> np.ndarray:
    """The sensor's picture, RGB uint8, of light (H, W, 3), 0 to 1: slight blur of the lens and noise.

    noise: standard deviation in grey levels at middle grey; it grows with brightness like photon noise.
    """
    import cv2

    blurred = cv2.GaussianBlur(picture, (0, 0), 0.4)
    level = 255 * np.clip(blurred, 0, 1)
    if noise > 0:
        level = level + noise * (0.5 + 0.5 * np.sqrt(level / 128)) * rng.standard_normal(level.shape, np.float32)
    return np.clip(level + 0.5, 0, 255).astype(np.uint8)
