"""A tracked motion smoothed over time, in overlapping blocks: poses of the same body, with short gaps bridged."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.motion.contact.contact import contacts_of
from shadowpuppet.motion.interpolation import filled, true_runs
from shadowpuppet.motion.motion import PER_FRAME, Motion
from shadowpuppet.tracking.smoothing.butterworth import PASSES, filtered
from shadowpuppet.tracking.smoothing.deviations import restated
from shadowpuppet.tracking.smoothing.facing import Faced, turned_on
from shadowpuppet.tracking.smoothing.fixed_interval import INDEPENDENT, LEAST, ORDER, Smoothed, differences, smooth
from shadowpuppet.tracking.smoothing.gaps import bridged, stray
from shadowpuppet.tracking.smoothing.method import Method
from shadowpuppet.tracking.smoothing.pose_path import STEPS, PathCost, likeliest_poses
from shadowpuppet.tracking.smoothing.projection import Markers, Points, markers, nearest_poses
from shadowpuppet.tracking.smoothing.standing import Standing, standing

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
    reversed: NDArray[np.bool_]
    """Frames (T,) of profiles that one camera's tracker took for facing the other way."""


class Tracked(NamedTuple):
    """Tracked poses of some frames."""

    times: Array
    """Seconds, of shape (T,)."""
    poses: Array
    """Of shape (T, D), rad or m."""
    pose_sd: Array
    """Stated deviations, of shape (T, D); not a number where there are none."""
    joint_sd: Array
    """Stated deviations of the joints, of shape (T, N, 3), metres; likewise."""


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
    limits: Mapping[str, float] | None = None
    """Of each kind of limb, metres, if deviations and statuses are to be `restated`; None: they stay those of each frame alone."""

    def __call__(self, motion: Motion, leans: Array | None = None) -> SmoothedMotion:
        """A motion smoothed in runs of known frames; `leans` (T,): of the head in a profile (`head_lean`). Raises `SettingsError` for a
        cut-off that the frame rate does not allow."""
        motion, mirrored, wrong = self._faced(motion, leans)
        inside = bridged(motion.times, motion.joints, self.gaps)
        poses, known = motion.poses.copy(), motion.known
        free, contacts = np.asarray((poses[known] != poses[known][:1]).any(0)), contacts_of(motion.table)
        floor = None if contacts is None else contacts.floor
        for begin, end in true_runs(known | inside):
            for block, kept in _blocks(motion.times, begin, end):
                poses[kept] = self._poses(motion[block], free, floor)[kept.start - block.start : kept.stop - block.start]
        return SmoothedMotion(self._motion(motion, poses, inside), inside, mirrored, wrong)

    @property
    def summary(self) -> dict[str, Any]:
        """What is done, as plain values."""
        if self.method == "butterworth":
            return {"method": self.method, "cutoff_hz": self.cutoff, "order": 2 * PASSES, "lag": 0, "gaps_s": self.gaps}
        return {"method": self.method, "gaps_s": self.gaps}

    def _faced(self, motion: Motion, leans: Array | None) -> Faced:
        """The motion of a person who may turn right round."""
        if self.method == "off":
            return Faced(motion, *np.zeros((2, len(motion)), bool))
        turned = turned_on(motion, self.away, leans)
        joints = motion.joints.copy()
        changed = (turned.mirrored | turned.reversed) & motion.known
        joints[changed] = self.points(turned.motion.poses[changed])
        return turned._replace(motion=replace(turned.motion, joints=joints))

    def _poses(self, motion: Motion, free: NDArray[np.bool_], floor: float | None) -> Array:
        """Poses (T, D) of a run of frames in which no gap is left; `floor`: its height (m), if something stands on it."""
        start = np.clip(filled(motion.times, _unwrapped(self.skeleton, motion.poses)), *self._wide(motion.poses))
        raw = markers(self.skeleton, self.points, start)
        unknown, number = ~motion.known, motion.joints.shape[1]
        both = np.where(unknown[:, None, None], np.nan, np.concatenate(raw, axis=1))
        if self.method == "butterworth":
            found = filtered(motion.times, both, self.cutoff)
            return self._nearest(start, found, number, free)
        sd = self._marker_sd(motion.pose_sd, motion.joint_sd)
        found = smooth(motion.times, both, sd, self._least(number))
        near = self._nearest(start, found.points, number, free)
        if len(motion) <= ORDER:
            return near
        stands = None if floor is None else standing(motion.times, motion.joint_names, found.points, floor)
        return self._path(near, filled(motion.times, both), found, motion.times, free, stands=stands)

    def likeliest(self, tracked: Tracked, start: Array, free: NDArray[np.bool_], given: int, given_sd: float, rounds: int,
                  steps: int) -> Array:
        """Poses (T, D) from `start` (T, D) on, of frames of which the first `given` are known: their markers to `given_sd` (m, and 1 for
        axes). Only `free` (D,) degrees of freedom change; `rounds` of estimating speeds and outliers, and Gauss-Newton `steps`. Up to
        three frames stay as they are."""
        if len(start) <= ORDER:
            return start
        measured = np.concatenate(markers(self.skeleton, self.points, tracked.poses), axis=1)
        sd = self._marker_sd(tracked.pose_sd, tracked.joint_sd)
        sd[:given] = given_sd / INDEPENDENT
        found = smooth(tracked.times, measured, sd, self._least(tracked.joint_sd.shape[1]), rounds)
        return self._path(_unwrapped(self.skeleton, start), measured, found, tracked.times, free, steps)

    def _path(self, start: Array, measured: Array, found: Smoothed, times: Array, free: NDArray[np.bool_], steps: int = STEPS,
              stands: Standing | None = None) -> Array:
        """The likeliest poses (T, D) from `start` on, given measured markers (T, M, 3), what they weigh by `found`, and what stands."""
        number = measured.shape[1] - 3 * len(self.skeleton.joints)
        share = np.repeat([1.0, AXES_SHARE], [number, measured.shape[1] - number])
        precision, still = found.precision * share[:, None], None
        if stands is not None:
            both = precision + stands.level
            measured, precision = (precision * measured + stands.level * stands.floor) / both, both
            still = _in_a_row(stands.still)
        cost = PathCost(_in_a_row(measured), _in_a_row(precision), differences(times), np.repeat(found.variances / share, 3, axis=1), still)
        return likeliest_poses(self.skeleton, self.points, start, cost, free, steps)

    def _marker_sd(self, pose_sd: Array, joint_sd: Array) -> Array:
        """Deviations (T, M, 3) of joints (m) and of the axes of the skeleton's joints, from those of poses (T, D) and joints (T, N, 3)."""
        turns = np.repeat(self._turns(_stated(pose_sd)), 3, axis=1)
        return np.concatenate([_stated(joint_sd), np.repeat(turns[..., None], 3, axis=2)], 1)

    def _least(self, number: int) -> Array:
        """Acceleration (M,) of a person who stands still, of `number` points (m/s^2) and of axes (1/s^2)."""
        return np.repeat([LEAST, LEAST / ARM], [number, 3 * len(self.skeleton.joints)])

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
        if self.limits is not None and self.method != "off":
            motion = restated(motion, self.limits)
        joint_sd, pose_sd = _grown(motion, joints, inside)
        status, limbs = motion.status.copy(), motion.limb_status.copy()
        status[inside], limbs[inside] = "predicted", "predicted"
        return replace(motion, poses=poses, joints=joints, joint_sd=joint_sd, pose_sd=pose_sd, status=status, limb_status=limbs)


def smoothed_parts(motion: Motion, parts: Sequence[tuple[int, MotionSmoother]], leans: Array) -> SmoothedMotion:
    """A motion smoothed in parts, one after another: for each its first frame and smoother, at first frame 0; `leans` (T,) of the head.
    Raises as they do."""
    ends = [*(begin for begin, _ in parts[1:]), len(motion)]
    found = [smoother(motion[begin:end], leans[begin:end]) for (begin, smoother), end in zip(parts, ends)]
    whole = {name: np.concatenate([getattr(each.motion, name) for each in found]) for name in PER_FRAME}
    return SmoothedMotion(replace(motion, **whole), np.concatenate([each.bridged for each in found]),
                          np.concatenate([each.mirrored for each in found]), np.concatenate([each.reversed for each in found]))


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
