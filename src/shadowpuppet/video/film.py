"""Reads films through PyAV: frames with their exact times; of a damaged film, the frames before the break."""

from __future__ import annotations

import contextlib
import math
import re
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from shadowpuppet.errors import VideoError, reason, warn
from shadowpuppet.video.container import opened
from shadowpuppet.video.frames import ASSUMED_RATE, EVERY, MOST_PIXELS, Frame, FrameSource, Image, Wanted, check_size, size_of
from shadowpuppet.video.selection import Irregular, Select, Stamped, chosen

if TYPE_CHECKING:
    from av import Packet, VideoFrame
    from av.container import InputContainer
    from av.video.stream import VideoStream

PLAIN_LUMA = re.compile(r"yuvj?4\d\dp|nv12|nv16|nv21|gray")
"""Pixel formats whose first plane is the 8-bit luma."""
DEEP_LUMA = re.compile(r"yuv|p[024]1|gray1")
"""Pixel formats with more bits."""
EVEN = 0.25
"""Greatest difference of a steady film's times from even ones, over their interval: a missing frame makes half."""
NOT_LATER = "one that is not later"
"""Words of the warning about such frames; a terminal shows the warning once for all films of a recording."""
LONGEST_STUTTER = 1.0
"""Seconds; times that go back by more are taken for a restart of the clock."""
STUDIO_TO_FULL = np.clip(np.round((np.arange(256) - 16) * (255 / 219)), 0, 255).astype(np.uint8)
"""Lookup table from the limited luma range of video, 16..235, to 0..255."""


def open_film(path: Path, grey: bool, rate: float | None) -> FrameSource:
    """A source of a film's frames; decodes the first one to find the size. Raises `VideoError`."""
    with opened(path, threads=1) as (container, stream):
        try:
            first = next(decoded(container, stream), None)
        except Break:
            first = None
        if first is None:
            raise VideoError(f"{path}: no frame of it can be decoded ({stream.codec_context.name}; at most {MOST_PIXELS} "
                             "pixels are)")
        size = size_of(converter(grey)(first))
        timed = first.pts is not None or first.dts is not None
        stated_rate = (stream.average_rate if timed else stream.guessed_rate) or stream.guessed_rate
        duration, mean_rate = _declared_duration(container, stream), float(stated_rate or math.nan)
        false = abs(stream.frames - duration * mean_rate) > 1 + 0.01 * stream.frames  # an .mp4 whose writer was interrupted
        count, pixel = None if false else stream.frames or None, _pixel(stream, first)

    step = 1 / (mean_rate if math.isfinite(mean_rate) else rate or ASSUMED_RATE)

    def read(wanted: Wanted) -> Iterator[Frame]:
        return _frames(path, film, step, grey, rate, wanted)

    film = FrameSource(str(path), size, rate or mean_rate, count, duration, read, pixel, first.interlaced_frame)
    return film


def _pixel(stream: VideoStream, first: VideoFrame) -> float:
    """Width over height of a pixel in the upright picture, as the stream or else the container says; 1 if neither does."""
    stated = stream.sample_aspect_ratio
    if not stated or stated <= 0:
        return 1.0
    return float(1 / stated if round(first.rotation / 90) % 2 else stated)


def tells_times(path: Path) -> bool:
    """Whether a film's first frames have time stamps. Raises `VideoError`."""
    with opened(path, threads=1) as (container, stream), contextlib.suppress(Break):
        frames = decoded(container, stream)
        return all(frame.pts is not None or frame.dts is not None for frame, _ in zip(frames, range(3)))
    return True  # damaged; reported elsewhere


def is_steady(path: Path) -> bool:
    """Whether a film's frames come at even intervals, none of them missing, by the times of its packets; False if it is damaged. Raises
    `VideoError`."""
    import av.error

    with opened(path, threads=1) as (container, stream), contextlib.suppress(OSError, av.error.FFmpegError):
        times = np.sort([packet.pts for packet in container.demux(stream) if packet.pts is not None])
        even = np.linspace(times[0], times[-1], len(times)) if len(times) > 1 else times
        return len(times) > 1 and bool(np.abs(times - even).max() < EVEN * (even[1] - even[0]))
    return False


def _frames(path: Path, film: FrameSource, step: float, grey: bool, rate: float | None, wanted: Wanted) -> Iterator[Frame]:
    """The wanted frames; the others are not decoded where the film's packets allow it."""
    answers, given = list[bool](), 0

    def noted(time: float) -> bool:
        answers.append(wanted(time))
        return answers[-1]

    if wanted is not EVERY:
        with contextlib.suppress(Irregular):
            for frame in _shown(path, film, step, grey, rate, noted, chosen):
                given += 1
                yield frame
            return
    again = iter(answers)  # each frame is requested once
    yield from islice(_shown(path, film, step, grey, rate, lambda time: wanted(time) if (known := next(again, None)) is None else known,
                             _one_by_one), given, None)


def _one_by_one(container: InputContainer, stream: VideoStream, asked: Callable[[Stamped], bool]) -> Iterator[VideoFrame]:
    """As `chosen`, but every frame is decoded. Raises `Break` after the last undamaged frame of a damaged film."""
    return (frame for frame in decoded(container, stream) if asked(frame))


def _shown(path: Path, film: FrameSource, step: float, grey: bool, rate: float | None, wanted: Wanted, select: Select) -> Iterator[Frame]:
    clock, convert, n, longest, broken = _Clock(path, step, quiet=rate is not None), converter(grey), 0, 0.0, ""

    def time_shown() -> float:
        """Time (s) of the last requested frame."""
        return (n - 1) / rate if rate else clock.last

    def asked(frame: Stamped) -> bool:
        nonlocal n, longest
        before, time = clock.last, clock(frame)
        if n > 10 and longest < 1.1 * step + 0.001 and time - before > 1.5 * step:  # steady so far, to the millisecond
            warn(f"{path}: between {before:.3f} and {time:.3f} s frames are missing: film at a lower rate or size if that recurs")
        longest, n = max(longest, time - before), n + 1
        return wanted(time_shown())

    with opened(path) as (container, stream):
        try:
            for frame in select(container, stream, asked):
                image = convert(frame)
                check_size(path, n - 1, time_shown(), image, film.size)
                yield Frame(time_shown(), image)
        except Break as cause:
            broken = str(cause)
    if not broken and film.duration - clock.last > 1.5 * longest and n != film.count:  # False if the duration is unknown
        broken = f"the file ends, {film.duration:.3f} s were announced"
    if broken:
        of = f" of {film.count}" if film.count else ""
        warn(f"{path}: broken off at frame {n}{of} ({clock.last + step:.3f} s): {broken}; the {n} frames before it are given: "
             "copy the film again if it was whole")


def _declared_duration(container: InputContainer, stream: VideoStream) -> float:
    if container.format.name == "avi" and stream.frames and stream.average_rate:
        return float(stream.frames / stream.average_rate)  # for a cut file FFmpeg states the remaining duration
    if stream.duration is not None and stream.time_base is not None:
        return float(stream.duration * stream.time_base)
    tag = re.fullmatch(r"(\d+):(\d+):([\d.]+)", stream.metadata.get("DURATION", ""))  # Matroska states it per stream
    if tag:
        return int(tag[1]) * 3600 + int(tag[2]) * 60 + float(tag[3])
    alone = len(container.streams) == 1  # the container's duration is that of its longest stream, perhaps audio
    return container.duration / 1e6 if alone and container.duration else math.nan


# Decoding


class Break(Exception):
    """A film cannot be decoded beyond this point."""


def decoded(container: InputContainer, stream: VideoStream, needless: Callable[[Packet], bool] | None = None) -> Iterator[VideoFrame]:
    """Frames in order of presentation. Raises `Break` after the last undamaged frame of a damaged film, `MemoryError`.

    needless: whether a packet's frame is not wanted, so that it is left out if no other refers to it: half of a film's frames, often.
    """
    import av.error

    packets, broken, last = container.demux(stream), "", None
    while not broken:
        try:
            if (packet := next(packets, None)) is None:
                return
            if needless is not None:
                stream.codec_context.skip_frame = "NONREF" if needless(packet) else "DEFAULT"
            if packet.is_corrupt and last:  # partial, at the end of a cut file
                frames, broken = _held(stream, last), "a cut picture"
            else:
                frames = packet.decode()
        except MemoryError:  # no damage
            raise
        except (OSError, av.error.FFmpegError) as error:
            frames, broken = _held(stream, last), reason(error)
        for frame in frames:
            if frame.is_corrupt:
                raise Break("a damaged picture")
            yield frame
            last = frame
    raise Break(broken)


def _held(stream: VideoStream, last: VideoFrame | None) -> list[VideoFrame]:
    """Frames still in the decoder at a break, up to the first gap after frame `last`."""
    import av.error

    frames: list[VideoFrame] = []
    with contextlib.suppress(av.error.FFmpegError):
        for frame in stream.codec_context.decode(None):
            step = frame.pts - last.pts if last and frame.pts is not None and last.pts is not None else 0
            if last and 0 < 1.5 * last.duration < step:
                break
            frame.time_base = stream.time_base  # only packets state it
            frames.append(frame)
            last = frame
    return frames


class _Clock:
    """Gives frames increasing times, seconds after the first frame: the container's if usable, else filled in with a warning."""

    def __init__(self, path: Path, step: float, quiet: bool = False) -> None:
        self.path, self.step, self.warned = path, step, quiet
        self.zero, self.last, self.shift = None, -step, 0.0
        self.last_dts, self.bad_pts, self.bad_dts = -math.inf, 0, 0

    def __call__(self, frame: Stamped) -> float:
        stamp, base = self._stamp(frame), frame.time_base
        if stamp is None or base is None:
            self._warn(self.last + self.step, f"has no time; times are filled in at {1 / self.step:g} frames/s (recording.toml: rate)")
            self.last += self.step
        else:
            self.zero = stamp if self.zero is None else self.zero
            self.last = self._increased((stamp - self.zero) * base.numerator / base.denominator + self.shift)
        return self.last

    def _stamp(self, frame: Stamped) -> int | None:
        # As FFmpeg's "best effort": use decoding times if presentation times went back more often than those.
        if frame.dts is not None:
            self.bad_dts += frame.dts <= self.last_dts
            self.last_dts = frame.dts
        usable = frame.pts is not None and (frame.dts is None or self.bad_pts <= self.bad_dts)
        return frame.pts if usable else frame.dts

    def _increased(self, time: float) -> float:
        if time > self.last:
            return time
        self.bad_pts += 1
        self._warn(self.last, f"is followed by {NOT_LATER}; times are moved so that they increase: convert the film to a constant rate if "
                              "the motion jerks there")
        if self.last - time < LONGEST_STUTTER:  # later times are correct again
            return self.last + self.step / 2
        self.shift += self.last + self.step - time  # the clock restarted
        return self.last + self.step

    def _warn(self, time: float, what: str) -> None:
        if not self.warned:
            warn(f"{self.path}: the frame at {time:.3f} s {what}")
        self.warned = True


# Pixels


def converter(grey: bool) -> Callable[[VideoFrame], Image]:
    """A function from decoded frames to upright (H, W, 3) or (H, W) arrays."""
    import cv2
    from av.video.reformatter import VideoReformatter

    reformat = VideoReformatter().reformat  # one per film: it keeps its tables between frames

    def convert(frame: VideoFrame) -> Image:
        if grey and PLAIN_LUMA.fullmatch(frame.format.name):
            image = _luma(frame)
        elif grey and DEEP_LUMA.match(frame.format.name):
            image = reformat(frame, format="gray").to_ndarray()
        else:
            image = reformat(frame, format="bgr24").to_ndarray()
            image = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY) if grey else image
        quarters = round(frame.rotation / 90) % 4  # counter-clockwise; undoes how the camera was held
        return np.ascontiguousarray(np.rot90(image, quarters) if quarters else image, np.uint8)

    return convert


def _luma(frame: VideoFrame) -> Image:
    """The luma plane (H, W), scaled to 0..255, without colour conversion."""
    import cv2
    from av.video.reformatter import ColorRange

    plane = frame.planes[0]
    luma = np.frombuffer(memoryview(plane), np.uint8).reshape(plane.height, plane.line_size)[:, : frame.width]  # rows are padded
    full = frame.color_range == ColorRange.JPEG or frame.format.name.startswith(("yuvj", "gray"))
    return luma.copy() if full else np.asarray(cv2.LUT(luma, STUDIO_TO_FULL), np.uint8)
