"""What postures are usual: all that are tried, what they look like, and how far from them is still usual."""

from __future__ import annotations

from itertools import product

import actor
import numpy as np
import pytest

from shadowpuppet.body.models import WHOLE
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.tracking.multiview.posture_prior import (
    ARMS,
    INFLATION,
    LEGS,
    MAX_PENALTY,
    MIN_DEVIATION,
    OBSERVED_JOINTS,
    UNSHOWN,
    PosturePrior,
    usual_arms,
    usual_postures,
)


@pytest.mark.parametrize("name", WHOLE)
def test_usual_postures_are_possible_and_differ(name):
    skeleton = actor.body(name).skeleton
    found = usual_postures(skeleton)
    assert found.shape == (len(ARMS) ** 2 * len(LEGS), len(skeleton.dofs))
    np.testing.assert_array_equal(found, skeleton.clamp(found))
    assert len(np.unique(found.round(6), axis=0)) == len(found)
    assert not found[:, skeleton.dof_indices(GLOBAL_DOFS)].any()


@pytest.mark.parametrize("name", WHOLE)
def test_usual_postures_are_what_they_are_said_to_be(name):
    """Both bodies take the same ones, each arm down, to the side, forward or up; a stride, a squat, a bow."""
    of = actor.body(name)
    at = [dict(zip(of.landmark_names, points)) for points in of.points(usual_postures(of.skeleton))]
    named = dict(zip(product(range(len(ARMS)), range(len(ARMS)), range(len(LEGS))), at))
    ways = {0: [0, 0, -1], 1: [0, 1, 0], 2: [1, 0, 0], 3: [0, 0, 1]}
    for left, right in product(ways, ways):
        for side, way, out in (("left", left, 1), ("right", right, -1)):
            arm = named[left, right, 0][f"{side}_elbow"] - named[left, right, 0][f"{side}_shoulder"]
            assert arm / np.linalg.norm(arm) @ (np.array(ways[way]) * [1, out, 1]) > 0.93
    standing, left, right, squat, bow = (named[0, 0, legs] for legs in range(5))
    assert (left["left_ankle"] - left["right_ankle"])[0] > 0.2
    assert (right["left_ankle"] - right["right_ankle"])[0] < -0.2
    assert squat["pelvis"][2] - squat["left_ankle"][2] < 0.75 * (standing["pelvis"][2] - standing["left_ankle"][2])
    assert bow["neck"][0] > standing["neck"][0] + 0.2


@pytest.mark.parametrize("name", WHOLE)
def test_an_arm_s_postures_are_those_of_the_whole(name):
    skeleton = actor.body(name).skeleton
    every = usual_postures(skeleton)
    for side in ("left", "right"):
        arms = usual_arms(skeleton, side)
        assert f"{side}_elbow_flexion" in arms
        found = np.stack(list(arms.values()), 1)
        wanted = np.unique(every[:, skeleton.dof_indices(arms)].round(9), axis=0)
        np.testing.assert_allclose(np.unique(found.round(9), axis=0), wanted)


@pytest.mark.parametrize("name", WHOLE)
def test_what_the_surface_shows_is_never_unusual(name, rng):
    """Arms and legs, but for the roll of feet; nor are place and heading."""
    skeleton = actor.body(name).skeleton
    usual, pose = PosturePrior.of(skeleton), np.clip(skeleton.rest_and_spread[0], *skeleton.limits)
    free = np.array([dof.joint.startswith(OBSERVED_JOINTS) or dof.name in GLOBAL_DOFS for dof in skeleton.dofs])
    free &= [not dof.name.endswith(UNSHOWN) for dof in skeleton.dofs]
    moved = pose + rng.normal(0, 1, len(pose)) * free
    np.testing.assert_allclose(usual.penalty(np.stack([pose, moved])), 0, atol=1e-12)
    for d, dof in enumerate(skeleton.dofs):
        if np.isfinite(usual.below[d]):
            off = np.tile(pose, (3, 1))
            off[:, d] += np.array([1.0, 2.0, 1e3]) * usual.above[d]
            strain = usual.penalty(off)
            np.testing.assert_allclose(strain[:2], [1 / (1 + 1 / MAX_PENALTY), 4 / (1 + 4 / MAX_PENALTY)], err_msg=dof.name)
            assert strain[2] == pytest.approx(MAX_PENALTY, rel=1e-3)


@pytest.mark.parametrize("name", WHOLE)
def test_a_pull_is_what_makes_the_strain(name, rng):
    """Its weights times squared distances from rest: near rest the strain itself, and never more than without the bound."""
    skeleton = actor.body(name).skeleton
    usual = PosturePrior.of(skeleton)
    near = usual.rest + 0.01 * rng.normal(size=len(usual.rest))
    assert usual.pull(near) @ (near - usual.rest) ** 2 == pytest.approx(usual.penalty(near[None])[0], rel=1e-2)
    assert (usual.pull(near + 3) <= usual.pull(near + 1e-9) + 1e-9).all()


def test_training_motion_says_what_is_usual_of_the_trunk(rng):
    skeleton = actor.body().skeleton
    chest, bow = skeleton.dof_indices(["chest_x", "root_bow"])
    library = actor.walk(skeleton, 200)
    library[:, chest] = 0.3 + 0.2 * rng.normal(size=200)
    library[:, bow] = 0.5
    usual = PosturePrior.of(skeleton, library)
    assert usual.rest[chest] == pytest.approx(0.3, abs=0.05)
    assert usual.below[chest] == usual.above[chest] == pytest.approx(INFLATION * library[:, chest].std())
    assert (usual.rest[bow], usual.below[bow]) == (pytest.approx(0.5), MIN_DEVIATION)
    assert usual.penalty(library).max() < PosturePrior.of(skeleton).penalty(library).max()
    assert np.isinf(usual.below[skeleton.dof_indices(["root_heading", "left_knee_flexion", "root_x"])]).all()
    lone = PosturePrior.of(skeleton, library[:1])
    np.testing.assert_array_equal(lone.rest, PosturePrior.of(skeleton).rest)  # one pose says nothing of deviations


def test_feet_of_people_who_stand_are_level():
    skeleton = actor.body().skeleton
    prior, flexion = PosturePrior.of(skeleton), skeleton.dof_names.index("left_ankle_flexion")
    poses = np.zeros((4, len(skeleton.dofs)))
    poses[1:, flexion] = np.radians([-15, 20, -1e6])
    poses[:, skeleton.dof_names.index("left_hip_x")] = 0.4  # no matter to the feet
    np.testing.assert_allclose(prior.rarity_of_feet(poses), [0, 0.45, 0.45, MAX_PENALTY / 2], rtol=1e-3)
