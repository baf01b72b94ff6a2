"""The people's motions with what became known later: which way they faced, their sizes, and who was who."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.motion.motion import PER_FRAME, Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.people.state import Measured, PeopleState
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.tracking.people.exchanges import given_back, refitted


def put_right(people: PeopleState, motions: Mapping[int, Motion], subject: Callable[[Measured], MultiviewSubject]) -> dict[int, Motion]:
    """Motions by the person's number, each with the frames whose front was decided later, and with the body of the final sizes; frames of
    two people who were exchanged are given back."""
    out, bodies = dict[int, Motion](), {}
    for number, motion in motions.items():
        person = people.people[number - 1]
        final = subject(person.measured)
        body, sizes = final.body, final.person.sizes
        assert isinstance(sizes, BoneSizes)  # of a whole body
        found = with_frames(motion, person.front.decided)
        before = found.known & (found.times < person.measured_at)
        if before.any():
            poses, joints = refitted(found, found.joints, before, body, sizes)
            found = replace(found, poses=poses, joints=joints)
        out[number], bodies[number] = found, (body, sizes)
    return given_back(out, people.exchanges, bodies)


def with_frames(motion: Motion, frames: Sequence[MotionFrame]) -> Motion:
    """A motion in which some of its frames, in any order, are replaced."""
    if not frames:
        return motion
    builder = MotionBuilder(motion.body_name, motion.dof_names, motion.joint_names)
    for frame in sorted({frame.time: frame for frame in frames}.values(), key=lambda frame: frame.time):
        builder.append(frame)
    other = builder.build()
    _, mine, theirs = np.intersect1d(motion.times, other.times, return_indices=True)
    values = {name: np.array(getattr(motion, name)) for name in PER_FRAME if name != "times"}
    for name, own in values.items():
        own[mine] = getattr(other, name)[theirs]
    return replace(motion, **values)
