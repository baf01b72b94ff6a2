"""Textures of walls and floors, from a bare wall to full shelves."""

from __future__ import annotations

import colorsys
from typing import Literal

import numpy as np

from shadowpuppet.geometry import Array

WallStyle = Literal["room", "plain", "cluttered", "textured"]


def paint_wall(kind: WallStyle, x: Array, z: Array, rng: np.random.Generator) -> Array:
    """Colours (..., 3), RGB, of walls at places `x` along them and heights `z`, metres."""
    if kind == "plain":
        return _plain(x, z, rng)
    if kind == "textured":
        return _bricks(x, z, rng)
    paint = _posters(x, z, rng)
    if kind == "cluttered":
        _shelves(paint, x, z, rng)
    return paint


def paint_floor(kind: WallStyle, x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Colours (..., 3), RGB, of the floor at places (x, y), metres."""
    colour = np.array(colorsys.hsv_to_rgb(rng.uniform(0.02, 0.15), rng.uniform(0.1, 0.5), rng.uniform(0.3, 0.65)))
    if kind == "plain":
        return colour * (1 + 0.03 * fractal_noise(2 * x, 2 * y, rng))[..., None]
    if kind == "textured":
        return _planks(colour, x, y, rng)
    size = rng.uniform(0.12, 0.4)
    checks = np.sign(np.sin(np.pi * x / size) * np.sin(np.pi * y / (size * rng.choice([1, 4]))))
    return colour * (1 + rng.uniform(0.03, 0.10) * checks + 0.06 * fractal_noise(2 * x, 2 * y, rng))[..., None]


def wall_colour(rng: np.random.Generator) -> Array:
    """The wall's colour (3,), which `paint_wall` draws first."""
    return np.array(colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(0.05, 0.4), rng.uniform(0.45, 0.85)))


def _plain(x: Array, z: Array, rng: np.random.Generator) -> Array:
    colour = wall_colour(rng)
    paint = colour * (1 + 0.03 * fractal_noise(0.5 * x, 0.5 * z, rng))[..., None]
    paint[z < 0.09] = 0.75 * colour + 0.1
    return paint


def _posters(x: Array, z: Array, rng: np.random.Generator) -> Array:
    colour = wall_colour(rng)
    paint = colour * (1 + rng.uniform(0.04, 0.22) * fractal_noise(x, z, rng))[..., None]
    for _ in range(rng.integers(3, 9)):
        cx, cz, w, h = rng.uniform(-2.2, 2.2), rng.uniform(0.4, 2.6), rng.uniform(0.1, 0.45), rng.uniform(0.1, 0.35)
        inside = (np.abs(x - cx) < w) & (np.abs(z - cz) < h)
        poster = np.array(colorsys.hsv_to_rgb(rng.uniform(), rng.uniform(0.1, 0.7), rng.uniform(0.25, 0.9)))
        pattern = 1 + 0.12 * np.sin(rng.uniform(10, 60) * x + rng.uniform(10, 60) * z)
        paint[inside] = (poster * pattern[..., None])[inside]
    paint[z < 0.09] = 0.75 * colour + 0.1
    return paint


def _shelves(paint: Array, x: Array, z: Array, rng: np.random.Generator) -> None:
    """Paint book shelves over the walls; some places stay empty."""
    for left, own in zip(np.arange(-27, 47, 1.1), rng.spawn(68)):
        wide, high = own.uniform(0.8, 1.05), own.uniform(1.3, 2.3)
        unit = (x > left) & (x < left + wide) & (z < high)
        if own.uniform() < 0.15 or not unit.any():
            continue
        wood = np.array(colorsys.hsv_to_rgb(own.uniform(0.05, 0.1), own.uniform(0.2, 0.6), own.uniform(0.2, 0.6)))
        paint[unit] = 0.5 * wood
        edges = np.cumsum(own.uniform(0.018, 0.07, 60))
        colours = np.array([colorsys.hsv_to_rgb(own.uniform(), own.uniform(0.1, 0.8), own.uniform(0.15, 0.85)) for _ in edges])
        for board in np.arange(0.05, high, 0.33):
            tall, rank = own.uniform(0.16, 0.28, len(edges)), own.permutation(len(edges))
            n = np.searchsorted(edges, np.clip(x - left, 0, wide)).clip(0, len(edges) - 1)
            book = unit & (z > board + 0.03) & (z < board + 0.03 + tall[n])
            paint[book] = colours[rank[n]][book]
            paint[unit & (np.abs(z - board) < 0.015)] = wood
        paint[unit & ((x < left + 0.02) | (x > left + wide - 0.02))] = wood


def _bricks(x: Array, z: Array, rng: np.random.Generator) -> Array:
    colour, wide, high = wall_colour(rng), rng.uniform(0.2, 0.28), rng.uniform(0.065, 0.085)
    row = np.floor(z / high)
    along = x / wide + 0.5 * (row % 2)
    tone = rng.uniform(-1, 1, (64, 64))[np.floor(along).astype(int) % 64, row.astype(int) % 64]
    joint = (np.mod(along, 1) * wide < 0.012) | (np.mod(z, high) < 0.012)
    paint = colour * (1 + 0.16 * tone + 0.10 * fractal_noise(3 * x, 3 * z, rng))[..., None]
    paint[joint] = (0.4 * colour + 0.45)[None]
    return paint


def _planks(colour: Array, x: Array, y: Array, rng: np.random.Generator) -> Array:
    wide, long = rng.uniform(0.10, 0.16), rng.uniform(0.8, 1.4)
    row = np.floor(x / wide)
    along = y / long + 0.37 * row
    tone = rng.uniform(-1, 1, (64, 64))[np.floor(along).astype(int) % 64, row.astype(int) % 64]
    grain = np.sin(90 * x + 6 * fractal_noise(2 * x, 0.7 * y, rng))
    seam = (np.mod(x, wide) < 0.006) | (np.mod(along, 1) * long < 0.006)
    paint = colour * (1 + 0.20 * tone + 0.08 * grain)[..., None]
    paint[seam] *= 0.5
    return paint


def fractal_noise(x: Array, y: Array, rng: np.random.Generator) -> Array:
    """Fractal value noise over the plane, about -1 to 1."""
    total = np.zeros_like(x)
    for octave in range(4):
        lattice = rng.uniform(-1, 1, (64, 64))
        u, v = x * 1.3 * 2**octave + 31.7, y * 1.3 * 2**octave + 17.3
        i, j = np.floor(u).astype(int), np.floor(v).astype(int)
        fu, fv = u - i, v - j
        fu, fv = fu * fu * (3 - 2 * fu), fv * fv * (3 - 2 * fv)
        corner = [lattice[(i + a) % 64, (j + b) % 64] for a in (0, 1) for b in (0, 1)]
        total += ((corner[0] * (1 - fv) + corner[1] * fv) * (1 - fu) + (corner[2] * (1 - fv) + corner[3] * fv) * fu) * 0.55**octave
    return total
