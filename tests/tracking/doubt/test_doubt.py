"""Standard deviations, their factors, and limbs' statuses: what they are made of, and what makes them grow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import people
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.body.models import MODELS, average_body
from shadowpuppet.motion.limbs import LIMBS, limb_of, limbs_of
from shadowpuppet.tracking.doubt.doubt import UNSEEN, Evidence, limb_statuses, pose_deviations
from shadowpuppet.tracking.doubt.limbs import GROUPS, group_of, lever_of, limb_of_part
from shadowpuppet.tracking.doubt.steps import STILL_ALLOWED, Trail, stillness, surprise
from shadowpuppet.tracking.doubt.variance import ModeWeights, VarianceModel, kind_before_one, turned, variance_model

JOINTS = ("neck", "left_shoulder", "left_elbow", "left_hand", "right_knee")
LIMITS = {"trunk": 0.3, "arm": 0.2, "leg": 0.3}
LIMBS_OF_JOINTS = ("trunk", "left_arm", "right_leg")


@pytest.mark.parametrize("name", MODELS)
def test_every_joint_and_part_of_every_body_has_a_limb_a_group_and_a_lever(name):
    body = average_body(name)
    limbs = set(limbs_of(body.landmark_names))
    assert {limb_of(joint) for joint in body.landmark_names} == limbs == {limb_of_part(part) for part in body.parts}
    assert {group_of(joint) for joint in body.landmark_names} <= set(GROUPS)
    assert all(0.1 < lever_of(joint) < 1 for joint in body.landmark_names)


def test_shoulders_move_with_the_trunk():
    trunk = {"pelvis", "chest", "left_shoulder", "right_shoulder", "neck", "head"}
    assert {part for part in average_body("anatomical").parts if limb_of_part(part) == "trunk"} == trunk


@pytest.mark.parametrize("kind", ["multiview", "monocular_whole", "both_whole"])
def test_soles_have_factors_of_their_own(kind):
    factors = variance_model(kind).factors
    ankle, sole, hand = (list(GROUPS).index(group_of(joint)) for joint in ("left_ankle", "left_toe", "left_hand"))
    assert not np.array_equal(factors[ankle], factors[sole])
    assert not np.array_equal(factors[hand], factors[sole])


@pytest.mark.parametrize("kind", ["monocular", "both_one"])
def test_an_upper_body_has_no_factors_of_legs(kind):
    assert variance_model(kind).groups == ("pelvis", "neck", "shoulder", "elbow", "hand")


@pytest.mark.parametrize("kind", ["monocular", "monocular_whole", "both_one", "both_whole", "multiview"])
def test_the_calibrated_factors_are_whole(kind):
    model, beside = variance_model(kind), kind.startswith("both")
    bodies = [average_body(name) for name in MODELS if (name in people.BODIES) == (kind in ("monocular", "both_one"))]
    assert kind == "multiview" or {kind_before_one(body, keypoints=beside) for body in bodies} == {kind}
    assert ("missed" in model.names) is beside
    assert {group_of(joint) for body in bodies for joint in body.landmark_names} <= set(model.groups)
    assert model.factors.shape == (len(model.groups), 3, len(model.names))
    assert (model.factors >= 0).all()
    assert (model.factors[:, :, model.names.index("constant")] > 0).all()
    assert {limb.rpartition("_")[2] for body in bodies for limb in limbs_of(body.landmark_names)} <= set(model.limits)
    assert all(0 < limit <= 0.3 for limit in model.limits.values())


def test_a_variance_is_the_sum_of_the_components_variances():
    factors = np.zeros((2, 3, 2))
    factors[0], factors[1] = [[1, 2], [0, 1], [3, 0]], [[0, 5], [0, 0], [1, 1]]
    model = VarianceModel(("a", "b"), ("neck", "elbow"), factors, LIMITS)
    a, b = np.full((2, 3), 0.3), np.full((2, 3), 0.2)
    found = model.sd(["neck", "left_elbow"], {"a": a, "b": b})
    np.testing.assert_allclose(found, [[np.hypot(0.3, 0.4), 0.2, 0.9], [1.0, 0, np.hypot(0.3, 0.2)]])


def test_deviations_turn_with_the_axes():
    quarter = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])
    np.testing.assert_allclose(turned(np.array([[1.0, 2, 3]]), quarter), [[2, 1, 3]])
    assert np.isclose((turned(np.array([[1.0, 2, 3]]), np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]) ** 2).sum(), 14)


# Degrees of freedom


def deviations(pose, sd=0.02):
    picture = people.picture()
    skeleton, joints = picture.body.skeleton, np.full((len(picture.body.landmark_names), 3), sd)
    return dict(zip(skeleton.dof_names, pose_deviations(skeleton, picture.points, pose, joints)))


def test_the_roll_of_a_straight_arm_is_unknown_within_its_limits_and_that_of_a_bent_one_is_known():
    skeleton = people.picture().body.skeleton
    low, high = (limit[skeleton.dof_names.index("left_elbow_roll")] for limit in skeleton.limits)
    straight, bent = (deviations(skeleton.pose(left_shoulder_abduction=1.2, left_elbow_flexion=angle)) for angle in (0.0, 1.4))
    assert np.isclose(straight["left_elbow_roll"], (high - low) / np.sqrt(12), rtol=0.05)
    assert bent["left_elbow_roll"] < 0.15


def test_calibrated_factors_widen_deviations_up_to_those_of_the_limits():
    picture, pose = people.picture(), people.picture().body.skeleton.pose(left_shoulder_abduction=1.2)
    skeleton, sd = picture.body.skeleton, np.full((len(picture.body.landmark_names), 3), 0.02)
    plain, wide, wider = (pose_deviations(skeleton, picture.points, pose, sd, factor) for factor in (1.0, 1.5, 100.0))
    low, high = skeleton.limits
    known = np.isfinite(high - low)
    np.testing.assert_allclose(wide, np.minimum(1.5 * plain, np.where(known, (high - low) / np.sqrt(12), 1.0)))
    np.testing.assert_allclose(wider[known], ((high - low) / np.sqrt(12))[known])


def test_left_and_right_share_their_factor_and_others_have_none():
    model = replace(variance_model("monocular"), dofs={"torso_bow": 2.0, "elbow_roll": 3.0})
    names = ["torso_bow", "left_elbow_roll", "right_elbow_roll", "left_knee_flexion"]
    np.testing.assert_array_equal(model.dof_factors(names), [2, 3, 3, 1])


@given(st.lists(st.floats(-1e4, 1e4), max_size=3), st.floats(1, 2000), st.floats(0.1, 10), st.floats(-1, 2))
def test_weights_of_other_places_leave_some_to_the_estimate_and_fall_with_the_cost(more, temperature, odds, growth):
    weights = ModeWeights(temperature, odds, growth)
    shares = weights.shares(np.array(more))
    assert (shares >= 0).all()
    assert shares.sum() < 1 or np.isclose(shares.sum(), 1)
    assert (np.diff(shares[np.argsort(more)]) <= 1e-12).all()


def test_the_estimate_of_more_places_is_the_likelier():
    weights = ModeWeights(400, 1, 1)
    assert weights.shares(np.zeros(1)).sum() == 0.5
    assert weights.shares(np.zeros(2)).sum() == 0.5
    assert ModeWeights(400, 1, 0).shares(np.zeros(2)).sum() == pytest.approx(2 / 3)


def test_the_deviation_of_an_angle_follows_from_that_of_what_it_moves():
    pose = people.picture().body.skeleton.pose(left_shoulder_abduction=1.2, left_elbow_flexion=1.4)
    fine, coarse = deviations(pose, 0.01), deviations(pose, 0.02)
    forearm = 0.25
    assert 0.2 * 0.01 / forearm < fine["left_elbow_flexion"] < 3 * 0.01 / forearm
    assert np.isclose(coarse["left_elbow_flexion"], 2 * fine["left_elbow_flexion"], rtol=0.1)
    assert all(coarse[name] >= fine[name] for name in fine)


# Limbs


def statuses(*radii: float, unseen: float = 0.0, frozen: bool = False, status: str = "tracked") -> tuple[str, ...]:
    sd = np.outer(radii, [1, 0, 0]).astype(float)
    return limb_statuses(LIMITS, JOINTS, sd, Evidence({}, dict.fromkeys(LIMBS, unseen), frozen), status)


def test_a_limb_is_as_doubtful_as_its_most_doubtful_joint():
    assert limbs_of(JOINTS) == LIMBS_OF_JOINTS
    assert statuses(0.1, 0.1, 0.1, 0.1, 0.1) == ("tracked",) * 3
    assert statuses(0.1, 0.1, 0.1, 0.21, 0.21) == ("tracked", "uncertain", "tracked")
    assert statuses(0.31, 0.1, 0.1, 0.1, 0.31) == ("uncertain", "tracked", "uncertain")


def test_a_doubtful_limb_that_no_silhouette_shows_is_predicted():
    assert statuses(0.1, 0.1, 0.1, 0.3, 0.1, unseen=UNSEEN + 0.01) == ("tracked", "predicted", "tracked")
    assert statuses(0.1, 0.1, 0.1, 0.1, 0.1, unseen=1.0) == ("tracked",) * 3


def test_no_limb_of_an_uncertain_frame_is_vouched_for():
    assert statuses(0.1, 0.1, 0.1, 0.1, 0.1, status="uncertain") == ("uncertain",) * 3


def test_all_limbs_of_a_frozen_picture_are_predicted():
    assert statuses(0.1, 0.1, 0.1, 0.1, 0.1, frozen=True) == ("predicted",) * 3


# Motion


def trail(places, rate: float) -> Trail:
    """The trail of a joint at places (T, 3), and one that stands still."""
    found = Trail()
    for n, place in enumerate(places):
        found = found.with_frame(n / rate, np.array([place, [0, 0, 0]], float))
    return found


@given(st.floats(4, 120), st.floats(-3, 3), st.integers(0, 40))
def test_an_even_motion_is_no_surprise_at_any_frame_rate(rate, speed, frames):
    places = [[speed * n / rate, 0, 0] for n in range(frames + 1)]
    found = surprise(np.array([places[-1], [0, 0, 0]]), frames / rate, trail(places[:-1], rate))
    np.testing.assert_allclose(found, 0, atol=1e-9)


@pytest.mark.parametrize("rate", [15, 30, 60])
def test_a_jump_is_as_surprising_at_any_frame_rate(rate):
    found = surprise(np.array([[0.2, 0, 0], [0, 0, 0]]), 1.0, trail([[0, 0, 0]] * rate, rate))
    np.testing.assert_allclose(found, [0.2, 0], atol=1e-9)


def test_a_trail_keeps_what_surprise_needs_and_no_more():
    assert len(trail([[0, 0, 0]] * 500, 100).seconds) < 20
    assert len(trail([[0, 0, 0]] * 500, 2).seconds) == 3
    np.testing.assert_array_equal(surprise(np.ones((2, 3)), 0.0, Trail()), [0, 0])
    np.testing.assert_array_equal(surprise(np.ones((2, 3)), 0.1, trail([[0, 0, 0]], 10)), [0, 0])


def test_few_repeated_pictures_are_no_fault_and_more_raise_the_doubt_to_a_bound():
    assert [stillness(n) for n in range(STILL_ALLOWED + 1)] == [0] * (STILL_ALLOWED + 1)
    later = [stillness(n) for n in range(STILL_ALLOWED, 100)]
    assert sorted(later) == later
    assert later[1] > 0
    assert later[-1] == 2
