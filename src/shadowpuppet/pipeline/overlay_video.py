"""The picture of a fit in several cameras: a grid of what they saw, with the model over it and the silhouettes' outlines."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.camera.drawing import BLACK, SILHOUETTE_ONLY, WHITE, draw_model, in_colour, overlay_frame, write_text
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.footage_rig import FrameSet
from shadowpuppet.video import FrameWriter, Image

if TYPE_CHECKING:  # both bring much with them
    from shadowpuppet.camera.mask import Mask
    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.video import FrameWriter, Image

WIDEST, TALLEST = 1600, 1000
"""Pixels that the grid has at most."""
SHOWN = 0.55
"""How strongly the model covers the picture."""


def rig_overlay(seen: FrameSet, frame: MotionFrame, pictures: Sequence[Picture]) -> Image:
    """One picture of a set (H, W, 3), blue green red: a tile a camera, with the model in its pose, and outlined the silhouette.

    `pictures` are the body in the cameras. A camera without a picture is black; a frame without a pose shows no model.
    """
    columns, rows, (width, height) = grid_of([picture.camera.size for picture in pictures])
    out = np.zeros((rows * height, columns * width, 3), np.uint8)
    pose = None if frame.pose is None else np.asarray(frame.pose, float)
    for n, picture in enumerate(pictures):
        y, x = divmod(n, columns)
        tile = out[y * height : (y + 1) * height, x * width : (x + 1) * width]
        image, mask = seen.images[n], seen.masks[n]
        _fit(tile, None if image is None else _tile(image, mask, picture, pose))
        write_text(tile, picture.camera.name if image is not None else f"{picture.camera.name}: no picture", 0, WHITE, size=height)
    write_text(out, f"{seen.time:.2f} s  {frame.status}", out.shape[0] - 40, WHITE, size=max(360, height))
    return out


def grid_of(sizes: Sequence[tuple[int, int]]) -> tuple[int, int, tuple[int, int]]:
    """Columns, rows and the size (width, height) of a tile for cameras of these sizes; even numbers, which films like."""
    wide, high = max(size[0] for size in sizes), max(size[1] for size in sizes)
    columns = min(range(1, len(sizes) + 1), key=lambda n: abs(np.log(n * wide / (-(-len(sizes) // n) * high) / (WIDEST / TALLEST))))
    rows = -(-len(sizes) // columns)
    scale = min(1.0, WIDEST / (columns * wide), TALLEST / (rows * high))
    return columns, rows, (max(2, 2 * round(scale * wide / 2)), max(2, 2 * round(scale * high / 2)))


def _tile(image: Image, mask: Mask | None, picture: Picture, pose: np.ndarray | None) -> Image:
    import cv2

    image = in_colour(image).copy()
    if pose is not None and np.isfinite(pose).all():
        drawn = image.copy()
        draw_model(drawn, picture, pose)
        image = np.asarray(cv2.addWeighted(drawn, SHOWN, image, 1 - SHOWN, 0), np.uint8)
    if mask is not None:
        contours = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)[0]
        cv2.drawContours(image, contours, -1, SILHOUETTE_ONLY, max(1, round(image.shape[0] / 480)))
    return image


def _fit(tile: Image, image: Image | None) -> None:
    """Scale an image into a tile, in its upper left corner."""
    import cv2

    tile[:] = BLACK
    if image is not None:
        scale = min(tile.shape[0] / image.shape[0], tile.shape[1] / image.shape[1])
        width, height = max(1, round(scale * image.shape[1])), max(1, round(scale * image.shape[0]))
        tile[:height, :width] = cv2.resize(image, (width, height), interpolation=cv2.INTER_AREA)


class RigOverlayWriter:
    """A film of overlays: `with RigOverlayWriter("overlay.mp4", 25, pictures) as film: film.write(seen, frame)`."""

    def __init__(self, path: str | Path, rate: float, pictures: Sequence[Picture]) -> None:
        """`rate`: frames/s. Raises `VideoError` for endings that are no film's, and later where it cannot be written."""
        from shadowpuppet.video import write_frames

        self.pictures = pictures
        self._film: FrameWriter = write_frames(path, rate)

    def __enter__(self) -> Self:
        """Use it in a `with` block."""
        self._film.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Finish the film; after an error what there is can be played from `<name>.part.<ending>`."""
        self._film.__exit__(kind)

    def write(self, seen: FrameSet, frame: MotionFrame) -> None:
        """Add a set of pictures with what was found in them."""
        self._film.write(rig_overlay(seen, frame, self.pictures))


class OverlayWriter:
    """A film of overlays: `with OverlayWriter("overlay.mp4", 25, picture) as film: film.write(image, mask, pose, ...)`."""

    def __init__(self, path: str | Path, rate: float, picture: Picture) -> None:
        """`rate`: frames/s. Raises `VideoError` for endings that are no film's, and later where it cannot be written."""
        from shadowpuppet.video import write_frames

        self.picture = picture
        self._film: FrameWriter = write_frames(path, rate)

    def __enter__(self) -> Self:
        """Use it in a `with` block."""
        self._film.__enter__()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Finish the film; after an error what there is can be played from `<name>.part.<ending>`."""
        self._film.__exit__(kind)

    def write(self, image: Image, mask: ArrayLike, pose: ArrayLike, *, status: str, time: float, overlap: float = np.nan,
              ignore: ArrayLike | None = None) -> None:
        """Add a frame; the arguments are those of `overlay_frame`."""
        self._film.write(overlay_frame(image, mask, self.picture, pose, status=status, time=time, overlap=overlap, ignore=ignore))
