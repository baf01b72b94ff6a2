"""Latency and rate of a session's poses."""

from __future__ import annotations

from array import array
from collections import deque
from typing import Any

import numpy as np

RECENT = 15
"""Number of pictures over which the displayed rate is averaged."""


class Timing:
    """Latencies and rates of a session, for the display and for metrics.json."""

    def __init__(self, rate: float) -> None:
        """`rate`: frames/s that the camera states; NaN if it does not."""
        self._usual = 1 / rate
        self.latencies, self._ages, self._done = array("d"), array("d"), deque[float](maxlen=RECENT + 1)
        self.dropped = 0
        """Pictures that came while another was tracked."""
        self._first: tuple[float, int] | None = None
        self._last, self._tracked, self._worked = (0.0, 0), -1, 0.0

    def came(self, captured: float, number: int) -> None:
        """Record that picture `number` was captured at a time (s)."""
        self._first, self._last = self._first or (captured, number), (captured, number)

    def pause(self) -> None:
        """Leave a gap in the pictures out of the rates."""
        self._usual, self._first, self._tracked = self.interval, None, -1
        self._done.clear()

    def done(self, captured: float, now: float, number: int) -> None:
        """Record that the pose of picture `number`, captured at a time (s), was found at time `now` (s)."""
        self.dropped += number - self._tracked - 1 if self._tracked >= 0 else 0
        self._tracked = number
        self.latencies.append(now - captured)
        self._worked += now - (self._done[-1] if self._done else captured)
        self._done.append(now)

    def given(self, age: float) -> None:
        """Record that a smoothed frame was given out, `age` seconds after its capture."""
        self._ages.append(age)

    @property
    def interval(self) -> float:
        """Seconds between pictures; by the camera's stated rate before two have come."""
        (last, number), (first, before) = self._last, self._first or self._last
        return (last - first) / (number - before) if number > before and last > first else self._usual

    @property
    def rate(self) -> float:
        """Poses/s over recent pictures; NaN before two poses."""
        return (len(self._done) - 1) / (self._done[-1] - self._done[0]) if len(self._done) > 1 else np.nan

    def summary(self) -> dict[str, Any]:
        """Entries of metrics.json: latencies in milliseconds and in frames of the camera, interval, rate."""
        if not self.latencies:
            return {}
        late, interval, of = np.array(self.latencies), self.interval, _summed(self.latencies)
        smoothed = {"smoothed_latency_ms": {key: round(1000 * value, 2) for key, value in _summed(self._ages).items()}}
        return {"latency_ms": {key: round(1000 * value, 2) for key, value in of.items()}, **(smoothed if self._ages else {}),
                "latency_frames": {key: round(value / interval, 3) for key, value in of.items()},
                "interval_ms": round(1000 * interval, 2), "frames_per_s": round(len(late) / max(self._worked, 1e-9), 2)}


def _summed(late: array[float]) -> dict[str, float]:
    """Median, 95th percentile and maximum of latencies, seconds; empty without any."""
    return {"median": float(np.median(late)), "p95": float(np.percentile(late, 95)), "max": max(late)} if late else {}
