"""Several people in made recordings: they keep apart, each has a truth, and the choices of the command line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from shadowpuppet.errors import SettingsError
from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.recording import read_recording
from shadowpuppet.synthetic import Bystander, Gesture, Ring, Scene, Spec
from shadowpuppet.synthetic.company import members
from shadowpuppet.synthetic.movement.gestures import PAUSE_SECONDS, shake_hands
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.recording import _bystander, perform, synthesize
from shadowpuppet.synthetic.spec_changes import SpecChanges, apply_changes
from shadowpuppet.video import open_frames

TOGETHER = ("round", "past", "dance", "shake_hands")


def figures(spec: Spec):
    """Joints (T, 17, 3) of everybody."""
    times, first = perform(spec, np.random.default_rng(0))
    return [first.joints, *(_bystander(spec, one, len(times), np.random.default_rng(n), first).joints
                            for n, one in enumerate(spec.scene.bystanders))]  # fmt: skip


@pytest.mark.parametrize("together", TOGETHER)
@pytest.mark.parametrize("count", [2, 3, 6])
def test_people_do_not_pass_through_each_other(together, count):
    spec = apply_changes(SpecChanges(people=count, together=together, cameras=4, seconds=8, rate=5), Spec())
    people = figures(spec)
    assert len(people) == count
    pelvis = [joints[:, JOINTS.index("pelvis"), :2] for joints in people]
    least = min(float(np.linalg.norm(one - other, axis=1).min()) for n, one in enumerate(pelvis) for other in pelvis[:n])
    assert least > 0.5


def test_hands_meet():
    spec = apply_changes(SpecChanges(together="shake_hands", cameras=4, seconds=6, rate=10), Spec())
    hands = [joints[:, JOINTS.index("right_hand")] for joints in figures(spec)]
    assert np.linalg.norm(hands[0] - hands[1], axis=1).min() < 0.25


@pytest.mark.parametrize("seconds", [2, 4, 9.5])
def test_a_handshake_is_in_order_of_time(seconds):
    times = [time for time, _ in shake_hands(seconds, np.random.default_rng(1))]
    assert times == sorted(times)
    assert times[-1] <= seconds + PAUSE_SECONDS


def test_the_first_person_is_at_the_origin():
    for together in TOGETHER:
        first, *_ = members(together, 5)
        assert (first.x, first.y) == (0, 0)


@pytest.mark.parametrize("together", TOGETHER)
@pytest.mark.parametrize("count", [2, 4])
def test_cameras_stand_around_all_people(together, count):
    spec = apply_changes(SpecChanges(people=count, together=together, cameras=5, seconds=4, rate=5), Spec())
    cameras = [view.camera() for view in spec.views()]
    pelvis = np.stack([joints[:, JOINTS.index("pelvis")] for joints in figures(spec)])  # (people, T, 3)
    for camera in cameras:
        pixels = camera.project(pelvis.reshape(-1, 3))
        assert ((pixels >= 0) & (pixels < np.array(camera.size) - 1)).all(1).mean() > 0.95
    placed = apply_changes(SpecChanges(people=count, together=together), Spec(ring=Ring(count=4, radius=6.0))).ring
    assert placed == Ring(count=4, radius=6.0)  # a spec's own cameras stay


def test_choices_of_the_command_line():
    spec = apply_changes(SpecChanges(people=3, cameras=5), Spec())
    assert len(spec.scene.bystanders) == 2
    assert len({one.seed for one in spec.scene.bystanders}) == 2
    assert spec.ring is not None
    assert spec.ring.radius > Ring().radius
    assert spec.motion[0].motion == "walk"
    assert apply_changes(SpecChanges(people=3, cameras=5, ring_radius=6.0), Spec()).ring.radius == 6.0
    assert apply_changes(SpecChanges(people=2, motion="box 4"), Spec()).motion[0].motion == "box"
    with pytest.raises(SettingsError, match="found --second-person and --people"):
        apply_changes(SpecChanges(people=2, second_person="aside"), Spec())
    for wrong in (1, 7):
        with pytest.raises(Exception, match="people"):
            SpecChanges(people=wrong)


def test_each_has_a_truth_and_the_ready_silhouettes_are_of_all(tmp_path):
    scene = Scene(empty_seconds=0.5, bystanders=(Bystander(motion=Gesture(motion="wave_hands")),))
    spec = Spec(rate=2, frames=2, motion=(Gesture(motion="stand", seconds=2),), scene=scene, training=(),
                ring=Ring(count=2, size=(48, 32)))  # fmt: skip
    recording = read_recording(synthesize(spec, tmp_path / "two"))
    assert [path.name for path in recording.truths] == ["truth_1.csv", "truth_2.csv"]
    assert (tmp_path / "two" / "truth_1.csv").read_bytes() == (tmp_path / "two" / "truth.csv").read_bytes()
    assert [view.masks for view in recording.views] == [tmp_path / "two" / "people" / f"cam{n}.mkv" for n in (1, 2)]
    alone = read_recording(synthesize(replace(spec, scene=Scene(empty_seconds=0.5)), tmp_path / "one"))
    assert alone.truths == ()
    assert alone.views[0].masks == tmp_path / "one" / "masks" / "cam1.mkv"


def test_who_is_away_is_in_no_picture_and_has_no_place_in_the_truth(tmp_path):
    someone = Bystander(ahead=1.0, motion=Gesture(motion="stand"), away=(0.5, 1.5))
    spec = Spec(rate=2, frames=4, motion=(Gesture(motion="stand", seconds=3),), training=(), ring=Ring(count=2, size=(48, 32)),
                scene=Scene(empty_seconds=0.5, bystanders=(someone,)))  # fmt: skip
    folder = synthesize(spec, tmp_path / "made")
    places = read_truth(folder / "truth_2.csv").positions
    assert np.isnan(places).all((1, 2)).tolist() == [False, True, True, False]
    people, first = ([frame.image for frame in open_frames(folder / kind / "cam1.mkv")] for kind in ("people", "masks"))
    assert [bool((both > one).any()) for both, one in zip(people, first)] == [True, False, False, True]


@pytest.mark.parametrize("count", [2, 3, 4, 7])
def test_dancers_look_at_the_middle_and_walkers_have_it_to_their_left(count):
    for together, aside in (("dance", 0), ("round", 90)):
        people = members(together, count)
        places = np.array([(one.x, one.y) for one in people])
        for one, place in zip(people, places):
            to_middle = places.mean(0) - place
            heading = -90 + one.turn_deg + aside  # at 0 they look along -y
            np.testing.assert_allclose(to_middle / np.linalg.norm(to_middle), [np.cos(np.radians(heading)), np.sin(np.radians(heading))],
                                       atol=1e-9)  # fmt: skip
            assert -180 <= one.turn_deg < 180
