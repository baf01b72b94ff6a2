"""A camera read in a thread of its own: its newest picture is kept, older ones are dropped; where it breaks off, it is tried again."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from typing import Generic, Self, TypeVar

from shadowpuppet.errors import VideoError
from shadowpuppet.video.live_source import Feed, Snapshot

Item = TypeVar("Item")
FIRST_WAIT, LONGEST_WAIT = 0.5, 8.0
"""Seconds before a camera that broke off is tried again; each time twice as long."""


class Newest(Generic[Item]):
    """A place for one thing: what is put there replaces what nobody took."""

    def __init__(self) -> None:
        """Empty."""
        self.put_count, self.dropped = 0, 0
        self._item: Item | None = None
        self._changed = threading.Condition()

    def put(self, item: Item) -> None:
        """Put a thing there; one that was not taken is dropped, and counted."""
        with self._changed:
            self.put_count += 1
            self.dropped += self._item is not None
            self._item = item
            self._changed.notify_all()

    def take(self, timeout: float = 0.0) -> Item | None:
        """What is there, waited for (seconds); None where nothing comes."""
        with self._changed:
            if self._item is None and timeout > 0:
                self._changed.wait(timeout)
            item, self._item = self._item, None
            return item

    @property
    def waiting(self) -> bool:
        """Whether something is there."""
        return self._item is not None

    def wake(self) -> None:
        """End the waiting of whoever waits."""
        with self._changed:
            self._changed.notify_all()


class Capture:
    """Reads a feed from `with` to its end; `newest.take()` is the last picture that came."""

    def __init__(self, feed: Feed) -> None:
        """Nothing is read yet."""
        self.feed, self.newest = feed, Newest[Snapshot]()
        self.problem = ""
        """Why no pictures come, in a sentence; empty while they do."""
        self.ended = False
        """Whether a film is over."""
        self.error: BaseException | None = None
        """What is not the camera's fault."""
        self._stop, self._again = threading.Event(), threading.Event()
        self._thread = threading.Thread(target=self._run, name="capture", daemon=True)

    def __enter__(self) -> Self:
        """Begin to read."""
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Let the feed go; a driver that does not return is left to end with the program."""
        self._stop.set()
        self._thread.join(1.0)

    def again(self) -> None:
        """Let go of the camera and open it once more, as for one whose picture stands still."""
        self._again.set()

    def _run(self) -> None:
        try:
            self._read_on(self._stop.wait)
        except BaseException as error:
            self.error = error
        self.ended = True
        self.newest.wake()

    def _read_on(self, wait: Callable[[float], bool]) -> None:
        """Read, and after a break try again after a while, until told to stop."""
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
        """Read until it ends; whether anything came."""
        came = False
        with contextlib.closing(self.feed.read()) as shots:  # type: ignore[type-var]
            for shot in shots:
                if self._stop.is_set() or self._again.is_set():
                    break
                self.problem, came = "", True
                self.newest.put(shot._replace(number=self.newest.put_count))
        return came
