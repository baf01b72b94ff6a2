"""Random access to a film's frames by time. The film stays open; at most two frames are in memory."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, NamedTuple, Self

import numpy as np

from shadowpuppet.errors import VideoError
from shadowpuppet.video.container import opened
from shadowpuppet.video.film import Break, converter, decoded
from shadowpuppet.video.frames import ASSUMED_RATE, Image, Size, within_memory
from shadowpuppet.video.images import IMAGE_SUFFIXES, in_folder, read_image

if TYPE_CHECKING:
    from av import Packet, VideoFrame

MAX_DECODED = 1.0
"""Largest step ahead, seconds, for which frames are decoded on if the container's index does not tell whether a key frame comes between."""
NEEDED = 4
"""Frame intervals before the wanted time from which on every frame is decoded; of those before at most what others refer to."""


class Seeker:
    """Frames of a film, picture or folder by time: `at(time)` is the nearest frame, or None if none is within 1.5 frame intervals.

    Times are those of `open_frames` if they increase; else frames are counted from the start after each step back. `shown` is the time of
    the frame that `at` returned last, NaN if it was None.
    """

    def __init__(self, source: Path, size: Size, rate: float | None = None, read: Callable[[Path], Image] = read_image) -> None:
        """`size`: of the frames; `rate`: frames/s, in place of the film's times; `read`: reads a picture file. Raises `VideoError` if
        nothing can be read."""
        self.source, self.size, self.rate, self.shown = source, size, rate, np.nan
        if source.is_dir():
            self._roll: _Folder | _Film | _Still = _Folder(source, rate, read)
        elif source.suffix.lower() in IMAGE_SUFFIXES:
            self._roll = _Still(source, read)
        else:
            self._roll = _Film(source, rate)

    def __enter__(self) -> Self:
        """Return itself; the film is already open."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Close it."""
        self.close()

    def close(self) -> None:
        """Close the film."""
        self._roll.close()

    def at(self, time: float) -> Image | None:
        """The frame (H, W, 3), blue green red, at a time, seconds after the first; None if there is none."""
        import cv2

        with within_memory(self.source):
            image, self.shown = self._roll.at(time)
        if image is None or image.shape[1::-1] == self.size:
            return image
        how = cv2.INTER_AREA if self.size[0] <= image.shape[1] else cv2.INTER_LINEAR
        return np.asarray(cv2.resize(image, self.size, interpolation=how), np.uint8)


class _Still:
    """A single picture, shown at every time."""

    def __init__(self, path: Path, read: Callable[[Path], Image]) -> None:
        self.image = read(path)

    def at(self, time: float) -> tuple[Image, float]:
        return self.image, time

    def close(self) -> None:
        """Nothing is open."""


class _Folder:
    """Pictures of a folder by time."""

    def __init__(self, folder: Path, rate: float | None, read: Callable[[Path], Image]) -> None:
        self.paths, self.times, _ = in_folder(folder, rate)
        self.read = read
        read(self.paths[0])
        self.step = float(np.median(np.diff(self.times))) if len(self.times) > 1 else np.inf

    def at(self, time: float) -> tuple[Image | None, float]:
        n = int(np.abs(self.times - time).argmin())
        there = abs(self.times[n] - time) <= 1.5 * self.step
        return (self.read(self.paths[n]), float(self.times[n])) if there else (None, np.nan)

    def close(self) -> None:
        """Nothing is open."""


class _Decoded(NamedTuple):
    """A decoded frame; pixels are converted on demand."""

    time: float
    frame: VideoFrame


class _Film:
    """A film, decoded from the present position, or from a key frame before the wanted time."""

    def __init__(self, path: Path, rate: float | None) -> None:
        self.path, self.convert = path, converter(grey=False)
        self.stack = contextlib.ExitStack()
        self.container, self.stream = self.stack.enter_context(opened(path))
        self.step = 1 / float(self.stream.average_rate or self.stream.guessed_rate or rate or ASSUMED_RATE)
        self.zero: int | None = None
        self.wanted = 0.0
        self.held: _Decoded | None = None
        self.waiting: _Decoded | None = None
        self.frames = self._read()
        self._advance()
        if self.waiting is None:
            raise VideoError(f"{path}: no frame of it can be decoded ({self.stream.codec_context.name})")
        if self.zero is None:  # frames without times
            self.step = 1 / float(self.stream.guessed_rate or rate or ASSUMED_RATE)
        self.scale = 1.0 if rate is None else rate * self.step  # ratio of the film's times to requested times

    def close(self) -> None:
        """Close the file."""
        self.frames.close()  # pyright: ignore[reportAttributeAccessIssue]
        self.stack.close()

    def at(self, time: float) -> tuple[Image | None, float]:
        self.wanted = wanted = time * self.scale
        reached = self.waiting or self.held
        back = self.held is not None and wanted < self.held.time - self.step / 4
        if reached is None or back or self._may_jump(reached.time, wanted):
            self._seek(wanted)
        while self.waiting is not None and self.waiting.time <= wanted:
            self._advance()
        near = [frame for frame in (self.held, self.waiting) if frame is not None and abs(frame.time - wanted) <= 1.5 * self.step]
        if not near:
            return None, np.nan
        nearest = min(near, key=lambda frame: abs(frame.time - wanted))
        return self.convert(nearest.frame), nearest.time / self.scale

    def _advance(self) -> None:
        """Decode one more frame: `held` is the present frame, `waiting` the next."""
        self.held, self.waiting = self.waiting, next(self.frames, None)

    def _may_jump(self, reached: float, wanted: float) -> bool:
        """Whether a key frame lies between two times; if the index does not tell, whether they are far apart."""
        base, entries = self.stream.time_base, self.stream.index_entries
        if wanted <= reached + NEEDED * self.step:
            return False
        if self.zero is not None and base is not None:
            key = entries.search_timestamp(self.zero + int(wanted / base))
            if 0 <= key < len(entries) - 1:  # a last one may be that of what was read so far
                return entries[key].timestamp > self.zero + reached / base
        return wanted > reached + MAX_DECODED

    def _seek(self, wanted: float) -> None:
        """Go to the last key frame before a time, or to the start if the film has no index."""
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

    def _needless(self, packet: Packet) -> bool:
        """Whether a packet's frame comes well before the wanted one."""
        base = self.stream.time_base
        if self.zero is None or packet.pts is None or base is None:
            return False
        return float((packet.pts - self.zero) * base) < self.wanted - NEEDED * self.step

    def _read(self) -> Iterator[_Decoded]:
        """Frames from the container's position; without time stamps they are counted from the start."""
        base, last = self.stream.time_base, -self.step
        with contextlib.suppress(Break):
            for frame in decoded(self.container, self.stream, self._needless):
                stamp = frame.pts if frame.pts is not None else frame.dts
                if stamp is None or base is None:
                    last += self.step
                    self.zero = None
                else:
                    self.zero = stamp if self.zero is None else self.zero
                    last = max(float((stamp - self.zero) * base), last)
                yield _Decoded(last, frame)
