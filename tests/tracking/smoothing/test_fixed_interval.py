"""Fixed-interval smoothing of points: least squares, exact for motion of constant acceleration, deaf to noise and outliers."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.tracking.smoothing.fixed_interval import LEAST, differences, jerks, smooth, solve

SD = 0.02


def uneven(rng, frames: int) -> np.ndarray:
    return np.cumsum(rng.uniform(0.5, 1.5, frames)) / 30


def smoothed(times, points, sd=SD, least=LEAST):
    return smooth(times, points, np.full(points.shape, sd), np.full(points.shape[1], least)).points


def test_differences_are_exact_for_cubic_polynomials_at_any_times(rng):
    times = uneven(rng, 9)
    third = differences(times)
    values = 5 + 2 * times - 4 * times**2 + 7 * times**3
    windows = np.stack([values[k : k + 6] for k in range(4)], 1)
    np.testing.assert_allclose((third * windows).sum(1), 42, rtol=1e-6)


@given(st.integers(4, 14), st.integers(0, 100))
def test_the_banded_solution_is_that_of_the_dense_equations(frames, seed):
    rng = np.random.default_rng(seed)
    times, measured = uneven(rng, frames), rng.normal(size=(frames, 2, 3))
    precision, variances, third = rng.uniform(1, 9, measured.shape), rng.uniform(1e5, 1e6, (frames - 3, 2)), differences(times)
    found = solve(third, measured, precision, variances)
    D = np.zeros((frames - 3, frames))
    for t, row in enumerate(third):
        D[t, t : t + 4] = row
    for m in range(2):
        for axis in range(3):
            A = np.diag(precision[:, m, axis]) + D.T @ np.diag(1 / variances[:, m]) @ D
            np.testing.assert_allclose(found[:, m, axis], np.linalg.solve(A, precision[:, m, axis] * measured[:, m, axis]), atol=1e-7)


@given(st.integers(1, 40), st.integers(0, 100))
def test_constant_acceleration_passes_unchanged(frames, seed):
    rng = np.random.default_rng(seed)
    times, a, b, c = uneven(rng, frames), *rng.normal(size=(3, 2, 3))
    points = a + b * times[:, None, None] + c * times[:, None, None] ** 2
    np.testing.assert_allclose(smoothed(times, points), points, atol=1e-5)


@pytest.mark.parametrize("rate", [15, 60, 200])
def test_noise_falls_and_motion_stays(rng, rate):
    times = np.arange(0, 3, 1 / rate)
    truth = np.stack([0.3 * np.sin(2 * np.pi * 0.7 * times), 0.2 * np.cos(2 * np.pi * 1.1 * times), 0 * times], 1)[:, None]
    points = truth + rng.normal(0, 0.15 * SD, truth.shape)
    found = smoothed(times, points)
    assert np.abs(found - truth).mean() < 0.9 * np.abs(points - truth).mean()
    acceleration = [np.sqrt((np.diff(x, n=2, axis=0) ** 2).mean()) * rate**2 for x in (found, truth, points)]
    assert acceleration[0] < 1.2 * acceleration[1]
    assert acceleration[0] < acceleration[2]


def test_a_quick_movement_is_smoothed_less_than_a_slow_one():
    times = np.arange(60) / 30
    quick = np.stack([np.sin(2 * np.pi * times), 0.05 * np.sin(2 * np.pi * times)], 1)[..., None] * [1.0, 0, 0]
    variances = jerks(times, quick, np.full(2, LEAST))
    assert (variances[:, 0] > 100 * variances[:, 1]).all()


def test_a_point_that_jumps_for_a_frame_hardly_counts():
    times = np.arange(60) / 30
    points = np.zeros((60, 1, 3))
    points[30] = 0.5
    assert np.abs(smoothed(times, points)).max() < 0.02


def test_unknown_points_are_interpolated_even_if_hardly_any_is_known():
    times = np.arange(9) / 10
    points = np.full((9, 1, 3), np.nan)
    points[0], points[8] = 0.0, 0.8
    np.testing.assert_allclose(smoothed(times, points)[:, 0, 0], times, atol=1e-3)
    assert np.isfinite(smoothed(times[:3], points[:3])).all()
