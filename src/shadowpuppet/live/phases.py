"""Helpers for the phases before tracking: collect pictures of the scene, wait for a person, work in a thread."""

from __future__ import annotations

import atexit
import threading
import weakref
from collections import deque
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.silhouette.quality import MIN_CONTACT, NEARLY_ALL
from shadowpuppet.video import Image

NOBODY, TOO_NEAR = 0.015, 0.6
"""Shares of the picture: a smaller silhouette is no person, a larger one is a person too near."""
STILL = 0.1
"""Largest difference to an earlier silhouette, as a share of the silhouette's pixels, while a person stands still."""
APART = 0.25
"""Age of that earlier silhouette, seconds."""
MEASURED = 6
"""Number of silhouettes of a still person from which they are measured."""
MOVING = 3.0
"""Seconds in the picture after which a person is measured, whatever they do."""


class StandStillDetector:
    """Detects from silhouettes when a person can be measured: having stood still for long enough, or been in the picture for `MOVING`."""

    def __init__(self, seconds: float) -> None:
        """`seconds`: how long a person must stand still."""
        self.seconds, self.message = seconds, "step into the picture, facing the camera"
        self._seen: deque[tuple[float, Mask]] = deque()
        self._since, self._there = np.nan, np.nan

    def see(self, now: float, mask: Mask) -> list[Mask] | None:
        """Take a silhouette (H, W) at time `now` (s). Returns up to `MEASURED` silhouettes of a person who stood still, twice as many of
        one who moved; None before."""
        while len(self._seen) > 1 and self._seen[0][0] < now - max(self.seconds, APART, MOVING) - 0.5:
            self._seen.popleft()
        hint = unfit(mask)
        moves = not hint and self._moves(now, mask)
        self._seen.append((now, mask))
        self.message = hint or "stand still a moment, facing the camera"
        if hint:
            self._since = self._there = np.nan
            return None
        self._there = now if np.isnan(self._there) else self._there
        if moves:
            self._since = np.nan
        elif np.isnan(self._since):
            self._since = now
        if now - self._since >= self.seconds:
            return self._from(self._since, MEASURED)
        return self._from(self._there, 2 * MEASURED) if now - self._there >= MOVING else None

    def _from(self, since: float, most: int) -> list[Mask]:
        """At most `most` silhouettes from the time `since` (s) on."""
        seen = [mask for time, mask in self._seen if time >= since]
        return [seen[k] for k in evenly_spread(len(seen), most)]

    def wait(self) -> None:
        """Start again, after a gap in the pictures."""
        self._seen.clear()
        self._since = self._there = np.nan

    def _moves(self, now: float, mask: Mask) -> bool:
        """Whether the silhouette differs from the one `APART` seconds earlier, or from the last one if there is none that old."""
        earlier = [seen for time, seen in self._seen if time <= now - APART] or [seen for _, seen in self._seen]
        return not earlier or bool(np.count_nonzero(mask ^ earlier[-1]) > STILL * np.count_nonzero(mask))


def unfit(mask: Mask) -> str:
    """Advice for a person who cannot be measured in a silhouette (H, W); empty if they can."""
    share = float(mask.mean())
    if share >= NEARLY_ALL:
        return "nearly all of the picture has changed: let the background be learnt again"
    if share < NOBODY:
        return "step into the picture, facing the camera"
    if share > TOO_NEAR or int(mask[0].sum()) >= MIN_CONTACT:
        return "step back: the head must be in the picture"
    if max(int(mask[:, 0].sum()), int(mask[:, -1].sum())) >= MIN_CONTACT:
        return "move to the middle of the picture"
    return ""


Returned = TypeVar("Returned")


_RUNNING = weakref.WeakSet[threading.Thread]()
ENDING = 10.0
"""Longest time (s) that the program's end waits for a task: Python ends a thread that is in compiled code by aborting the program."""


@atexit.register
def _wait() -> None:
    for thread in list(_RUNNING):
        thread.join(ENDING)


def in_background(task: Callable[[], Returned]) -> Callable[[], Returned | None]:
    """Start a task in a daemon thread; returns a function that returns the result, or None while it is not ready.

    That function raises the task's error.
    """
    done: list[Returned] = []
    failed: list[BaseException] = []

    def run() -> None:
        try:
            done.append(task())
        except BaseException as error:
            failed.append(error)

    def result() -> Returned | None:
        if failed:
            raise failed[0]
        return done[0] if done else None

    thread = threading.Thread(target=run, name="measuring", daemon=True)
    _RUNNING.add(thread)
    thread.start()
    return result


KEPT = 20
"""Least number of pictures that are kept of a session; at most twice as many are."""


class PictureSampler:
    """Keeps `KEPT` to twice `KEPT` of the pictures added, evenly spread, with their times; all of them if there are fewer."""

    def __init__(self) -> None:
        """A sampler without pictures."""
        self.kept: list[tuple[float, Image]] = []
        self._step, self._seen = 1, 0

    def add(self, time: float, image: Image) -> None:
        """Add the next picture (H, W, 3) or (H, W), of a time (s)."""
        if self._seen % self._step == 0:
            self.kept.append((time, image))
            if len(self.kept) == 2 * KEPT:
                self.kept, self._step = self.kept[::2], 2 * self._step
        self._seen += 1


class BackgroundCollector:
    """Counts down from the first picture on, then collects pictures of the scene, empty or not."""

    def __init__(self, countdown: float, seconds: float) -> None:
        """`countdown`: seconds until collecting begins; `seconds`: how long it lasts."""
        self.countdown, self.seconds = countdown, seconds
        self.wait()

    def see(self, now: float, image: Image) -> bool:
        """Take a picture (H, W, 3) or (H, W) at time `now` (s). Returns whether there are enough."""
        self._began = now if np.isnan(self._began) else self._began
        self._left = self._began + self.countdown + self.seconds - now
        if self._left <= self.seconds:
            self.pictures.add(now, image)
        return self._left <= 0 and len(self.pictures.kept) > 1

    def wait(self) -> None:
        """Start again with the next picture, after a gap in the pictures."""
        self.pictures, self._began, self._left = PictureSampler(), np.nan, self.countdown + self.seconds

    @property
    def left(self) -> float:
        """Seconds left of the countdown, or, after it, of collecting."""
        return max(self._left - self.seconds if self._left > self.seconds else self._left, 0.0)

    @property
    def message(self) -> str:
        """Instruction to the person; without a countdown there is none to be given."""
        if self._left > self.seconds:
            return "step out of the picture, or stay and move"
        return "finding the empty scene" if self.countdown == 0 else "stay out, or keep moving: finding the empty scene"
