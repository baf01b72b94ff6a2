"""Draws the overlay of several cameras: a grid of their images with the model and the silhouettes' outlines."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.captions import WHITE, Words, strip
from shadowpuppet.camera.drawing import GREY, SILHOUETTE_ONLY, draw_keypoints, draw_person, in_colour, write_over
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.motion.motion import BLANK, MotionFrame
from shadowpuppet.pipeline.rig import FrameSet
from shadowpuppet.tracking.doubt.limbs import doubtful_names
from shadowpuppet.video import Image

WIDEST, TALLEST = 1600, 1000
"""Largest width and height of the cameras' pictures in a grid, pixels."""
OUTLINED: Words = (("outline: silhouette", SILHOUETTE_ONLY),)
"""What the grid shows beside the model, in words."""


def overlay_grid(frames: FrameSet, found: MotionFrame, pictures: Sequence[Picture], last: MotionFrame | None = None) -> Image:
    """An image (H, W, 3), blue green red, with a tile for each camera that shows the model in its pose and the silhouette's outline.

    `pictures`: the body as each camera sees it; limbs that are not vouched for are dashed. A camera without a frame is grey. Without a
    pose the model is drawn as it was `last`, all dashed, or not at all.
    """
    if found.status in BLANK and last is not None:
        found = last._replace(limb_status=["predicted"] * len(LIMBS))
    return _grid(frames, [each.camera for each in pictures], [("", found, pictures)])


def overlay_of_people(frames: FrameSet, cameras: Sequence[Camera],
                      people: Sequence[tuple[int, MotionFrame, Sequence[Picture]]]) -> Image:
    """As `overlay_grid`, with several people: number, frame and the body as each camera sees it. The number stands above the head."""
    return _grid(frames, cameras, [(str(number), found, pictures) for number, found, pictures in people])


def _grid(frames: FrameSet, cameras: Sequence[Camera], people: Sequence[tuple[str, MotionFrame, Sequence[Picture]]]) -> Image:
    """Tiles of all cameras, under their names, with the models of people."""
    grid = grid_of(cameras)
    out = np.zeros((grid.rows * (grid.header + grid.height), grid.columns * grid.width, 3), np.uint8)
    keypoints = frames.seen.keypoints or (None,) * len(cameras)
    for n, camera in enumerate(cameras):
        rows, columns = grid.place(n)
        out[rows.start - grid.header : rows.start, columns] = strip(grid.width, [[(camera.name, WHITE)]], grid.header)
        image = frames.images[n]
        drawn = [(number, pictures[n], found) for number, found, pictures in people if found.pose is not None]
        _fit(out[rows, columns], None if image is None else _tile(image, frames.seen.masks[n], drawn, keypoints[n]))
    return out


class Grid(NamedTuple):
    """Where the pictures of cameras are in a grid, pixels: tiles of one size, each under a strip with the camera's name."""

    columns: int
    rows: int
    width: int
    height: int
    header: int
    """Height of the strips."""

    def place(self, n: int) -> tuple[slice, slice]:
        """Rows and columns of the picture of the `n`-th camera."""
        row, column = divmod(n, self.columns)
        top, left = row * (self.header + self.height) + self.header, column * self.width
        return slice(top, top + self.height), slice(left, left + self.width)


def grid_of(cameras: Sequence[Camera]) -> Grid:
    """The grid for cameras of their sizes and names. Widths and heights are even, as videos need."""
    sizes = [camera.size for camera in cameras]
    wide, high = max(size[0] for size in sizes), max(size[1] for size in sizes)
    columns = min(range(1, len(sizes) + 1), key=lambda n: abs(np.log(n * wide / (-(-len(sizes) // n) * high) / (WIDEST / TALLEST))))
    rows = -(-len(sizes) // columns)
    scale = min(1.0, WIDEST / (columns * wide), TALLEST / (rows * high))
    width, height = max(2, 2 * round(scale * wide / 2)), max(2, 2 * round(scale * high / 2))
    return Grid(columns, rows, width, height, max(len(strip(width, [[(camera.name, WHITE)]])) for camera in cameras))


def _tile(image: Image, mask: Mask | None, people: Sequence[tuple[str, Picture, MotionFrame]], keypoints: Keypoints | None) -> Image:
    import cv2

    image = in_colour(image).copy()
    for number, picture, found in people:
        if np.isfinite(pose := np.asarray(found.pose, float)).all():
            draw_person(image, picture, pose, doubtful_names(picture.body, found.limb_status))
            write_over(image, number, picture, pose)
    if mask is not None:
        contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]
        cv2.drawContours(image, contours, -1, SILHOUETTE_ONLY, max(1, round(image.shape[0] / 480)))
    if keypoints is not None:
        draw_keypoints(image, keypoints)
    return image


def _fit(tile: Image, image: Image | None) -> None:
    """Scale an image into the upper left corner of a tile."""
    import cv2

    tile[:] = 0 if image is not None else GREY
    if image is not None:
        scale = min(tile.shape[0] / image.shape[0], tile.shape[1] / image.shape[1])
        width, height = max(1, round(scale * image.shape[1])), max(1, round(scale * image.shape[0]))
        tile[:height, :width] = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
