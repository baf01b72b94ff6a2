"""Stages: which DOF they draw, with what noise, how they weigh, and what is no stage."""

from __future__ import annotations

import numpy as np
import pytest
from people import camera, picture, random_poses

from shadowpuppet.errors import SettingsError
from shadowpuppet.tracking.monocular.extended_stage import ExtendedStage, make_stage
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.particle_filter import Particles, evaluate
from shadowpuppet.tracking.silhouette_cost import Observation, silhouette_costs

PLAIN = {"motion_weight": 0.0, "posture_weight": 0.0}
FLAT = "torso+left_arm+right_arm"


def stage(name: str = "left_arm", preset: str = "liu2011", body: str = "cardbox", size=(160, 120), **overrides) -> FilterStage:
    return make_stage(picture(body, camera(size)), make_settings(preset, overrides), name)


def names(of: FilterStage) -> list[str]:
    return [of.picture.body.skeleton.dof_names[d] for d in of.dofs]


# What a stage draws ---------------------------------------------------------------------------------------------------


def test_the_paper_s_stages_of_four_dof_and_table_i_s_noise():
    torso, left, right = (stage(name) for name in ("torso", "left_arm", "right_arm"))
    assert names(torso) == ["torso_y", "torso_twist", "torso_bow", "torso_bend"]
    assert names(left) == [f"left_{name}" for name in ("shoulder_abduction", "shoulder_forward", "elbow_roll", "elbow_flexion")]
    assert names(right) == [name.replace("left", "right") for name in names(left)]
    np.testing.assert_array_equal(torso.sigma, [0.02, 0.1, 0.1, 0.1])
    np.testing.assert_array_equal(left.sigma, [0.25] * 4)
    assert [s.number for s in (torso, left, right)] == [200] * 3


@pytest.mark.parametrize("name", ["torso", "left_arm", FLAT])
def test_the_paper_s_stages_have_none_of_our_additions(name):
    assert type(stage(name)) is FilterStage
    for addition in ({"explore": 1}, {"motion_weight": 1.0}, {"posture_weight": 1.0}, {"estimate": "mean"}):
        assert type(stage(name, **addition)) is ExtendedStage


@pytest.mark.parametrize(("name", "number", "dofs"), [
    (FLAT, 600, 12), ("right_arm+left_arm", 400, 8), (" torso + left_arm ", 400, 8), ("torso+torso", 200, 4),
])  # fmt: skip
def test_parts_that_are_moved_at_once(name, number, dofs):
    joined = stage(name)
    assert (joined.number, len(joined.dofs)) == (number, dofs)
    assert (np.diff(joined.dofs) > 0).all()
    expected = [0.02 if n == "torso_y" else 0.1 if n.startswith("torso") else 0.25 for n in names(joined)]
    np.testing.assert_array_equal(joined.sigma, expected)


# How a stage selects (eq. 8, Algorithms 3 and 4)


def selected(rank_by: str, resampling: str = "deterministic") -> np.ndarray:
    """Of six particles whose costs in the last picture rise, and in the new one fall, but for the fifth, which costs least there."""
    of = stage(rank_by=rank_by, resampling=resampling, arm={"survival": 0.5})
    known, new = -np.arange(6.0), np.array([-6.0, -5, -4, -3, 0, -1])
    particles = Particles(np.zeros((6, len(of.dofs))), -known, known)
    return of.selection(particles, lambda poses: (-new, new))(np.random.default_rng(0), known, 6)


def test_ranked_by_the_last_picture_the_new_one_or_the_new_one_for_the_best_alone():
    assert selected("last").tolist() == [0, 1, 2, 0, 0, 0]
    assert selected("new").tolist() == [4, 5, 3, 4, 4, 4]
    assert selected("best_new").tolist() == [4, 1, 2, 4, 4, 4]  # the survivors are those of the known costs


def test_algorithm_3_draws_by_the_known_weights_beside_the_best_in_the_new_picture():
    last, best_new = selected("last", "stratified"), selected("best_new", "stratified")
    assert (last[0], best_new[0]) == (0, 4)
    np.testing.assert_array_equal(best_new[1:], last[1:])


@pytest.mark.parametrize("name", ["legs", "torso+legs", "", "torso+", "left", "Torso"])
def test_an_unknown_part_is_said_with_those_there_are(name):
    with pytest.raises(SettingsError, match=r"stages: unknown part '.*' in '.*'; there are: left_arm, right_arm, torso"):
        stage(name)


def test_values_are_put_into_poses_and_nothing_else(rng):
    arm = stage()
    pose = random_poses(rng, arm.picture.body.skeleton, 1)[0]
    values = rng.standard_normal((5, 4))
    poses = arm.put(pose, values)
    np.testing.assert_array_equal(poses[:, arm.dofs], values)
    others = np.setdiff1d(np.arange(12), arm.dofs)
    np.testing.assert_array_equal(poses[:, others], np.repeat(pose[None, others], 5, 0))
    np.testing.assert_array_equal(arm.put(pose, values[2]), poses[2])
    assert not np.shares_memory(arm.put(pose, values[2]), pose)


# How it draws ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["torso", "left_arm", FLAT])
@pytest.mark.parametrize("preset", ["liu2011", "default"])
def test_the_first_particle_is_not_moved(name, preset, rng):
    part = stage(name, preset)
    for cycle in range(3):
        values = np.repeat(part.clamp(0.1 * rng.standard_normal((1, len(part.dofs)))), 50, 0)
        drawn = part.propose(cycle)(rng, values)
        np.testing.assert_array_equal(drawn[0], values[0])
        assert (drawn[1:] != values[0]).any(1).all()


def test_noise_cools_from_cycle_to_cycle(rng):
    part = stage("torso", cooling=0.5, limits=False)
    values = np.zeros((4000, 4))
    for cycle in range(3):
        np.testing.assert_allclose(part.propose(cycle)(rng, values)[1:].std(0), part.sigma * 0.5**cycle, rtol=0.08)


def test_limits_are_kept_or_not(rng):
    values = np.tile([3.0, 1.5, 1.5, 0.05], (500, 1))
    low, high = (limit[stage().dofs] for limit in stage().picture.body.skeleton.limits)
    kept, free = (stage(limits=limits).propose(0)(rng, values)[1:] for limits in (True, False))
    assert ((kept >= low) & (kept <= high)).all()
    assert ((free < low) | (free > high)).any()


@pytest.mark.parametrize(("name", "cycle", "number"), [("torso", 0, 250), ("left_arm", 0, 250), ("left_arm", 1, 200), (FLAT, 0, 600)])
def test_poses_from_afar_are_tried_beside_in_the_first_cycle_of_a_stage_of_one_part(name, cycle, number, rng):
    part = stage(name, explore=50)
    assert len(part.propose(cycle)(rng, np.zeros((part.number, len(part.dofs))))) == number


@pytest.mark.parametrize("sigma", [0.1, 0.02])
def test_the_torso_is_explored_near_where_it_is_and_upright(sigma, rng):
    """Also where angles and places have the same deviation."""
    part = stage("torso", explore=1, torso={"sigma_rotation": sigma, "sigma_translation": 0.02})
    assert isinstance(part, ExtendedStage)
    tried = part.explore(rng, np.array([0.9, 0.5, 0.5, 0.5]), 4000)
    np.testing.assert_allclose(tried.mean(0), [0.9, 0, 0, 0], atol=0.03)
    np.testing.assert_allclose(tried.std(0), [0.1, 0.3, 0.3, 0.3], rtol=0.1)


def test_an_arm_is_explored_all_over(rng):
    tried = stage(explore=2000).propose(0)(rng, np.zeros((200, 4)))[200:]
    low, high = (limit[stage().dofs] for limit in stage().picture.body.skeleton.limits)
    assert (np.ptp(tried, axis=0) > 0.8 * (high - low)).all()


# How it weighs --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["torso", "left_arm", FLAT])
@pytest.mark.parametrize("body", ["cardbox", "rounded"])
def test_costs_are_eq_2_and_weights_eq_6(name, body, rng):
    part = stage(name, body=body, torso_arms="last")
    pose = random_poses(rng, part.picture.body.skeleton, 1)[0] * 0.4
    observation = Observation.of(part.picture.mask(0.8 * pose))
    values = pose[part.dofs] + 0.2 * rng.standard_normal((20, len(part.dofs)))
    costs, log_weights = part.weigh(observation, pose, pose)(values)
    np.testing.assert_array_equal(costs, silhouette_costs(part.picture, observation, part.put(pose, values)))
    # sigma_gamma of Table I is for 320 x 240; this picture has a quarter of its pixels.
    sigma = (4000 if name == "left_arm" else 8000) / 4
    np.testing.assert_allclose(log_weights, -(costs**2) / (2 * sigma**2))


def test_weights_do_not_depend_on_the_picture_s_size(rng):
    """The same poses at twice the resolution cost four times as many pixels and weigh the same."""
    values, found = 0.5 * rng.standard_normal((20, 4)), []
    for size in ((320, 240), (640, 480)):
        part = stage(size=size, preset="default", body="cardbox")
        observation = Observation.of(part.picture.mask(np.zeros(12)))
        found.append(part.weigh(observation, np.zeros(12), np.full(12, 0.1))(values))
    np.testing.assert_allclose(found[1][0], 4 * found[0][0], rtol=0.02, atol=60)
    np.testing.assert_allclose(found[1][1], found[0][1], rtol=0.15)


def test_unusual_postures_cost_their_strain(rng):
    plain, pulled = (stage(**{**PLAIN, "posture_weight": weight}) for weight in (0.0, 7.0))
    pose, values = np.zeros(12), rng.standard_normal((10, 4))
    observation = Observation.of(plain.picture.mask(pose))
    more = pulled.weigh(observation, pose, pose)(values)[0] - plain.weigh(observation, pose, pose)(values)[0]
    np.testing.assert_allclose(more, 7 / 4 * plain.picture.body.skeleton.posture_penalty(plain.put(pose, values)))


@pytest.mark.parametrize(("name", "points"), [
    ("torso", {"left_shoulder", "right_shoulder"}), ("left_arm", {"left_elbow", "left_hand"}), ("right_arm", {"right_elbow", "right_hand"}),
    (FLAT, {f"{side}_{name}" for side in ("left", "right") for name in ("shoulder", "elbow", "hand")}),
])  # fmt: skip
def test_moving_costs_by_how_far_the_stage_s_points_went(name, points, rng):
    overrides = {**PLAIN, "motion_reach": 0.2, "explore": 0}
    plain, pulled = stage(name, **overrides), stage(name, **overrides | {"motion_weight": 300.0})
    view = plain.picture
    last, pose = (0.3 * pose for pose in random_poses(rng, view.body.skeleton, 2))
    values = pose[plain.dofs] + 0.3 * rng.standard_normal((10, len(plain.dofs)))
    observation = Observation.of(view.mask(pose))
    more = pulled.weigh(observation, pose, last)(values)[0] - plain.weigh(observation, pose, last)(values)[0]
    chosen = sorted(points)
    squared = ((view.points(plain.put(pose, values), chosen) - view.points(last[None], chosen)) ** 2).sum(2)
    np.testing.assert_allclose(more, 300 / 4 * (squared / (1 + squared / 0.2**2)).sum(1))
    assert (more < 300 / 4 * 0.2**2 * len(points)).all()  # it holds no one who plainly went
    still = [part.weigh(observation, last, last)(last[None, plain.dofs])[0] for part in (plain, pulled)]
    assert still[0] == pytest.approx(still[1], abs=1e-9)


def test_the_torso_s_stage_draws_the_arms_carried_along_or_not_at_all(rng):
    last, hidden = (stage("torso", torso_arms=how) for how in ("last", "hidden"))
    pose = last.picture.body.skeleton.pose(left_shoulder_abduction=1.5)
    arms = [i for i, part in enumerate(last.picture.body.parts) if "arm" in part]
    assert set(arms) <= set(last.partial.moving)
    assert not set(arms) & {*hidden.partial.moving, *hidden.partial.still}
    assert set(arms) <= set(stage("torso+left_arm", torso_arms="hidden").partial.moving)  # an arm that is sought is drawn
    observation = Observation.of(last.picture.mask(pose))
    values = pose[last.dofs][None]
    assert last.weigh(observation, pose, pose)(values)[0] == 0
    assert hidden.weigh(observation, pose, pose)(values)[0] > 0


# What it estimates ----------------------------------------------------------------------------------------------------


def test_the_estimate_is_the_best_particle_or_a_mean_that_leans_to_it():
    poses = np.array([[0.0] * 4, [1.0] * 4, [2.0] * 4])
    particles = Particles(poses, np.array([30.0, 20.0, 400.0]), np.zeros(3))
    np.testing.assert_array_equal(stage(estimate="best").estimate(particles), poses[1])
    mean = stage(estimate="mean").estimate(particles)
    assert (poses[0] < mean).all()
    assert (mean < poses[1]).all()
    np.testing.assert_allclose(mean, mean[0])
    alike = Particles(poses, np.full(3, 5.0), np.zeros(3))
    np.testing.assert_allclose(stage(estimate="mean").estimate(alike), 1)


def test_evaluated_particles_hold_the_stage_s_values(rng):
    arm = stage()
    pose = np.zeros(12)
    values = rng.standard_normal((7, 4))
    particles = evaluate(values, arm.weigh(Observation.of(arm.picture.mask(pose)), pose, pose))
    assert [array.shape for array in particles] == [(7, 4), (7,), (7,)]
    np.testing.assert_array_equal(particles.best, values[np.argmin(particles.costs)])
