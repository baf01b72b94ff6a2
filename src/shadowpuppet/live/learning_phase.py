"""Collects pictures of the empty scene: a countdown, then some seconds without anybody."""

from __future__ import annotations

import numpy as np

from shadowpuppet.silhouette.background import FrameSampler, smoothed, to_planes
from shadowpuppet.video import Image

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
