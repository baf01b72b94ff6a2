"""Times at one rate: gaps of whole frames are found, trembling is borne, and times that are none of a rate are said to be so."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.interpolation import filled, rate_of, true_runs, uniform_sampling


@pytest.mark.parametrize("rate", [23.976, 25, 29.97, 60, 119.88, 1000])
def test_a_films_times_rounded_to_milliseconds_have_its_rate(rate):
    found = uniform_sampling(np.round(np.arange(500) / rate, 3 if rate < 500 else 6) + 7.25)
    assert found.rate == pytest.approx(rate, rel=2e-4)
    np.testing.assert_array_equal(found.frames, np.arange(500))


@pytest.mark.parametrize(("digits", "frames"), [(3, 61), (3, 500), (5, 2), (5, 3), (5, 61), (9, 500)])
@pytest.mark.parametrize("rate", [10, 12.5, 24, 25, 30, 50, 60, 120])
def test_the_rate_is_the_nominal_one_if_the_times_are_its_own_but_for_rounding(rate, frames, digits):
    assert rate_of(np.round(np.arange(frames) / rate + 4.0, digits)) == rate
    assert rate_of(np.floor(np.arange(frames) / rate * 10**digits + 1e-6) / 10**digits) == rate


@pytest.mark.parametrize("digits", [3, 5, 9])
@pytest.mark.parametrize(("rate", "written"), [(24000 / 1001, "23.976"), (30000 / 1001, "29.97"), (60000 / 1001, "59.9401")])
def test_ntscs_rates_stay(rate, written, digits):
    assert f"{rate_of(np.round(np.arange(150) / rate, digits)):.6g}" == written


@pytest.mark.parametrize("rate", [30.4, 29.5, 31.25, 7.3])
def test_a_rate_that_is_another_stays(rate):
    assert rate_of(np.round(np.arange(100) / rate, 5)) == pytest.approx(rate, rel=1e-5)


@pytest.mark.parametrize("times", [[0.0, 1e-300, 2e-300], [0.0, 1e300, 2e300], [-1e305, 0.0, 1e305]])
def test_impossible_times_have_a_rate(times):
    assert rate_of(times) > 0


def test_missing_frames_are_places_without_a_frame():
    kept = np.delete(np.arange(50), [5, 6, 7, 30])
    found = uniform_sampling(kept / 25)
    assert found.frames is not None
    np.testing.assert_array_equal(np.flatnonzero(found.frames < 0), [5, 6, 7, 30])
    np.testing.assert_array_equal(found.frames[kept], np.arange(46))
    np.testing.assert_allclose(found.times, np.arange(50) / 25, atol=1e-12)


def test_frames_that_lie_between_are_to_be_found_again():
    times = np.cumsum(np.random.default_rng(3).uniform(0.02, 0.08, 60))
    found = uniform_sampling(times)
    assert found.frames is None
    np.testing.assert_allclose(np.diff(found.times)[:-1], np.median(np.diff(times)))
    assert times[0] <= found.times[0] <= found.times[-1] <= times[-1]


def test_one_frame_and_none():
    assert len(uniform_sampling([3.0]).times) == 1
    with pytest.raises(ShadowPuppetError, match="found no frame"):
        uniform_sampling([])


def test_far_too_long_a_gap_is_said():
    with pytest.raises(ShadowPuppetError, match=r"in steps of 0\.01 s"):
        uniform_sampling([0, 0.01, 0.02, 1e7])


@given(st.lists(st.booleans()))
def test_runs_are_all_that_is_true_and_each_ends_where_it_is_not(known):
    runs = true_runs(known)
    assert [n for start, end in runs for n in range(start, end)] == [n for n, each in enumerate(known) if each]
    assert all(end < start for (_, end), (start, _) in pairwise(runs))


@given(st.lists(st.booleans(), min_size=1, max_size=12).filter(any), st.integers(0, 99))
def test_unknown_values_are_filled_along_straight_lines_and_at_the_ends_with_the_nearest(known, seed):
    rng = np.random.default_rng(seed)
    times, slope = np.cumsum(rng.uniform(0.01, 1, len(known))), rng.normal(size=(2, 3))
    line = 5 + times[:, None, None] * slope
    values = np.where(np.array(known)[:, None, None], line, np.nan)
    values[:, 0, 0] = np.nan
    before = values.copy()
    found = filled(times, values)
    first, last = np.flatnonzero(known)[[0, -1]]
    expected = 5 + np.clip(times, times[first], times[last])[:, None, None] * slope
    expected[:, 0, 0] = np.nan  # never known
    np.testing.assert_allclose(found, expected, atol=1e-12)
    np.testing.assert_array_equal(values, before)
