"""A person who turns right round before one camera.

A silhouette does not tell front from back: a person mirrored in depth, left and right exchanged, draws the same. A tracker that follows
one camera takes a person for one who faces it: one who turns round comes to a profile and then seems to turn back. Who stands
frontally, is seen from the side for a moment, and stands frontally again has turned round.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import filled, true_runs
from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.motion.motion import Motion

TWIST, BEND = "torso_twist", "torso_bend"
NEAR, STEADY, PROFILE = np.radians(50), np.radians(62), np.radians(70)
"""Twist of the trunk (rad) about a profile; and that which a profile reaches at least, as a median of three frames and in one: the trunk
of a boxer twists by 69 degrees."""
SHORTEST, LONGEST = 0.15, 0.8
"""Time (s) that the passing of a profile lasts. To turn so far and back in less than this, a trunk would have to be jerked round
(20 rad/s^2)."""
LEAVING = 0.3
"""Time (s) from standing frontally to a profile."""
FRONTAL, AROUND = np.radians(35), 0.4
"""Mean twist (rad) below which a person stands frontally, and the time (s) for which they do so before and after."""


def turns(motion: Motion) -> list[int]:
    """Frames of an upper body's motion in which the person passes a profile and turns on, away from the camera or back to it."""
    if TWIST not in motion.dof_names or not motion.known.any():
        return []
    twist = filled(motion.times, motion.poses[:, motion.dof_names.index(TWIST)])
    steady, found = median_filter(twist, 3, mode="nearest"), list[int]()
    for begin, end in true_runs(np.abs(steady) > NEAR):
        peak, lasted = begin + int(np.abs(steady[begin:end]).argmax()), motion.times[end - 1] - motion.times[begin]
        if np.abs(twist[begin:end]).max() < PROFILE or abs(steady[peak]) < STEADY or not SHORTEST <= lasted <= LONGEST:
            continue
        before, after = np.searchsorted(motion.times, [motion.times[begin] - LEAVING - AROUND, motion.times[end - 1] + LEAVING + AROUND])
        first, last = np.searchsorted(motion.times, [motion.times[begin] - LEAVING, motion.times[end - 1] + LEAVING])
        around = np.abs(steady[before:first]), np.abs(steady[last:after])
        if all(len(each) and each.mean() < FRONTAL for each in around):
            found.append(peak)
    return found


def turned_on(motion: Motion, away: bool = False) -> tuple[Motion, NDArray[np.bool_]]:
    """An upper body's motion in which the person who passes a profile turns on, without new joints; and the frames (T,) that are mirrored.
    In its first frames the person faces the camera, or looks `away` from it."""
    if TWIST not in motion.dof_names:
        return motion, np.zeros(len(motion), bool)
    mirrored, poses, limbs = np.full(len(motion), away), motion.poses.copy(), motion.limb_status.copy()
    at = turns(motion)
    for begin, end in zip(at, [*at[1:], len(motion)]):
        mirrored[begin + 1 : end + 1] = not mirrored[begin]
    if not mirrored.any():
        return motion, mirrored
    poses[mirrored] = mirror(motion.dof_names, poses[mirrored])
    twist = motion.dof_names.index(TWIST)
    poses[motion.known, twist] = np.unwrap(poses[motion.known, twist])
    limbs[mirrored] = limbs[mirrored][:, _exchanged(limbs_of(motion.joint_names))]
    pose_sd, joint_sd = motion.pose_sd.copy(), motion.joint_sd.copy()
    pose_sd[mirrored] = pose_sd[mirrored][:, _exchanged(motion.dof_names)]
    joint_sd[mirrored] = joint_sd[mirrored][:, _exchanged(motion.joint_names)]
    return replace(motion, poses=poses, pose_sd=pose_sd, joint_sd=joint_sd, limb_status=limbs), mirrored


def mirror(names: tuple[str, ...], poses: Array) -> Array:
    """Poses (T, D) of an upper body, its degrees of freedom named `names`, mirrored in depth: the silhouette is the same but for
    perspective."""
    out = poses[:, _exchanged(names)]
    twist, bend = names.index(TWIST), names.index(BEND)
    out[:, twist], out[:, bend] = np.pi - out[:, twist], -out[:, bend]
    return out


def _exchanged(names: tuple[str, ...]) -> list[int]:
    """For each name the index of its counterpart on the other side."""
    other = dict(zip(SIDES, SIDES[::-1]))
    there = [name.partition("_") for name in names]
    return [names.index(f"{other[side]}_{rest}") if side in other else n for n, (side, _, rest) in enumerate(there)]
