"""Reads live cameras through OpenCV."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from shadowpuppet.errors import VideoError, warn
from shadowpuppet.video.frames import Frame, FrameSource, Image, Wanted, check_size, size_of

if TYPE_CHECKING:
    from cv2 import VideoCapture


def camera_number(source: str | Path | int) -> int | None:
    """The number of a live camera, given as an int or as `camera:N`; None for anything else."""
    if isinstance(source, int):
        return source
    number = str(source).removeprefix("camera:")
    return int(number) if number != str(source) and number.isdecimal() else None


def open_camera(number: int, grey: bool, rate: float | None) -> FrameSource:
    """A source of a camera's frames as they come, timed by a monotonic clock; `rate` is requested from the camera. Raises `VideoError`."""
    import cv2

    capture, first = open_device(number, rate)
    stated_rate = capture.get(cv2.CAP_PROP_FPS)
    ready, size = [capture], size_of(first)  # opening takes a second: the first reader continues with this capture

    def read(wanted: Wanted) -> Iterator[Frame]:
        frames = _frames(ready.pop() if ready else open_device(number, rate)[0], number, grey, size)
        return (frame for frame in frames if wanted(frame.time))

    return FrameSource(f"camera:{number}", size, stated_rate if stated_rate > 0 else math.nan, None, math.nan, read)


def open_device(number: int, rate: float | None) -> tuple[VideoCapture, Image]:
    """Open a camera; returns the capture and its first picture. Raises `VideoError`."""
    import cv2

    with _quiet():
        capture = cv2.VideoCapture(number)
    capture.set(cv2.CAP_PROP_BUFFERSIZE, 1)  # buffered pictures would get too late times
    if rate:
        capture.set(cv2.CAP_PROP_FPS, rate)
    good, image = capture.read() if capture.isOpened() else (False, None)
    if not good or image is None:
        capture.release()
        raise VideoError(f"camera {number}: gives no picture; is it connected, and not in use by another program?")
    return capture, np.asarray(image, np.uint8)


@contextlib.contextmanager
def _quiet() -> Iterator[None]:
    """Silence OpenCV's messages on a missing camera, which is raised as an error."""
    import cv2

    log: Any = getattr(cv2.utils, "logging", cv2)  # OpenCV 5, and 4
    level = log.getLogLevel()
    log.setLogLevel(0)
    try:
        yield
    finally:
        log.setLogLevel(level)


def pictures(capture: VideoCapture) -> Iterator[tuple[float, Image]]:
    """Pictures of an opened camera until it ends, with seconds of the monotonic clock; releases the camera."""
    try:
        while capture.grab():
            now = time.monotonic()  # before decoding, which takes time
            good, image = capture.retrieve()
            if not good:
                break
            yield now, np.asarray(image, np.uint8)
    finally:
        capture.release()


def _frames(capture: VideoCapture, number: int, grey: bool, size: tuple[int, int]) -> Iterator[Frame]:
    import cv2

    start, n = math.nan, 0
    for now, image in pictures(capture):
        start = now if n == 0 else start
        image = np.asarray(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if grey and image.ndim == 3 else image, np.uint8)
        check_size(f"camera {number}", n, now - start, image, size)
        yield Frame(now - start, image)
        n += 1
    warn(f"camera {number}: gave no more pictures after {n}")
