"""Which way people face: walks, views from the side and quick turns change the odds, and the frames before follow."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.tracking.people import front as module
from shadowpuppet.tracking.people.front import KNOWN, MOST, SETTLING, Front, Step, Undecided, face, step_of
from shadowpuppet.tracking.people.tracker import Share

RATE = 15.0


def walked(speed: float, facing: float, seconds: float = 1.2, direction: float = 0.4) -> Front:
    """The front after a walk at `speed` (m/s) towards `direction`, the body turned by `facing` from it (rad)."""
    front, way = Front(0.0, False), np.array([np.cos(direction), np.sin(direction)])
    for n in range(round(seconds * RATE)):
        heading = direction + facing
        front, _ = front.moved(Step(n / RATE, speed * n / RATE * way, np.array([np.cos(heading), np.sin(heading)])))
    return front


@pytest.mark.parametrize(("speed", "facing", "sign"), [
    (1.2, np.pi, -1), (0.8, np.pi - 0.6, -1), (1.2, 0.0, 1), (1.2, np.pi / 2, 0), (0.3, np.pi, 0), (0.0, np.pi, 0)])
def test_the_way_tells_where_people_face(speed, facing, sign):
    odds = walked(speed, facing).odds
    assert np.sign(odds) * (abs(odds) >= KNOWN) == sign


def test_a_step_back_is_no_walk():
    assert abs(walked(0.8, np.pi, seconds=0.4).odds) < KNOWN


def test_odds_are_bounded_and_forgotten():
    front = walked(3.0, 0.0, seconds=4)
    assert front.odds == MOST
    for n in range(45):
        front, _ = front.moved(Step(4 + n / RATE, front.steps[-1].place, front.steps[-1].facing))
    assert abs(front.odds) < 0.5


def test_where_the_body_was_long_ago_is_no_way():
    front, _ = Front(0.0, False).moved(Step(0.0, np.zeros(2), np.array([1.0, 0.0])))
    front, _ = front.lost().moved(Step(3.0, np.array([2.0, 0.0]), np.array([1.0, 0.0])))
    assert front.odds == 0


@pytest.mark.parametrize(("seconds", "angle", "quick"), [(0.4, np.pi, True), (1.2, np.pi, False), (0.4, np.pi / 2, False)])
def test_a_body_that_turns_more_quickly_than_people_has_changed_over(seconds, angle, quick):
    front, found = Front(), []
    for n in range(40):
        heading = angle * np.clip((n / RATE - 1.0) / seconds, 0, 1)
        front, is_quick = front.moved(Step(n / RATE, np.zeros(2), np.array([np.cos(heading), np.sin(heading)])))
        found.append(is_quick)
    assert sum(found) == quick


def test_a_quick_turn_exchanges_the_undecided_frames():
    one, other = MotionFrame(0.0, "uncertain"), MotionFrame(0.0, "tracked")
    front, _ = Front(2.0, False, undecided=(Undecided(one, other),)).moved(Step(0.0, np.zeros(2), np.array([1.0, 0.0])))
    front, is_quick = front.moved(Step(0.1, np.zeros(2), np.array([-1.0, 0.0])))
    assert is_quick
    assert front.odds == pytest.approx(-2, abs=0.5)
    assert front.undecided == (Undecided(other, one),)
    assert front.found(wrong=False).decided == (other,)
    assert front.found(wrong=True).decided == (one,)


@pytest.mark.parametrize("heading", [0.0, 1.3, -2.5])
def test_the_body_faces_where_its_toes_point(heading):
    body = make_body("anatomical", average_sizes("anatomical", 1.75))
    pose = np.zeros(len(body.skeleton.dof_names))
    pose[body.skeleton.dof_indices(["root_x", "root_heading"])] = 0.7, heading
    at = dict(zip(body.landmark_names, body.points(pose[None])[0]))
    step = step_of(body, pose, 2.0)
    assert step.time == 2.0
    np.testing.assert_allclose(step.place, [0.7, 0.0])
    feet = sum(at[f"{side}_toe"] - at[f"{side}_heel"] for side in ("left", "right"))[:2]
    np.testing.assert_allclose(feet / np.linalg.norm(feet), step.facing, atol=0.05)


@pytest.fixture
def seen(monkeypatch):
    """What frames show: the overlap of the body turned round, whether from the side, the odds that keypoints tell; `followed` faces for
    some seconds."""
    now = SimpleNamespace(told=0.0, other=0.75, side=True, status="tracked", facing=np.array([1.0, 0.0]), way=np.zeros(2), turns=0)

    def turned(*given):
        return SimpleNamespace(overlap=now.other, status=now.status, pose="turned")

    def turn_round(*given):
        now.turns += 1
        return turned()

    monkeypatch.setattr(module, "turn_round", turn_round)
    monkeypatch.setattr(module, "follow_turned", turned)
    monkeypatch.setattr(module, "shown_of", lambda *given: SimpleNamespace(toward=lambda pose: now.told) if now.told else None)
    monkeypatch.setattr(module, "shows_side", lambda tracker, share: now.side)
    monkeypatch.setattr(module, "step_of", lambda body, pose, time: Step(time, now.way * time, now.facing))
    now.time = 0.0

    def followed(front: Front, seconds: float, **more):
        states = []
        for _ in range(round(seconds * RATE)):
            share = Share(SimpleNamespace(overlap=0.75, status="tracked", pose="here"), None, [], None)
            front, state = face(front, SimpleNamespace(body=None, rate=RATE), None, share, now.time, **more)
            front = front if front.is_known else front.with_frame(MotionFrame(now.time, "tracked"), MotionFrame(now.time, "lost"))
            states.append(state.pose)
            now.time += 1 / RATE
        return front, states

    now.followed = followed
    return now


@pytest.mark.parametrize(("lead", "side", "known", "turned"), [
    (0.05, True, True, False), (-0.05, True, True, True), (0.01, True, False, False), (-0.01, True, False, False),
    (0.05, False, False, False)])
def test_a_person_is_followed_both_ways_until_one_is_better_from_the_side(seen, lead, side, known, turned):
    seen.other, seen.side = 0.75 - lead, side
    front, states = seen.followed(Front().begun(is_known=False), 3.0)
    assert seen.turns == 1
    assert front.is_known == known
    assert ("turned" in states) == turned
    assert {frame.status for frame in front.decided} == ({"lost" if turned else "tracked"} if known else set())


def test_the_first_moments_and_a_single_frame_tell_nothing(seen):
    seen.other = 0.3
    front, _ = seen.followed(Front().begun(is_known=False), SETTLING - 0.02)
    seen.other = 0.75
    front, _ = seen.followed(front, 0.5)
    assert not front.is_known
    seen.other = 0.3
    front, _ = seen.followed(front, 2 / RATE)
    assert not front.is_known


def test_average_sizes_fit_too_alike_to_tell(seen):
    seen.other = 0.6
    assert not seen.followed(Front().begun(is_known=False), 3.0, fit_tells=False)[0].is_known
    seen.way = np.array([1.2, 0.0])
    assert seen.followed(Front().begun(is_known=False), 1.5, fit_tells=False)[0].is_known


def test_a_body_that_is_lost_turned_round_faced_the_wrong_way_then(seen):
    seen.other = np.nan
    front, states = seen.followed(Front().begun(is_known=False), 2 * SETTLING)
    assert front.is_known
    assert "turned" not in states


@pytest.mark.parametrize(("other", "turned"), [(0.75, True), (0.5, False)])
def test_a_body_that_is_carried_backwards_is_turned_round_if_that_fits(seen, other, turned):
    seen.other, seen.way = other, np.array([-1.0, 0.0])
    _, states = seen.followed(Front(), 2.0)
    assert ("turned" in states) == turned


@pytest.mark.parametrize(("lead", "status", "undone"), [(0.01, "tracked", True), (0.03, "tracked", False), (0.0, "lost", False)])
def test_a_quick_turn_is_undone_if_the_body_turned_back_fits_as_well(seen, lead, status, undone):
    front, _ = seen.followed(Front(), 1.0)
    seen.facing, seen.other, seen.status = -seen.facing, 0.75 - lead, status
    front, states = seen.followed(front, 1 / RATE)
    assert front.is_known == undone
    assert states == ["turned" if undone else "here"]


@pytest.mark.parametrize(("told", "pose", "turns"), [(30.0, "here", 0), (-30.0, "turned", 1)])
def test_keypoints_that_are_certain_tell_the_front_at_once(seen, told, pose, turns):
    seen.told = told
    front, states = seen.followed(Front().begun(is_known=False), 1 / RATE)
    assert front.is_known
    assert front.odds >= KNOWN
    assert (states, seen.turns) == ([pose], turns)


def test_keypoints_that_are_less_certain_tell_it_later(seen):
    seen.told = 4.0
    front, _ = seen.followed(Front().begun(is_known=False), 3 / RATE)
    assert not front.is_known
    front, states = seen.followed(front, 1.0)
    assert front.is_known
    assert "turned" not in states


def test_keypoints_turn_a_known_front_round_and_let_people_walk_backwards(seen):
    seen.told = -100.0
    front, states = seen.followed(Front(), 1 / RATE)
    assert front.is_known
    assert states == ["turned"]
    seen.told, seen.way = 8.0, np.array([-1.2, 0.0])
    assert "turned" not in seen.followed(front, 3.0)[1]


def test_known_fronts_cost_nothing(seen):
    front, _ = seen.followed(Front(), 3.0)
    assert front.is_known
    assert seen.turns == 0
