"""Reads frames of films, folders of pictures and live cameras, one at a time; writes films and pictures."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import VideoError
from shadowpuppet.video.camera_device import camera_number, open_camera
from shadowpuppet.video.container import FILM_SUFFIXES
from shadowpuppet.video.film import open_film
from shadowpuppet.video.frames import ASSUMED_RATE, Frame, FrameSource, Image, Size, Wanted
from shadowpuppet.video.images import IMAGE_SUFFIXES, open_folder, open_picture, read_image, write_image
from shadowpuppet.video.writer import FrameWriter, write_frames

__all__ = ["FILM_SUFFIXES", "IMAGE_SUFFIXES", "Frame", "FrameSource", "FrameWriter", "Image", "Size", "camera_number", "fitted",
           "open_frames", "open_untimed", "read_image", "write_frames", "write_image"]


def open_frames(source: str | Path | int, *, grey: bool = False, size: Size | None = None, rate: float | None = None,
                whole: Size | None = None) -> FrameSource:
    """Open a film, a picture, a folder of pictures (in natural order), or a live camera (its number or `camera:N`).

    Raises `VideoError` if nothing can be read. A film that breaks off or is damaged gives the frames before the break, then a
    `ShadowPuppetWarning`.

    Args:
        source: the path or number.
        grey: give frames (H, W); for films the luma, scaled to 0..255, without decoding colours.
        size: width and height to which frames are scaled.
        rate: frames/s, replaces the source's times; a folder's times are in `timestamps.txt` or `.csv` (seconds, one per picture).
        whole: width and height to which frames are cut, or filled up with their edge, at the right and the bottom, before they are scaled.
    """
    if rate is not None and not (math.isfinite(rate) and rate > 0):
        raise VideoError(f"{source}: rate: found {rate}, expected a positive number of frames/s")
    if size is not None and min(size) < 1:
        raise VideoError(f"{source}: size: found {size}, expected two positive numbers of pixels")
    number, path = camera_number(source), Path(str(source))
    if number is not None:
        frames = open_camera(number, grey, rate)
    elif not path.exists():
        raise VideoError(f"{path}: no such film, picture or folder")
    elif path.is_dir():
        frames = open_folder(path, grey, rate)
    elif path.suffix.lower() in IMAGE_SUFFIXES:
        frames = open_picture(path, grey)
    else:
        frames = open_film(path, grey, rate)
    return fitted(frames, size, whole)


def open_untimed(source: str | Path) -> FrameSource:
    """As `open_frames`, for pictures without regard to their times: a folder needs none."""
    return open_frames(source, rate=ASSUMED_RATE if Path(source).is_dir() else None)


def fitted(frames: FrameSource, size: Size | None, whole: Size | None = None) -> FrameSource:
    """A source of the same frames, first cut or filled up to the size `whole`, then scaled to `size`; None leaves them as they are."""
    if whole is not None and whole != frames.size:
        frames = _filled(frames, whole)
    return frames if size in (None, frames.size) else _scaled(frames, size)


def _filled(frames: FrameSource, size: Size) -> FrameSource:
    width, height = size

    def read(wanted: Wanted) -> Iterator[Frame]:
        for time, image in frames.read(wanted):
            cut = image[:height, :width]
            missing = [(0, height - cut.shape[0]), (0, width - cut.shape[1]), (0, 0)][: cut.ndim]
            yield Frame(time, np.pad(cut, missing, "edge"))

    return replace(frames, size=size, read=read)


def _scaled(frames: FrameSource, size: Size) -> FrameSource:
    import cv2

    smaller = size[0] <= frames.size[0] and size[1] <= frames.size[1]
    how = cv2.INTER_AREA if smaller else cv2.INTER_LINEAR

    def read(wanted: Wanted) -> Iterator[Frame]:
        for time, image in frames.read(wanted):
            yield Frame(time, np.asarray(cv2.resize(image, size, interpolation=how), np.uint8))

    return replace(frames, size=size, read=read)
