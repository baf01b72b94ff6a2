"""Poses from markers: nearest one by one, and the likeliest path of all."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from runs import BODIES, body_of, smooth_poses

from shadowpuppet.tracking.smoothing.fixed_interval import differences
from shadowpuppet.tracking.smoothing.pose_path import REACH, PathCost, likeliest_poses, solve_banded
from shadowpuppet.tracking.smoothing.projection import derivatives, in_a_row, markers, nearest_poses


@pytest.fixture(params=BODIES)
def body(request):
    return body_of(request.param)


def test_poses_are_found_again_by_their_markers(body, rng):
    poses = body.skeleton.clamp(smooth_poses(body, 12, rng))
    free = np.ones(poses.shape[1], bool)
    free[0] = False
    start = body.skeleton.clamp(poses + rng.normal(0, 0.05, poses.shape) * free)
    found = nearest_poses(body.skeleton, body.points, start, markers(body.skeleton, body.points, poses), free)
    np.testing.assert_allclose(found, poses, atol=2e-3)
    assert (found[:, 0] == poses[:, 0]).all()


def test_limits_hold_unless_the_start_is_beyond_them(body, rng):
    poses = body.skeleton.clamp(smooth_poses(body, 5, rng))
    low, high = body.skeleton.limits
    wanted = markers(body.skeleton, body.points, poses + rng.normal(0, 0.5, poses.shape))
    found = nearest_poses(body.skeleton, body.points, poses, wanted, np.ones(len(low), bool))
    assert ((found >= low) & (found <= high)).all()


@given(st.integers(1, 12), st.integers(1, 3), st.integers(0, 50))
def test_the_banded_system_is_solved_as_the_dense_one(frames, size, seed):
    rng = np.random.default_rng(seed)
    near = np.abs(np.subtract.outer(np.arange(frames), np.arange(frames))) <= REACH
    A = np.kron(near, np.ones((size, size))) * rng.normal(size=(frames * size, frames * size))
    A = A + A.T + 40 * np.eye(len(A))
    four = A.reshape(frames, size, frames, size)
    blocks = [np.array([four[t, :, t + k] for t in range(frames - k)]).reshape(-1, size, size) for k in range(REACH + 1)]
    right = rng.normal(size=(frames, size))
    np.testing.assert_allclose(solve_banded(blocks, right).ravel(), np.linalg.solve(A, right.ravel()), atol=1e-9)


def a_cost(rng, at: np.ndarray, noise: float) -> PathCost:
    times = np.arange(len(at)) / 20
    variance = np.full((len(at) - 3, at.shape[1]), 100.0)
    return PathCost(at + rng.normal(0, noise, at.shape), np.full(at.shape, 1e4), differences(times), variance)


def test_the_gradient_and_the_curvature_of_a_path_are_its_derivatives(rng):
    at = rng.normal(size=(7, 2))
    cost = a_cost(rng, rng.normal(size=(7, 2)), 0.1)
    for t in range(7):
        step = np.zeros_like(at)
        step[t, 1] = 1e-3
        slope = (cost(at + step) - cost(at - step)) / 2e-3
        assert slope == pytest.approx(-2 * cost.downhill(at)[t, 1], rel=1e-5)
        for apart in range(min(REACH, 6 - t) + 1):
            change = cost.downhill(at)[t + apart, 1] - cost.downhill(at + step)[t + apart, 1]
            assert change / 1e-3 == pytest.approx(cost.curvature(apart)[t, 1], rel=1e-5)


def test_derivatives_are_those_of_the_markers(body, rng):
    poses, which = smooth_poses(body, 3, rng), np.array([1, 3])
    at, J = derivatives(body.skeleton, body.points, poses, which)
    np.testing.assert_allclose(at, in_a_row(markers(body.skeleton, body.points, poses)), atol=1e-12)
    moved = poses.copy()
    moved[:, 3] += 1e-4
    change = in_a_row(markers(body.skeleton, body.points, moved)) - at
    np.testing.assert_allclose(J[:, 1], change / 1e-4, atol=1e-3)


def test_a_noisy_path_of_poses_becomes_smoother_and_nearer(rng):
    body = body_of("rounded")
    truth = body.skeleton.clamp(smooth_poses(body, 40, rng, reach=0.4))
    noisy = body.skeleton.clamp(truth + rng.normal(0, 0.02, truth.shape))
    at = in_a_row(markers(body.skeleton, body.points, noisy))
    cost = a_cost(rng, at, 0.0)
    found = likeliest_poses(body.skeleton, body.points, noisy, cost, np.ones(truth.shape[1], bool))
    new = in_a_row(markers(body.skeleton, body.points, found))
    right = in_a_row(markers(body.skeleton, body.points, truth))
    assert cost(new) < 0.5 * cost(at)
    assert np.abs(new - right).mean() < 0.8 * np.abs(at - right).mean()
    held = likeliest_poses(body.skeleton, body.points, noisy, cost, np.zeros(truth.shape[1], bool))
    assert (held == noisy).all()
