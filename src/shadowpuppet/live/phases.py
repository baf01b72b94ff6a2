"""What happens before tracking: the empty scene is collected, a person stands still, the sizes are fitted in a thread."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from typing import TypeVar

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.silhouette.background import FrameSampler, smoothed, to_planes
from shadowpuppet.silhouette.quality import MIN_CONTACT, NEARLY_ALL
from shadowpuppet.video import Image

NOBODY, TOO_NEAR = 0.015, 0.6
"""Share of the picture under which a silhouette is no person, and from which on a person is too near."""
STILL = 0.1
"""Largest share of a silhouette's pixels that differ from an earlier one while a person stands still..."""
APART = 0.25
"""... this many seconds before."""
MEASURED = 6
"""Number of silhouettes in which a person is measured."""


class StandStillDetector:
    """Looks at silhouettes until a person has stood still for long enough to be measured."""

    def __init__(self, seconds: float) -> None:
        """`seconds`: how long a person must stand still."""
        self.seconds, self.message = seconds, "step into the picture, facing the camera"
        self._seen: deque[tuple[float, Mask]] = deque()
        self._since = np.nan

    def see(self, now: float, mask: Mask) -> list[Mask] | None:
        """Take a silhouette (H, W) at a time (s); returns those of the person who stood still, once there is one, else None."""
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
        return [still[k] for k in np.unique(np.linspace(0, len(still) - 1, MEASURED).astype(int))]

    def wait(self) -> None:
        """No pictures came for a while: start again."""
        self._seen.clear()
        self._since = np.nan

    def _moves(self, now: float, mask: Mask) -> bool:
        """Whether the silhouette differs from that of a quarter of a second ago, or from the last where there is none."""
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
    """Start a task in a daemon thread; the answer gives its result, None before it is ready.

    An error of the task is raised by the answer.
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
"""Pictures of the empty scene that are kept: this many to twice as many."""
MOVED, MOVED_SHARE = 20.0, 0.005
"""Difference (grey levels) of a pixel between the first and the last pictures, and share of such pixels, from which on something moved."""
TRIES = 3
"""Attempts to learn a moving scene, before it is taken as it is."""


class BackgroundCollector:
    """Counts down, then collects the empty scene, from the first picture on."""

    def __init__(self, countdown: float, seconds: float) -> None:
        """Seconds until learning begins, and how long it takes."""
        self.countdown, self.seconds = countdown, seconds
        self.tries, self.note = 0, ""
        self._spread, self._began, self._left = FrameSampler(KEPT), np.nan, countdown + seconds

    def see(self, now: float, image: Image) -> list[Image] | None:
        """A picture (H, W, 3) or (H, W) at a time (s); the empty scene's pictures, once there are enough."""
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
        """No pictures came for a while: start again with the next one."""
        self._spread, self._began, self._left = FrameSampler(KEPT), np.nan, self.countdown + self.seconds

    @property
    def left(self) -> float:
        """Seconds until the countdown ends, or then until all is learnt."""
        return max(self._left - self.seconds if self._left > self.seconds else self._left, 0.0)

    @property
    def message(self) -> str:
        """What the person is to do."""
        return f"{self.note}step out of the picture" if self._left > self.seconds else "stay out: the empty scene is learnt"


def moved(scene: list[Image]) -> bool:
    """Whether the last third of some pictures differs from the first."""
    third = max(len(scene) // 3, 1)
    before, after = (np.mean([smoothed(to_planes(image)).astype(np.float32) for image in part], axis=0)
                     for part in (scene[:third], scene[-third:]))
    return float((np.abs(after - before).max(2) > MOVED).mean()) > MOVED_SHARE
