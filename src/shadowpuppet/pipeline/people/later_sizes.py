"""People whom the first seconds do not show apart are measured while they are tracked, on their share of what later frames show."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.io.person import Person
from shadowpuppet.pipeline.people.fronts import turn
from shadowpuppet.pipeline.people.member import Member, Shown
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.tracking.people.evidence import draw_person
from shadowpuppet.tracking.people.facing import SETTLING
from shadowpuppet.tracking.people.shared_sizes import Measure, measure, shows
from shadowpuppet.tracking.people.tracker import at_pose, follow_turned, shows_side

SETS, SECONDS = 8, 1.4
"""Number of frames in which a person is measured, and the least time from the first to the last of them."""
ATTEMPTS = 2
"""Number of attempts after which average sizes stay."""
LEAD = 0.02
"""Least difference of the mean overlaps of the person measured facing one way and the other that tells the front."""


def measure_later(member: Member, time: float) -> None:
    """Note what a frame shows of a person of average sizes; with enough frames, measure them, and go on with the body of these sizes."""
    if member.subject.is_measured or member.attempts >= ATTEMPTS:
        return
    if member.share is None or member.state is None or member.lost_since is not None:
        return
    known = member.facing.is_known
    if not known and (member.trial is None or time - member.trial.begun < SETTLING):
        return
    if not shows(member.share) or not (known or shows_side(member.subject.tracker, member.share)):
        return
    turned = None if known or member.trial is None else member.trial.state.pose
    share = member.share._replace(masks=tuple(member.share.masks), ignored=tuple(member.share.ignored))
    member.shown.append(Shown(time, share, member.state.pose, turned))
    usable = [each for each in member.shown if known or each.turned is not None][-SETS:]
    if len(usable) == SETS and usable[-1].time - usable[0].time >= SECONDS - 1e-6:
        _go_on_measured(member, usable, time, known)


def _go_on_measured(member: Member, frames: list[Shown], time: float, known: bool) -> None:
    subject, rng = member.subject, member.rng
    expected, shares = subject.person.sizes, [frame.share for frame in frames]
    assert isinstance(expected, BoneSizes)
    make = partial(make_body, subject.tracker.settings.body)
    found = measure(rng, make, expected, subject.tracker, shares, np.array([frame.pose for frame in frames]))
    lead = np.inf
    if not known:
        other = measure(rng, make, expected, subject.tracker, shares, np.array([frame.turned for frame in frames]))
        lead = float(np.nan_to_num(found.overlaps).mean() - np.nan_to_num(other.overlaps).mean())
        found = found if lead >= 0 else other
    member.shown.clear()
    member.attempts += 1
    if np.nan_to_num(found.overlaps).mean() < np.nan_to_num([share.state.overlap for share in shares]).mean():
        return  # no better than the average sizes
    member.earlier, member.measured_at, member.subject = subject, time, _measured(subject, found, len(frames))
    member.before = None
    state = follow_turned(found.tracker, rng, at_pose(found.tracker, shares[-1].state, found.poses[-1]), shares[-1])
    assert member.share is not None
    member.share = member.share._replace(drawn=draw_person(found.tracker, state.pose))
    if abs(lead) >= LEAD and not known:
        member.trial = None
        if lead < 0:
            turn(member, time, state)
        else:
            member.facing.show(time, wrong=False)
    elif not known:
        member.trial = None  # begins again with the new body
    member.state, member.share = state, member.share._replace(state=state)
    member.walk.forget()


def _measured(subject: MultiviewSubject, found: Measure, frames: int) -> MultiviewSubject:
    """The subject with the body of the sizes found."""
    source = f"a height of {subject.person.height or 0:.2f} m as seen, and the person's share of {frames} frames among others"
    sizes = dict(zip(found.sizes.names(), map(float, found.sizes.to_array()), strict=True))
    summary = {"source": source, "overlap": round(float(np.nanmean(found.overlaps)), 3), "residual": found.residual, "frames": frames,
               "sizes": sizes}
    return replace(subject, body=found.tracker.body, tracker=found.tracker, person=Person(found.sizes, subject.person.height, source),
                   summary=summary, is_measured=True)
