"""Who comes, who is lost, who leaves and comes back."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.body.models import average_sizes
from shadowpuppet.camera.mask import Seen
from shadowpuppet.errors import TrackingError
from shadowpuppet.io.files.nested import read_nested, write_nested
from shadowpuppet.pipeline.people import fronts, later_sizes
from shadowpuppet.pipeline.people import group as module
from shadowpuppet.pipeline.people.group import GONE_SECONDS, Group, first_people
from shadowpuppet.pipeline.people.kept import TYPES, kept, restore
from shadowpuppet.pipeline.people.member import Shown
from shadowpuppet.tracking.people.appearance import nothing
from shadowpuppet.tracking.people.facing import Trial
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.people.tracker import Begun, Share
from shadowpuppet.tracking.people.walking import Step

STEP = 0.1


def figure(x: float, height: float = 1.7) -> Figure:
    return Figure(np.array([x, 0.0]), height)


@pytest.fixture
def scene(monkeypatch):
    """A group whose trackers follow people to their figure, and are lost where there is none; `figures` are those seen now."""
    now = SimpleNamespace(figures=[], fits=0, refuse=False, facing=np.array([1.0, 0.0]), sided=True, measured=True, lead=0.0, side=True,
                          images=())

    def fit(rng, sets):
        if now.refuse:
            raise TrackingError("nobody")
        now.fits += 1
        return SimpleNamespace(tracker=None, body=None, is_measured=now.measured)

    def place(state):
        return min((each.place for each in now.figures), key=lambda other: abs(other[0] - state.place[0]), default=np.full(2, 99.0))

    def step(people, points, masks):
        found = {}
        for number, person in people.items():
            near = abs(place(person.state)[0] - person.state.place[0]) < 0.4
            where = place(person.state) if near else person.state.place
            state = SimpleNamespace(place=where, pose=where, status="tracked" if near else "lost", overlap=0.8)
            found[number] = Share(state, None, [], None)
        return found

    def start(tracker, rng, figure, drawn, points, masks):
        return Begun(SimpleNamespace(place=figure.place, pose=figure.place, status="tracked", overlap=0.8), now.sided)

    def other(tracker, rng, *given):
        state = next(each.state for each in given if isinstance(each, Share))
        return SimpleNamespace(place=state.place, pose=state.pose, status="tracked", overlap=state.overlap - now.lead, is_other=True)

    monkeypatch.setattr(fronts, "turn_round", other)
    monkeypatch.setattr(fronts, "follow_turned", other)
    monkeypatch.setattr(module, "follow_turned", other)
    monkeypatch.setattr(fronts, "shows_side", lambda tracker, share: now.side)
    monkeypatch.setattr(later_sizes, "shows", lambda share: False)
    monkeypatch.setattr(module, "find_people", lambda floor, seen, explained=(): list(now.figures))
    monkeypatch.setattr(module, "explained", lambda drawn: [])
    monkeypatch.setattr(module, "place_of", lambda body, state: state.place)
    monkeypatch.setattr(module, "step", step)
    monkeypatch.setattr(module, "start", start)
    monkeypatch.setattr(fronts, "step_of", lambda body, pose, time: Step(time, pose[:2], now.facing))
    now.group = Group(None, None, fit, np.random.default_rng(0))
    now.time = 0.0

    def run(seconds: float, *figures: Figure) -> list[int]:
        now.figures = list(figures)
        for _ in range(round(seconds / STEP)):
            now.group.next(now.time, None, Seen((None,)), now.images)
            now.time += STEP
        return [member.number for member in now.group.present]

    now.run = run
    return now


def test_who_stays_is_a_person_and_who_flickers_is_none(scene):
    assert scene.run(0.4, figure(0)) == []
    assert scene.run(1.0) == []
    assert scene.run(1.0, figure(0)) == [1]
    assert scene.fits == 1


def test_a_second_person_comes(scene):
    scene.run(1.0, figure(0))
    assert scene.run(1.0, figure(0), figure(2)) == [1, 2]
    assert scene.run(1.0, figure(0.1), figure(1.9)) == [1, 2]
    assert scene.fits == 2


def test_who_leaves_is_absent_after_a_second(scene):
    scene.run(1.0, figure(0), figure(2))
    assert scene.run(GONE_SECONDS - 0.2, figure(0)) == [1, 2]
    assert scene.run(0.5, figure(0)) == [1]
    assert scene.group.members[1].state is None


def test_who_is_as_tall_comes_back(scene):
    scene.run(1.0, figure(0, 1.8), figure(2, 1.5))
    scene.run(2.0)
    assert scene.run(1.0, figure(-1, 1.52)) == [2]
    assert scene.run(1.0, figure(-1, 1.52), figure(3, 1.2)) == [2, 3]


def test_a_person_who_cannot_be_measured_is_no_person(scene):
    scene.refuse = True
    assert scene.run(2.0, figure(0)) == []
    scene.refuse = False
    assert scene.run(1.0, figure(0)) == [1]


def test_first_people_are_those_who_last(monkeypatch):
    sets = [[figure(0), figure(2)], [figure(0.05)], [figure(0.1), figure(2.1)], [figure(0.1), figure(2.1), figure(5)]]
    monkeypatch.setattr(module, "find_people", lambda floor, seen: sets[seen.masks[0]])
    people, every = first_people(None, [0.0, 0.1, 0.2, 0.3], [Seen((n,)) for n in range(4)])
    assert [len(each.sets) for each in people] == [4, 3]
    assert [len(figures) for figures in every] == [2, 1, 2, 3]


def test_cameras_are_judged_only_while_everybody_is_tracked(scene):
    scene.run(1.0, figure(0))
    assert scene.group.is_clear
    scene.run(0.3, figure(0), figure(2))
    assert not scene.group.is_clear
    scene.run(1.0, figure(0), figure(2))
    assert scene.group.is_clear
    scene.run(0.2, figure(0))
    assert not scene.group.is_clear


@pytest.mark.parametrize(("facing", "fits", "turns"), [(-1.0, True, 1), (-1.0, False, 0), (1.0, True, 0)])
def test_who_is_carried_backwards_is_turned_round_if_that_fits(scene, monkeypatch, facing, fits, turns):
    scene.facing, turned = np.array([facing, 0.0]), []

    def turn(tracker, rng, share):
        if fits:
            turned.append(share)
            scene.facing = -scene.facing
        return SimpleNamespace(**vars(share.state) | {"overlap": 0.78 if fits else 0.7})

    monkeypatch.setattr(fronts, "turn_round", turn)
    scene.run(1.0, figure(0))
    for n in range(20):
        scene.run(STEP, figure(0.1 * n))
    assert scene.group.present
    assert len(turned) == turns


@pytest.mark.parametrize(("sided", "measured", "known"), [(True, True, True), (False, True, False), (True, False, False)])
def test_where_a_person_faces_is_known_from_silhouettes_or_when_they_walk(scene, sided, measured, known):
    scene.sided, scene.measured = sided, measured
    scene.run(1.0, figure(0))
    (member,) = scene.group.members
    assert member.facing.is_known == known
    for n in range(20):
        scene.run(STEP, figure(0.1 * n))
    assert member.facing.is_known


@pytest.mark.parametrize(("lead", "side", "known", "turned"), [
    (0.05, True, True, False), (-0.05, True, True, True), (0.01, True, False, False), (0.05, False, False, False)])
def test_who_stands_is_followed_both_ways_until_one_is_better_from_the_side(scene, lead, side, known, turned):
    scene.sided, scene.lead, scene.side = False, lead, side
    scene.run(1.0, figure(0))
    (member,) = scene.group.members
    assert (member.trial is not None) == side
    states = []
    for _ in range(20):
        scene.run(STEP, figure(0))
        states.append(member.share.state)
    assert member.facing.is_known == known
    assert any(hasattr(state, "is_other") for state in states) == turned
    assert [part.wrong for part in member.facing.parts] == [turned]
    assert np.isnan(member.facing.parts[0].until) != known


def test_a_sudden_turn_raises_doubt_until_it_is_tried(scene):
    scene.lead = 0.05
    scene.run(2.0, figure(0))
    (member,) = scene.group.members
    assert member.facing.is_known
    scene.facing = -scene.facing
    scene.run(2 * STEP, figure(0))
    assert not member.facing.is_known
    scene.run(2.0, figure(0))
    assert member.facing.is_known
    assert len(member.facing.parts) == 2


def test_frames_that_show_no_side_do_not_count(scene):
    scene.sided, scene.lead = False, -0.05
    scene.run(1.0, figure(0))
    (member,) = scene.group.members
    assert member.trial is not None
    scene.side = False
    scene.run(2.0, figure(0))
    assert not member.facing.is_known
    scene.side = True
    scene.run(2.0, figure(0))
    assert member.facing.is_known


@pytest.mark.parametrize(("lead", "kept"), [(0.01, True), (0.03, False)])
def test_a_sudden_turn_is_undone_if_the_body_turned_back_fits_as_well(scene, lead, kept):
    scene.run(2.0, figure(0))
    (member,) = scene.group.members
    scene.facing, scene.lead = -scene.facing, lead
    scene.run(STEP, figure(0))
    assert hasattr(member.state, "is_other") == kept
    assert member.share.state is member.state
    assert member.facing.is_known == kept
    assert len(member.facing.parts) == 2 - kept


def dressed(bin: int):
    found = nothing(1)
    found[..., bin] = 50
    return found


@pytest.fixture
def colours(scene, monkeypatch):
    """Clothes of those who stand at a place, by its x: what the pictures show."""
    worn: dict[float, int] = {}

    def gather(group, time, bodies, free, masks, images):
        for member in group.present:
            if (bin := worn.get(round(float(member.state.place[0]), 1))) is not None:
                group.identity.see(member.number, time, dressed(bin))
        return [dressed(worn[round(float(each.place[0]), 1)]) for each in free]

    monkeypatch.setattr(Group, "_gather", gather)
    scene.images = [np.zeros((2, 2), np.uint8)]
    return worn


@pytest.mark.parametrize(("bin", "numbers"), [(20, [1]), (8, [2]), (28, [3]), (9, [2])])
def test_who_comes_back_is_known_by_their_clothes(scene, colours, bin, numbers):
    colours |= {0.0: 20, 2.0: 8, -1.0: bin}
    scene.run(3.0, figure(0, 1.7), figure(2, 1.7))
    assert scene.run(2.0) == []
    assert scene.run(1.0, figure(-1, 1.71)) == numbers
    assert not scene.group.identity.is_doubted(numbers[0])
    assert scene.fits == max(2, numbers[0])


def test_who_is_as_tall_and_dressed_alike_is_in_doubt(scene, colours):
    colours |= {0.0: 20, 2.0: 20, -1.0: 20}
    scene.run(3.0, figure(0, 1.7), figure(2, 1.7))
    scene.run(2.0)
    (number,) = scene.run(3.0, figure(-1, 1.7))
    assert scene.group.identity.is_doubted(number)


def test_without_pictures_who_is_as_tall_as_two_others_is_in_doubt(scene):
    scene.run(3.0, figure(0, 1.7), figure(2, 1.7))
    scene.run(2.0)
    (number,) = scene.run(3.0, figure(-1, 1.7))
    assert scene.group.identity.is_doubted(number)


def test_people_who_were_exchanged_are_put_right(scene, colours):
    colours |= {0.0: 20, 2.0: 8}
    scene.run(3.0, figure(0), figure(2))
    colours |= {0.0: 8, 2.0: 20}  # as if each tracker had gone over to the other
    scene.run(1.5, figure(0), figure(2))
    assert [round(float(member.state.place[0])) for member in scene.group.present] == [2, 0]
    (exchange,) = scene.group.exchanges
    assert (exchange.one, exchange.other) == (1, 2)
    scene.run(3.0, figure(0), figure(2))
    assert len(scene.group.exchanges) == 1


def test_people_who_pass_through_each_other_are_in_doubt_without_colours(scene):
    scene.run(1.0, figure(0), figure(2))
    for n in range(10):
        scene.run(STEP, figure(0.1 * n), figure(2 - 0.1 * n))
    assert scene.group.identity.questions
    scene.run(0.4, figure(0.95), figure(1.05))
    scene.run(2.0, figure(0.6), figure(1.4))
    assert all(scene.group.identity.is_doubted(member.number) for member in scene.group.present)


def test_a_group_goes_on_from_what_is_kept(scene, colours, tmp_path):
    colours |= {0.0: 20, 2.0: 8, -1.0: 28}
    scene.sided = False  # so that there is a trial
    scene.run(2.0, figure(0), figure(2))
    scene.run(0.3, figure(0), figure(2), figure(-1))  # who comes
    group = scene.group
    group.identity.meet(1, 2, scene.time, is_open=True)
    group.rng.random()
    for member in group.members:
        member.rng.random()
        member.subject.person = SimpleNamespace(sizes=average_sizes("anatomical", 1.7), height=1.7, source="")
        member.subject.summary, member.state = {"overlap": 0.9}, None
        member.trial = None if member.trial is None else Trial(member.trial.begun, None)
        member.shown = [Shown(0.5, Share(None, None, (None,), None, (None,)), np.ones(3), None)]
        member.earlier, member.measured_at = member.subject, 0.7
    write_nested(tmp_path / "kept.npz", kept(group))
    again = Group(None, None, None, np.random.default_rng(0))
    restore(again, read_nested(tmp_path / "kept.npz", TYPES), lambda held: group.members[0].subject)
    assert str(kept(again)) == str(kept(group))
    assert again.rng.spawn(1)[0].random() == group.rng.spawn(1)[0].random()
    assert [each.random() for each in (again.rng, *(member.rng for member in again.members))] == [
        each.random() for each in (group.rng, *(member.rng for member in group.members))]  # fmt: skip
    for one, other in zip(again.members, group.members):
        assert (one.shown[0].time, one.measured_at) == (other.shown[0].time, other.measured_at)
        assert one.subject_at(0.6) is one.earlier
    (coming,), (look, *_) = again.coming, list(again.seen.values())[::-1]
    assert any(figure is coming.figures[-1] for figure in look.figures)
