"""Draws the overlay of several cameras: a grid of their images with the model and the silhouettes' outlines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.camera.drawing import (
    BLACK,
    LEGEND,
    SILHOUETTE_ONLY,
    WHITE,
    draw_model,
    in_colour,
    lines_below,
    said_of,
    write_text,
    write_words,
)
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.motion.limbs import LIMBS, status_in_words
from shadowpuppet.motion.motion import BLANK, MotionFrame
from shadowpuppet.pipeline.rig import FrameSet
from shadowpuppet.tracking.doubt.limbs import doubtful_names
from shadowpuppet.video import Image

WIDEST, TALLEST = 1600, 1000
"""Largest width and height of the grid, pixels."""
LEAST_SIZE = 360
"""Height, pixels, of the smallest picture that the legend and the caption are scaled for."""
SHOWN = 0.55
"""Opacity of the model."""


def overlay_grid(frames: FrameSet, found: MotionFrame, pictures: Sequence[Picture], last: MotionFrame | None = None) -> Image:
    """An image (H, W, 3), blue green red, with a tile for each camera that shows the model in its pose and the silhouette's outline.

    `pictures`: the body as each camera sees it; limbs that are not vouched for are pale. A camera without a frame is black. Without a
    pose the model is drawn as it was `last`, all pale, or not at all.
    """
    if found.status in BLANK and last is not None:
        pale = last._replace(limb_status=["predicted"] * len(LIMBS))
        return _grid(frames, [(pale, pictures)], said_of(found.status, last.time))
    return _grid(frames, [(found, pictures)], status_in_words(found.status, pictures[0].body.landmark_names, found.limb_status))


def overlay_of_people(frames: FrameSet, people: Sequence[tuple[int, MotionFrame, Sequence[Picture]]]) -> Image:
    """As `overlay_grid`, with several people: number, frame and the body as each camera sees it. Without people the images alone."""
    words = ", ".join(f"person {number} {found.status}" for number, found, _ in people)
    return _grid(frames, [(found, pictures) for _, found, pictures in people], words or "no person yet")


def _grid(frames: FrameSet, people: Sequence[tuple[MotionFrame, Sequence[Picture]]], words: str) -> Image:
    """Tiles of all cameras with the models of people."""
    if people:
        sizes = [picture.camera.size for picture in people[0][1]]
        names = [picture.camera.name for picture in people[0][1]]
    else:
        sizes = [(64, 48) if image is None else image.shape[1::-1] for image in frames.images]
        names = [f"camera {n + 1}" for n in range(len(sizes))]
    columns, rows, (width, height) = grid_of(sizes)
    out = np.zeros((rows * height, columns * width, 3), np.uint8)
    for n, name in enumerate(names):
        y, x = divmod(n, columns)
        tile = out[y * height : (y + 1) * height, x * width : (x + 1) * width]
        image, mask = frames.images[n], frames.seen.masks[n]
        drawn = [(pictures[n], found) for found, pictures in people if found.pose is not None]
        _fit(tile, None if image is None else _tile(image, mask, drawn))
        write_text(tile, name if image is not None else f"{name}: no picture", 0, WHITE, size=height)
    size = max(LEAST_SIZE, height)
    lines = lines_below(out, f"{frames.time:.2f} s  {words}", 0, size)
    legend, caption = (out.shape[0] - round(up * size / LEAST_SIZE) - lines[-1][0] for up in (65, 40))
    write_words(out, legend, (*LEGEND, ("outline: silhouette", SILHOUETTE_ONLY)), size)
    for below, line in lines:
        write_text(out, line, caption + below, WHITE, size=size)
    return out


def grid_of(sizes: Sequence[tuple[int, int]]) -> tuple[int, int, tuple[int, int]]:
    """Numbers of columns and rows, and the tiles' size (width, height), for cameras of these sizes. Width and height are even, as videos
    need."""
    wide, high = max(size[0] for size in sizes), max(size[1] for size in sizes)
    columns = min(range(1, len(sizes) + 1), key=lambda n: abs(np.log(n * wide / (-(-len(sizes) // n) * high) / (WIDEST / TALLEST))))
    rows = -(-len(sizes) // columns)
    scale = min(1.0, WIDEST / (columns * wide), TALLEST / (rows * high))
    return columns, rows, (max(2, 2 * round(scale * wide / 2)), max(2, 2 * round(scale * high / 2)))


def _tile(image: Image, mask: Mask | None, people: Sequence[tuple[Picture, MotionFrame]]) -> Image:
    import cv2

    image = in_colour(image).copy()
    poses = [(picture, np.asarray(found.pose, float), found) for picture, found in people if found.pose is not None]
    if any(np.isfinite(pose).all() for _, pose, _ in poses):
        drawn = image.copy()
        for picture, pose, found in poses:
            if np.isfinite(pose).all():
                draw_model(drawn, picture, pose, doubtful_names(picture.body, found.limb_status))
        image = np.asarray(cv2.addWeighted(drawn, SHOWN, image, 1 - SHOWN, 0), np.uint8)
    if mask is not None:
        contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]
        cv2.drawContours(image, contours, -1, SILHOUETTE_ONLY, max(1, round(image.shape[0] / 480)))
    return image


def _fit(tile: Image, image: Image | None) -> None:
    """Scale an image into the upper left corner of a tile."""
    import cv2

    tile[:] = BLACK
    if image is not None:
        scale = min(tile.shape[0] / image.shape[0], tile.shape[1] / image.shape[1])
        width, height = max(1, round(scale * image.shape[1])), max(1, round(scale * image.shape[0]))
        tile[:height, :width] = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)
