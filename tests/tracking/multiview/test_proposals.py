"""Where poses may be a frame later: plain dynamics, the prior's share, what it leaves to a walk, and whose prior it is."""

from __future__ import annotations

from dataclasses import replace

import actor
import numpy as np
import pytest

from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.prior.local_pca import Subspaces
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.tracking.multiview.exploration import ARM_NOISE, JOINT_CHANCE, NOISE_SCALES
from shadowpuppet.tracking.multiview.posture_prior import usual_arms
from shadowpuppet.tracking.multiview.proposals import Proposals
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

SKELETON = actor.body().skeleton
PLAIN = MultiviewSettings(method="particle_filter", velocity=0.0, defensive=0.25, keep=0.0)
HYBRID = replace(PLAIN, method="hybrid", explore=0.0)
D = len(SKELETON.dofs)
POSE = actor.stance(SKELETON)
ROOT = SKELETON.dof_indices(GLOBAL_DOFS)


def prior_of(names, *, at=0.2, wide: float = 1e-3) -> MotionPrior:
    """One region: a line of poses through `at` along the first number."""
    width = len(names)
    basis = np.eye(width)[None, :, :1]
    line = Subspaces(np.full((1, width), at), basis, np.full((1, 1), wide**2), np.array([1e-8]))
    return MotionPrior(line, np.ones((1, 1)), np.ones(1), tuple(names))


def drawn(settings, poses, prior=None, velocity=None, scale=1.0, seed=0, mismatch=lambda poses: np.zeros(len(poses))) -> np.ndarray:
    velocity = np.zeros(D) if velocity is None else velocity
    return Proposals(SKELETON, settings, prior)(np.random.default_rng(seed), poses, POSE, velocity, mismatch, scale)[0]


def many(number: int = 4000) -> np.ndarray:
    return np.tile(POSE, (number, 1))


@pytest.mark.parametrize("scale", [1.0, 0.4])
def test_plain_dynamics_move_everything_by_its_sigma(scale):
    settings = replace(PLAIN, sigma_rotation=0.01, sigma_translation=0.003, sigma_heading=0.02)
    noise = (drawn(settings, many(), scale=scale) - POSE)[1:]
    free = ~np.isin(SKELETON.dof_names, [dof.name for dof in SKELETON.dofs if POSE[SKELETON.dof_names.index(dof.name)] - dof.low < 0.1])
    wanted = [0.02 if dof.name == "root_heading" else 0.003 if dof.kind == "translation" else 0.01 for dof in SKELETON.dofs]
    np.testing.assert_allclose(noise.std(0)[free] / (scale * np.array(wanted)[free]), 1, atol=0.06)
    assert np.abs(np.corrcoef(noise.T[free]) - np.eye(free.sum())).max() < 0.08


def test_what_is_refined_afterwards_is_moved_joint_by_joint_near_and_far():
    settings = replace(HYBRID, sigma_rotation=0.01)
    moved = drawn(settings, many()) != POSE
    moved = moved[1:]
    for joint in SKELETON.joints:
        own = [d for d, dof in enumerate(SKELETON.dofs) if dof.joint == joint.name]
        if own:
            assert moved[:, own].any(1).mean() == pytest.approx(JOINT_CHANCE, abs=0.04)
    chest, knee = SKELETON.dof_indices(["chest_x", "left_knee_flexion"])
    assert np.corrcoef(moved[:, chest], moved[:, knee])[0, 1] == pytest.approx(0, abs=0.1)  # while one joint stays another is moved
    far = np.abs((drawn(settings, many()) - POSE)[1:, chest])
    assert far.max() > 2.5 * 0.01 * NOISE_SCALES[1]
    assert far.std() == pytest.approx(0.01 * np.sqrt(JOINT_CHANCE * np.mean(np.square(NOISE_SCALES))), rel=0.15)


def test_a_share_tries_an_arm_in_a_usual_posture():
    still = replace(HYBRID, explore=0.25, sigma_rotation=1e-6, sigma_translation=1e-6, sigma_heading=1e-6)
    found = drawn(still, many(400))
    changed = np.abs(found - POSE) > 1e-3
    assert not changed[:300].any()
    sides = {side: [d for d, dof in enumerate(SKELETON.dofs) if dof.joint in (f"{side}_shoulder", f"{side}_elbow")]
             for side in ("left", "right")}
    left, right = (changed[300:, dofs].any(1) for dofs in sides.values())
    assert (left ^ right).all()
    assert 30 < left.sum() < 70
    assert not changed[:, np.setdiff1d(np.arange(D), sides["left"] + sides["right"])].any()
    usual = np.stack(list(usual_arms(SKELETON, "left").values()), 1)
    arms = found[300:][left][:, sides["left"]]
    off = arms[:, None] - usual
    assert np.median(np.sqrt((off**2).mean(2)).min(1)) < 1.5 * ARM_NOISE
    assert not (np.abs(drawn(replace(still, method="particle_filter"), many(400)) - POSE) > 1e-3).any()


def test_of_the_arms_that_are_tried_the_one_most_like_what_is_seen_is_taken():
    still = replace(HYBRID, explore=1.0, sigma_rotation=1e-6, sigma_translation=1e-6, sigma_heading=1e-6)
    elbow = SKELETON.dof_indices(["left_elbow_flexion"])[0]

    def off(**seen) -> float:
        bent = drawn(still, many(200), **seen)[1:, elbow]
        return float(np.median(np.abs(bent[np.abs(bent - POSE[elbow]) > 1e-3] - 2.0)))  # in the others it is the right arm

    assert off(mismatch=lambda poses: np.abs(poses[:, elbow] - 2.0)) < 0.5 * off()


@pytest.mark.parametrize("settings", [PLAIN, HYBRID], ids=["particle_filter", "hybrid"])
@pytest.mark.parametrize("speed", [0.0, 0.5, 1.0])
def test_the_first_is_the_last_pose_moved_on(settings, speed):
    velocity = np.linspace(0.01, 0.05, D)
    found = drawn(replace(settings, velocity=speed), many(8) + 0.01, velocity=velocity)
    wanted = POSE.copy()
    wanted[ROOT] += speed * velocity[ROOT]
    np.testing.assert_allclose(found[0], SKELETON.clamp(wanted))
    shift = found[1:, ROOT] - (POSE[ROOT] + 0.01 + speed * velocity[ROOT])
    assert np.abs(shift).max() < 6 * max(NOISE_SCALES) * settings.sigma_heading


@pytest.mark.parametrize("settings", [PLAIN, HYBRID], ids=["particle_filter", "hybrid"])
def test_limits_are_kept_and_the_same_seed_proposes_the_same(settings):
    wild = replace(settings, sigma_rotation=2.0)
    prior = prior_of(["left_knee_flexion", "chest_x"], at=-1.0)
    poses = many(50)
    kept = poses.copy()
    found = drawn(wild, poses, prior)
    np.testing.assert_array_equal(found, SKELETON.clamp(found))
    np.testing.assert_array_equal(found, drawn(wild, poses, prior))
    assert (found != drawn(wild, poses, prior, seed=1)).any()
    np.testing.assert_array_equal(poses, kept)


@pytest.mark.parametrize("share", [0.0, 0.25, 0.5, 1.0])
def test_the_prior_proposes_all_but_the_defensive_share(share):
    names = ["left_knee_flexion", "right_knee_flexion", "chest_y"]
    settings = replace(HYBRID, defensive=share, sigma_translation=0.01, sigma_heading=0.03)
    found = drawn(settings, many(400), prior_of(names))
    by_prior = np.abs(found[:, SKELETON.dof_indices(names[1:])] - 0.2).max(1) < 1e-6  # what its line does not hold is forgotten
    assert by_prior.sum() == 400 - round(share * 400)
    assert not by_prior[: round(share * 400)].any()
    rest = np.setdiff1d(np.arange(D), np.concatenate([SKELETON.dof_indices(names), ROOT]))
    np.testing.assert_array_equal(found[by_prior][:, rest], np.tile(POSE[rest], (by_prior.sum(), 1)))
    if share < 1:
        walked = found[by_prior][:, ROOT] - POSE[ROOT]
        np.testing.assert_allclose(walked.std(0), [0.01, 0.01, 0.01, 0.03], rtol=0.2)


def test_what_the_prior_cannot_hold_may_stay():
    names = ["left_knee_flexion", "right_knee_flexion", "chest_y"]
    knee = SKELETON.dof_indices(["right_knee_flexion"])[0]
    for keep in (0.0, 0.5, 1.0):
        found = drawn(replace(HYBRID, defensive=0.0, keep=keep), many(5), prior_of(names))[:, knee]
        np.testing.assert_allclose(found, 0.2 + keep * (POSE[knee] - 0.2), atol=1e-9)


def two_regions(names) -> MotionPrior:
    """Two regions, at 0.2 and 0.8; each is followed by the other."""
    one = prior_of(names)
    centres = np.stack([np.full(len(names), 0.2), np.full(len(names), 0.8)])
    regions = Subspaces(centres, np.repeat(one.subspaces.bases, 2, 0), np.repeat(one.subspaces.variances, 2, 0), np.full(2, 1e-8))
    return MotionPrior(regions, np.array([[0.0, 1.0], [1.0, 0.0]]), np.full(2, 0.5), tuple(names))


def test_the_next_region_follows_the_one_that_the_pose_lies_in():
    names = ["left_knee_flexion", "right_knee_flexion", "chest_y"]
    prior, poses = two_regions(names), many(6)
    poses[:3, SKELETON.dof_indices(names)] = 0.25  # nearest to region 0
    poses[3:, SKELETON.dof_indices(names)] = 0.75
    found = drawn(replace(HYBRID, defensive=0.0), poses, prior)
    np.testing.assert_allclose(found[:, SKELETON.dof_indices(names[1:])][:, 0], [0.8] * 3 + [0.2] * 3)


def test_the_region_that_was_drawn_stays_a_particle_s_own_where_the_settings_carry_it():
    """Ni 2008, V-A: the state s is drawn before refinement; the refined pose may lie in another region."""
    names = ["left_knee_flexion", "right_knee_flexion", "chest_y"]
    poses, carried = many(6), np.array([1, 1, 0, 0, 0, 1])
    poses[:, SKELETON.dof_indices(names)] = 0.25  # nearest to region 0
    propose, of = Proposals(SKELETON, replace(HYBRID, defensive=0.0, region="drawn"), two_regions(names)), SKELETON.dof_indices(["chest_y"])
    given = np.random.default_rng(0), poses, POSE, np.zeros(D), lambda poses: np.zeros(len(poses))
    found, regions = propose(*given, regions=carried)
    np.testing.assert_array_equal(regions, 1 - carried)
    np.testing.assert_allclose(found[:, of][:, 0], np.where(regions, 0.8, 0.2))
    np.testing.assert_array_equal(propose(*given)[1], 1)  # those of a first frame follow from the poses
    assert Proposals(SKELETON, replace(HYBRID, defensive=0.0), two_regions(names))(*given)[1] is None


def test_a_pose_by_noise_lies_in_the_nearest_region():
    names = ["left_knee_flexion", "right_knee_flexion", "chest_y"]
    poses, settings = many(6), replace(HYBRID, defensive=0.5, region="drawn")
    poses[:, SKELETON.dof_indices(names)] = 0.75
    last = poses[0]
    found, regions = Proposals(SKELETON, settings, two_regions(names))(
        np.random.default_rng(0), poses, last, np.zeros(D), lambda poses: np.zeros(len(poses)), regions=np.zeros(6, np.int64))
    assert found.shape == (6, D)
    np.testing.assert_array_equal(regions, 1)  # the first three by where they lie, the others by the transition from 0


def test_a_prior_of_all_moves_the_place_too():
    """As in the paper, where the prior knows place and heading."""
    found = drawn(replace(HYBRID, defensive=0.0), many(20), prior_of(SKELETON.dof_names, at=0.0))
    np.testing.assert_allclose(found[:, ROOT[1:]], 0, atol=1e-9)  # no walk is added


@pytest.mark.parametrize(("names", "said"), [
    (("left_knee_flexion", "left_hip_flexion"), "found left_hip_flexion names"),
    (("tail",), "found tail names of degrees of freedom, expected some of root_x, root_y"),
])
def test_a_prior_of_another_body_is_refused(names, said):
    with pytest.raises(ShadowPuppetError, match=rf"prior: {said}.*another body"):
        Proposals(SKELETON, HYBRID, prior_of(names))


def test_a_prior_that_does_not_say_what_it_is_of_is_refused():
    nameless = replace(prior_of(["chest_x"]), names=())
    with pytest.raises(ShadowPuppetError, match=r"prior: found no names .*another body"):
        Proposals(SKELETON, HYBRID, nameless)
