"""Heels and toes in the truth, and their contact with the floor."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from shadowpuppet.io.motion.motion_files import read_truth
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.metrics import joint_errors
from shadowpuppet.synthetic import Gesture, Mannequin, Spec, Viewpoint
from shadowpuppet.synthetic.person.clothes import Clothes
from shadowpuppet.synthetic.person.kinematics import SEGMENTS
from shadowpuppet.synthetic.person.limbs import leg
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.recording import feet_of, perform
from shadowpuppet.synthetic.truth import SOLES, Soles, sole_points, write_truth

HEEL, TOE = 0, 1


def walked(motion: str = "walk", rate: float = 60, **more) -> tuple[Spec, np.ndarray, Soles]:
    spec = Spec(body=Mannequin(), motion=(Gesture(motion=motion, seconds=6),), rate=rate, cameras=(Viewpoint(distance=6),), **more)
    times, figure = perform(spec, np.random.default_rng(2))
    return spec, times, feet_of(spec, times, figure, np.random.default_rng(2))


@pytest.mark.parametrize(("motion", "stands"), [("walk", (0.52, 0.66)), ("jog", (0.28, 0.42))])
def test_a_foot_is_in_contact_as_long_as_published(motion, stands):
    _, times, feet = walked(motion)
    middle = (times > 2.5) & (times < 5.0)
    foot = feet.contact[middle].reshape(-1, 2, 2).any(2)  # left, right
    assert stands[0] < foot.mean() < stands[1]
    assert foot.any(1).all() == (motion == "walk")  # only who jogs flies
    lands = feet.contact[:, HEEL] & ~np.roll(feet.contact[:, HEEL], 1) & middle
    if motion == "walk":
        assert lands.any()
        assert not feet.contact[lands][:, TOE].any()  # the heel first


def test_a_point_in_contact_stays_where_it_is():
    *_, feet = walked(rate=200)
    way = np.linalg.norm(np.diff(feet.points, axis=0), axis=2)
    both = feet.contact[1:] & feet.contact[:-1]
    assert way[both].max() < 0.6 / 200
    assert abs(feet.points[feet.contact][:, 2]).max() < 0.02
    assert feet.points[..., 2].min() > -0.005
    assert feet.points[..., 2].max() > 0.1


def test_contact_does_not_depend_on_the_frame_rate():
    (_, _, slow), (_, _, fast) = walked(rate=15), walked(rate=60)
    np.testing.assert_array_equal(slow.contact, fast.contact[::4][: len(slow.contact)])
    np.testing.assert_allclose(slow.points, fast.points[::4][: len(slow.points)], atol=1e-9)


def test_standing_soles_are_flat_and_the_toes_ahead_of_the_heels():
    spec, _, feet = walked("squat")
    assert feet.contact.all()
    np.testing.assert_allclose(feet.points[..., 2], 0, atol=1e-9)
    ahead = feet.points[0, [0, 2], 1] - feet.points[0, [1, 3], 1]
    np.testing.assert_allclose(ahead, 0.86 * spec.body.measure("foot_length"), rtol=0.02)
    _, figure = perform(spec, np.random.default_rng(2))
    ankle = figure.joints[0, JOINTS.index("left_ankle")]
    assert feet.points[0, TOE, 1] < ankle[1] < feet.points[0, HEEL, 1]


@pytest.mark.parametrize("body", [Mannequin(), Mannequin(stature=1.2, build=0.5)])
def test_the_shoe_is_flat_from_heel_to_ball_and_its_rear_a_heel_s_way_behind_the_ankle(body):
    shoe = next(loft for loft in leg(body, Clothes()) if loft.segment == "left_foot")
    along, _, depth, _, down = shoe.stations.T
    under = body.length("ankle") + shoe.start[2] - depth - down  # height of the sole's middle over the floor
    np.testing.assert_allclose(under, 0.002, atol=0.003)
    rear = shoe.start[1] + shoe.caps[0]
    assert 0.2 < rear / body.measure("foot_length") < 0.26
    assert along[-1] - shoe.start[1] >= -body.ball()[1]  # it reaches the ball


@pytest.mark.parametrize(("posture", "heels", "toes"), [("seated", 1, 1), ("kneeling", 0, 0), ("lying", 1, 0)])
def test_which_points_of_the_soles_touch_the_floor_in_other_postures(posture, heels, toes):
    spec = Spec(motion=(Gesture(motion="stand", seconds=2),), posture=posture, rate=5)
    times, figure = perform(spec, np.random.default_rng(0))
    contact = feet_of(spec, times, figure, np.random.default_rng(0)).contact
    np.testing.assert_array_equal(contact, np.tile([heels, toes, heels, toes], (len(times), 1)))


def test_a_sole_moves_with_its_foot():
    _, figure = perform(Spec(motion=(Gesture(motion="stand", seconds=2),), rate=1), np.random.default_rng(0))
    before = sole_points(Mannequin(), figure)
    origin = figure.origin.copy()
    origin[:, SEGMENTS.index("left_foot")] += [0, 0, 0.3]
    after = sole_points(Mannequin(), figure._replace(origin=origin))
    np.testing.assert_allclose(after[:, HEEL] - before[:, HEEL], np.broadcast_to([0, 0, 0.3], (len(before), 3)))
    np.testing.assert_array_equal(np.delete(after, HEEL, 1), np.delete(before, HEEL, 1))


def test_readers_of_a_truth_get_the_joints_they_know(tmp_path):
    _, times, feet = walked(rate=10)
    joints = np.random.default_rng(0).normal(size=(len(times), len(JOINTS), 3))
    write_truth(tmp_path / "with", times, joints, 10.0, feet)
    write_truth(tmp_path / "without", times, joints, 10.0)
    for ending in (".csv", ".trc"):
        new, old = (read_truth((tmp_path / name).with_suffix(ending)) for name in ("with", "without"))
        assert new.names == (*old.names, *SOLES)
        np.testing.assert_array_equal(new.select(old.names).positions, old.positions)
        named = read_joints((tmp_path / "with").with_suffix(ending))
        assert named.names == (*JOINTS, *SOLES)
        np.testing.assert_allclose(named.select(SOLES).positions, feet.points, atol=1.1e-5)
    columns = [(tmp_path / f"{name}.csv").read_text().splitlines() for name in ("with", "without")]
    assert all(new.startswith(old + ",") for new, old in zip(*columns))
    run = read_joints(tmp_path / "without.csv")
    moved = replace(run, positions=run.positions + 0.01)
    assert joint_errors(moved, read_truth(tmp_path / "with.csv")).names == joint_errors(moved, run).names
