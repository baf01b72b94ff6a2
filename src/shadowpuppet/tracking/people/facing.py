"""Which way people face, where it is not known.

Beside others one frame's silhouettes hardly distinguish a person's front from the back. A second of them does, if the person is also
followed as facing the other way (`Trial`), or the person walks. From then on the front is known, and so it is for the frames before: those
in which the body faced the wrong way are corrected when the run ends.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.body.skeleton import other_side
from shadowpuppet.geometry import Array
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.tracking.multiview.tracker import MultiviewState

SETTLING, LEAST_TRIAL, LONGEST_TRIAL = 0.4, 1.0, 3.0
"""Seconds after which the overlaps of a trial count; from which on it is decided; after which it begins again."""
LEAST_LEADS = 3
"""Number of frames that show the person from the side from which on a trial is decided."""
CLEARLY = 0.02
"""Least mean difference of the overlaps that decides, of all frames and of the last third: a pose turned round takes time to settle."""


class Trial:
    """A person who is also followed as facing the other way."""

    def __init__(self, time: float, state: MultiviewState) -> None:
        """`state`: of the body turned round, at a time (s)."""
        self.begun, self.state = time, state
        self.leads = list[float]()
        """By how much the body as it is fitted better (overlap)."""

    def add(self, time: float, state: MultiviewState, overlap: float, counts: bool = True) -> None:
        """The next state of the body turned round, and the overlap of the body as it is. `counts`: whether the frame shows the person
        from the side."""
        self.state = state
        if counts and time - self.begun >= SETTLING:
            self.leads.append(float(np.nan_to_num(overlap) - np.nan_to_num(state.overlap)))

    def is_right(self, time: float) -> bool | None:
        """Whether the body as it is faces the right way; None if that is not clear yet."""
        if time - self.begun < LEAST_TRIAL or len(self.leads) < LEAST_LEADS:
            return None
        lead, lately = (float(np.mean(each)) for each in (self.leads, self.leads[-max(len(self.leads) // 3, 1) :]))
        return lead > 0 if min(lead * np.sign(lead), lately * np.sign(lead)) >= CLEARLY else None


class Part(NamedTuple):
    """A part of a person's motion, from one search on."""

    begin: float
    """Seconds."""
    until: float = np.nan
    """Time (s) from which on the front was known; not a number: it never did, or it was known from the beginning."""
    wrong: bool = False
    """Whether the body faced the wrong way until then."""


class Doubted(NamedTuple):
    """What a frame would be if the front were known."""

    status: str
    limbs: tuple[str, ...]
    """Status of each limb."""


@dataclass(eq=False)
class Facing:
    """What is known about the front of one person over time."""

    parts: list[Part] = field(default_factory=list)
    is_known: bool = True
    """Whether it is known now."""
    doubted: dict[float, Doubted] = field(default_factory=dict)
    """Frames, by time (s), that are doubted for their front alone."""

    def begin(self, time: float, is_known: bool) -> None:
        """The person was found at a time (s), so that the body may face another way than before."""
        self.parts.append(Part(time))
        self.is_known = is_known

    def show(self, time: float, wrong: bool) -> None:
        """The front is known from a time (s) on; `wrong`: the body is turned round now."""
        if not self.is_known and self.parts and np.isnan(self.parts[-1].until):
            self.parts[-1] = self.parts[-1]._replace(until=time, wrong=wrong)
        self.is_known = True

    def known_later(self, times: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Frames (T,) in which the front was not known yet, and is known from a later frame; those of them that face the wrong way."""
        known, wrong = np.zeros((2, len(times)), bool)
        for part in self.parts:
            before = (part.begin <= times) & (times < part.until)
            known |= before
            wrong |= before & part.wrong
        return known, wrong

    def corrected(self, motion: Motion, body: Body, sizes: BoneSizes) -> Motion:
        """The person's motion with what is known later: the sides of frames that face the wrong way are exchanged, and the body of these
        sizes fitted to the joints; frames doubted for their front alone get the status that they would have had."""
        known, wrong = self.known_later(motion.times)
        wrong &= motion.known
        out = _exchanged(motion, wrong, body, sizes) if wrong.any() else motion
        status, limbs = out.status.copy(), out.limb_status.copy()
        for n in np.flatnonzero(known & ~wrong):
            if (frame := self.doubted.get(float(motion.times[n]))) is not None and frame.limbs:
                status[n], limbs[n] = frame
        return replace(out, status=status, limb_status=limbs)


def refitted(motion: Motion, joints: Array, frames: NDArray[np.bool_], body: Body, sizes: BoneSizes) -> tuple[Array, Array]:
    """Poses (T, D) and joints (T, J, 3) of a motion in which those of some frames (T,) are the body's nearest to given `joints`."""
    poses, joints = motion.poses.copy(), joints.copy()
    fitted = fit_poses(JointTable(motion.times[frames], motion.joint_names, joints[frames]), body.name, sizes, any_bend=True)
    poses[frames], joints[frames] = fitted.poses, body.points(fitted.poses)
    return poses, joints


def _exchanged(motion: Motion, frames: NDArray[np.bool_], body: Body, sizes: BoneSizes) -> Motion:
    """A motion in which the joints of some frames (T,) are those of the other side, in poses that reach them."""
    joints = motion.joints.copy()
    joints[frames] = joints[frames][:, other_side(motion.joint_names)]
    poses, joints = refitted(motion, joints, frames, body, sizes)
    joint_sd, pose_sd = motion.joint_sd.copy(), motion.pose_sd.copy()
    joint_sd[frames] = joint_sd[frames][:, other_side(motion.joint_names)]
    pose_sd[frames] = pose_sd[frames][:, other_side(motion.dof_names)]
    return replace(motion, poses=poses, joints=joints, joint_sd=joint_sd, pose_sd=pose_sd)
