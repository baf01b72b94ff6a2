"""Who comes, who is lost, who leaves and comes back."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.camera.mask import Seen
from shadowpuppet.errors import TrackingError
from shadowpuppet.io.files.nested import read_nested, write_nested
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.people import group as module
from shadowpuppet.pipeline.people.group import GONE_SECONDS, Frames, Group, doubted, first_people
from shadowpuppet.pipeline.people.state import TYPES, Measured, PeopleState, PersonState, Shown
from shadowpuppet.tracking.multiview.tracker import MultiviewState
from shadowpuppet.tracking.people.appearance import nothing
from shadowpuppet.tracking.people.figures import Figure
from shadowpuppet.tracking.people.front import KNOWN
from shadowpuppet.tracking.people.tracker import Begun, Share

STEP = 0.1


def figure(x: float, height: float = 1.7) -> Figure:
    return Figure(np.array([x, 0.0]), height)


def at(place: np.ndarray, status: str = "tracked") -> MultiviewState:
    return MultiviewState(np.asarray(place), np.zeros(2), None, 0.0, 0.8, status)


class Dressed(Group):
    """A group in whose pictures people wear what stands by the x of their place."""

    worn: dict[float, int]

    def colours(self, people, bodies, free, frames):
        identity = people.identity
        for person in people.present:
            if (bin := self.worn.get(round(float(person.state.pose[0]), 1))) is not None:
                identity = identity.see(person.number, frames.time, dressed(bin))
        return identity, [dressed(self.worn[round(float(each.place[0]), 1)]) for each in free]


@pytest.fixture
def scene(monkeypatch):
    """A group whose trackers follow people to their figure, and are lost where there is none; `figures` are those seen now."""
    now = SimpleNamespace(figures=[], fits=0, refuse=False, sided=True, measured=True, images=(), faced=None)

    def fit(rng, seen):
        if now.refuse:
            raise TrackingError("nobody")
        now.fits += 1
        return Measured(np.full(3, float(now.fits)), 1.7, "", {}, now.measured)

    def step(people, points, masks, keypoints=()):
        found = {}
        for number, person in people.items():
            here = person.state.pose
            there = min((each.place for each in now.figures), key=lambda other: abs(other[0] - here[0]), default=np.full(2, 99.0))
            near = abs(there[0] - here[0]) < 0.4
            found[number] = Share(at(there if near else here, "tracked" if near else "lost"), None, [], None)
        return found

    def face(front, tracker, rng, share, time, fit_tells):
        return (front, share.state) if now.faced is None else now.faced(front, share, fit_tells)

    monkeypatch.setattr(module, "face", face)
    monkeypatch.setattr(module, "follow_turned", lambda tracker, rng, state, share: state)
    monkeypatch.setattr(module, "measured_later", lambda person, subject, rng, time: person)
    monkeypatch.setattr(module, "motion_frame", lambda subject, time, state, seen, before=None: (MotionFrame(time, state.status), time))
    monkeypatch.setattr(module, "find_people", lambda floor, seen, explained=(): list(now.figures))
    monkeypatch.setattr(module, "explained", lambda drawn: [])
    monkeypatch.setattr(module, "place_of", lambda body, state: state.pose)
    monkeypatch.setattr(module, "step", step)
    monkeypatch.setattr(module, "start", lambda tracker, rng, one, *given: Begun(at(one.place), now.sided))
    now.group = Dressed(None, None, fit, lambda measured: SimpleNamespace(tracker=None, body=None))
    now.people, now.time = PeopleState(is_begun=True), 0.0

    def run(seconds: float, *figures: Figure) -> list[int]:
        now.figures = list(figures)
        for _ in range(round(seconds / STEP)):
            now.people = now.group.next(now.people, Frames(now.time, None, Seen((None,)), now.images))
            now.time += STEP
        return [person.number for person in now.people.present]

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
    assert scene.people.people[1].state is None


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


def test_no_more_people_come_than_there_are_to_be(scene, monkeypatch):
    object.__setattr__(scene.group, "most", 1)
    assert scene.run(1.0, figure(0), figure(2)) == [1]
    assert scene.run(2.0, figure(0), figure(2)) == [1]
    scene.run(2.0, figure(9))
    assert scene.run(1.0, figure(3)) == [1]  # back again


def test_first_people_are_those_who_last(monkeypatch):
    sets = [[figure(0), figure(2)], [figure(0.05)], [figure(0.1), figure(2.1)], [figure(0.1), figure(2.1), figure(5)]]
    monkeypatch.setattr(module, "find_people", lambda floor, seen: sets[seen.masks[0]])
    given = None, [0.0, 0.1, 0.2, 0.3], [Seen((n,)) for n in range(4)]
    assert [len(each.sightings) for each in first_people(*given)] == [4, 3]
    sets[0][1] = sets[0][1]._replace(evidence=9.0)
    assert [len(each.sightings) for each in first_people(*given, most=1)] == [3]


def test_cameras_are_judged_only_while_everybody_is_tracked(scene):
    scene.run(1.0, figure(0))
    assert scene.people.is_clear
    scene.run(0.3, figure(0), figure(2))
    assert not scene.people.is_clear
    scene.run(1.0, figure(0), figure(2))
    assert scene.people.is_clear
    scene.run(0.2, figure(0))
    assert not scene.people.is_clear


@pytest.mark.parametrize(("sided", "measured", "known"), [(True, True, True), (False, True, False), (True, False, False)])
def test_the_front_is_known_from_silhouettes_that_tell_and_measured_sizes(scene, sided, measured, known):
    scene.sided, scene.measured = sided, measured
    scene.run(1.0, figure(0))
    (person,) = scene.people.people
    assert person.front.is_known == known
    assert person.frame.status == ("tracked" if known else "uncertain")


def test_frames_of_an_unknown_front_are_kept_until_it_is_known(scene):
    scene.sided = False
    scene.faced = lambda front, share, fit_tells: (front._replace(other=at(share.state.pose, "lost")), share.state)
    scene.run(1.0, figure(0))
    (before,) = scene.people.people
    assert {(each.frame.status, each.other.status) for each in before.front.undecided} == {("tracked", "lost")}
    assert before.frame.status == "uncertain"
    other = at([9.0, 0.0])
    scene.faced = lambda front, share, fit_tells: (front.found(wrong=True), other)
    scene.run(STEP, figure(0))
    (person,) = scene.people.people
    assert person.state is person.share.state is other
    assert person.frame.status == "tracked"
    assert [frame.status for frame in person.front.decided] == ["lost"] * len(before.front.undecided)
    assert before.front.decided == ()  # a state never changes


@pytest.mark.parametrize(("measured", "known", "odds", "sure"), [
    (True, True, 0.0, True), (True, False, KNOWN + 1, False), (False, True, KNOWN + 1, True), (False, True, KNOWN, False)])
def test_average_sizes_are_vouched_for_while_the_person_walks_forwards(scene, measured, known, odds, sure):
    scene.measured, scene.faced = measured, lambda front, share, fit_tells: (front._replace(odds=odds, is_known=known), share.state)
    scene.run(1.0, figure(0))
    (person,) = scene.people.people
    assert person.is_front_sure == sure
    assert person.frame.status == ("tracked" if sure else "uncertain")


def test_nothing_of_a_person_who_may_face_the_other_way_is_vouched_for():
    frame = doubted(MotionFrame(0.0, "tracked", limb_status=["tracked", "predicted", "lost"]))
    assert (frame.status, frame.limb_status) == ("uncertain", ("uncertain", "predicted", "lost"))
    assert doubted(MotionFrame(0.0, "lost")).status == "lost"


def dressed(bin: int):
    found = nothing(1)
    found[..., bin] = 50
    return found


@pytest.fixture
def colours(scene):
    """Clothes of those who stand at a place, by its x: what the pictures show."""
    worn: dict[float, int] = {}
    object.__setattr__(scene.group, "worn", worn)
    scene.images = [np.zeros((2, 2), np.uint8)]
    return worn


@pytest.mark.parametrize(("bin", "numbers"), [(20, [1]), (8, [2]), (28, [3]), (9, [2])])
def test_who_comes_back_is_known_by_their_clothes(scene, colours, bin, numbers):
    colours |= {0.0: 20, 2.0: 8, -1.0: bin}
    scene.run(3.0, figure(0, 1.7), figure(2, 1.7))
    assert scene.run(2.0) == []
    assert scene.run(1.0, figure(-1, 1.71)) == numbers
    assert not scene.people.identity.is_doubted(numbers[0])
    assert scene.fits == max(2, numbers[0])


def test_who_is_as_tall_and_dressed_alike_is_in_doubt(scene, colours):
    colours |= {0.0: 20, 2.0: 20, -1.0: 20}
    scene.run(3.0, figure(0, 1.7), figure(2, 1.7))
    scene.run(2.0)
    (number,) = scene.run(3.0, figure(-1, 1.7))
    assert scene.people.identity.is_doubted(number)


def test_without_pictures_who_is_as_tall_as_two_others_is_in_doubt(scene):
    scene.run(3.0, figure(0, 1.7), figure(2, 1.7))
    scene.run(2.0)
    (number,) = scene.run(3.0, figure(-1, 1.7))
    assert scene.people.identity.is_doubted(number)


def test_people_who_were_exchanged_are_put_right(scene, colours):
    colours |= {0.0: 20, 2.0: 8}
    scene.run(3.0, figure(0), figure(2))
    colours |= {0.0: 8, 2.0: 20}  # as if each tracker had gone over to the other
    scene.run(1.5, figure(0), figure(2))
    assert [round(float(person.state.pose[0])) for person in scene.people.present] == [2, 0]
    (exchange,) = scene.people.exchanges
    assert (exchange.one, exchange.other) == (1, 2)
    scene.run(3.0, figure(0), figure(2))
    assert len(scene.people.exchanges) == 1


def test_people_who_pass_through_each_other_are_in_doubt_without_colours(scene):
    scene.run(1.0, figure(0), figure(2))
    for n in range(10):
        scene.run(STEP, figure(0.1 * n), figure(2 - 0.1 * n))
    assert scene.people.identity.questions
    scene.run(0.4, figure(0.95), figure(1.05))
    scene.run(2.0, figure(0.6), figure(1.4))
    assert all(scene.people.identity.is_doubted(person.number) for person in scene.people.present)


def test_people_go_on_from_what_is_kept(scene, colours, tmp_path):
    colours |= {0.0: 20, 2.0: 8, -1.0: 28}
    scene.sided = False  # so that there are undecided frames
    scene.faced = lambda front, share, fit_tells: (front._replace(other=None if scene.time < 1 else share.state), share.state)
    scene.run(2.0, figure(0), figure(2))
    scene.run(0.3, figure(0), figure(2), figure(-1))  # who comes
    people = scene.people._replace(identity=scene.people.identity.meet(1, 2, scene.time, is_open=True))
    one = people.people[0]
    shown = Shown(0.5, Share(at(np.zeros(2)), None, (None,), None, (None,)), np.ones(3))
    people = people.having(one._replace(shown=(shown,), earlier=one.measured, measured_at=0.7))
    assert people.coming
    assert people.people[0].front.undecided
    write_nested(tmp_path / "kept.npz", people.kept())
    again = read_nested(tmp_path / "kept.npz", TYPES)
    assert str(again) == str(people.kept())
    assert isinstance(again, PeopleState)
    assert isinstance(again.people[0], PersonState)
    assert again.people[0].sizes_at(0.6) is again.people[0].earlier
    frames = Frames(scene.time, None, Seen((None,)), scene.images)
    assert str(scene.group.next(again, frames).kept()) == str(scene.group.next(people, frames).kept())
