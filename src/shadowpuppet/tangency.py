"""Outermost planes through two cameras that touch a silhouette: both cameras' must be the same (epipolar tangency).

After Wong & Cipolla 2001, "Structure and motion from silhouettes". Distances are told in pixels.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.masks import Mask, may_be_person

WIDE = 2.6
"""Radians that a silhouette may cover around the line from camera to camera: beyond, that line runs through or along it."""
EVERY = 2
"""Pixels of a contour from one taken to the next."""
BORDER = 2
"""Pixels from the picture's border within which nothing can be said of an outline."""
SMALL = 0.1
"""Outlines shorter than this, over the longest, are specks."""


class Outline(NamedTuple):
    """A silhouette's outline as one camera sees it."""

    pixels: Array
    """Of shape (K, 2)."""
    firm: Mask
    """Whether each is far from the picture's border, of shape (K,)."""
    rays: Array
    """Unit directions in the world, of shape (K, 3)."""


class Outlines:
    """Outlines of masks in cameras, each found once."""

    def __init__(self) -> None:
        """None yet."""
        self._pixels: dict[int, tuple[Mask, Array, Mask]] = {}
        self._known: dict[tuple[int, int], tuple[Camera, Outline]] = {}

    def of(self, camera: Camera, mask: Mask | None) -> Outline | None:
        """The outline of a mask (H, W); None where nobody is in it."""
        if mask is None or not may_be_person(mask):
            return None
        if id(mask) not in self._pixels:
            self._pixels[id(mask)] = (mask, *_followed(mask))  # the mask is kept, so that no other gets its number
        if (id(camera), id(mask)) not in self._known:
            _, pixels, firm = self._pixels[id(mask)]
            rays = camera.rays(pixels) @ camera.T_camera_world[:3, :3]
            self._known[id(camera), id(mask)] = camera, Outline(pixels, firm, rays / np.linalg.norm(rays, axis=1, keepdims=True))
        return self._known[id(camera), id(mask)][1]


def _followed(mask: Mask) -> tuple[Array, Mask]:
    import cv2

    contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
    longest = max(map(len, contours))
    pixels = np.concatenate([c[::EVERY, 0] for c in contours if len(c) > SMALL * longest]).astype(float)
    return pixels, np.asarray(((pixels >= BORDER) & (pixels < np.array(mask.shape[::-1]) - BORDER)).all(1))


def tangent_distances(cameras: Sequence[Camera], rows: Sequence[Sequence[Outline | None]]) -> Array:
    """Median distance (C, C) of the tangents of every two cameras, pixels, over rows of outlines; not a number where there is none."""
    out = np.full((len(cameras), len(cameras)), np.nan)
    for i, j in combinations(range(len(cameras)), 2):
        pairs = [(row[i], row[j]) for row in rows]
        values = np.array([_apart(cameras[i], a, cameras[j], b) for a, b in pairs if a is not None and b is not None]).ravel()
        values = values[np.isfinite(values)]
        out[i, j] = out[j, i] = np.median(values) if len(values) else np.nan
    return out


def _apart(first: Camera, a: Outline, second: Camera, b: Outline) -> tuple[float, float]:
    """Distances (pixels) of both pairs of outermost tangents; not a number at the border, or where they cannot be told."""
    line = second.centre - first.centre
    length = float(np.linalg.norm(line))
    if length < 1e-9:
        return np.nan, np.nan
    line = line / length
    aside = [outline.rays - (outline.rays @ line)[:, None] * line for outline in (a, b)]
    ahead = _unit(aside[0].sum(0)) + _unit(aside[1].sum(0))
    ahead = _unit(ahead if np.linalg.norm(ahead) > 1e-6 else aside[0].sum(0))
    angles = [np.arctan2(part @ np.cross(line, ahead), part @ ahead) for part in aside]
    if max(float(np.ptp(each)) for each in angles) > WIDE:
        return np.nan, np.nan
    focal = [float(np.diag(camera.matrix)[:2].mean()) for camera in (first, second)]

    def end(pick) -> float:
        k = [int(pick(each)) for each in angles]
        lever = np.mean([f * np.linalg.norm(part[at]) for f, part, at in zip(focal, aside, k)])
        return abs(angles[0][k[0]] - angles[1][k[1]]) * float(lever) if a.firm[k[0]] and b.firm[k[1]] else np.nan

    return end(np.argmin), end(np.argmax)


def _unit(vector: Array) -> Array:
    return vector / max(float(np.linalg.norm(vector)), 1e-12)
