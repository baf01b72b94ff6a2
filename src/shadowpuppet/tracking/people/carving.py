"""A coarse visual hull over the floor: voxels that all cameras that see them see as silhouette."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel

PITCHES = 0.05, 0.06, 0.08
"""Sides of a voxel that are tried, metres: the first that gives no more than `MAX_VOXELS`."""
MAX_VOXELS = 600_000
REACH, HALF_WIDTH = 2.5, 6.0
"""The room extends this far (m) beyond the surface points that it is made from, and to at most this far from their median."""
BELOW, ABOVE = 0.1, 2.4
"""Lowest and highest voxels, metres from the floor."""
MIN_VIEWS = 2
"""Least number of cameras that see a voxel."""
MANY_VIEWS = 5
"""From this number of cameras on, one may miss: its silhouette may have a hole."""


class Room(NamedTuple):
    """Voxels over the floor, and the pixels on which cameras see them."""

    corner: Array
    """Lowest corner, world, of shape (3,), metres."""
    pitch: float
    """Side of a voxel, metres."""
    pixels: NDArray[np.int32]
    """Index of the pixel, in a flattened mask, on which each camera sees each voxel's centre; -1 outside of its picture; of shape
    (C, X, Y, Z)."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of voxels along x, y and z."""
        return self.pixels.shape[1:]

    def places(self, voxels: NDArray[np.int64]) -> Array:
        """Centres (N, 3), world, metres, of voxels given by their indices (N, 3)."""
        return self.corner + self.pitch * (voxels + 0.5)


def make_room(cameras: Sequence[Camera], points: Array) -> Room:
    """The room around surface points (P, 3), world, metres, of all people; the lowest of them stand on the floor."""
    middle, floor = np.median(points[:, :2], axis=0), float(np.percentile(points[:, 2], 0.5))
    low = np.maximum(np.percentile(points[:, :2], 1, axis=0) - REACH, middle - HALF_WIDTH)
    high = np.minimum(np.percentile(points[:, :2], 99, axis=0) + REACH, middle + HALF_WIDTH)
    corner, size = np.array([*low, floor - BELOW]), np.array([*(high - low), BELOW + ABOVE])
    pitch = next((each for each in PITCHES if np.prod(np.ceil(size / each)) <= MAX_VOXELS), PITCHES[-1])
    shape = np.ceil(size / pitch).astype(int)
    pixels = np.full((len(cameras), *shape), -1, np.int32)
    grid = np.stack(np.meshgrid(*(corner[i] + pitch * (np.arange(shape[i]) + 0.5) for i in range(3)), indexing="ij"), -1)
    for n, camera in enumerate(cameras):
        width, height = camera.size
        x, y = np.moveaxis(np.nan_to_num(camera.project(grid), nan=-9.0), -1, 0)
        inside = (x > -0.5) & (x < width - 0.5) & (y > -0.5) & (y < height - 0.5)
        column, row = (np.rint(np.where(inside, each, 0)).astype(np.int32) for each in (x, y))
        pixels[n][inside] = (row * width + column)[inside]
    return Room(corner, pitch, pixels)


def carve(room: Room, masks: Sequence[Mask | None]) -> NDArray[np.bool_]:
    """Voxels (X, Y, Z) that may be a person's in one frame's masks (H, W), one per camera, None for one without. A mask that is nearly all
    of its picture carves nothing."""
    occupied = np.zeros(room.shape, np.bool_)
    used = [n for n, mask in enumerate(masks) if mask is not None and (may_be_person(mask) or not mask.any())]
    if len(used) >= MIN_VIEWS:
        flat = [np.ascontiguousarray(masks[n], bool).ravel() for n in used]
        longest = max(len(each) for each in flat)
        stacked = np.stack([np.pad(each, (0, longest - len(each))) for each in flat])
        _carve(room.pixels, np.array(used), stacked, MIN_VIEWS, MANY_VIEWS, occupied)
    return occupied


@kernel
def _carve(pixels, used, masks, least, many, occupied):  # pragma: no cover
    """Mark the voxels (X, Y, Z) that the silhouettes (C, pixels) of the cameras `used` do not carve away."""
    for x in range(occupied.shape[0]):
        for y in range(occupied.shape[1]):
            for z in range(occupied.shape[2]):
                seen = missed = 0
                for n in range(used.size):
                    at = pixels[used[n], x, y, z]
                    if at >= 0:
                        seen += 1
                        if not masks[n, at]:
                            missed += 1
                            if missed > 1 or used.size < many:
                                break
                occupied[x, y, z] = seen - missed >= least and (missed == 0 or (missed == 1 and seen >= many))
