"""Obstacles in the scene, made of boxes and round posts, and their rendering by ray casting."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence
from typing import Annotated, Literal, NamedTuple

import numpy as np
from pydantic import Field
from pydantic.dataclasses import dataclass

from shadowpuppet.geometry import Array
from shadowpuppet.settings import STRICT
from shadowpuppet.synthetic.compositing import FAR, Layer

FilmSeconds = Annotated[float, Field(ge=0, le=3600)]
Coordinate = Annotated[float, Field(ge=-10, le=10)]
MIN_DISTANCE = 0.25
"""Least distance of an obstacle from the person's place, metres."""


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Obstacle:
    """An obstacle, which does not move; present in the film of the empty scene too, unless it enters later."""

    kind: Literal["table", "chair", "pillar", "cabinet"]
    """Kind: a table 74 cm high, a chair with its back 92 cm high, a round pillar, a cabinet 1.05 m high."""
    ahead: Coordinate = 0.8
    """Distance in front of the person, metres; negative behind."""
    left: Coordinate = 0.0
    """Distance to the person's left, metres."""
    turn_deg: Annotated[float, Field(ge=-180, le=180)] = 0.0
    """Rotation to the left about the vertical, degrees; at 0 its front faces where the person looks."""
    colour: Annotated[int, Field(ge=0)] = 1
    """Seed of its colour."""
    scale: Annotated[float, Field(ge=0.4, le=2)] = 1.0
    """Factor on all its lengths."""
    seat: bool = False
    """Whether it is the chair on which the person sits: it gets their place, direction and seat height, and `ahead`, `left`, `turn_deg` and
    `scale` have no effect."""
    enters: FilmSeconds | None = None
    """Time of the film at which it appears, from one frame to the next, seconds; 0: there from the first frame on, but not in the film of
    the empty scene. By default it is there in both."""
    leaves: FilmSeconds | None = None
    """Time of the film at which it disappears, seconds; by default it stays."""

    def __post_init__(self) -> None:
        """Check the times, that only a chair is a seat, and that the obstacle does not stand at the person's place."""
        if self.leaves is not None and self.leaves <= (self.enters or 0.0):
            raise ValueError(f"leaves: found {self.leaves:g} s, expected a time after it enters ({self.enters or 0:g} s)")
        if self.seat and self.kind != "chair":
            raise ValueError(f"seat: found a {self.kind}, expected a chair")
        if not self.seat and np.hypot(self.ahead, self.left) < MIN_DISTANCE:
            raise ValueError(f"ahead, left: found {self.ahead:g}, {self.left:g}, where the person stands; "
                             f"expected {MIN_DISTANCE} m of distance")


class Block(NamedTuple):
    """A box, or an upright elliptic post within it."""

    low: tuple[float, float, float]
    """Lowest corner, metres, in the obstacle's frame: x to its left, y backward, z up, the origin on the floor below its middle."""
    high: tuple[float, float, float]
    """Highest corner."""
    round: bool = False


def _legs(half_x: float, half_y: float, height: float, thick: float) -> list[Block]:
    return [Block((x - thick, y - thick, 0.0), (x + thick, y + thick, height))
            for x in (-half_x + thick, half_x - thick) for y in (-half_y + thick, half_y - thick)]  # fmt: skip


SHAPES: dict[str, list[Block]] = {
    "table": [Block((-0.60, -0.36, 0.71), (0.60, 0.36, 0.74)), *_legs(0.56, 0.33, 0.71, 0.025)],
    "chair": [Block((-0.21, -0.21, 0.43), (0.21, 0.21, 0.47)), *_legs(0.21, 0.21, 0.43, 0.02),
              Block((-0.21, 0.17, 0.47), (-0.17, 0.21, 0.92)), Block((0.17, 0.17, 0.47), (0.21, 0.21, 0.92)),
              Block((-0.17, 0.175, 0.62), (0.17, 0.205, 0.90))],
    "pillar": [Block((-0.06, -0.06, 0.0), (0.06, 0.06, 9.0), True), Block((-0.11, -0.11, 0.0), (0.11, 0.11, 0.10))],
    "cabinet": [Block((-0.45, -0.20, 0.0), (0.45, 0.20, 1.02)), Block((-0.47, -0.22, 1.02), (0.47, 0.22, 1.05))],
}
"""The blocks of each kind."""


class Furniture:
    """All obstacles of a scene, in the world."""

    def __init__(self, things: Sequence[Obstacle]) -> None:
        """things: the spec's obstacles."""
        self.things = tuple(things)

    def __bool__(self) -> bool:
        """Whether there are obstacles."""
        return bool(self.things)

    def at(self, seconds: float | None) -> Furniture:
        """The obstacles that are there `seconds` after the film's first frame; None: in the film of the empty scene."""
        if seconds is None:
            return Furniture([thing for thing in self.things if thing.enters is None])
        return Furniture([thing for thing in self.things
                          if (thing.enters or 0.0) <= seconds and (thing.leaves is None or seconds < thing.leaves)])

    def arrangements(self) -> list[Furniture]:
        """The different obstacles at a time, each once; first those of the empty scene."""
        times = [0.0, *(time for thing in self.things for time in (thing.enters, thing.leaves) if time is not None)]
        found = {now.things: now for now in (self.at(None), *map(self.at, times))}
        return list(found.values())

    def intersect(self, start: Array, rays: Array) -> tuple[Array, Array, Array, Array]:
        """Nearest intersections of rays (..., 3): distances in lengths of the rays (`FAR` if none), normals (..., 3), places in the
        obstacle's frame (..., 3) and the obstacle's index (-1 if none). start: of shape (3,) or (..., 3), metres, world.
        """
        shape = rays.shape[:-1]
        nearest, which = np.full(shape, FAR), np.full(shape, -1)
        normals, places = np.zeros(rays.shape), np.zeros(rays.shape)
        for n, thing in enumerate(self.things):
            turn = np.radians(thing.turn_deg)
            frame = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
            eye, ray = (start - np.array([thing.left, -thing.ahead, 0])) @ frame / thing.scale, rays @ frame / thing.scale
            for block in SHAPES[thing.kind]:
                away, normal = (_post if block.round else _box)(eye, ray, block)
                closer = away < nearest
                nearest[closer], which[closer] = away[closer], n
                normals[closer] = normal[closer] @ frame.T
                places[closer] = (eye + away[..., None] * ray)[closer]
        return nearest, normals, places, which

    def layer(self, eye: Array, rays: Array, fine: Array, lights: Array) -> Layer:
        """The obstacles seen from `eye`: unit rays (H, W, 3) at pixel centres, and `fine` (2H, 2W, 3), four per pixel."""
        depth = self.intersect(eye, rays)[0]
        _, normals, places, which = self.intersect(eye, fine)
        hit = which >= 0
        light = sum(strength * np.maximum(normals @ lamp, 0) for *lamp, strength in lights[:2])
        light = light + lights[2, 3] * (0.65 + 0.35 * normals[..., 2])
        paint = np.zeros(fine.shape)
        for n, thing in enumerate(self.things):
            paint[which == n] = _paint(thing, places[which == n])
        shown = np.where(hit[..., None], paint * light[..., None], 0.0)
        height, width = depth.shape
        picture = shown.reshape(height, 2, width, 2, 3).mean((1, 3))
        alpha = hit.reshape(height, 2, width, 2).mean((1, 3))
        return Layer(picture, alpha, depth)

    def shades(self, points: Array, lamp: Array) -> np.ndarray:
        """Whether points (..., 3) of floor and walls lie in shadow of a distant lamp in direction `lamp`."""
        return self.intersect(points + 1e-4 * lamp, np.broadcast_to(lamp, points.shape))[0] < FAR

    def holds(self, point: Array, margin: float = 0.1) -> str | None:
        """Kind of the obstacle that contains a point (3,), enlarged by `margin` metres; None if none does."""
        for thing in self.things:
            turn = np.radians(thing.turn_deg)
            frame = np.array([[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]])
            place, near = (point - np.array([thing.left, -thing.ahead, 0])) @ frame / thing.scale, margin / thing.scale
            for block in SHAPES[thing.kind]:
                if (place > np.array(block.low) - near).all() and (place < np.array(block.high) + near).all():
                    return thing.kind
        return None


def _box(eye: Array, rays: Array, block: Block) -> tuple[Array, Array]:
    """Distance along rays to a box, `FAR` if missed or behind, and the normal: slab method (Kay & Kajiya 1986)."""
    with np.errstate(divide="ignore", invalid="ignore"):
        a, b = (np.array(block.low) - eye) / rays, (np.array(block.high) - eye) / rays
    near, far = np.fmin(a, b), np.fmax(a, b)
    enter, leave = near.max(-1), far.min(-1)
    away = np.where((enter < leave) & (enter > 0), enter, FAR)
    axis = near.argmax(-1)
    normal = -np.sign(np.take_along_axis(rays, axis[..., None], -1)) * np.eye(3)[axis]
    return away, normal


def _post(eye: Array, rays: Array, block: Block) -> tuple[Array, Array]:
    """Distance along rays to the mantle of an upright elliptic cylinder, and the normal; its ends are out of sight."""
    low, high = np.array(block.low), np.array(block.high)
    middle, half = (low + high) / 2, (high - low) / 2
    o, d = ((eye - middle) / half)[..., :2], (rays / half)[..., :2]
    square, along, off = (d**2).sum(-1), (o * d).sum(-1), (o**2).sum(-1) - 1
    root = along**2 - square * off
    with np.errstate(divide="ignore", invalid="ignore"):
        away = (-along - np.sqrt(np.maximum(root, 0))) / square
    z = eye[..., 2] + away * rays[..., 2]
    good = (root > 0) & (away > 0) & (z >= low[2]) & (z <= high[2])
    away = np.where(good, away, FAR)
    normal = np.zeros(rays.shape)
    normal[..., :2] = (o + np.where(good, away, 0.0)[..., None] * d) / half[:2]
    normal /= np.linalg.norm(normal, axis=-1, keepdims=True) + 1e-12
    return away, normal


def _paint(thing: Obstacle, places: Array) -> Array:
    """Colours (n, 3) at places (n, 3) of an obstacle: wood grain, or plain paint on a pillar."""
    rng = np.random.default_rng(thing.colour)
    colour = np.array(colorsys.hsv_to_rgb(rng.uniform(0.03, 0.12), rng.uniform(0.2, 0.6), rng.uniform(0.35, 0.75)))
    if thing.kind == "pillar":
        return np.broadcast_to(0.5 * colour + 0.3, places.shape)
    x, y, z = places.T
    grain = np.sin(55 * y + 4 * np.sin(7 * x + 3 * z) + 31 * z * (thing.kind != "table"))
    return colour * (1 + 0.08 * grain)[:, None]
