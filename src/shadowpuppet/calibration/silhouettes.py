"""Silhouettes to compare cameras by: each mask's contour, viewing rays and distance map, computed once.

A set is one moment: a silhouette or None for each camera. Rows are sets, in order of time.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.geometry import Array

CONTOUR_STEP = 2
"""Sampling step along a contour, pixels."""
BORDER_MARGIN = 2
"""Distance from the picture's border, pixels, within which an outline may be the border's, not the person's."""
MIN_CONTOUR_SHARE = 0.1
"""Contours shorter than this share of the longest are specks."""
ALIGNED = 12
"""Number of sets, spread over all, in which cameras are compared once their films are in step."""


class Outline(NamedTuple):
    """A silhouette's outline as one camera sees it."""

    pixels: Array
    """Of shape (K, 2)."""
    firm: Mask
    """Whether each is far from the picture's border, of shape (K,)."""
    rays: Array
    """Unit directions in the world, of shape (K, 3)."""


class Silhouette:
    """A mask (H, W), stored as bits, with its contours, distances and outlines, each computed once."""

    def __init__(self, mask: Mask) -> None:
        """Of a mask (H, W)."""
        self._shape, self._bits = mask.shape, np.packbits(mask)
        self._outlines: dict[int, tuple[Camera, Outline]] = {}

    @property
    def mask(self) -> Mask:
        """The mask, of shape (H, W)."""
        height, width = self._shape
        return np.unpackbits(self._bits, count=height * width).reshape(height, width).astype(bool)

    @cached_property
    def contour(self) -> tuple[Array, Mask]:
        """Pixels (K, 2) of the contours, and whether each is far from the picture's border (K,)."""
        import cv2

        contours = cv2.findContours(self.mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)[0]
        longest = max(map(len, contours))
        pixels = np.concatenate([c[::CONTOUR_STEP, 0] for c in contours if len(c) > MIN_CONTOUR_SHARE * longest]).astype(float)
        return pixels, np.asarray(((pixels >= BORDER_MARGIN) & (pixels < np.array(self._shape[::-1]) - BORDER_MARGIN)).all(1))

    @cached_property
    def distance(self) -> NDArray[np.float32]:
        """Distance of each pixel (H, W) to the silhouette, pixels."""
        import cv2

        return np.asarray(cv2.distanceTransform((~self.mask).astype(np.uint8), cv2.DIST_L2, 3), np.float32)

    def outline(self, camera: Camera) -> Outline:
        """The outline, its rays as `camera` sees them."""
        if id(camera) not in self._outlines:
            pixels, firm = self.contour
            rays = camera.rays(pixels) @ camera.T_camera_world[:3, :3]
            # The camera is stored too: while it exists, no other camera gets its id.
            self._outlines[id(camera)] = camera, Outline(pixels, firm, rays / np.linalg.norm(rays, axis=1, keepdims=True))
        return self._outlines[id(camera)][1]

    def mirrored(self) -> Silhouette:
        """The silhouette with left and right exchanged."""
        return Silhouette(self.mask[:, ::-1])


Row = Sequence[Silhouette | None]


def silhouettes_of(masks: Sequence[Mask | None]) -> list[Silhouette | None]:
    """The silhouettes of one set; None for a camera without a picture, and for a mask that is empty or nearly full."""
    return [Silhouette(mask) if mask is not None and may_be_person(mask) else None for mask in masks]


def outlines_of(cameras: Sequence[Camera], row: Row) -> list[Outline | None]:
    """The outlines of one set, by camera."""
    return [None if silhouette is None else silhouette.outline(camera) for camera, silhouette in zip(cameras, row)]


def aligned_sets(rows: Sequence[Row], shifts: Sequence[float], count: int = ALIGNED) -> list[Row]:
    """Some of the sets, evenly spread, in which camera k's silhouette is taken `shifts[k]` sets later."""
    steps, F = [round(shift) for shift in shifts], len(rows)
    first, last = max(0, -min(steps)), F - 1 - max(0, *steps)
    chosen = np.unique(np.linspace(first, max(first, last), count).astype(int))
    return [[rows[f + step][k] if f + step < F else None for k, step in enumerate(steps)] for f in chosen.tolist()]
