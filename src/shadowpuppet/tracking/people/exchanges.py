"""Frames before it was noticed that two people had been exchanged, given back to whom they belong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.geometry import Array
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.motion import BLANK, PER_FRAME, JointTable, Motion
from shadowpuppet.tracking.people.identity import Exchange


def given_back(motions: Mapping[int, Motion], exchanges: Sequence[Exchange],
               people: Mapping[int, tuple[Body, BoneSizes]]) -> dict[int, Motion]:
    """The people's motions, by number, with the frames of exchanges given back, as `uncertain`. `people`: the body and sizes of each, which
    are fitted to the joints of the frames that they get."""
    out = dict(motions)
    for begin, end, one, other in reversed(exchanges):
        _, mine, theirs = np.intersect1d(out[one].times, out[other].times, return_indices=True)
        during = (out[one].times[mine] >= begin) & (out[one].times[mine] < end)
        mine, theirs = mine[during], theirs[during]
        if len(mine):
            out |= {one: _with_frames(out[one], mine, out[other], theirs, *people[one]),
                    other: _with_frames(out[other], theirs, out[one], mine, *people[other])}  # fmt: skip
    return out


def refitted(motion: Motion, joints: Array, frames: NDArray[np.bool_], body: Body, sizes: BoneSizes) -> tuple[Array, Array]:
    """Poses (T, D) and joints (T, J, 3) of a motion in which those of some frames (T,) are the body's nearest to given `joints`."""
    poses, joints = motion.poses.copy(), joints.copy()
    fitted = fit_poses(JointTable(motion.times[frames], motion.joint_names, joints[frames]), body.name, sizes, any_bend=True)
    poses[frames], joints[frames] = fitted.poses, body.points(fitted.poses)
    return poses, joints


def _with_frames(motion: Motion, frames: NDArray[np.int64], other: Motion, theirs: NDArray[np.int64], body: Body,
                 sizes: BoneSizes) -> Motion:
    """A motion whose `frames` are those of another one, `theirs`, with the body fitted to them."""
    values = {name: np.array(getattr(motion, name)) for name in PER_FRAME if name != "times"}
    for name, own in values.items():
        own[frames] = getattr(other, name)[theirs]
    for name in ("status", "limb_status"):
        values[name][frames] = np.where(values[name][frames] == "tracked", "uncertain", values[name][frames])
    got = np.zeros(len(motion), bool)
    got[frames] = ~np.isin(values["status"][frames], BLANK)
    if got.any():
        values["poses"], values["joints"] = refitted(motion, values["joints"], got, body, sizes)
        values["poses"][frames[~got[frames]]] = np.nan
    return replace(motion, **values)
