"""The people's motions with what became known later: which way they faced, their sizes, and who was who."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.motion import PER_FRAME, JointTable, Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.people.group import doubted
from shadowpuppet.pipeline.people.state import Measured, PeopleState
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.pipeline.subject import FittedPerson
from shadowpuppet.tracking.people.identity import Exchange


def put_right(people: PeopleState, motions: Mapping[int, Motion], subject: Callable[[Measured], MultiviewSubject]) -> dict[int, Motion]:
    """Motions by the person's number, each with the frames whose front was decided later, and with the body of the final sizes; frames of
    two people who were exchanged are given back."""
    out, final = dict[int, Motion](), {number: subject(people.people[number - 1].measured) for number in motions}
    for number, motion in motions.items():
        person = people.people[number - 1]
        out[number] = with_body(with_frames(motion, person.front.decided), motion.times < person.measured_at, final[number])
    return given_back(out, people.exchanges, final)


def given_back(motions: Mapping[int, Motion], exchanges: Sequence[Exchange], people: Mapping[int, FittedPerson]) -> dict[int, Motion]:
    """The people's motions, by number, with the frames of exchanges given back, as `uncertain`."""
    out = dict(motions)
    for begin, end, one, other in reversed(exchanges):
        swapped = dict[int, Motion]()
        for mine, theirs in ((one, other), (other, one)):
            during = (out[mine].times >= begin) & (out[mine].times < end) & np.isin(out[mine].times, out[theirs].times)
            frames = (doubted(frame) for frame in out[theirs].frames() if begin <= frame.time < end)
            swapped[mine] = with_body(with_frames(out[mine], frames), during, people[mine])
        out |= swapped
    return out


def with_frames(motion: Motion, frames: Iterable[MotionFrame]) -> Motion:
    """A motion in which some of its frames, in any order, are replaced; others are ignored."""
    builder = MotionBuilder(motion.body_name, motion.dof_names, motion.joint_names)
    for frame in sorted({frame.time: frame for frame in frames}.values(), key=lambda frame: frame.time):
        builder.append(frame)
    other = builder.build()
    _, mine, theirs = np.intersect1d(motion.times, other.times, return_indices=True)
    values = {name: np.array(getattr(motion, name)) for name in PER_FRAME if name != "times"}
    for name, own in values.items():
        own[mine] = getattr(other, name)[theirs]
    return replace(motion, **values) if len(mine) else motion


def with_body(motion: Motion, frames: NDArray[np.bool_], person: FittedPerson) -> Motion:
    """A motion whose poses in some frames (T,) are those of a person's body that are nearest to the joints."""
    frames = frames & motion.known
    if not frames.any():
        return motion
    poses, joints, sizes = motion.poses.copy(), motion.joints.copy(), person.person.sizes
    assert isinstance(sizes, BoneSizes)  # of a whole body
    fitted = fit_poses(JointTable(motion.times[frames], motion.joint_names, joints[frames]), person.body.name, sizes, any_bend=True)
    poses[frames], joints[frames] = fitted.poses, person.body.points(fitted.poses)
    return replace(motion, poses=poses, joints=joints)
