"""Live feeds of pictures: a camera, a network stream, or a film played at its own rate."""

from __future__ import annotations

import math
import re
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

from shadowpuppet.errors import SettingsError, VideoError, warn
from shadowpuppet.video import IMAGE_SUFFIXES, FrameSource, Image, Size, camera_number, open_frames
from shadowpuppet.video.camera_device import open_device, pictures
from shadowpuppet.video.film import tells_times
from shadowpuppet.video.frames import size_of
from shadowpuppet.video.moments import span_of
from shadowpuppet.video.network_stream import SCHEMES, open_stream, without_secrets

ADDRESS = re.compile(r"([a-z][a-z0-9+.-]*)://", re.IGNORECASE)
"""Beginning of a network address."""
MAX_DELAY = 1.0
"""Seconds by which a film may lag behind its clock before the clock is set back."""


class Snapshot(NamedTuple):
    """A picture from a feed."""

    captured: float
    """Time of capture, seconds of the monotonic clock."""
    image: Image
    shown: float | None = None
    """Time in the film, seconds; None for a camera."""
    number: int = 0
    """Number of pictures before it."""


@dataclass(frozen=True)
class Feed:
    """A live source of pictures; every `read` opens it again."""

    name: str
    size: Size
    """Width and height of its first picture, pixels."""
    rate: float
    """Stated frames/s; NaN if unknown."""
    live: bool
    """Whether the source is live, and reopened if it ends; False for films."""
    read: Callable[[], Iterator[Snapshot]] = field(repr=False)
    """Pictures as they come, until the source ends. Raises `VideoError` if it cannot be opened or breaks off."""
    put_off: Callable[[float], None] = field(default=lambda seconds: None, repr=False)
    """Tells a film that it stood still for some seconds: it goes on where it was."""


def open_feed(source: str | int, *, rate: float | None = None, speed: float = 1.0, start: str | None = None,
              end: str | None = None) -> Feed:
    """Open a camera (its number, or `camera:N`), a network address (http, rtsp, tcp, udp, ...), or a film or folder of pictures.

    A film is played at its own times, `speed` times as fast, from `start` to `end` (as in `moments`); `rate` (frames/s) replaces its times,
    and is requested from a camera. Raises `VideoError` if nothing can be read, or a film has no times and no rate is given;
    `SettingsError` for a span that the source does not have.
    """
    number = int(source) if str(source).isdecimal() else camera_number(source)
    scheme = ADDRESS.match(str(source))
    if (number is not None or scheme is not None) and (start, end) != (None, None):
        raise SettingsError(f"start, end: found {start or end} and the live source {without_secrets(str(source))}, expected them with a "
                            "film only")
    if number is not None:
        return _camera(number, rate)
    if scheme is not None and scheme[1].lower() not in SCHEMES:
        raise VideoError(f"{source}: found an address of the kind {scheme[1]!r}, expected one of {', '.join(SCHEMES)}, the number of "
                         "a camera, or a film")
    if scheme is not None:
        return _stream(str(source))
    film = _timed(Path(str(source)), rate)
    begin, last = span_of(start, end, film.rate, film.count / film.rate if film.count else film.duration)
    return film_feed(film.between(begin, last), speed)


def corrected(feeds: Sequence[Feed], delays: Sequence[float]) -> list[Feed]:
    """Live feeds with the times at which pictures were captured: those of their arrival, less a delay (s) each; the feeds if there are no
    delays. Raises `SettingsError` for another number of delays, or a film."""
    if delays and len(delays) != len(feeds):
        raise SettingsError(f"delay: found {len(delays)} for {len(feeds)} cameras, expected one each")
    return [_earlier(feed, delay) for feed, delay in zip(feeds, delays)] if delays else list(feeds)


def _earlier(feed: Feed, delay: float) -> Feed:
    if not feed.live:
        raise SettingsError(f"delay: found one for the film {feed.name}, expected cameras and streams only; [start] in a recording.toml "
                            "is for films")

    def read() -> Iterator[Snapshot]:
        for shot in feed.read():
            yield shot._replace(captured=shot.captured - delay)

    return replace(feed, read=read)


def _camera(number: int, rate: float | None) -> Feed:
    import cv2

    device, first = open_device(number, rate)
    stated_rate, ready = device.get(cv2.CAP_PROP_FPS), [device]  # opening takes a second: the first reader continues with it

    def read() -> Iterator[Snapshot]:
        for now, image in pictures(ready.pop() if ready else open_device(number, rate)[0]):
            yield Snapshot(now, image)

    return Feed(f"camera {number}", size_of(first), stated_rate if stated_rate > 0 else math.nan, True, read)


def _stream(address: str) -> Feed:
    shown, size, rate = open_stream(address)
    ready = [shown]  # many senders accept one connection only: the first reader continues with it

    def read() -> Iterator[Snapshot]:
        for now, image in ready.pop() if ready else open_stream(address)[0]:
            yield Snapshot(now, image)

    return Feed(without_secrets(address), size, rate, True, read)


def film_feed(film: FrameSource, speed: float = 1.0, clock: Callable[[], float] = time.monotonic,
              wait: Callable[[float], None] = time.sleep) -> Feed:
    """A feed that plays a film as if live: each frame comes when it is due, and that is its time of capture."""
    delay = 0.0

    def put_off(seconds: float) -> None:
        nonlocal delay
        delay += seconds

    def read() -> Iterator[Snapshot]:
        start, delayed, warned = math.nan, delay, False
        for time_, image in film:
            start = clock() - time_ / speed if math.isnan(start) else start
            start, delayed = start + delay - delayed, delay
            due = start + time_ / speed
            while (ahead := due - clock()) > 0:
                wait(ahead)
            if -ahead > MAX_DELAY:  # too slow: set the clock back
                start, due = start - ahead, due - ahead
                if not warned:
                    warn(f"{film.name}: cannot be decoded as fast as it is to be played; it is played slower")
                warned = True
            yield Snapshot(due, image, time_)

    return Feed(film.name, film.size, film.rate * speed, False, read, put_off)


def _timed(path: Path, rate: float | None) -> FrameSource:
    """Open a film. Raises `VideoError` if it has no times and no rate is given."""
    if path.suffix.lower() in IMAGE_SUFFIXES and path.is_file():
        raise VideoError(f"{path}: found a single picture, expected a film, a folder of pictures, the number of a camera, or a network "
                         "address")
    film = open_frames(path, rate=rate)
    timed = any((path / f"timestamps.{end}").exists() for end in ("txt", "csv")) if path.is_dir() else tells_times(path)
    if rate is None and not timed:
        raise VideoError(f"{path}: its frames have no times, so that it cannot be played at its own rate; say how many frames a second "
                         "were filmed (--rate)")
    return film
