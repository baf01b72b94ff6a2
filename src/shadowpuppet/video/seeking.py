"""Frames of a film at any time, for whoever goes back and forth in it: the film stays open, no more than a frame is held."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from shadowpuppet.errors import VideoError
from shadowpuppet.video.film import Break, converter, decoded, opened
from shadowpuppet.video.frames import ASSUMED_RATE, Image, Size
from shadowpuppet.video.images import IMAGE_SUFFIXES, in_folder, read_image

if TYPE_CHECKING:
    from av import VideoFrame

AHEAD = 1.0
"""Seconds up to which frames are decoded one after the other; what is farther is sought by the container's index."""


class Seeker:
    """A film, picture or folder of pictures: `at(time)` is the frame nearest to a time, None where there is none within a step and a half.

    Times are as `open_frames` gives them for films whose times increase; those of others are counted from the start at each step back.
    May be used by several threads, one at a time.
    """

    def __init__(self, source: Path, size: Size, rate: float | None = None) -> None:
        """`size`: frames are scaled to it; `rate` (frames/s) replaces the film's times. Raises `VideoError` where nothing can be read."""
        self.source, self.size, self.rate = source, size, rate
        self._lock, self._stack = threading.Lock(), contextlib.ExitStack()
        if source.is_dir():
            self._roll: _Folder | _Film | _Still = _Folder(source, rate)
        elif source.suffix.lower() in IMAGE_SUFFIXES:
            self._roll = _Still(source)
        else:
            self._roll = _Film(source, rate)

    def __enter__(self) -> Self:
        """It is open already."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """Let the film go."""
        with self._lock:
            self._roll.close()

    def at(self, time: float) -> Image | None:
        """The frame (H, W, 3), blue green red, that is shown at a time, seconds after the first."""
        import cv2

        with self._lock:
            image = self._roll.at(time)
        if image is None or image.shape[1::-1] == self.size:
            return image
        how = cv2.INTER_AREA if self.size[0] <= image.shape[1] else cv2.INTER_LINEAR
        return np.asarray(cv2.resize(image, self.size, interpolation=how), np.uint8)


class _Still:
    """One picture, at every time."""

    def __init__(self, path: Path) -> None:
        self.image = read_image(path)

    def at(self, time: float) -> Image | None:
        return self.image

    def close(self) -> None:
        """Nothing is open."""


class _Folder:
    """Pictures by their times."""

    def __init__(self, folder: Path, rate: float | None) -> None:
        self.paths, self.times, _ = in_folder(folder, rate)
        read_image(self.paths[0])
        self.step = float(np.median(np.diff(self.times))) if len(self.times) > 1 else np.inf

    def at(self, time: float) -> Image | None:
        n = int(np.abs(self.times - time).argmin())
        return read_image(self.paths[n]) if abs(self.times[n] - time) <= 1.5 * self.step else None

    def close(self) -> None:
        """Nothing is open."""


class _Shown(NamedTuple):
    """A frame as it was decoded; pixels are made of those alone that are asked for."""

    time: float
    frame: VideoFrame


class _Film:
    """A film that is read on from where it is, or from a key frame before the one that is wanted."""

    def __init__(self, path: Path, rate: float | None) -> None:
        self.path, self.convert = path, converter(grey=False)
        self.stack = contextlib.ExitStack()
        self.container, self.stream = self.stack.enter_context(opened(path))
        self.step = 1 / float(self.stream.average_rate or self.stream.guessed_rate or rate or ASSUMED_RATE)
        self.zero: int | None = None
        self.held: _Shown | None = None
        self.waiting: _Shown | None = None
        self.frames = self._read()
        self._advance()
        if self.waiting is None:
            raise VideoError(f"{path}: no frame of it can be decoded ({self.stream.codec_context.name})")
        if self.zero is None:  # its frames tell no times
            self.step = 1 / float(self.stream.guessed_rate or rate or ASSUMED_RATE)
        self.scale = 1.0 if rate is None else rate * self.step  # from times that are asked for to the film's own

    def close(self) -> None:
        """Let the file go."""
        self.frames.close()  # pyright: ignore[reportAttributeAccessIssue]
        self.stack.close()

    def at(self, time: float) -> Image | None:
        wanted = time * self.scale
        reached = self.waiting or self.held
        if reached is None or wanted > reached.time + AHEAD or (self.held is not None and wanted < self.held.time - self.step / 4):
            self._seek(wanted)
        while self.waiting is not None and self.waiting.time <= wanted:
            self._advance()
        near = [shown for shown in (self.held, self.waiting) if shown is not None and abs(shown.time - wanted) <= 1.5 * self.step]
        return self.convert(min(near, key=lambda shown: abs(shown.time - wanted)).frame) if near else None

    def _advance(self) -> None:
        """The next frame is held, the one after it waits."""
        self.held, self.waiting = self.waiting, next(self.frames, None)

    def _seek(self, wanted: float) -> None:
        """Go to the last key frame before a time, or to the start where the film cannot be sought in."""
        import av.error

        base = self.stream.time_base
        self.held = self.waiting = None
        if self.zero is not None and base is not None:
            with contextlib.suppress(av.error.FFmpegError, OSError):
                self.container.seek(self.zero + int(max(wanted - self.step, 0.0) / base), stream=self.stream)
                self.frames = self._read()
                self._advance()
                if self.waiting is not None and self.waiting.time <= wanted + self.step / 2:
                    return
        self._restart()

    def _restart(self) -> None:
        self.stack.close()
        self.stack = contextlib.ExitStack()
        self.container, self.stream = self.stack.enter_context(opened(self.path))
        self.zero, self.held = None, None
        self.frames = self._read()
        self._advance()

    def _read(self) -> Iterator[_Shown]:
        """Frames from where the container is; those of films that tell no times are counted from the start."""
        base, last = self.stream.time_base, -self.step
        with contextlib.suppress(Break):
            for frame in decoded(self.container, self.stream):
                stamp = frame.pts if frame.pts is not None else frame.dts
                if stamp is None or base is None:
                    last += self.step
                    self.zero = None
                else:
                    self.zero = stamp if self.zero is None else self.zero
                    last = max(float((stamp - self.zero) * base), last)
                yield _Shown(last, frame)
