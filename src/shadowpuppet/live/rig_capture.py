"""Reads several cameras at once, each in its own thread, and combines simultaneous pictures into sets."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from contextlib import ExitStack
from typing import NamedTuple, Self

import numpy as np

from shadowpuppet.pipeline.rig import NEAR
from shadowpuppet.video import Image
from shadowpuppet.video.capture import CameraCapture, Newest
from shadowpuppet.video.live_source import Feed, Snapshot

RECENT = 16
"""Number of recent pictures of a camera by which its interval is measured."""
SILENT = 3.0
"""Intervals after which a camera that gives no picture is not waited for any more."""


class SnapshotSet(NamedTuple):
    """Simultaneous pictures of all cameras."""

    captured: float
    """Time of capture, seconds of the monotonic clock; of several cameras that of the leading one (`Pairing`)."""
    images: tuple[Image | None, ...]
    """Each camera's picture; None of one that has none near that time."""
    shown: float | None = None
    """Time in the films, seconds; None for cameras."""
    number: int = 0
    """Number of sets before it."""


class _Pictures:
    """A camera's pictures that are in no set yet."""

    def __init__(self, rate: float) -> None:
        """`rate`: frames/s that the camera states; NaN if it does not."""
        self.waiting = deque[Snapshot]()
        self.last = -np.inf
        """Time of capture of the newest picture, seconds."""
        self._stated = 1 / rate if rate > 0 else 1 / 30
        self._steps = deque[float](maxlen=RECENT)

    def add(self, shot: Snapshot) -> None:
        """Add the next picture."""
        if np.isfinite(self.last):
            self._steps.append(shot.captured - self.last)
        self.last = shot.captured
        self.waiting.append(shot)

    @property
    def interval(self) -> float:
        """Seconds between its pictures: as stated at first, then as they come, less the longest gap, which may be a break."""
        if len(self._steps) < RECENT // 2:
            return self._stated
        return max((sum(self._steps) - max(self._steps)) / (len(self._steps) - 1), 1e-3)

    def nearest(self, moment: float, reach: float) -> Snapshot | None:
        """Take out the picture nearest to a time (s), and all before it; None if none is within `reach` (s)."""
        best = None
        while self.waiting and self.waiting[0].captured <= moment + reach:
            if best is not None and abs(self.waiting[0].captured - moment) > abs(best.captured - moment):
                break  # it may belong to the next set
            best = self.waiting.popleft()
        return best if best is not None and best.captured >= moment - reach else None


class Pairing:
    """Combines the pictures of several cameras into sets, by the times at which they were captured.

    A leading camera, of the median rate among those that give pictures, sets the time; of each other the nearest picture belongs to it, at
    most about half the leader's interval (`NEAR`) away. A set is complete when every camera has a later picture, or is to give its next
    one too late. A camera that is overdue by `SILENT` intervals is not waited for.
    """

    def __init__(self, rates: Sequence[float], delays: Sequence[float]) -> None:
        """`rates`: frames/s that the cameras state, NaN for none; `delays`: seconds from a picture's capture to its arrival."""
        self.cameras, self.delays = [_Pictures(rate) for rate in rates], tuple(delays)
        self._moment = -np.inf

    def add(self, camera: int, shot: Snapshot) -> list[SnapshotSet]:
        """Add a camera's next picture; the sets that are complete now."""
        self.cameras[camera].add(shot)
        sets = []
        while (found := self._next()) is not None:
            sets.append(found)
        return sets

    def _next(self) -> SnapshotSet | None:
        now = max(camera.last for camera in self.cameras)
        first = min(camera.last for camera in self.cameras) == -np.inf  # some have not begun
        giving = [n for n, camera in enumerate(self.cameras)
                  if first or now - camera.last - self.delays[n] <= SILENT * camera.interval]
        middle = sorted(self.cameras[n].interval for n in giving)[len(giving) // 2]
        leader = min(giving, key=lambda n: (round(abs(middle / self.cameras[n].interval - 1), 1), n))
        interval, own = self.cameras[leader].interval, self.cameras[leader].waiting
        while own and own[0].captured <= self._moment:
            own.popleft()  # from before this camera led
        if not own or any(self._may_come(self.cameras[n], own[0].captured, NEAR * interval) for n in giving):
            return None
        self._moment = own[0].captured
        shots = [camera.nearest(self._moment, NEAR * interval) for camera in self.cameras]
        shown = [shot.shown for shot in shots if shot is not None and shot.shown is not None]
        return SnapshotSet(self._moment, tuple(None if shot is None else shot.image for shot in shots), max(shown, default=None))

    @staticmethod
    def _may_come(camera: _Pictures, moment: float, reach: float) -> bool:
        """Whether a camera may yet give a picture that is nearer to a time (s) than those it gave."""
        return camera.last < moment and camera.last + camera.interval <= moment + reach


class _Member(Newest[Snapshot]):
    """Takes the pictures of one of several cameras."""

    def __init__(self, capture: RigCapture, camera: int) -> None:
        super().__init__()
        self._capture, self._camera = capture, camera

    def put(self, item: Snapshot) -> None:
        self.put_count += 1
        self._capture.add(self._camera, item)

    def wake(self) -> None:
        self._capture.newest.wake()


class RigCapture:
    """Reads several feeds within its `with` block; has the interface of `CameraCapture`."""

    def __init__(self, feeds: Sequence[Feed], delays: Sequence[float] = ()) -> None:
        """Reading starts with the `with` block; `delays`: seconds from a picture's capture to its arrival, already taken off the feeds'
        times; none if left out."""
        self.captures = [CameraCapture(feed, _Member(self, n)) for n, feed in enumerate(feeds)]
        self.newest = Newest[SnapshotSet]()
        self._pairing, self._adding = Pairing([feed.rate for feed in feeds], delays or (0.0,) * len(feeds)), threading.Lock()
        self._open = ExitStack()

    def add(self, camera: int, shot: Snapshot) -> None:
        """Add a camera's picture, in its thread."""
        with self._adding:
            for each in self._pairing.add(camera, shot):
                self.newest.put(each._replace(number=self.newest.put_count))

    def __enter__(self) -> Self:
        """Start reading."""
        for capture in self.captures:
            self._open.enter_context(capture)
        return self

    def __exit__(self, *_: object) -> None:
        """Stop reading."""
        self._open.close()

    def again(self, camera: int) -> None:
        """Close and reopen a camera."""
        self.captures[camera].again()

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
