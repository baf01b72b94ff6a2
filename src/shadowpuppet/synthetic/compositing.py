"""Layers (images of one object alone, with alpha and depth) and their composition by depth."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array

FAR = 1e9
"""Depth of pixels that meet nothing, metres."""


class Layer(NamedTuple):
    """Image of one object (a person, the furniture) by one camera."""

    picture: Array
    """Light, premultiplied by alpha, of shape (H, W, 3), RGB, about 0 to 1."""
    alpha: Array
    """Share of each pixel that the object covers, of shape (H, W)."""
    depth: Array
    """Distance from the camera along the rays of pixel centres, of shape (H, W), metres; `FAR` where it is missed."""

    @property
    def mask(self) -> np.ndarray:
        """Exact silhouette at pixel centres, of shape (H, W), true or false."""
        return self.depth < FAR

    @property
    def reach(self) -> Array:
        """Depth (H, W), metres; pixels covered in part but not at their centre have the least depth of their neighbours."""
        import cv2

        around = cv2.erode(self.depth, np.ones((3, 3)))
        return np.where((self.depth >= FAR) & (self.alpha > 0), around, self.depth)

    def part(self, box: tuple[slice, slice]) -> Layer:
        """The layer within a window of rows and columns."""
        return Layer(self.picture[box], self.alpha[box], self.depth[box])

    def over(self, below: Array) -> Array:
        """This layer drawn over a picture (H, W, 3)."""
        return self.picture + (1 - self.alpha)[..., None] * below


def composite_people(room: Array, people: Sequence[Layer], things: Sequence[Layer]) -> Array:
    """`composite` of people and things over the room's picture (H, W, 3); faster, as people are drawn in their bounding box only."""
    picture = composite(room, things)
    covered = np.any([layer.alpha > 0 for layer in people], axis=0)
    rows, columns = (np.flatnonzero(covered.any(axis)) for axis in (1, 0))
    if len(rows):
        box = slice(max(rows[0] - 1, 0), rows[-1] + 2), slice(max(columns[0] - 1, 0), columns[-1] + 2)
        picture = picture.copy()
        picture[box] = composite(room[box], [layer.part(box) for layer in (*people, *things)])
    return picture


def composite(room: Array, layers: Sequence[Layer]) -> Array:
    """Layers drawn over the room's picture (H, W, 3), at each pixel the farthest first."""
    if len(layers) < 2:
        return layers[0].over(room) if layers else room
    depth = np.stack([layer.reach for layer in layers])
    order = np.argsort(-depth, axis=0, kind="stable")
    picture = room
    for rank in order:
        light = np.zeros_like(room)
        clear = np.ones(room.shape[:2])
        for n, layer in enumerate(layers):
            here = rank == n
            light[here] = layer.picture[here]
            clear[here] -= layer.alpha[here]
        picture = light + clear[..., None] * picture
    return picture


def visible(layer: Layer, others: Sequence[Layer]) -> np.ndarray:
    """Mask (H, W) of the pixels at whose centres a layer is nearer than all others."""
    shown = layer.depth < FAR
    for other in others:
        shown &= layer.depth < other.depth
    return shown
