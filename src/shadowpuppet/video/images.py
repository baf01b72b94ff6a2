"""Reads and writes picture files, and reads folders of pictures."""

from __future__ import annotations

import codecs
import contextlib
import math
import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FILE_MEMORY, VideoError, check_regular, choices, is_out_of_memory, reason, warn
from shadowpuppet.video.frames import ASSUMED_RATE, MOST_PIXELS, Frame, FrameSource, Image, Wanted, check_size, size_of, within_memory
from shadowpuppet.video.picture_header import read_header

IMAGE_SUFFIXES = (".bmp", ".jpeg", ".jpg", ".png", ".tif", ".tiff", ".webp")
PNG, PNG_PALETTE = b"\x89PNG\r\n\x1a\n", b"\3"
"""First bytes of a PNG, and its mark (byte 25) of a picture with a palette."""


class Layers(NamedTuple):
    """A picture with what `read_image` leaves out."""

    image: Image
    """As `read_image` gives it, (H, W) or (H, W, 3), not turned."""
    alpha: Image | None = None
    """Opacity (H, W), 0..255; None for a picture without."""
    numbers: NDArray[np.uint16] | None = None
    """Of each pixel (H, W) its place in a palette, or its grey value of 16 bit; None for other pictures."""
    palette: bool = False
    """Whether `numbers` are places in a palette."""
    coloured: bool = False
    """Whether these show colours, not only greys."""


def read_image(path: str | Path, grey: bool = False) -> Image:
    """Read a picture, (H, W, 3) blue green red or (H, W) grey, 8 bit, rotated as its EXIF data say; its size is checked before it is
    decoded. Raises `VideoError`."""
    import cv2

    return np.asarray(_decoded(path, cv2.IMREAD_GRAYSCALE if grey else cv2.IMREAD_COLOR)[0], np.uint8)


def read_layers(path: str | Path) -> Layers:
    """Read a picture with its alpha, palette and depth. Raises `VideoError`, as `read_image` does."""
    import cv2

    found, data = _decoded(path, cv2.IMREAD_UNCHANGED)
    image = np.asarray(found >> 8 if found.dtype == np.uint16 else found, np.uint8)
    if found.ndim == 2 and found.dtype == np.uint16:
        return Layers(image, numbers=found)
    alpha = np.ascontiguousarray(image[..., 3]) if image.ndim == 3 and image.shape[2] == 4 else None
    image = np.ascontiguousarray(image[..., :3]) if image.ndim == 3 else image
    places = _palette_places(data) if data[25:26] == PNG_PALETTE and data.startswith(PNG) else None
    return Layers(image, alpha, places, places is not None, places is not None and is_coloured(image))


def is_coloured(image: Image) -> bool:
    """Whether a picture (H, W, 3) or (H, W) has pixels that are not grey."""
    return image.ndim == 3 and bool((image != image[..., :1]).any())


def _palette_places(data: bytes) -> NDArray[np.uint16] | None:
    """Place (H, W) of each pixel of a PNG in its palette, which OpenCV does not give; None if it is damaged."""
    import av
    import av.error

    with contextlib.suppress(av.error.FFmpegError, ValueError):
        for frame in av.CodecContext.create("png", "r").decode(av.Packet(data)):
            if isinstance(frame, av.VideoFrame) and frame.format.name == "pal8":
                return frame.to_ndarray()[0].astype(np.uint16)
    return None


def _decoded(path: str | Path, how: int) -> tuple[NDArray[Any], bytes]:
    """A picture, decoded as `how` says, and its file's bytes: the only place where picture files are opened."""
    import cv2

    with within_memory(path):
        data = _content(Path(path))
        header, image = read_header(data), None
        if header is not None and header.most > MOST_PIXELS:
            raise VideoError(f"{path}: found a picture of {header.width} x {header.height} pixels, which takes the memory of "
                             f"{header.most} while it is decoded; expected at most {MOST_PIXELS}: scale it")
        try:
            if header is not None:
                image = cv2.imdecode(np.frombuffer(data, np.uint8), how)
        except cv2.error as error:
            if is_out_of_memory(error):
                raise
    if image is None:
        raise VideoError(f"{path}: not a picture that can be read (damaged, or none of {choices(IMAGE_SUFFIXES)})")
    return image, data


def _content(path: Path) -> bytes:
    """A picture file's bytes: `cv2.imread` cannot open every name on every system."""
    try:
        check_regular(path)
        if path.stat().st_size > FILE_MEMORY:
            raise VideoError(f"{path}: found {path.stat().st_size} bytes, expected a picture of at most {FILE_MEMORY}")
        return path.read_bytes()
    except OSError as error:
        raise VideoError(f"{path}: the picture cannot be read ({reason(error)})") from None


def write_image(path: str | Path, image: Image) -> None:
    """Write a picture (H, W, 3) blue green red or (H, W) grey, 8 bit, in the format of the path's ending. Raises `VideoError`."""
    import cv2

    path = Path(path)
    if path.suffix.lower() not in IMAGE_SUFFIXES:
        raise VideoError(f"{path}: found the ending {path.suffix!r}, expected one of {choices(IMAGE_SUFFIXES)}")
    check_image(path, image)
    part = path.with_name(f"{path.stem}.part{path.suffix}")  # so that no partial picture remains
    try:
        part.write_bytes(cv2.imencode(path.suffix.lower(), image)[1].tobytes())
        os.replace(part, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise VideoError(f"{path}: the picture cannot be written ({reason(error)})") from None


def check_image(path: Path, image: Image) -> None:
    """Raise `VideoError` if an array is not a picture (H, W, 3) or (H, W) of uint8."""
    found = np.asarray(image)
    if found.dtype != np.uint8 or found.ndim not in (2, 3) or (found.ndim == 3 and found.shape[2] != 3) or not found.size:
        raise VideoError(f"{path}: found a picture of {found.dtype}, shape {found.shape}; expected uint8, (H, W, 3) or (H, W)")


def open_picture(path: Path, grey: bool) -> FrameSource:
    """A picture as a source of one frame."""
    image = read_image(path, grey)

    def read(wanted: Wanted) -> Iterator[Frame]:
        if wanted(0.0):
            yield Frame(0.0, image.copy())

    return FrameSource(str(path), size_of(image), math.nan, 1, math.nan, read)


def open_folder(folder: Path, grey: bool, rate: float | None) -> FrameSource:
    """A source of a folder's pictures in natural order. Raises `VideoError`."""
    paths, times, assumed = in_folder(folder, rate)
    size, n = size_of(read_image(paths[0], grey)), len(paths)
    mean_rate = float((n - 1) / times[-1]) if n > 1 else math.nan

    def read(wanted: Wanted) -> Iterator[Frame]:
        if assumed:
            warn(f"{folder}: no timestamps.txt in it and no rate given: {ASSUMED_RATE:g} frames/s are assumed")
        for i, (time, path) in enumerate(zip(times.tolist(), paths)):
            if not wanted(time):
                continue
            image = read_image(path, grey)
            check_size(path, i, time, image, size)
            yield Frame(time, image)

    return FrameSource(str(folder), size, mean_rate, n, n / mean_rate, read)


def in_folder(folder: Path, rate: float | None = None) -> tuple[list[Path], NDArray[np.float64], bool]:
    """A folder's pictures in natural order, their times (s), and whether the times are assumed. Raises `VideoError`."""
    paths = sorted((p for p in folder.iterdir() if p.suffix.lower() in IMAGE_SUFFIXES and p.name[0] != "."), key=_natural)
    if not paths:
        raise VideoError(f"{folder}: no pictures in this folder (endings looked for: {choices(IMAGE_SUFFIXES)})")
    n = len(paths)
    stamps = None if rate else next((p for p in (folder / "timestamps.txt", folder / "timestamps.csv") if p.exists()), None)
    times = np.arange(n) / (rate or ASSUMED_RATE) if stamps is None else _read_times(stamps, n)
    return paths, times, stamps is None and rate is None and n > 1


def _natural(path: Path) -> list[tuple[int, str]]:
    """Sort key for natural order: 2 before 10."""
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in re.split(r"(\d+)", path.name.lower())]


def _read_times(path: Path, count: int) -> NDArray[np.float64]:
    """Read times (count,), seconds after the first: one number per line, or the first column of a table, with or without a header."""
    try:
        content = path.read_bytes()
        is_wide = content[2:] and content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        text = content.decode("utf-16" if is_wide else "utf-8-sig")
        lines = [line.strip() for line in text.splitlines() if line.strip()]
        cells = [re.split(r"[,;\s]", line)[0] for line in lines]
        times = np.array(cells[1:] if cells and not re.match(r"[-+.\d]", cells[0]) else cells, float)
    except (OSError, ValueError) as error:
        raise VideoError(f"{path}: expected one time in seconds a line ({error})") from None
    if len(times) != count:
        raise VideoError(f"{path}: found {len(times)} times for {count} pictures, expected one for each")
    if not np.isfinite(times).all() or (np.diff(times) <= 0).any():
        raise VideoError(f"{path}: found times that are not finite or not later than the one before, expected increasing seconds")
    return times - times[0]
