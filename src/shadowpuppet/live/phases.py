"""Helpers for the phases before tracking: collect the empty scene, detect a person standing still, fit the sizes in a thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.silhouette.background import FrameSampler, smoothed, to_planes
from shadowpuppet.silhouette.quality import MIN_CONTACT, NEARLY_ALL
from shadowpuppet.video import Image

NOBODY, TOO_NEAR = 0.015, 0.6
"""Shares of the picture: a smaller silhouette is no person, a larger one is a person too near."""
STILL = 0.1
"""Largest difference to an earlier silhouette, as a share of the silhouette's pixels, while a person stands still."""
APART = 0.25
"""Age of that earlier silhouette, seconds."""
MEASURED = 6
"""Number of silhouettes from which a person is measured."""


class StandStillDetector:
    """Detects from silhouettes when a person has stood still for long enough to be measured."""

    def __init__(self, seconds: float) -> None:
        """`seconds`: how long a person must stand still."""
        self.seconds, self.message = seconds, "step into the picture, facing the camera"
        self._seen: deque[tuple[float, Mask]] = deque()
        self._since = np.nan

    def see(self, now: float, mask: Mask) -> list[Mask] | None:
        """Take a silhouette (H, W) at time `now` (s). Returns up to `MEASURED` silhouettes once a person has stood still, else None."""
        while len(self._seen) > 1 and self._seen[0][0] < now - max(self.seconds, APART) - 0.5:
            self._seen.popleft()
        hint = unfit(mask)
        moves = not hint and self._moves(now, mask)
        self._seen.append((now, mask))
        if hint or moves:
            self._since, self.message = np.nan, hint or "stand still a moment, facing the camera"
            return None
        self._since = now if np.isnan(self._since) else self._since
        self.message = "stand still a moment, facing the camera"
        if now - self._since < self.seconds:
            return None
        still = [seen for time, seen in self._seen if time >= self._since]
        return [still[k] for k in evenly_spread(len(still), MEASURED)]

    def wait(self) -> None:
        """Start again, after a gap in the pictures."""
        self._seen.clear()
        self._since = np.nan

    def _moves(self, now: float, mask: Mask) -> bool:
        """Whether the silhouette differs from the one `APART` seconds earlier, or from the last one if there is none that old."""
        earlier = [seen for time, seen in self._seen if time <= now - APART] or [seen for _, seen in self._seen]
        return not earlier or bool(np.count_nonzero(mask ^ earlier[-1]) > STILL * np.count_nonzero(mask))


def unfit(mask: Mask) -> str:
    """Advice for a person who cannot be measured in a silhouette (H, W); empty if they can."""
    share = float(mask.mean())
    if share >= NEARLY_ALL:
        return "nearly all of the picture has changed: let the background be learnt anew"
    if share < NOBODY:
        return "step into the picture, facing the camera"
    if share > TOO_NEAR or int(mask[0].sum()) >= MIN_CONTACT:
        return "step back: the head must be in the picture"
    if max(int(mask[:, 0].sum()), int(mask[:, -1].sum())) >= MIN_CONTACT:
        return "move to the middle of the picture"
    return ""


Result = TypeVar("Result")


def in_background(task: Callable[[], Result]) -> Callable[[], Result | None]:
    """Start a task in a daemon thread; returns a function that returns the result, or None while it is not ready.

    That function raises the task's error.
    """
    done: list[Result] = []
    failed: list[BaseException] = []

    def run() -> None:
        try:
            done.append(task())
        except BaseException as error:
            failed.append(error)

    def result() -> Result | None:
        if failed:
            raise failed[0]
        return done[0] if done else None

    threading.Thread(target=run, name="measuring", daemon=True).start()
    return result


KEPT = 20
"""Least number of pictures of the empty scene that are kept; at most twice as many are."""
MOVED, MOVED_SHARE = 20.0, 0.005
"""The scene moved if more than this share of pixels differ by more than this many grey levels between the first and the last pictures."""
TRIES = 3
"""Number of attempts; the last one is used even if the scene moved."""


class BackgroundCollector:
    """Counts down from the first picture on, then collects pictures of the empty scene."""

    def __init__(self, countdown: float, seconds: float) -> None:
        """`countdown`: seconds until collecting begins; `seconds`: how long it lasts."""
        self.countdown, self.seconds = countdown, seconds
        self.tries, self.note = 0, ""
        self._spread, self._began, self._left = FrameSampler(KEPT), np.nan, countdown + seconds

    def see(self, now: float, image: Image) -> list[Image] | None:
        """Take a picture (H, W, 3) or (H, W) at time `now` (s). Returns the pictures of the empty scene once it is complete, else None."""
        self._began = now if np.isnan(self._began) else self._began
        self._left = self._began + self.countdown + self.seconds - now
        if self._left <= self.seconds:
            self._spread.add(image)
        if self._left > 0 or len(self._spread.kept) < 2:
            return None
        scene = self._spread.kept
        self.tries += 1
        if self.tries < TRIES and moved(scene):
            self.note, self._spread, self._began = "something moved: ", FrameSampler(KEPT), np.nan
            return None
        return scene

    def wait(self) -> None:
        """Start again with the next picture, after a gap in the pictures."""
        self._spread, self._began, self._left = FrameSampler(KEPT), np.nan, self.countdown + self.seconds

    @property
    def left(self) -> float:
        """Seconds left of the countdown, or, after it, of collecting."""
        return max(self._left - self.seconds if self._left > self.seconds else self._left, 0.0)

    @property
    def message(self) -> str:
        """Instruction to the person."""
        return f"{self.note}step out of the picture" if self._left > self.seconds else "stay out: the empty scene is learnt"


def moved(scene: list[Image]) -> bool:
    """Whether the last third of the pictures differs from the first third."""
    third = max(len(scene) // 3, 1)
    before, after = (np.mean([smoothed(to_planes(image)).astype(np.float32) for image in part], axis=0)
                     for part in (scene[:third], scene[-third:]))
    return float((np.abs(after - before).max(2) > MOVED).mean()) > MOVED_SHARE
