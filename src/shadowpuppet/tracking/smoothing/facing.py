"""A person who turns right round before one camera.

A silhouette does not tell front from back: a person mirrored in depth, left and right exchanged, draws the same. A tracker that follows
one camera takes a person for one who faces it: one who turns round comes to a profile and then seems to turn back. Who stands
frontally, is seen from the side for a moment, and stands frontally again has turned round. In profile it cannot tell either which way
the person faces, but the head's place above the neck does (`head_lean`).
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import other_side
from shadowpuppet.body.upper_body import BEND, TWIST
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import filled, sums_about, true_runs
from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.motion.motion import Motion

NEAR, STEADY, PROFILE = np.radians(50), np.radians(62), np.radians(70)
"""Twist of the trunk (rad) about a profile; and that which a profile reaches at least, as a median of three frames and in one: the trunk
of a boxer twists by 69 degrees."""
AT_LEAST = np.radians(60)
"""The twist (rad), both of three frames and of one, that is enough if the head shows that it is a profile: a tracker may lag behind a quick
turn."""
SHORTEST, BRIEF, LONGEST = 0.15, 0.1, 0.8
"""Time (s) that the passing of a profile lasts, at least, and at least if the head shows that it is one; and at most. To turn so far and
back in less than this, a trunk would have to be jerked round (20 rad/s^2)."""
LEAVING = 0.3
"""Time (s) from standing frontally to a profile."""
FRONTAL, AROUND = np.radians(35), 0.4
"""Mean twist (rad) below which a person stands frontally, and the time (s) for which they do so before and after."""
BESIDE = 0.5
"""Time (s) before and after a profile that is about it."""
CLEAR = 0.04
"""Median lean of the head (`head_lean`) in a profile, from which on it says which way the person faces; 0.08 to 0.13 of made people."""
EDGE = np.radians(10)
"""Twist (rad) up to which the passing of a profile reaches that is turned to the other side."""


def turns(motion: Motion, leans: Array | None = None) -> list[int]:
    """Frames of an upper body's motion in which the person passes a profile and turns on, away from the camera or back to it. The `leans`
    (T,) of the head help to recognise a profile."""
    if TWIST not in motion.dof_names or not motion.known.any():
        return []
    twist = filled(motion.times, motion.poses[:, motion.dof_names.index(TWIST)])
    from scipy.ndimage import median_filter  # takes a third of a second to import

    steady, found = median_filter(twist, 3, mode="nearest"), list[int]()
    for begin, end in true_runs(np.abs(steady) > NEAR):
        peak, lasted = begin + int(np.abs(steady[begin:end]).argmax()), motion.times[end - 1] - motion.times[begin]
        shown = leans is not None and abs(_lean(leans[begin:end])) >= CLEAR
        least, constant, shortest = (AT_LEAST, AT_LEAST, BRIEF) if shown else (PROFILE, STEADY, SHORTEST)
        if np.abs(twist[begin:end]).max() < least or abs(steady[peak]) < constant or not shortest <= lasted <= LONGEST:
            continue
        before, after = np.searchsorted(motion.times, [motion.times[begin] - LEAVING - AROUND, motion.times[end - 1] + LEAVING + AROUND])
        first, last = np.searchsorted(motion.times, [motion.times[begin] - LEAVING, motion.times[end - 1] + LEAVING])
        around = np.abs(steady[before:first]), np.abs(steady[last:after])
        if all(len(each) and each.mean() < FRONTAL for each in around):
            found.append(peak)
    return found


def about_profile(motion: Motion) -> NDArray[np.bool_]:
    """Frames (T,) of an upper body's motion in or about a profile: there two passes over a film may be mirror images of each other."""
    if TWIST not in motion.dof_names:
        return np.zeros(len(motion), bool)
    near = np.abs(np.nan_to_num(motion.poses[:, motion.dof_names.index(TWIST)])) > NEAR
    return sums_about(motion.times, near, BESIDE) > 0


class Faced(NamedTuple):
    """A motion without new joints, and what was changed."""

    motion: Motion
    mirrored: NDArray[np.bool_]
    """Frames (T,) in which the person has turned away."""
    reversed: NDArray[np.bool_]
    """Frames (T,) of profiles that were tracked as facing the wrong way."""


def turned_on(motion: Motion, away: bool = False, leans: Array | None = None) -> Faced:
    """An upper body's motion in which the person who passes a profile turns on, the way that the head's `leans` (T,) say.
    In its first frames the person faces the camera, or looks `away` from it."""
    none = np.zeros(len(motion), bool)
    if TWIST not in motion.dof_names:
        return Faced(motion, none, none)
    mirrored, poses, limbs = np.full(len(motion), away), motion.poses.copy(), motion.limb_status.copy()
    at = turns(motion, leans)
    for begin, end in zip(at, [*at[1:], len(motion)]):
        mirrored[begin + 1 : end + 1] = not mirrored[begin]
    wrong = none if leans is None or not at else _wrong_way(motion, at, leans)
    if not (mirrored | wrong).any():
        return Faced(motion, mirrored, wrong)
    poses[mirrored] = mirror(motion.dof_names, poses[mirrored])
    twist, bend = motion.dof_names.index(TWIST), motion.dof_names.index(BEND)
    for dof in (twist, bend):
        poses[wrong, dof] *= -1
    poses[motion.known, twist] = np.unwrap(poses[motion.known, twist])
    limbs[mirrored] = limbs[mirrored][:, other_side(limbs_of(motion.joint_names))]
    pose_sd, joint_sd = motion.pose_sd.copy(), motion.joint_sd.copy()
    pose_sd[mirrored] = pose_sd[mirrored][:, other_side(motion.dof_names)]
    joint_sd[mirrored] = joint_sd[mirrored][:, other_side(motion.joint_names)]
    return Faced(replace(motion, poses=poses, pose_sd=pose_sd, joint_sd=joint_sd, limb_status=limbs), mirrored, wrong)


def _wrong_way(motion: Motion, at: list[int], leans: Array) -> NDArray[np.bool_]:
    """Frames (T,) about the profiles `at` in which the head's `leans` (T,) say that the person faces the other way."""
    twist, out = filled(motion.times, motion.poses[:, motion.dof_names.index(TWIST)]), np.zeros(len(motion), bool)
    for peak in at:
        side = np.sign(twist[peak]) * twist
        profile, reach = _around(side > NEAR, peak), _around(side > EDGE, peak)
        if _lean(leans[profile]) * np.sign(twist[peak]) <= -CLEAR:
            out[reach] = True
    return out


def _lean(leans: Array) -> float:
    """Median of the head's leans (N,) in a profile; 0 if most are unknown."""
    known = leans[np.isfinite(leans)]
    return float(np.median(known)) if 2 * len(known) >= max(len(leans), 1) else 0.0


def _around(inside: NDArray[np.bool_], frame: int) -> slice:
    """The frames about one that are all `inside` (T,)."""
    return next((slice(begin, end) for begin, end in true_runs(inside) if begin <= frame < end), slice(frame, frame + 1))


def mirror(names: tuple[str, ...], poses: Array) -> Array:
    """Poses (T, D) of an upper body, its degrees of freedom named `names`, mirrored in depth: the silhouette is the same but for
    perspective."""
    out = poses[:, other_side(names)]
    twist, bend = names.index(TWIST), names.index(BEND)
    out[:, twist], out[:, bend] = np.pi - out[:, twist], -out[:, bend]
    return out
