"""People of average sizes are measured where later frames show them, and go on with that body."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import actor
import numpy as np
import pytest

from shadowpuppet.io.person import Person
from shadowpuppet.pipeline.people import later_sizes
from shadowpuppet.pipeline.people.later_sizes import ATTEMPTS, SETS, measured_later
from shadowpuppet.pipeline.people.state import Measured, PersonState
from shadowpuppet.pipeline.person_rig import MultiviewSubject
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.people.evidence import Drawn
from shadowpuppet.tracking.people.front import Front
from shadowpuppet.tracking.people.shared_sizes import Measure
from shadowpuppet.tracking.people.tracker import Share, at_pose

LARGE = actor.sizes(thigh_length=1.1)
POSE = actor.stance(actor.body().skeleton)
TRACKER = MultiviewTracker(actor.body(), actor.cameras(), MultiviewSettings(particles=40))
SUBJECT = MultiviewSubject(body=TRACKER.body, person=Person(actor.sizes(), 1.75, "the height alone"), summary={}, hull=actor.hull(),
                           tracker=TRACKER, is_measured=False)  # fmt: skip


def state(pose) -> MultiviewState:
    return at_pose(TRACKER, MultiviewState(pose, 0 * pose, None, 0.0, 0.8, "tracked"), pose)


def person(measured: bool = False, **more) -> PersonState:
    share = Share(state(POSE), None, [None], Drawn((), (), np.zeros((0, 3)), np.zeros(0)), [None])
    return PersonState(1, Measured.of(replace(SUBJECT, is_measured=measured)), 1.75, np.zeros(2), share.state, share=share, **more)


def unknown() -> Front:
    """A front that is followed both ways."""
    return Front(0.0, False, other=state(POSE + 0.1), since=0.0)


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


def watched(one: PersonState, frames: int = SETS, step: float = 0.2) -> PersonState:
    for n in range(frames):
        one = measured_later(one, SUBJECT, np.random.default_rng(0), 5.0 + step * n)
    return one


def test_a_person_who_is_shown_well_enough_is_measured(seen):
    before = watched(person(), SETS - 1)
    assert not before.measured.is_measured
    time = 5.0 + 0.2 * (SETS - 1)
    one = measured_later(before, SUBJECT, np.random.default_rng(0), time)
    assert one.measured.is_measured
    np.testing.assert_array_equal(one.measured.sizes, LARGE.to_array())
    assert "share of 8 frames" in one.measured.source
    assert one.measured_at == time
    assert one.sizes_at(time - 0.1) is before.measured
    assert one.sizes_at(time) is one.measured
    assert len(seen.measured) == 1  # the front is known: not the other way
    assert not before.measured.is_measured  # a state never changes


@pytest.mark.parametrize(("shows", "measured", "step"), [(False, False, 0.2), (True, True, 0.2), (True, False, 0.01)])
def test_a_person_who_is_not_shown_or_has_been_measured_is_not(seen, shows, measured, step):
    seen.shows = shows
    watched(person(measured), 2 * SETS, step)
    assert not seen.measured


@pytest.mark.parametrize(("overlaps", "wrong"), [((0.9, 0.8), False), ((0.8, 0.9), True)])
def test_of_an_unknown_front_both_ways_are_measured(seen, overlaps, wrong):
    seen.overlaps = overlaps
    one = watched(person(front=unknown()))
    assert len(seen.measured) == 2
    assert one.measured.is_measured
    assert one.front.is_known
    np.testing.assert_array_equal(one.state.pose, POSE + 0.1 if wrong else POSE)
    assert one.share.state is one.state


def test_sizes_that_fit_no_better_than_average_ones_are_not_taken(seen):
    seen.overlaps = 0.7, 0.6
    one = watched(person(), 5 * SETS)
    assert not one.measured.is_measured
    assert one.earlier is None
    assert len(seen.measured) == ATTEMPTS


def test_an_unknown_front_is_not_measured_from_before_and_behind(seen):
    seen.side = False
    watched(person(front=unknown()), 2 * SETS)
    assert not seen.measured
