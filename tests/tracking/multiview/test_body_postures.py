"""Usual postures of the whole body: the same for all bodies, mirrors and places; the density and its kernel."""

from __future__ import annotations

import actor
import numpy as np
import pytest
from scipy.stats import multivariate_normal

from shadowpuppet.tracking.multiview.body_postures import FLOOR, JOINTS, BodyPostures, D, body_directions, mirrored, usual_body_postures

BODY = actor.body()
LEFT, RIGHT = list(range(2, 8)), list(range(8, 14))


def joints_of(pose) -> np.ndarray:
    return BODY.points(np.atleast_2d(pose), names=JOINTS)


def mixture(rng, number=2) -> BodyPostures:
    spread = np.stack([np.cov(rng.normal(size=(D, 80))) for _ in range(number)])
    return BodyPostures(np.full(number, 1 / number), rng.normal(size=(number, D)), spread)


def test_directions_do_not_depend_on_place_heading_or_size(rng):
    joints = joints_of(actor.stance(BODY.skeleton))[0]
    angle = rng.uniform(-3, 3)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    np.testing.assert_allclose(body_directions(1.3 * joints @ turn.T + rng.normal(size=3)), body_directions(joints), atol=1e-9)


def test_a_mirrored_person_has_mirrored_directions():
    joints = joints_of(actor.stance(BODY.skeleton))[0]
    joints[LEFT[1:3]] += [[0.02, 0.1, 0.05], [0.05, 0.2, 0.1]]
    joints[LEFT[4:]] += [[0.0, 0.3, 0.1], [0.1, 0.2, 0.1]]
    there = joints[[0, 1, *RIGHT, *LEFT]] * [-1, 1, 1]
    np.testing.assert_allclose(body_directions(there), mirrored(body_directions(joints)), atol=1e-9)


def test_right_forward_and_up_of_one_who_bows():
    # pelvis at the origin, the trunk forward (world y): up in the trunk's frame is backwards
    arm, leg = [[0.2, 0.5, 0], [0.2, 0.5, -0.3], [0.2, 0.8, -0.3]], [[0.1, 0, 0], [0.1, 0, -0.4], [0.1, 0, -0.8]]
    other = [[-x, y, z] for x, y, z in arm + leg]
    found = body_directions(np.array([[0, 0, 0], [0, 0.5, 0], *other, *arm, *leg])).reshape(-1, 3)
    down, along = [0, 1, 0], [0, 0, 1]
    np.testing.assert_allclose(found, [down, along, down, down, down, along, down, down, [0, -1, 0]], atol=1e-9)


def test_the_density_is_that_of_the_mixture_and_its_mirror(rng):
    postures = mixture(rng)
    X = postures.means[rng.integers(2, size=30)] + 0.3 * rng.normal(size=(30, D))
    log_density = np.logaddexp.reduce([np.log(w / 2) + multivariate_normal(m, c).logpdf(Y) for Y in (X, mirrored(X))
                                       for w, m, c in zip(postures.weights, postures.means, postures.covariances)])  # fmt: skip
    found = postures.rarity(X)
    below = log_density - log_density.max() > -FLOOR + 10
    np.testing.assert_allclose(found[below] - found[below][0], log_density[below][0] - log_density[below], atol=1e-3)
    np.testing.assert_allclose(postures.rarity(mirrored(X)), found)
    assert postures.rarity(100 * X).max() == pytest.approx(FLOOR)


def test_the_kernel_is_the_density(rng):
    joints = joints_of(actor.stance(BODY.skeleton)) + 0.1 * rng.normal(size=(40, len(JOINTS), 3))
    postures = usual_body_postures()
    naive = postures.rarity(body_directions(joints))
    np.testing.assert_allclose(postures.rarity_of(joints), naive, rtol=1e-9, atol=1e-9)
    assert np.ptp(naive) > 1


def test_standing_is_usual_and_nothing_is_impossible(rng):
    standing = joints_of(actor.stance(BODY.skeleton))
    assert usual_body_postures().rarity_of(standing)[0] < 10
    assert usual_body_postures().rarity(rng.normal(size=(500, D))).max() <= FLOOR


def test_the_table_is_a_mixture():
    found = usual_body_postures()
    assert found.weights.sum() == pytest.approx(1, abs=1e-3)
    assert np.linalg.eigvalsh(found.covariances).min() > 0.01
