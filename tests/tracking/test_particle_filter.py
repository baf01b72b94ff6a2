"""One estimation cycle: resampled, moved and weighed; against Kalman's filter where that is exact."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest

from shadowpuppet.tracking.particle_filter import Particles, diffuse, evaluate, step
from shadowpuppet.tracking.resampling import SCHEMES, deterministic, make_scheme, normalise, stratified


def weigh(poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The cost of a pose is its distance from zero."""
    costs = np.abs(poses).sum(1)
    return costs, -(costs**2)


def test_a_step_resamples_then_moves_then_weighs(rng):
    particles = evaluate(np.array([[3.0], [1.0], [2.0]]), weigh)
    seen = {}

    def propose(generator, poses):
        assert generator is rng
        seen["proposed"] = poses.copy()
        return poses + 1

    after = step(rng, particles, resample=partial(deterministic, survival=0.7), propose=propose, weigh=weigh, number=3)
    np.testing.assert_array_equal(seen["proposed"], [[1], [2], [1]])
    np.testing.assert_array_equal(after.poses, [[2], [3], [2]])
    np.testing.assert_array_equal(after.costs, [2, 3, 2])
    np.testing.assert_array_equal(after.log_weights, [-4, -9, -4])


def test_ancestors_are_drawn_by_weight_not_by_cost(rng):
    weights = np.array([-50.0, 0.0, -60.0])  # the second has nearly all weight, and the greatest cost
    particles = Particles(np.array([[1.0], [2], [3]]), np.array([0.0, 9, 1]), weights)
    after = step(rng, particles, resample=make_scheme("stratified", 0), propose=lambda _, poses: poses, weigh=weigh, number=50)
    assert np.mean(after.poses == 2) > 0.9


def test_the_best_pose_is_that_of_least_cost_whatever_the_weights():
    particles = Particles(np.array([[1.0, 1], [2, 2], [3, 3]]), np.array([5.0, 4, 6]), np.array([0.0, -9, -1]))
    np.testing.assert_array_equal(particles.best, [2, 2])


@pytest.mark.parametrize("number", [None, 1, 2, 5, 40])
@pytest.mark.parametrize("name", SCHEMES)
def test_there_are_as_many_after_a_step_as_asked_for(name, number, rng):
    particles = evaluate(rng.standard_normal((5, 2)), weigh)
    after = step(rng, particles, resample=make_scheme(name, 0.4), propose=lambda _, poses: poses, weigh=weigh, number=number)
    assert after.poses.shape == (number or 5, 2)
    np.testing.assert_array_equal(after.poses[0], particles.best)


def test_a_step_changes_nothing_that_it_was_given(rng):
    particles = evaluate(rng.standard_normal((6, 2)), weigh)
    before = [array.copy() for array in particles]
    step(rng, particles, resample=make_scheme("stratified", 0), propose=lambda g, p: diffuse(g, p, np.ones(2)), weigh=weigh)
    for array, copy in zip(particles, before, strict=True):
        np.testing.assert_array_equal(array, copy)


def test_noise_has_its_deviations_and_spares_the_first(rng):
    sigma = np.array([0.1, 2.0, 0.0])
    poses = np.full((20_000, 3), 7.0)
    moved = diffuse(rng, poses, sigma)
    np.testing.assert_array_equal(moved[0], 7)
    np.testing.assert_allclose(moved[1:].std(0), sigma, rtol=0.03)
    np.testing.assert_allclose(moved[1:].mean(0), 7, atol=0.05)
    assert (poses == 7).all()
    assert abs(np.corrcoef(moved[1:, :2].T)[0, 1]) < 0.03


@pytest.mark.parametrize("name", SCHEMES)
def test_best_cost_never_rises_while_the_first_particle_stays(name, rng):
    particles = evaluate(rng.standard_normal((30, 3)) * 5, weigh)
    costs = [particles.costs.min()]
    for _ in range(25):
        particles = step(rng, particles, resample=make_scheme(name, 0.2), propose=lambda g, p: diffuse(g, p, np.full(3, 0.3)), weigh=weigh)
        costs.append(particles.costs.min())
    assert (np.diff(costs) <= 0).all()
    assert costs[-1] < costs[0]


def test_it_is_a_particle_filter_in_kalman_s_sense(rng):
    """On a linear model with Gaussian noise the weighted mean is Kalman's, but for the draws' chance (5 standard errors)."""
    walk, noise, number = 0.5, 0.8, 20_000
    truth = np.cumsum(walk * rng.standard_normal(25))
    mean, variance = 0.0, 1.0

    def move(generator, poses):
        return poses + walk * generator.standard_normal(poses.shape)

    particles = Particles(rng.standard_normal((number, 1)), np.zeros(number), np.zeros(number))
    for seen in truth + noise * rng.standard_normal(25):
        def likelihood(poses, seen=seen):
            costs = (poses[:, 0] - seen) ** 2 / (2 * noise**2)
            return costs, -costs

        variance += walk**2
        gain = variance / (variance + noise**2)
        mean, variance = mean + gain * (seen - mean), (1 - gain) * variance
        particles = step(rng, particles, resample=stratified, propose=move, weigh=likelihood)
        weights = normalise(particles.log_weights)
        found = weights @ particles.poses[:, 0]
        effective = 1 / (weights**2).sum()
        assert abs(found - mean) < 5 * np.sqrt(variance / effective) + 0.01
        assert weights @ (particles.poses[:, 0] - found) ** 2 == pytest.approx(variance, rel=0.1)


def test_same_seed_same_particles():
    def run() -> Particles:
        rng = np.random.default_rng(11)
        particles = evaluate(rng.standard_normal((20, 2)), weigh)
        for _ in range(5):
            scheme = make_scheme("residual", 0)
            particles = step(rng, particles, resample=scheme, propose=lambda g, p: diffuse(g, p, np.ones(2)), weigh=weigh)
        return particles

    for one, other in zip(run(), run(), strict=True):
        np.testing.assert_array_equal(one, other)
