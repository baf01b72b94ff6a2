"""Components of doubt that one and several cameras share: constants, joints that leave their course, pictures that do not change."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array

CONSTANT = 0.015
"""The constant component of doubt, metres: bodies differ in where their joints are."""
DISTANCE = 0.02
"""Standard deviation of a person's distance from an only camera, over it: bodies differ in their proportions."""
PACE = 1 / 15
"""Time (s) over which motion is compared, at any frame rate: neighbouring frames of a fast film differ by jitter."""
KEPT = 2.6 * PACE
"""Time (s) for which joints are kept."""
STILL_ALLOWED, STILL_UNIT = 2, 15
"""Frames that may repeat a silhouette, and the number of further ones after which a joint may be off by its lever."""


class Trail(NamedTuple):
    """Joints of the last moments, the latest last."""

    seconds: tuple[float, ...] = ()
    points: tuple[Array, ...] = ()
    """Of each time (L, 3), metres."""

    def with_frame(self, seconds: float, points: Array) -> Trail:
        """The trail with a new frame's joints (L, 3), less what `surprise` does not need: frames of the time `KEPT`, and two at least."""
        recent = sum(seconds - then <= KEPT for then in self.seconds)
        first = -max(recent, 2)
        return Trail((*self.seconds[first:], seconds), (*self.points[first:], points))

    def nearest(self, seconds: float) -> int:
        """Index of the frame nearest to a time (s)."""
        return int(np.argmin(np.abs(np.array(self.seconds) - seconds)))


def surprise(points: Array, seconds: float, trail: Trail) -> Array:
    """Distance (L,), metres, of joints (L, 3) from where the motion of the time `PACE` before the last would have taken them in it.

    0 until a trail is long enough. Of frames further apart: the distance in `PACE` at the same acceleration.
    """
    last = trail.nearest(seconds - PACE) if trail.seconds else 0
    first = min(trail.nearest(trail.seconds[last] - PACE), last - 1) if last else -1
    if first < 0 or seconds - trail.seconds[first] < 1.5 * PACE:
        return np.zeros(len(points))
    gaps = seconds - trail.seconds[last], trail.seconds[last] - trail.seconds[first]
    change = (points - trail.points[last]) / gaps[0] - (trail.points[last] - trail.points[first]) / gaps[1]
    return np.linalg.norm(change, axis=1) * (PACE**2 / max(sum(gaps) / 2, PACE))


def stillness(frames: int) -> float:
    """Factor of the joints' levers, 0 to 2, after a number of frames with the same silhouette."""
    return min(max(frames - STILL_ALLOWED, 0) / STILL_UNIT, 2.0)
