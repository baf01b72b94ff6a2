"""Reads several cameras at once, each in its own thread, and combines simultaneous pictures into sets."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import ExitStack
from typing import NamedTuple, Self

from shadowpuppet.pipeline.rig import NEAR
from shadowpuppet.video import Image
from shadowpuppet.video.capture import Capture
from shadowpuppet.video.live_source import Feed, Snapshot


class SnapshotSet(NamedTuple):
    """Simultaneous pictures of all cameras."""

    captured: float
    """Time of capture of the latest picture, seconds of the monotonic clock."""
    images: tuple[Image, ...]
    shown: float | None = None
    """Time in the films, seconds; None for cameras."""
    number: int = 0
    """Number of sets before it."""


class NewestSet:
    """Buffer for the newest set of pictures, with the interface of `Newest`."""

    def __init__(self, captures: Sequence[Capture], interval: float) -> None:
        """`interval`: seconds between two pictures of a camera."""
        self.captures, self.interval, self.put_count = captures, interval, 0
        self._next: list[Snapshot | None] = [None] * len(captures)

    def take(self, timeout: float = 0.0) -> SnapshotSet | None:
        """The next set, waiting up to `timeout` seconds; None if none comes."""
        end = time.monotonic() + timeout
        while behind := self.behind():
            for n in behind:
                if (shot := self.captures[n].newest.take(max(end - time.monotonic(), 0.0))) is None:
                    return None
                self._next[n] = shot
        shots = [shot for shot in self._next if shot is not None]
        self._next = [None] * len(self.captures)
        self.put_count += 1
        shown = [shot.shown for shot in shots if shot.shown is not None]
        return SnapshotSet(max(shot.captured for shot in shots), tuple(shot.image for shot in shots), max(shown, default=None),
                           self.put_count - 1)

    def behind(self) -> list[int]:
        """Indices of cameras without a picture, or with one older than another camera's by more than about half an interval (`NEAR`)."""
        films = all(shot is None or shot.shown is not None for shot in self._next)
        moments = [None if shot is None else shot.shown if films else shot.captured for shot in self._next]
        latest = max((moment for moment in moments if moment is not None), default=0.0)
        return [n for n, moment in enumerate(moments) if moment is None or moment < latest - NEAR * self.interval]

    @property
    def waiting(self) -> bool:
        """Whether the next set can still be completed: every camera that lacks a picture has one in its buffer, or has not ended."""
        return not any(self.captures[n].ended and not self.captures[n].newest.waiting for n in self.behind())


class RigCapture:
    """Reads several feeds within its `with` block; has the interface of `Capture`."""

    def __init__(self, feeds: Sequence[Feed], interval: float) -> None:
        """Reading starts with the `with` block; `interval`: seconds between two pictures of a camera."""
        self.captures = [Capture(feed) for feed in feeds]
        self.newest = NewestSet(self.captures, interval)
        self._open = ExitStack()

    def __enter__(self) -> Self:
        """Start reading."""
        for capture in self.captures:
            self._open.enter_context(capture)
        return self

    def __exit__(self, *_: object) -> None:
        """Stop reading."""
        self._open.close()

    def again(self) -> None:
        """Close and reopen all cameras."""
        for capture in self.captures:
            capture.again()

    def hold(self, still: bool) -> None:
        """Let films stand `still`, or go on."""
        for capture in self.captures:
            capture.hold(still)

    @property
    def problem(self) -> str:
        """Why no pictures come, in a sentence; empty while they do."""
        return next(filter(None, (capture.problem for capture in self.captures)), "")

    @property
    def ended(self) -> bool:
        """Whether any film is over."""
        return any(capture.ended for capture in self.captures)

    @property
    def error(self) -> BaseException | None:
        """An error that ended reading, other than a camera's breaking off; None if there is none."""
        return next((capture.error for capture in self.captures if capture.error is not None), None)
