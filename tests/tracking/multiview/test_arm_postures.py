"""Usual arm postures: the same for all bodies, sides and places; the density; and what it does to a tracker's costs."""

from __future__ import annotations

import actor
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from shadowpuppet.tracking.multiview.arm_postures import JOINTS, UNKNOWN, ArmPostures, arm_directions, usual_arm_postures

BODY = actor.body()
HANGING, FORWARD, BEHIND = [0.1, -0.1, -1, 0.1, 0.2, -1], [0.1, 1, 0, 0.1, 1, 0], [0.1, -1, 0, 0.1, -1, 0.2]


def directions(*bones) -> np.ndarray:
    bones = np.array(bones, float).reshape(-1, 2, 3)
    return (bones / np.linalg.norm(bones, axis=-1, keepdims=True)).reshape(-1, 6)


def joints_of(pose) -> np.ndarray:
    return BODY.points(np.atleast_2d(pose), names=JOINTS)


def test_directions_do_not_depend_on_place_heading_or_size(rng):
    joints = joints_of(actor.stance(BODY.skeleton))[0]
    angle = rng.uniform(-3, 3)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    np.testing.assert_allclose(arm_directions(1.3 * joints @ turn.T + rng.normal(size=3)), arm_directions(joints), atol=1e-9)


def test_a_mirrored_person_has_the_same_arms_exchanged():
    joints = joints_of(actor.stance(BODY.skeleton))[0]
    joints[3:5] += [[0.02, 0.1, 0.05], [0.05, 0.2, 0.1]]  # the left elbow and wrist alone
    mirrored = joints[[0, 1, 5, 6, 7, 2, 3, 4]] * [1, -1, 1]
    np.testing.assert_allclose(arm_directions(mirrored), arm_directions(joints)[::-1], atol=1e-9)


def test_right_forward_and_up():
    left, right = ([-0.2, 0, 1.5], [-0.5, 0, 1.5], [-0.5, 0.3, 1.5]), ([0.2, 0, 1.5], [0.2, 0, 1.2], [0.2, 0, 0.9])
    joints = np.array([[0, 0, 1], [0, 0, 1.5], *left, *right])
    np.testing.assert_allclose(arm_directions(joints), [[1, 0, 0, 0, 1, 0], [0, 0, -1, 0, 0, -1]], atol=1e-9)


def test_the_density_is_that_of_the_mixture(rng):
    spread = np.stack([np.diag(rng.uniform(0.02, 0.2, 6)) for _ in range(2)])
    postures = ArmPostures(np.array([0.3, 0.7]), rng.normal(size=(2, 6)), spread)
    X = rng.normal(size=(50, 6))
    normal = sum(w * multivariate_normal(m, c).pdf(X) for w, m, c in zip(postures.weights, postures.means, postures.covariances))
    uniform = 1 / (4 * np.pi) ** 2 / (2 * np.pi * 0.12**2)
    np.testing.assert_allclose(np.exp(postures.log_density(X)), (1 - UNKNOWN) * normal + UNKNOWN * uniform)
    assert np.all(postures.rarity(X) >= 0)
    assert postures.rarity(postures.means).min() == 0


def test_hanging_arms_are_usual_those_behind_the_back_rare_and_nothing_is_impossible():
    hanging, forward, behind = usual_arm_postures().rarity(directions(HANGING, FORWARD, BEHIND))
    assert hanging < 2 < forward < behind
    far = usual_arm_postures().rarity(directions(*np.random.default_rng(0).normal(size=(500, 6))))
    assert far.max() < 8.5


def test_the_kernel_is_the_density_of_both_arms(rng):
    joints = joints_of(actor.stance(BODY.skeleton)) + 0.1 * rng.normal(size=(40, 8, 3))
    postures = usual_arm_postures()
    naive = postures.rarity(arm_directions(joints).reshape(-1, 6)).reshape(-1, 2).sum(1)
    np.testing.assert_allclose(postures.rarity_of_both(joints), naive, rtol=1e-9, atol=1e-9)
    assert np.ptp(naive) > 1


def test_the_table_is_a_mixture_with_its_source():
    found = usual_arm_postures()
    assert found.weights.sum() == pytest.approx(1, abs=1e-3)
    np.testing.assert_allclose(found.covariances, found.covariances.swapaxes(1, 2))
    assert np.linalg.eigvalsh(found.covariances).min() > 0.01
