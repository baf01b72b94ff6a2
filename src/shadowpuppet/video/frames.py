"""Frames, and sources of frames."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from itertools import takewhile
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FILE_MEMORY, VideoError, is_out_of_memory, reason

Image = NDArray[np.uint8]
"""A picture, of shape (H, W, 3), blue green red, or (H, W) grey, 0..255."""
Size = tuple[int, int]
"""Width and height, pixels."""
Wanted = Callable[[float], bool]
"""Whether the picture of a frame is wanted, asked once for each frame, in order, with its time (s)."""
EVERY: Wanted = lambda _: True  # noqa: E731
"""All frames are: they are decoded one after another."""

MOST_PIXELS = int(FILE_MEMORY / 12.5)
"""Greatest number of pixels of a picture: decoders take up to 12 bytes for each (animated PNG; JPEG of four colours 11)."""
ROUNDING = 1e-6
"""Rounding error of a time, seconds."""
ASSUMED_RATE = 30.0
"""Frames/s if neither the source nor the caller states times."""


@contextlib.contextmanager
def within_memory(path: object) -> Iterator[None]:
    """Context that reads a file. Raises `VideoError` naming it if memory does not suffice."""
    try:
        yield
    except Exception as error:
        if not is_out_of_memory(error):
            raise
        raise VideoError(f"{path}: too large for the memory of this machine ({reason(error)})") from None


class Frame(NamedTuple):
    """A picture and its time."""

    time: float
    """Seconds after the source's first frame."""
    image: Image


@dataclass(frozen=True)
class FrameSource:
    """An iterable of frames in order of time. Each iteration begins at the start, or, for a live camera, at the present."""

    name: str
    size: Size
    """Width and height of the frames, pixels."""
    rate: float
    """Mean frames/s; NaN if unknown."""
    count: int | None
    """Number of frames; None if the container does not state it."""
    duration: float
    """Seconds; NaN if the container does not state it."""
    read: Callable[[Wanted], Iterator[Frame]] = field(repr=False)
    """The frames that are wanted; the others are passed over without making their pictures, and of most films without decoding them."""
    pixel: float = 1.0
    """Width of a pixel over its height, as the film says; 1 if it does not."""
    interlaced: bool = False
    """Whether each frame holds two moments, in every other row."""

    def __iter__(self) -> Iterator[Frame]:
        """Read from the start."""
        return self.read(EVERY)

    def between(self, begin: float, end: float) -> FrameSource:
        """The frames from `begin` on and before `end`, seconds, at the same times."""

        def read(wanted: Wanted) -> Iterator[Frame]:
            inside = self.read(lambda time: time >= begin - ROUNDING and (time >= end - ROUNDING or wanted(time)))
            return takewhile(lambda frame: frame.time < end - ROUNDING, inside)

        return replace(self, count=None, duration=math.nan, read=read)


def size_of(image: Image) -> Size:
    """Width and height of a picture (H, W) or (H, W, 3)."""
    return image.shape[1], image.shape[0]


def check_size(name: object, n: int, time: float, image: Image, size: Size) -> None:
    """Raise `VideoError` if frame `n` differs in size from those before it."""
    found = size_of(image)
    if found != size:
        raise VideoError(f"{name}: frame {n} ({time:.3f} s) is {found[0]} x {found[1]} pixels, those before it "
                         f"{size[0]} x {size[1]}; all frames must have one size")
