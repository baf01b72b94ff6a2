"""Checks that a camera's pictures come, change, and keep their size."""

from __future__ import annotations

import numpy as np

from shadowpuppet.video import Image, Size
from shadowpuppet.video.frames import size_of

SILENT, SILENT_FRAMES = 1.0, 5.0
"""Seconds, and multiples of the camera's interval, without a picture after which it counts as silent; the longer one holds."""
FROZEN, FROZEN_FRAMES = 1.5, 5
"""Seconds and number of identical pictures after which a camera counts as frozen: real ones have noise."""
FIRST_PATIENCE, LONGEST_PATIENCE = 3.0, 60.0
"""Seconds before a frozen camera is opened again; doubled each time."""


class CameraWatchdog:
    """Reports problems of a camera's pictures, in sentences for the user."""

    def __init__(self, name: str, size: Size, live: bool) -> None:
        """`size`: expected size of the pictures; a source that is not `live`, a film, is never reported as frozen or silent."""
        self.name, self.size, self.live = name, size, live
        self._last: Image | None = None
        self._changed = self._came = np.nan
        self._same = 0
        self._patience, self._asked = FIRST_PATIENCE, np.nan

    def see(self, now: float, image: Image) -> str:
        """The problem of a picture that came at time `now` (s), in a sentence; empty if there is none."""
        self._came = now
        if size_of(image) != self.size:
            found = size_of(image)
            return (f"{self.name}: found pictures of {found[0]} x {found[1]} pixels, expected {self.size[0]} x {self.size[1]} as before; "
                    "they are not used")
        if self._last is None or not _same(image, self._last):
            self._last, self._changed, self._same = image, now, 0
            self._patience, self._asked = FIRST_PATIENCE, np.nan
            return ""
        self._same += 1
        return f"{self.name}: the picture stands still" if self.frozen(now) else ""

    def frozen(self, now: float) -> bool:
        """Whether the same picture has come repeatedly for `FROZEN` seconds."""
        return self.live and self._same >= FROZEN_FRAMES and now - self._changed >= FROZEN

    def silence(self, now: float, problem: str, interval: float) -> str:
        """The problem if no picture has come by time `now` (s), in a sentence; empty if it is too early to tell.

        `problem`: the reader's message; `interval`: seconds between pictures.
        """
        self._came = now if np.isnan(self._came) else self._came
        if problem:
            return f"{problem} (it is tried again)"
        usual = SILENT_FRAMES * interval if np.isfinite(interval) else 0.0
        silent = self.live and now - self._came > max(SILENT, usual)
        return f"{self.name}: no picture for {now - self._came:.0f} s" if silent else ""

    def asks_again(self, now: float) -> bool:
        """Whether a frozen camera should be opened again; true once per waiting time."""
        if not self.frozen(now):
            return False
        self._asked = now if np.isnan(self._asked) else self._asked
        if now - self._asked < self._patience:
            return False
        self._asked, self._patience = now, min(2 * self._patience, LONGEST_PATIENCE)
        return True


def _same(image: Image, other: Image) -> bool:
    return np.array_equal(image[::8, ::8], other[::8, ::8]) and np.array_equal(image, other)
