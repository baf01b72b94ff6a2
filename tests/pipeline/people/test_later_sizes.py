"""People of average sizes are measured where later frames show them, and go on with that body."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import actor
import numpy as np
import pytest

from shadowpuppet.io.person import Person
from shadowpuppet.pipeline.people import later_sizes
from shadowpuppet.pipeline.people.later_sizes import ATTEMPTS, SETS, measure_later
from shadowpuppet.pipeline.people.member import Member
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.people.evidence import Drawn
from shadowpuppet.tracking.people.shared_sizes import Measure
from shadowpuppet.tracking.people.tracker import Share, at_pose

LARGE = actor.sizes(thigh_length=1.1)
POSE = actor.stance(actor.body().skeleton)


def member(measured: bool = False) -> Member:
    tracker = MultiviewTracker(actor.body(), actor.cameras(), MultiviewSettings(particles=40))
    subject = MultiviewSubject(body=tracker.body, person=Person(actor.sizes(), 1.75, "the height alone"), summary={}, hull=actor.hull(),
                               tracker=tracker, is_measured=measured)
    state = at_pose(tracker, MultiviewState(POSE, 0 * POSE, None, 0.0, 0.8, "tracked"), POSE)
    share = Share(state, None, [None], Drawn((), (), np.zeros((0, 3)), np.zeros(0)), [None])
    return Member(1, subject, np.random.default_rng(0), state, 1.75, np.zeros(2), share=share)


@pytest.fixture
def seen(monkeypatch):
    """What frames show: how well the body measured facing the way it is tracked, and the other, overlaps."""
    now = SimpleNamespace(shows=True, side=True, overlaps=(0.9, 0.8), measured=[])

    def measure(rng, make, expected, tracker, shares, poses):
        now.measured.append(poses)
        turned = not np.allclose(poses, POSE)
        overlaps = np.full(len(poses), now.overlaps[turned])
        return Measure(replace(tracker, body=make(LARGE)), LARGE, poses, overlaps, 0.01)

    monkeypatch.setattr(later_sizes, "measure", measure)
    monkeypatch.setattr(later_sizes, "shows", lambda share: now.shows)
    monkeypatch.setattr(later_sizes, "shows_side", lambda tracker, share: now.side)
    monkeypatch.setattr(later_sizes, "draw_person", lambda tracker, pose: None)
    monkeypatch.setattr(later_sizes, "follow_turned", lambda tracker, rng, state, share: state)
    return now


def watched(one: Member, frames: int = SETS, step: float = 0.2) -> float:
    for n in range(frames):
        measure_later(one, 5.0 + step * n)
    return 5.0 + step * (frames - 1)


def test_who_is_shown_well_enough_is_measured(seen):
    one = member()
    watched(one, SETS - 1)
    assert not one.subject.is_measured
    time = 5.0 + 0.2 * (SETS - 1)
    measure_later(one, time)
    assert one.subject.is_measured
    assert one.subject.person.sizes == LARGE
    assert one.subject.tracker.body is one.subject.body
    assert "share of 8 frames" in one.subject.person.source
    assert one.measured_at == time
    assert one.subject_at(time - 0.1).person.sizes == actor.sizes()
    assert one.subject_at(time) is one.subject
    assert len(seen.measured) == 1  # the front is known: not the other way


@pytest.mark.parametrize(("shows", "measured", "step"), [(False, False, 0.2), (True, True, 0.2), (True, False, 0.01)])
def test_who_is_not_shown_or_has_been_measured_is_not(seen, shows, measured, step):
    one = member(measured)
    seen.shows = shows
    watched(one, 2 * SETS, step)
    assert not seen.measured


@pytest.mark.parametrize(("overlaps", "known", "wrong"), [((0.9, 0.8), True, False), ((0.8, 0.9), True, True), ((0.9, 0.89), False, False)])
def test_of_an_unknown_front_both_ways_are_measured(seen, overlaps, known, wrong):
    one, seen.overlaps = member(), overlaps
    other = POSE + 0.1
    one.facing.begin(0.0, is_known=False)
    one.trial = SimpleNamespace(begun=0.0, state=SimpleNamespace(pose=other))
    time = watched(one)
    assert len(seen.measured) == 2
    assert one.subject.is_measured
    assert one.facing.is_known == known
    assert [part.wrong for part in one.facing.parts] == [wrong]
    np.testing.assert_array_equal(one.state.pose, other if wrong else POSE)
    assert one.measured_at == time
    assert one.trial is None


def test_sizes_that_fit_no_better_than_average_ones_are_not_taken(seen):
    one, seen.overlaps = member(), (0.7, 0.6)
    watched(one, 5 * SETS)
    assert not one.subject.is_measured
    assert one.earlier is None
    assert len(seen.measured) == ATTEMPTS


def test_an_unknown_front_is_not_measured_from_before_and_behind(seen):
    one = member()
    seen.side = False
    one.facing.begin(0.0, is_known=False)
    one.trial = SimpleNamespace(begun=0.0, state=SimpleNamespace(pose=POSE))
    watched(one, 2 * SETS)
    assert not seen.measured


@pytest.mark.parametrize(("measured", "known", "forward", "sure"), [
    (True, True, 0.0, True), (True, False, 0.9, False), (False, True, 0.9, True), (False, True, 0.0, False)])
def test_who_has_average_sizes_is_vouched_for_while_they_walk_forwards(measured, known, forward, sure):
    one = member(measured)
    one.facing.is_known, one.walk = known, SimpleNamespace(forward=forward)
    assert one.is_front_sure == sure
