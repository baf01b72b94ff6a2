"""Who is carried backwards for a second faces the wrong way; who turns, stands or steps back does not."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.tracking.people.walking import Step, Walk, step_of


def walked(speed: float, facing: float, seconds: float = 1.2, rate: float = 15.0, direction: float = 0.4) -> Walk:
    """A walk at `speed` (m/s) towards `direction`, the body turned by `facing` from it (rad)."""
    walk, way = Walk(), np.array([np.cos(direction), np.sin(direction)])
    for n in range(round(seconds * rate)):
        heading = direction + facing
        walk.add(Step(n / rate, speed * n / rate * way, np.array([np.cos(heading), np.sin(heading)])))
    return walk


@pytest.mark.parametrize(("speed", "facing", "forward"), [
    (1.2, np.pi, -1), (0.8, np.pi - 0.6, -np.cos(0.6)), (1.2, 0.0, 1), (1.2, np.pi / 2, 0), (0.3, np.pi, 0), (0.0, np.pi, 0),
])
def test_the_way_tells_where_people_face(speed, facing, forward):
    assert walked(speed, facing).forward == pytest.approx(forward, abs=1e-9)


def test_a_step_back_is_no_walk():
    assert walked(1.2, np.pi, seconds=0.6).forward == 0


def test_after_a_turn_the_way_begins_again():
    walk = walked(1.2, np.pi)
    walk.forget()
    assert walk.forward == 0


@pytest.mark.parametrize(("pause", "noticed"), [(0.2, True), (0.9, False)])
def test_a_body_that_is_found_turned_round_after_a_loss_is_noticed(pause, noticed):
    """Found again it was searched for, and front and back hardly differ; in longer than that people turn."""
    walk = walked(1.0, 0.0)
    last = walk.steps[-1]
    walk.lose()
    assert walk.forward == 0
    walk.add(Step(last.time + pause, last.place, -last.facing))
    assert walk.jerked == (last.time if noticed else None)


def test_a_long_way_ago_does_not_count():
    walk = walked(1.2, np.pi)
    for n in range(30):
        walk.add(Step(1.2 + n / 15, np.zeros(2), np.array([1.0, 0.0])))
    assert walk.forward == 0


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


@pytest.mark.parametrize(("seconds", "angle", "quick"), [(0.4, np.pi, True), (1.2, np.pi, False), (0.4, np.pi / 2, False)])
def test_a_body_that_turns_more_quickly_than_people_is_noticed(seconds, angle, quick):
    walk, noticed = Walk(), []
    for n in range(40):
        heading = angle * np.clip((n / 15 - 1.0) / seconds, 0, 1)
        walk.add(Step(n / 15, np.zeros(2), np.array([np.cos(heading), np.sin(heading)])))
        noticed.append(walk.jerked)
    since = [time for time in noticed if time is not None]
    assert bool(since) == quick
    assert all(0.8 < time < 1.0 + seconds for time in since)
