"""Reads a camera in a thread: keeps the newest picture, drops older ones, and reopens a camera that breaks off."""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Generic, Self, TypeVar

from shadowpuppet.errors import VideoError
from shadowpuppet.video.live_source import Feed, Snapshot

Held = TypeVar("Held")
FIRST_WAIT, LONGEST_WAIT = 0.5, 8.0
"""Seconds before a camera that broke off is opened again; the wait doubles each time."""
NAP = 0.1
"""Seconds after which a film that stands still looks whether it is to end."""


class Newest(Generic[Held]):
    """A buffer for one item, shared by threads: a new item replaces one that was not taken."""

    def __init__(self) -> None:
        """Empty."""
        self.put_count, self.dropped = 0, 0
        self._item: Held | None = None
        self._changed = threading.Condition()

    def put(self, item: Held) -> None:
        """Store an item; one that was not taken is dropped, and counted."""
        with self._changed:
            self.put_count += 1
            self.dropped += self._item is not None
            self._item = item
            self._changed.notify_all()

    def take(self, timeout: float = 0.0) -> Held | None:
        """Remove and return the item, waiting up to `timeout` seconds; None if none comes."""
        with self._changed:
            if self._item is None and timeout > 0:
                self._changed.wait(timeout)
            item, self._item = self._item, None
            return item

    @property
    def waiting(self) -> bool:
        """Whether an item is stored."""
        return self._item is not None

    def wake(self) -> None:
        """End all waits in `take`."""
        with self._changed:
            self._changed.notify_all()


class CameraCapture:
    """Reads a feed within its `with` block; `newest.take()` is the latest picture."""

    def __init__(self, feed: Feed, newest: Newest[Snapshot] | None = None) -> None:
        """Reading starts with the `with` block; `newest`: the buffer that gets the pictures, a new one if left out."""
        self.feed, self.newest = feed, Newest[Snapshot]() if newest is None else newest
        self.problem = ""
        """Why no pictures come, as a sentence; empty while they do."""
        self.ended = False
        """Whether a film is over."""
        self.error: BaseException | None = None
        """An error that ended reading, other than a camera's breaking off."""
        self._stop, self._again, self._goes_on = threading.Event(), threading.Event(), threading.Event()
        self._goes_on.set()
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)

    def __enter__(self) -> Self:
        """Start the thread."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop reading; a driver that hangs is left to end with the program."""
        self._stop.set()
        self._thread.join(1.0)

    def again(self, _: int = 0) -> None:
        """Close and reopen the camera, for one whose picture is frozen."""
        self._again.set()

    def hold(self, still: bool) -> None:
        """Let a film stand `still`, or go on; a camera never stands still."""
        (self._goes_on.clear if still else self._goes_on.set)()

    def _held(self) -> float:
        """Wait while a film stands still; the seconds that it did."""
        before = time.monotonic()
        while not (self.feed.live or self._stop.is_set() or self._goes_on.wait(NAP)):
            pass
        held = time.monotonic() - before
        if held < NAP:
            return 0.0
        self.feed.put_off(held)
        return held

    def _run(self) -> None:
        try:
            self._read_on(self._stop.wait)
        except BaseException as error:
            self.error = error
        self.ended = True
        self.newest.wake()

    def _read_on(self, wait: Callable[[float], bool]) -> None:
        """Read until stopped; reopen a camera that breaks off after a wait."""
        pause = FIRST_WAIT
        while not self._stop.is_set():
            try:
                if self._read_once():
                    pause = FIRST_WAIT
                if not self.feed.live:
                    return
                if self._again.is_set():
                    self._again.clear()
                    continue
                self.problem = f"{self.feed.name}: gives no more pictures"
            except VideoError as error:
                if not self.feed.live:
                    raise
                self.problem = str(error)
            if wait(pause):
                return
            pause = min(2 * pause, LONGEST_WAIT)

    def _read_once(self) -> bool:
        """Read until the feed ends; returns whether a picture came."""
        came = False
        with contextlib.closing(self.feed.read()) as shots:  # type: ignore[type-var]
            for shot in shots:
                if self._stop.is_set() or self._again.is_set():
                    break
                self.problem, came = "", True
                self.newest.put(shot._replace(captured=shot.captured + self._held(), number=self.newest.put_count))
        return came
