"""The floor on which people stand, and the pixels on which an upright figure at each of its places would be seen.

A figure is a few rows of points across the view. Points of trunk and head must be silhouette, and one of the points at each height of the
legs; guards above the head and below the feet must not, so that a figure has the right size and distance. (Fleuret et al. 2008 compare
boxes with silhouettes so.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel

PITCHES, MOST_PLACES = (0.1, 0.125, 0.15, 0.2), 5000
"""Distances of neighbouring places that are tried, metres: the first that gives no more than `MOST_PLACES`."""
REACH, HALF_WIDTH = 2.5, 6.0
"""The floor extends this far (m) beyond the surface points that it is made from, and to at most this far from their median."""
HEIGHTS = 1.0, 1.15, 1.3, 1.45, 1.6, 1.75, 1.9
"""Heights of figures, metres."""
TRUNK = tuple((share, (-0.07, 0.0, 0.07) if share < 0.85 else (-0.03, 0.0, 0.03))
              for share in (0.5, 0.56, 0.62, 0.68, 0.74, 0.8, 0.88, 0.94))  # fmt: skip
"""Rows of trunk and head: height over the figure's, and places across the view, metres."""
LEGS, ASIDE = (0.06, 0.17, 0.28, 0.39), (-0.25, -0.12, 0.0, 0.12, 0.25)
"""Heights of the rows of the legs over the figure's, and places across the view at which they may be."""
OVER, UNDER = 0.15, -0.15
"""Places of the guards: above the head, and above the floor, metres."""

SPACING = 0.275
"""Distance of neighbouring heights at which points are projected, and between which they are interpolated, metres: the heights are
multiples of it, so that floors at several levels share them."""


class Floor(NamedTuple):
    """Places on the floor, and figures there."""

    cameras: tuple[Camera, ...]
    level: float
    """Height of the floor, world, metres."""
    places: Array
    """Of shape (N, 2), world, metres."""
    pitch: float
    """Distance of neighbouring places, metres."""
    pixels: NDArray[np.int32]
    """Index of the pixel, in a flattened mask of half the size, of each point of a figure: (N, heights, cameras, points), in the order of
    `TRUNK`, `LEGS`, the guard above and the guard below; -1 outside of the picture."""


def floor_under(cameras: Sequence[Camera], points: Array, level: float, reach: float = REACH, near: float = np.inf) -> Floor:
    """The floor at a `level`, metres, below surface points (P, 3), world, metres, of all people, and `reach` beyond them; only places that
    have a point at most `near` from them."""
    return Ground.under(cameras, points, reach, near).at(level)


@dataclass(frozen=True, eq=False)
class Ground:
    """Places whose floor may be at any level; what floors at several levels have in common is projected once."""

    cameras: tuple[Camera, ...]
    places: Array
    """Of shape (N, 2), world, metres."""
    pitch: float
    """Distance of neighbouring places, metres."""
    projected: dict[tuple[int, int], NDArray[np.float32]] = field(default_factory=dict)
    """By camera and height, in multiples of `SPACING`: pixels (N, 3, 2) of the points at `ASIDE`'s ends and middle."""

    @classmethod
    def under(cls, cameras: Sequence[Camera], points: Array, reach: float = REACH, near: float = np.inf) -> Ground:
        """As `floor_under`."""
        from scipy.spatial import KDTree

        middle = np.median(points[:, :2], axis=0)
        low = np.maximum(np.percentile(points[:, :2], 1, axis=0) - reach, middle - HALF_WIDTH)
        high = np.minimum(np.percentile(points[:, :2], 99, axis=0) + reach, middle + HALF_WIDTH)
        pitch = next((each for each in PITCHES if np.prod(np.ceil((high - low) / each)) <= MOST_PLACES), PITCHES[-1])
        x, y = (np.arange(start, end, pitch) for start, end in zip(low, high))
        places = np.stack(np.meshgrid(x, y, indexing="ij"), -1).reshape(-1, 2)
        if np.isfinite(near):
            places = places[KDTree(points[:, :2]).query(places, distance_upper_bound=near)[0] <= near]
        return cls(tuple(cameras), places, pitch)

    def at(self, level: float) -> Floor:
        """The floor at a level, metres."""
        pixels = np.stack([self._pixels(n, level) for n in range(len(self.cameras))], 2)
        return Floor(self.cameras, level, self.places, self.pitch, pixels)

    def _pixels(self, n: int, level: float) -> NDArray[np.int32]:
        """Of the figures on the floor at a level, in one camera: (N, heights, points)."""
        first, last = (int(np.floor((level + z) / SPACING)) for z in (UNDER, HEIGHTS[-1] + OVER))
        exact = np.stack([self._projected(n, k) for k in range(first, last + 2)], 1)
        found = np.empty((len(self.places), len(HEIGHTS), POINTS), np.int32)
        for h, height in enumerate(HEIGHTS):
            rows = [(share * height, aside) for share, aside in TRUNK] + [(share * height, ASIDE) for share in LEGS]
            rows += [(height + OVER, (-0.03, 0.0, 0.03)), (UNDER, ASIDE)]
            up = (level + np.array([z for z, aside in rows for _ in aside])) / SPACING - first
            across = np.array([each for _, aside in rows for each in aside]) / ASIDE[-1] + 1
            k, m = np.clip(up.astype(int), 0, last - first), np.clip(across.astype(int), 0, 1)
            _between(exact, k, m, (up - k).astype(np.float32), (across - m).astype(np.float32), _halved(self.cameras[n]), found[:, h])
        return found

    def _projected(self, n: int, k: int) -> NDArray[np.float32]:
        if (n, k) not in self.projected:
            sides = np.array([ASIDE[0], 0.0, ASIDE[-1]])
            points = figure_points(self.cameras[n], self.places, np.full(3, k * SPACING), sides)
            with np.errstate(over="ignore"):  # of a point beside the lens, infinitely far outside the picture
                self.projected[n, k] = self.cameras[n].project(points).astype(np.float32)
        return self.projected[n, k]


@kernel
def _between(exact, k, m, u, v, size, found):  # pragma: no cover
    """Index (N, P) of the pixels of points between projected ones (N, nodes, 3, 2): shares u and v (P,) of the way from node k, m (P,)."""
    width, height = size
    one, half, beyond = np.float32(1), np.float32(0.5), np.float32(-9)
    for n in range(found.shape[0]):
        for p in range(found.shape[1]):
            a, b = one - u[p], one - v[p]
            near, far = exact[n, k[p], m[p]], exact[n, k[p], m[p] + 1]
            above, beside = exact[n, k[p] + 1, m[p]], exact[n, k[p] + 1, m[p] + 1]
            x = half * (a * (b * near[0] + v[p] * far[0]) + u[p] * (b * above[0] + v[p] * beside[0]))
            y = half * (a * (b * near[1] + v[p] * far[1]) + u[p] * (b * above[1] + v[p] * beside[1]))
            found[n, p] = -1
            if x > beyond and y > beyond and x < width and y < height:  # not of points behind the camera, which are not a number
                i, j = int(np.rint(x)), int(np.rint(y))
                if 0 <= i < width and 0 <= j < height:
                    found[n, p] = j * width + i


def figure_points(camera: Camera, places: Array, z: Array, across: Array) -> Array:
    """Points (N, P, 3), world, at heights (P,) and places across the view (P,), metres, of figures at places (N, 2)."""
    away = places - camera.centre[:2]
    away = away / np.maximum(np.linalg.norm(away, axis=1, keepdims=True), 1e-9)
    x = places[:, None, 0] - away[:, None, 1] * across
    y = places[:, None, 1] + away[:, None, 0] * across
    return np.stack([x, y, np.broadcast_to(z, x.shape)], -1)


def pixel_index(camera: Camera, points: Array) -> NDArray[np.int32]:
    """Index of the pixel of points (..., 3), in a flattened mask of half the size; -1 outside of the picture."""
    return _index(camera, camera.project(points))


def _index(camera: Camera, pixels: Array) -> NDArray[np.int32]:
    """The same of pixels (..., 2) of the whole picture."""
    width, height = _halved(camera)
    at = np.rint(np.nan_to_num(0.5 * pixels, nan=-9.0, posinf=-9.0, neginf=-9.0).clip(-9, 1e6)).astype(np.int32)
    x, y = at[..., 0], at[..., 1]
    return np.where((x >= 0) & (x < width) & (y >= 0) & (y < height), y * width + x, -1).astype(np.int32)


def _halved(camera: Camera) -> tuple[int, int]:
    """Width and height of a camera's masks of half the size."""
    return (camera.size[0] + 1) // 2, (camera.size[1] + 1) // 2


POINTS = sum(len(aside) for _, aside in TRUNK) + len(LEGS) * len(ASIDE) + 3 + len(ASIDE)
"""Number of points of a figure."""
