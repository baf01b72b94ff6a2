"""Which way each of several people faces, while they are tracked: found out by walking, or by following both ways for a while."""

from __future__ import annotations

import numpy as np

from shadowpuppet.pipeline.people.member import Member
from shadowpuppet.tracking.multiview.tracker import MultiviewState
from shadowpuppet.tracking.people.facing import CLEARLY, LONGEST_TRIAL, Trial
from shadowpuppet.tracking.people.tracker import Share, follow_turned, shows_side, turn_round
from shadowpuppet.tracking.people.walking import ALONG, step_of

TURN_LOSS = 0.05
"""Overlap by which a body turned round may fit worse if the person walks that way: among others front and back differ by 0.02."""


def face_the_way(member: Member, time: float) -> None:
    """Turn a person round whose body moves backwards: beside others the silhouettes hardly distinguish front and back, but people walk
    forwards."""
    if member.state is None or member.share is None or member.lost_since is not None:
        member.walk.lose()
        member.trial = None
        member.shown.clear()
        return
    member.walk.add(step_of(member.subject.body, member.state.pose, time))
    if (since := member.walk.jerked) is not None:
        _mind_the_jerk(member, member.share, since, time)
    if member.walk.forward > ALONG:
        member.facing.show(time, wrong=False)
    elif member.walk.forward < -ALONG:
        turned = turn_round(member.subject.tracker, member.rng, member.share)
        if _lead(member.state, turned) <= TURN_LOSS:
            turn(member, time, turned)
        else:
            member.walk.forget()
            member.facing.is_known = False
    _try_both_ways(member, member.share, time)


def _mind_the_jerk(member: Member, share: Share, since: float, time: float) -> None:
    """The body turned more quickly than people turn, as where it was searched for again: if the body turned back fits about as well it is
    right; otherwise the front is unknown."""
    member.walk.forget()
    turned = turn_round(member.subject.tracker, member.rng, share)
    if turned.status != "lost" and _lead(share.state, turned) < CLEARLY:
        _replace_state(member, turned)
        member.walk.add(step_of(member.subject.body, turned.pose, time))
        return
    member.trial = None
    member.shown.clear()
    member.facing.begin(since, is_known=False)


def _try_both_ways(member: Member, share: Share, time: float) -> None:
    """Follow a person of unknown front as facing the other way too, until that is clearly better or worse."""
    tracker, trial = member.subject.tracker, member.trial
    if member.facing.is_known:
        member.trial = None
        return
    side = shows_side(tracker, share)
    if trial is None or time - trial.begun > LONGEST_TRIAL:
        member.trial = Trial(time, turn_round(tracker, member.rng, share)) if side else None  # no view that tells: nothing to follow
    else:
        trial.add(time, follow_turned(tracker, member.rng, trial.state, share), share.state.overlap, side)
        if not member.subject.is_measured:  # with average sizes both ways fit too alike: the sizes that suit each decide
            return
        if (right := trial.is_right(time)) is not None:
            member.trial = None
            if right:
                member.facing.show(time, wrong=False)
            else:
                turn(member, time, trial.state)


def turn(member: Member, time: float, turned: MultiviewState) -> None:
    """Replace a person's state by that of the body turned round, which is right."""
    member.facing.show(time, wrong=True)
    member.walk.forget()
    member.shown.clear()
    _replace_state(member, turned)


def _replace_state(member: Member, state: MultiviewState) -> None:
    assert member.share is not None
    member.state, member.share = state, member.share._replace(state=state)


def _lead(state: MultiviewState, other: MultiviewState) -> float:
    """By how much the body of a state fits better than another (overlap)."""
    return float(np.nan_to_num(state.overlap) - np.nan_to_num(other.overlap))
