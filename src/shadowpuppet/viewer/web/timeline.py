"""The viewer's timeline: the current frame, determined by a clock, the playback speed and the user's commands."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from shadowpuppet.geometry import Array

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Playback speeds."""
REST = 1.0
"""Longest pause at the last frame before a loop starts again, seconds."""


class Timeline:
    """Frames at times (T,), seconds, one of them current. Thread-safe."""

    def __init__(self, times: Array, clock: Callable[[], float], loop: bool = True) -> None:
        """`clock`: monotonic seconds."""
        self.times, self._clock, self.loop = np.asarray(times, float), clock, loop
        self._lock = threading.RLock()
        self._frame, self._speed = 0, 1.0
        self._began: tuple[float, float] | None = None

    @property
    def frame(self) -> int:
        """Index of the current frame."""
        return self._frame

    @property
    def time(self) -> float:
        """Time of the current frame, seconds."""
        return float(self.times[self._frame])

    @property
    def playing(self) -> bool:
        """Whether the timeline is playing."""
        return self._began is not None

    @property
    def speed(self) -> float:
        """Playback speed."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        with self._lock:
            self._speed = speed
            if self.playing:
                self.play()

    def play(self) -> None:
        """Play from the current frame; from the first after the last."""
        with self._lock:
            if len(self.times) < 2:
                return
            if self._frame == len(self.times) - 1:
                self._frame = 0
            self._began = self._clock(), self.time

    def pause(self) -> None:
        """Stop at the current frame."""
        with self._lock:
            self._began = None

    def seek(self, frame: int) -> None:
        """Go to a frame; playing goes on from there."""
        with self._lock:
            self._frame = int(np.clip(frame, 0, len(self.times) - 1))
            if self.playing:
                self._began = self._clock(), self.time

    def step(self, frames: int) -> None:
        """Go some frames forward or back, and stop."""
        with self._lock:
            self.pause()
            wanted, last = self._frame + frames, len(self.times) - 1
            self._frame = wanted % (last + 1) if self.loop else int(np.clip(wanted, 0, last))

    def tick(self) -> int:
        """Advance to the current time; returns the frame."""
        with self._lock:
            if self._began is None:
                return self._frame
            began, start = self._began
            now = start + (self._clock() - began) * self._speed
            if now > self.times[-1] + min(REST * self._speed, self._last_step):
                if self.loop:
                    self._frame, now = 0, float(self.times[0])
                    self._began = self._clock(), now
                else:
                    self._frame, self._began = len(self.times) - 1, None
                    return self._frame
            self._frame = max(int(np.searchsorted(self.times, now + 1e-9, side="right")) - 1, 0)
            return self._frame

    @property
    def _last_step(self) -> float:
        return float(np.median(np.diff(self.times)))
