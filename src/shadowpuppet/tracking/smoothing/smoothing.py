"""A tracked motion smoothed over time, in overlapping blocks: poses of the same body, with short gaps bridged."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import filled, true_runs
from shadowpuppet.motion.motion import Motion
from shadowpuppet.tracking.smoothing.butterworth import PASSES, filtered
from shadowpuppet.tracking.smoothing.facing import turned_on
from shadowpuppet.tracking.smoothing.fixed_interval import LEAST, ORDER, differences, smooth
from shadowpuppet.tracking.smoothing.gaps import bridged, stray
from shadowpuppet.tracking.smoothing.method import Method
from shadowpuppet.tracking.smoothing.pose_path import PathCost, likeliest_poses
from shadowpuppet.tracking.smoothing.projection import Markers, Points, markers, nearest_poses

BLOCK, OVERLAP = 1500, 4.0
"""Frames of a block, and the time (s) by which it is continued at both ends, after which a frame has no influence."""
UNSTATED = 0.02
"""Deviation (m or rad) where none is stated."""
GREATEST_TURN = 1.0
"""Bound of the deviation (rad) of a joint's orientation."""
AXES_SHARE = 0.03
"""Weight of the axes' costs: they repeat what the joints' positions say, but for twists."""
ARM = 0.3
"""Length (m) of a limb, which makes accelerations of its end accelerations of its turn."""


class SmoothedMotion(NamedTuple):
    """A smoothed motion, and what was bridged."""

    motion: Motion
    bridged: NDArray[np.bool_]
    """Frames (T,) that were unknown and are `predicted` now."""
    mirrored: NDArray[np.bool_]
    """Frames (T,) in which the person has turned away from one camera, whose tracker took them for facing it."""


@dataclass(frozen=True, eq=False)
class MotionSmoother:
    """Smooths motions of a body."""

    skeleton: Skeleton
    points: Points
    """From poses (N, D) to the motion's joints (N, J, 3) in the world, metres."""
    method: Method = "tracker"
    cutoff: float = 6.0
    """Of the low-pass filter, Hz."""
    gaps: float = 0.5
    """Longest gap that is bridged, seconds; 0: none."""
    away: bool = False
    """Whether one camera first sees the person from behind."""

    def __call__(self, motion: Motion) -> SmoothedMotion:
        """A motion smoothed in runs of known frames. Raises `SettingsError` for a cut-off that the frame rate does not allow."""
        motion, mirrored = self._faced(motion)
        inside = bridged(motion.times, motion.joints, self.gaps)
        poses, known = motion.poses.copy(), motion.known
        free = np.asarray((poses[known] != poses[known][:1]).any(0))
        for begin, end in true_runs(known | inside):
            for block, kept in _blocks(motion.times, begin, end):
                poses[kept] = self._poses(motion[block], free)[kept.start - block.start : kept.stop - block.start]
        return SmoothedMotion(self._motion(motion, poses, inside), inside, mirrored)

    @property
    def summary(self) -> dict[str, Any]:
        """What is done, as plain values."""
        if self.method == "butterworth":
            return {"method": self.method, "cutoff_hz": self.cutoff, "order": 2 * PASSES, "lag": 0, "gaps_s": self.gaps}
        return {"method": self.method, "gaps_s": self.gaps}

    def _faced(self, motion: Motion) -> tuple[Motion, NDArray[np.bool_]]:
        """The motion of a person who may turn right round, and the frames (T,) that are mirrored."""
        if self.method == "off":
            return motion, np.zeros(len(motion), bool)
        turned, mirrored = turned_on(motion, self.away)
        joints = motion.joints.copy()
        changed = mirrored & motion.known
        joints[changed] = self.points(turned.poses[changed])
        return replace(turned, joints=joints), mirrored

    def _poses(self, motion: Motion, free: NDArray[np.bool_]) -> Array:
        """Poses (T, D) of a run of frames in which no gap is left."""
        start = np.clip(filled(motion.times, _unwrapped(self.skeleton, motion.poses)), *self._wide(motion.poses))
        raw = markers(self.skeleton, self.points, start)
        unknown, number = ~motion.known, motion.joints.shape[1]
        both = np.where(unknown[:, None, None], np.nan, np.concatenate(raw, axis=1))
        if self.method == "butterworth":
            found = filtered(motion.times, both, self.cutoff)
            return self._nearest(start, found, number, free)
        turns = np.repeat(self._turns(_stated(motion.pose_sd)), 3, axis=1)
        sd = np.concatenate([_stated(motion.joint_sd), np.repeat(turns[..., None], 3, axis=2)], 1)
        found = smooth(motion.times, both, sd, np.repeat([LEAST, LEAST / ARM], [number, turns.shape[1]]))
        near = self._nearest(start, found.points, number, free)
        if len(motion) <= ORDER:
            return near
        share = np.repeat([1.0, AXES_SHARE], [number, turns.shape[1]])
        cost = PathCost(_in_a_row(filled(motion.times, both)), _in_a_row(found.precision * share[:, None]), differences(motion.times),
                        np.repeat(found.variances / share, 3, axis=1))
        return likeliest_poses(self.skeleton, self.points, near, cost, free)

    def _nearest(self, start: Array, found: Array, number: int, free: NDArray[np.bool_]) -> Array:
        """Poses (T, D) near `start` whose markers are nearest to those found (T, M, 3), `number` points before the axes."""
        return nearest_poses(self.skeleton, self.points, start, Markers(found[:, :number], found[:, number:]), free)

    def _wide(self, poses: Array) -> tuple[Array, Array]:
        low, high = self.skeleton.limits
        return np.minimum(low, np.nanmin(poses, 0)), np.maximum(high, np.nanmax(poses, 0))

    def _turns(self, sd: Array) -> Array:
        """Deviations (T, J), rad, of the orientations of the skeleton's joints, from those of the degrees of freedom (T, D)."""
        out = np.zeros((len(sd), len(self.skeleton.joints)))
        for dof, column in zip(self.skeleton.dofs, sd.T):
            if dof.kind != "translation":
                out[:, self.skeleton.joint_index(dof.joint)] += column**2
        for j, joint in enumerate(self.skeleton.joints):
            if joint.parent is not None:
                out[:, j] += out[:, self.skeleton.joint_index(joint.parent)]
        return np.sqrt(np.clip(out, UNSTATED**2, GREATEST_TURN**2))

    def _motion(self, motion: Motion, poses: Array, inside: NDArray[np.bool_]) -> Motion:
        """The motion with new poses (T, D) and their joints; bridged frames are `predicted`, with deviations that grow into the gap."""
        changed = inside if self.method == "off" else motion.known | inside
        poses, joints = np.where(changed[:, None], poses, motion.poses), motion.joints.copy()
        joints[changed] = self.points(poses[changed])
        joint_sd, pose_sd = _grown(motion, joints, inside)
        status, limbs = motion.status.copy(), motion.limb_status.copy()
        status[inside], limbs[inside] = "predicted", "predicted"
        return replace(motion, poses=poses, joints=joints, joint_sd=joint_sd, pose_sd=pose_sd, status=status, limb_status=limbs)


def _grown(motion: Motion, joints: Array, inside: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Deviations of joints (T, J, 3) and of poses (T, D) of a motion whose frames `inside` (T,) are bridged: there those of the frames
    about the gap, and what the joints may stray; the poses' grow in the same proportion."""
    joint_sd, pose_sd = motion.joint_sd.copy(), motion.pose_sd.copy()
    if inside.any():
        between, more = filled(motion.times, joint_sd)[inside], stray(motion.times, joints, inside)[inside]
        joint_sd[inside] = np.sqrt(between**2 + more[..., None] ** 2)
        growth = np.sqrt((joint_sd[inside] ** 2).mean((1, 2)) / (between**2).mean((1, 2)))
        pose_sd[inside] = filled(motion.times, pose_sd)[inside] * growth[:, None]
    return joint_sd, pose_sd


def _blocks(times: Array, begin: int, end: int) -> Iterator[tuple[slice, slice]]:
    """Blocks of the frames from `begin` to `end`, each continued by `OVERLAP`, and the frames that are kept of each."""
    for first in range(begin, end, BLOCK):
        last = min(first + BLOCK, end)
        before = int(np.searchsorted(times, times[first] - OVERLAP))
        after = int(np.searchsorted(times, times[last - 1] + OVERLAP, "right"))
        yield slice(max(before, begin), min(after, end)), slice(first, last)


def _stated(sd: Array) -> Array:
    """Deviations with `UNSTATED` where there is none."""
    return np.where(sd > 0, sd, UNSTATED)


def _in_a_row(values: Array) -> Array:
    """Values (T, M, 3) as (T, 3 M)."""
    return values.reshape(len(values), -1)


def _unwrapped(skeleton: Skeleton, poses: Array) -> Array:
    """Poses (T, D) whose angles without limits do not jump by whole turns."""
    out = poses.copy()
    known = np.isfinite(poses).all(1)
    for d, dof in enumerate(skeleton.dofs):
        if dof.kind == "rotation" and not np.isfinite(dof.low):
            out[known, d] = np.unwrap(poses[known, d])
    return out
