"""Who comes, who is lost, who leaves and comes back."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.errors import TrackingError
from shadowpuppet.pipeline.people import group as module
from shadowpuppet.pipeline.people.group import GONE_SECONDS, Group, first_people
from shadowpuppet.tracking.people.columns import Column

STEP = 0.1


def column(x: float, height: float = 1.7) -> Column:
    return Column(np.array([x, 0.0]), height, 0.1, np.zeros((0, 3), np.int64))


@pytest.fixture
def scene(monkeypatch):
    """A group whose trackers follow people to their column, and are lost where there is none; `columns` are those seen now."""
    now = SimpleNamespace(columns=[], fits=0, refuse=False)

    def fit(rng, sets):
        if now.refuse:
            raise TrackingError("nobody")
        now.fits += 1
        return SimpleNamespace(tracker=None, body=None)

    def place(state):
        return min((each.place for each in now.columns), key=lambda other: abs(other[0] - state.place[0]), default=np.full(2, 99.0))

    def step(people, points, masks):
        found = {}
        for number, person in people.items():
            near = abs(place(person.state)[0] - person.state.place[0]) < 0.4
            where = place(person.state) if near else person.state.place
            state = SimpleNamespace(place=where, status="tracked" if near else "lost")
            found[number] = SimpleNamespace(state=state, drawn=None)
        return found

    def start(tracker, rng, column, drawn, points, masks):
        return SimpleNamespace(place=column.place, status="tracked")

    monkeypatch.setattr(module, "find_people", lambda room, masks, explained=(): list(now.columns))
    monkeypatch.setattr(module, "explained", lambda drawn, number: [])
    monkeypatch.setattr(module, "place_of", lambda body, state: state.place)
    monkeypatch.setattr(module, "step", step)
    monkeypatch.setattr(module, "start", start)
    now.group = Group(None, None, fit, np.random.default_rng(0))
    now.time = 0.0

    def run(seconds: float, *columns: Column) -> list[int]:
        now.columns = list(columns)
        for _ in range(round(seconds / STEP)):
            now.group.next(now.time, None, [None])
            now.time += STEP
        return [member.number for member in now.group.present]

    now.run = run
    return now


def test_who_stays_is_a_person_and_who_flickers_is_none(scene):
    assert scene.run(0.4, column(0)) == []
    assert scene.run(1.0) == []
    assert scene.run(1.0, column(0)) == [1]
    assert scene.fits == 1


def test_a_second_person_comes(scene):
    scene.run(1.0, column(0))
    assert scene.run(1.0, column(0), column(2)) == [1, 2]
    assert scene.run(1.0, column(0.1), column(1.9)) == [1, 2]
    assert scene.fits == 2


def test_who_leaves_is_absent_after_a_second(scene):
    scene.run(1.0, column(0), column(2))
    assert scene.run(GONE_SECONDS - 0.2, column(0)) == [1, 2]
    assert scene.run(0.5, column(0)) == [1]
    assert scene.group.members[1].state is None


def test_who_is_as_tall_comes_back(scene):
    scene.run(1.0, column(0, 1.8), column(2, 1.5))
    scene.run(2.0)
    assert scene.run(1.0, column(-1, 1.52)) == [2]
    assert scene.run(1.0, column(-1, 1.52), column(3, 1.2)) == [2, 3]


def test_somebody_who_cannot_be_measured_is_no_person(scene):
    scene.refuse = True
    assert scene.run(2.0, column(0)) == []
    scene.refuse = False
    assert scene.run(1.0, column(0)) == [1]


def test_first_people_are_those_who_last(monkeypatch):
    sets = [[column(0), column(2)], [column(0.05)], [column(0.1), column(2.1)], [column(0.1), column(2.1), column(5)]]
    monkeypatch.setattr(module, "find_people", lambda room, masks: sets[masks[0]])
    people, every = first_people(None, [0.0, 0.1, 0.2, 0.3], [[n] for n in range(4)])
    assert [len(each.sets) for each in people] == [4, 3]
    assert [len(columns) for columns in every] == [2, 1, 2, 3]
