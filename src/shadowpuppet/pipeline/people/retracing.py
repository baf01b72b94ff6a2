"""Frames before it was known which way a person faces, or what their sizes are: the person is followed backwards through them.

What became known in a later frame is the beginning, and the other people's bodies are where the run found them; so evidence is divided
better than it was at the time.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.body.whole_body import heading_column
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.motion import BLANK, PER_FRAME, Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.people.group import Group
from shadowpuppet.pipeline.people.member import Member
from shadowpuppet.pipeline.subject import motion_frame
from shadowpuppet.tracking.multiview.tracker import MultiviewState
from shadowpuppet.tracking.particle_filter import gathered
from shadowpuppet.tracking.people.evidence import Drawn, draw_person
from shadowpuppet.tracking.people.facing import refitted
from shadowpuppet.tracking.people.tracker import Person, Share, keep_front, observed, step
from shadowpuppet.tracking.people.walking import TURN

LONGEST = 10.0
"""Time (s) over which people are followed backwards at most."""
AS_WELL, TURNED = 0.02, 0.1
"""Overlap by which frames followed backwards may fit worse than as they were; by which they may where these face another way: the front is
known at the end, from which people are followed."""
AGREE = 0.12
"""Greatest mean distance (m) of the joints of a frame followed backwards from those that there were, if both are to be right."""
MOST_LOST = 5
"""Number of frames in a row after which a person who is lost is not followed further."""


class Stretch(NamedTuple):
    """Frames in which a person is to be followed backwards."""

    number: int
    """The person's."""
    begin: float
    """Seconds."""
    until: float
    """Time (s) of the first frame after them."""


class Packed(NamedTuple):
    """A frame's silhouettes."""

    time: float
    """Seconds."""
    sizes: tuple[tuple[int, int] | None, ...]
    """Height and width of each camera's mask."""
    bits: tuple[NDArray[np.uint8] | None, ...]
    """Their pixels, eight a byte."""

    def masks(self) -> list[Mask | None]:
        """The masks (H, W), one per camera."""
        return [None if size is None or bits is None else np.unpackbits(bits, count=size[0] * size[1]).reshape(size).view(np.bool_)
                for size, bits in zip(self.sizes, self.bits)]  # fmt: skip


def packed(time: float, masks: Sequence[Mask | None]) -> Packed:
    """The masks (H, W) of a frame, one per camera."""
    return Packed(time, tuple(None if mask is None else (mask.shape[0], mask.shape[1]) for mask in masks),
                  tuple(None if mask is None else np.packbits(mask) for mask in masks))  # fmt: skip


def stretches(group: Group, motions: Mapping[int, Motion]) -> list[Stretch]:
    """The frames in which people had average sizes or an unknown front, and are measured or their front is known in the frame after; those
    that end first come first. None of a person who was exchanged with another in them."""
    found = list[Stretch]()
    for member in group.members:
        if member.number not in motions or not len(motions[member.number]):
            continue
        begin = float(motions[member.number].times[0])
        open_ = [(min(part.begin, _doubted_since(member, motions[member.number], part.until)), part.until)
                 for part in member.facing.parts if np.isfinite(part.until)]  # fmt: skip
        if np.isfinite(member.measured_at):
            open_.append((begin, member.measured_at))
        for start, end in _joined(open_):
            start = max(start, begin, end - LONGEST)
            exchanged = any(member.number in (each.one, each.other) and each.begin < end and each.end > start for each in group.exchanges)
            if not exchanged and end > start:
                found.append(Stretch(member.number, start, end))
    return sorted(found, key=lambda each: (each.until, each.number))


def _doubted_since(member: Member, motion: Motion, until: float) -> float:
    """Time (s) from which on the front was unknown in all frames before a time (s): where a body was lost, and found again, a new part of
    unknown front begins."""
    at = int(np.searchsorted(motion.times, until - 1e-6))
    while at and float(motion.times[at - 1]) in member.facing.doubted:
        at -= 1
    return float(motion.times[min(at, len(motion) - 1)])


def _joined(intervals: Iterable[tuple[float, float]]) -> list[tuple[float, float]]:
    """The same stretches of time as intervals that neither overlap nor touch, in order."""
    joined = list[tuple[float, float]]()
    for begin, end in sorted(intervals):
        if joined and begin <= joined[-1][1]:
            joined[-1] = joined[-1][0], max(joined[-1][1], end)
        else:
            joined.append((begin, end))
    return joined


def with_final_bodies(group: Group, motions: Mapping[int, Motion]) -> dict[int, Motion]:
    """The people's motions, with the body of the sizes found later fitted to the joints of frames before."""
    out = dict(motions)
    for number, motion in motions.items():
        member = group.members[number - 1]
        before = motion.known & (motion.times < member.measured_at)
        if before.any():
            sizes = member.subject.person.sizes
            assert isinstance(sizes, BoneSizes)
            poses, joints = refitted(motion, motion.joints, before, member.subject.body, sizes)
            out[number] = replace(motion, poses=poses, joints=joints)
    return out


def retraced(group: Group, motions: Mapping[int, Motion], wanted: Sequence[Stretch], frames: Sequence[Packed]) -> dict[int, Motion]:
    """The people's motions, by number, each followed backwards through the wanted stretches. `frames`: silhouettes of all of these."""
    out = dict(motions)
    for stretch in wanted:
        before = [frame for frame in frames if stretch.begin - 1e-6 <= frame.time < stretch.until - 1e-6]
        motion = out[stretch.number]
        if before and (start := _start(group.members[stretch.number - 1], motion, stretch.until)) is not None:
            out[stretch.number] = _followed_back(group, out, stretch.number, start, before)
    return out


def _start(member: Member, motion: Motion, until: float) -> MultiviewState | None:
    """The state from which a person is followed backwards: that of the first frame known from a time (s) on; None if that is
    a second later."""
    known = np.flatnonzero(motion.known & (motion.times >= until - 1e-6) & (motion.times < until + 1))
    if not len(known):
        return None
    first = int(known[0])
    pose, after = motion.poses[first].copy(), first + 1
    moving = after < len(motion) and bool(motion.known[after])
    velocity = pose - motion.poses[after] if moving else np.zeros_like(pose)
    particles = gathered(pose, member.subject.tracker.number)
    return MultiviewState(pose, velocity, particles, float(motion.cost[first]), float(motion.overlap[first]), "tracked")


def _followed_back(group: Group, motions: Mapping[int, Motion], number: int, state: MultiviewState, frames: Sequence[Packed]) -> Motion:
    member, motion = group.members[number - 1], motions[number]
    tracker, before, lost = member.subject.tracker, None, 0
    found, leads = list[MotionFrame](), list[float]()
    for frame in reversed(frames):
        masks = frame.masks()
        beside, person = _others(group, motions, number, frame.time), Person(tracker, member.rng, state)
        share = step({number: person}, group.hull.points(masks), masks, beside)[number]
        share = keep_front(tracker, member.rng, state, share)
        state, member.share = share.state, share
        lost = lost + 1 if state.status in BLANK else 0
        if lost > MOST_LOST:
            break
        made, before = motion_frame(member.subject, frame.time, state, member.observation, before)
        found.append(_agreed(made, motion))
        leads.append(_lead(member, share, motion, frame.time))
    # only as far back as the frames followed backwards fit better than, or as well as, those that there were
    number_kept = int(np.argmax(np.concatenate([[0.0], np.cumsum(leads)])))
    return _with(motion, found[:number_kept])


def _others(group: Group, motions: Mapping[int, Motion], number: int, time: float) -> dict[int, Drawn]:
    """The other people's bodies at a time (s)."""
    found = dict[int, Drawn]()
    for other, motion in motions.items():
        if other != number and (at := _row(motion, time)) is not None and motion.known[at]:
            found[other] = draw_person(group.members[other - 1].subject.tracker, motion.poses[at])
    return found


def _agreed(frame: MotionFrame, motion: Motion) -> MotionFrame:
    """A frame followed backwards: not `tracked` where the motion has the joints elsewhere, as one of the two is wrong."""
    at = _row(motion, frame.time)
    if at is None or frame.joints is None or not motion.known[at] or \
            float(np.linalg.norm(np.asarray(frame.joints) - motion.joints[at], axis=-1).mean()) <= AGREE:
        return frame
    limbs = None if frame.limb_status is None else ["uncertain" if each == "tracked" else each for each in frame.limb_status]
    return frame._replace(status="uncertain" if frame.status == "tracked" else frame.status, limb_status=limbs)


def _row(motion: Motion, time: float) -> int | None:
    """Index of the motion's frame of a time (s); None if it has none."""
    at = int(np.searchsorted(motion.times, time - 1e-6))
    return at if at < len(motion) and abs(motion.times[at] - time) < 1e-6 else None


def _lead(member: Member, share: Share, motion: Motion, time: float) -> float:
    """By how much a frame followed backwards fits better (overlap) than the motion at that time (s), and `AS_WELL`."""
    if (at := _row(motion, time)) is None:
        return -1.0  # the run has no such frame
    if not motion.known[at]:
        return AS_WELL
    observation = observed(member.subject.tracker, share)
    mine, theirs = (float(np.nan_to_num(observation.overlap(pose))) for pose in (share.state.pose, motion.poses[at]))
    heading = heading_column(member.subject.body.skeleton)
    turned = np.cos(share.state.pose[heading] - motion.poses[at, heading]) < np.cos(TURN)
    return mine - theirs + (TURNED if turned else AS_WELL)


def _with(motion: Motion, frames: Sequence[MotionFrame]) -> Motion:
    """A motion in which some frames, the last first, are replaced."""
    if not frames:
        return motion
    builder = MotionBuilder(motion.body_name, motion.dof_names, motion.joint_names)
    for frame in reversed(frames):
        builder.append(frame)
    other = builder.build()
    _, mine, theirs = np.intersect1d(np.round(motion.times, 6), np.round(other.times, 6), return_indices=True)
    if len(theirs) < len(other):
        raise ShadowPuppetError("frames followed backwards: found some that the run does not have")
    values = {name: np.array(getattr(motion, name)) for name in PER_FRAME if name != "times"}
    for name, own in values.items():
        own[mine] = getattr(other, name)[theirs]
    return replace(motion, **values)
