"""Fixed-lag smoothing: every pose as soon as some of the next are there, by the same cost as the pass over a whole film.

Poses that were given out count as known to a few millimetres, so that the motion goes on from them without a step. The frames since then
are estimated again with every frame, from the last estimate on.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import BLANK, MotionFrame
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother, Tracked

PAST = 0.15
"""Time (s) for which poses that were given out still count: three frames would be enough, but for the local speed."""
GIVEN_SD = 0.003
"""Deviation (m, and 1 for axes) of markers of poses that were given out."""
PAUSE = 0.5
"""Time (s) without a pose after which the motion begins again."""
ROUNDS, STEPS = 2, 2
"""Rounds of estimating speeds and outliers, and Gauss-Newton steps, a frame: each goes on from the last frame's."""


class _Given(NamedTuple):
    frame: MotionFrame
    pose: Array


class FixedLag:
    """Smooths frames as they come. Frames without a pose pass in their place."""

    def __init__(self, smoother: MotionSmoother, lag: float) -> None:
        """`smoother`: of the person's body; `lag`: seconds from a frame to the one with which it is given out, rounded to whole frames, at
        least one."""
        self.smoother, self.lag = smoother, lag
        self._waiting, self._given = deque[MotionFrame](), deque[_Given]()
        self._estimates = dict[float, Array]()
        self._free: NDArray[np.bool_] | None = None
        self._first: Array | None = None
        self._last = np.nan
        """Time of the newest frame with a pose."""

    def __call__(self, frame: MotionFrame) -> list[MotionFrame]:
        """The frames, smoothed, that are due when this one, later than all before, has come."""
        out = list[MotionFrame]()
        if _has_pose(frame):
            if frame.time - self._last > PAUSE:
                out = self.rest()
            self._last = frame.time
            pose = np.asarray(frame.pose, float)
            self._first = pose if self._first is None else self._first
            self._free = (pose != self._first) | (False if self._free is None else self._free)
        latest = frame.time - self.lag + (frame.time - self._waiting[-1].time if self._waiting else 0.0) / 2
        due = sum(each.time <= latest for each in self._waiting)
        self._waiting.append(frame)
        return out + self._give(due)

    def rest(self) -> list[MotionFrame]:
        """The frames that wait yet, when no more come for some time."""
        out = self._give(len(self._waiting))
        self._given.clear()
        return out

    def _give(self, count: int) -> list[MotionFrame]:
        """The first `count` frames that wait, which then wait no more."""
        if not count:
            return []
        self._estimate([each for each in self._waiting if _has_pose(each)])
        out = list(self._leave(count))
        while self._given and out and self._given[0].frame.time < out[-1].time - PAST:
            self._given.popleft()
        return out

    def _leave(self, count: int) -> Iterator[MotionFrame]:
        for _ in range(count):
            frame = self._waiting.popleft()
            pose = self._estimates.pop(frame.time, None)
            if pose is not None:
                self._given.append(_Given(frame, pose))
                frame = frame._replace(pose=pose, joints=self.smoother.points(pose[None])[0])
            yield frame

    def _estimate(self, waiting: list[MotionFrame]) -> None:
        """Estimate the poses of the frames that wait, which have one."""
        frames = [*(each.frame for each in self._given), *waiting]
        if not waiting:
            return
        known, skeleton = len(self._given), self.smoother.skeleton
        measured = np.array([*(each.pose for each in self._given), *(np.asarray(each.pose, float) for each in waiting)])
        start = measured.copy()
        for k, each in enumerate(waiting, known):
            start[k] = self._estimates.get(each.time, start[k])
        tracked = Tracked(np.array([each.time for each in frames]), measured, _stacked(frames, "pose_sd", (len(skeleton.dofs),)),
                          _stacked(frames, "joint_sd", self.smoother.points(measured[:1]).shape[1:]))
        assert self._free is not None
        found = self.smoother.likeliest(tracked, start, self._free, known, GIVEN_SD, ROUNDS, STEPS)
        self._estimates = {each.time: pose for each, pose in zip(waiting, found[known:])}


def _has_pose(frame: MotionFrame) -> bool:
    return frame.pose is not None and frame.status not in BLANK and bool(np.isfinite(np.asarray(frame.pose, float)).all())


def _stacked(frames: list[MotionFrame], name: str, shape: tuple[int, ...]) -> Array:
    """Deviations (T, *shape) of frames, not a number where none are stated."""
    return np.array([np.full(shape, np.nan) if (sd := getattr(each, name)) is None else np.asarray(sd, float) for each in frames])
