"""A timeline: which frame is shown now, by a clock, a speed, and what was asked for."""

from __future__ import annotations

import threading
from collections.abc import Callable

import numpy as np

from shadowpuppet.geometry import Array

SPEEDS = (0.1, 0.25, 0.5, 1.0, 2.0, 4.0)
"""Seconds of the motion a second."""
REST = 1.0
"""Seconds that the last frame is seen before a loop begins anew, at most."""


class Timeline:
    """Frames at times (T,), seconds, of which one is the current. May be used from several threads."""

    def __init__(self, times: Array, clock: Callable[[], float], loop: bool = True) -> None:
        """`clock`: seconds that never go back."""
        self.times, self._clock, self.loop = np.asarray(times, float), clock, loop
        self._lock = threading.RLock()
        self._frame, self._speed = 0, 1.0
        self._began: tuple[float, float] | None = None

    @property
    def frame(self) -> int:
        """The current one."""
        return self._frame

    @property
    def time(self) -> float:
        """The current frame's, seconds."""
        return float(self.times[self._frame])

    @property
    def playing(self) -> bool:
        """Whether it goes on by itself."""
        return self._began is not None

    @property
    def speed(self) -> float:
        """Seconds of the motion a second."""
        return self._speed

    @speed.setter
    def speed(self, speed: float) -> None:
        with self._lock:
            self._speed = speed
            if self.playing:
                self.play()

    def play(self) -> None:
        """Go on from the current frame; from the first, where it is the last."""
        with self._lock:
            if len(self.times) < 2:
                return
            if self._frame == len(self.times) - 1:
                self._frame = 0
            self._began = self._clock(), self.time

    def pause(self) -> None:
        """Stay at the current frame."""
        with self._lock:
            self._began = None

    def seek(self, frame: int) -> None:
        """Go to a frame, and go on from there where it plays."""
        with self._lock:
            self._frame = int(np.clip(frame, 0, len(self.times) - 1))
            if self.playing:
                self._began = self._clock(), self.time

    def step(self, frames: int) -> None:
        """Go some frames on or back, and stay there."""
        with self._lock:
            self.pause()
            wanted, last = self._frame + frames, len(self.times) - 1
            self._frame = wanted % (last + 1) if self.loop else int(np.clip(wanted, 0, last))

    def tick(self) -> int:
        """The frame for now: the last one whose time has come."""
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
