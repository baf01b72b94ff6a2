"""Clips: a mirror's laws, frame rates, gaps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.interpolation import resample, resample_table
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.training import mirrored, without_gaps

NAMES = ("pelvis", "left_hip", "left_knee", "right_hip", "right_knee")


def table(frames: int = 30, rate: float = 50.0) -> JointTable:
    rng = np.random.default_rng(5)
    return JointTable(3.0 + np.arange(frames) / rate, NAMES, rng.standard_normal((frames, 5, 3)))


# Mirrored


def test_a_mirror_swaps_the_sides_and_turns_y():
    original = table()
    seen = mirrored(original)
    assert seen.names == NAMES
    np.testing.assert_array_equal(seen.positions[:, 1], original.positions[:, 3] * [1, -1, 1])
    np.testing.assert_array_equal(seen.positions[:, 0], original.positions[:, 0] * [1, -1, 1])
    np.testing.assert_array_equal(mirrored(seen).positions, original.positions)


def test_a_mirror_keeps_lengths_and_gaps():
    original = table()
    original.positions[4, 3] = np.nan
    seen = mirrored(original)
    assert np.isnan(seen.positions[4, 1]).all()
    assert np.isnan(seen.positions).sum() == 3
    lengths = [np.linalg.norm(np.diff(each.positions[:, pair], axis=1), axis=2) for each, pair in ((original, [1, 2]), (seen, [3, 4]))]
    np.testing.assert_allclose(*lengths)


def test_a_joint_without_its_other_side_is_said():
    with pytest.raises(ShadowPuppetError, match="joint 'left_knee': found no 'right_knee' beside it, which a mirror needs"):
        mirrored(table().select(["pelvis", "left_knee"]))


# Resampled


@pytest.mark.parametrize(("rate", "most"), [(25.0, 1e-12), (50.0, 1e-12), (30.0, 1e-3), (60.0, 1e-3), (120.0, 1e-3)])
def test_smooth_motion_stays_the_same_motion(rate, most):
    """A swing of 0.3 m at 2 Hz, seen at 50 frames/s: to the millimetre; exact where the times are those of frames."""
    times = np.arange(100) / 50
    wanted, values = resample(times, 0.3 * np.sin(4 * np.pi * times + 1), rate)
    np.testing.assert_allclose(np.diff(wanted), 1 / rate)
    assert (wanted[0], len(wanted)) == (0.0, int(1.98 * rate + 1e-9) + 1)
    np.testing.assert_allclose(values, 0.3 * np.sin(4 * np.pi * wanted + 1), atol=most)


@settings(deadline=None)
@given(frames=st.integers(1, 12), rate=st.floats(1, 300), seed=st.integers(0, 2**32 - 1))
def test_any_times_give_even_ones_within_and_straight_lines_stay_straight(frames, rate, seed):
    rng = np.random.default_rng(seed)
    times = np.cumsum(0.005 + 0.1 * rng.random(frames)) - 1
    slope, at = rng.standard_normal((2, 2, 3))
    wanted, values = resample(times, at + times[:, None, None] * slope, rate)
    assert wanted[0] == times[0]
    assert times[-1] - 1 / rate * (1 + 1e-6) < wanted[-1] <= times[-1]
    np.testing.assert_allclose(values, at + wanted[:, None, None] * slope, atol=1e-9)


def test_nothing_is_made_up_in_gaps():
    """At twice the rate, what lies beside an unknown frame is unknown; each joint has its own gaps."""
    original = table(20)
    original.positions[5:7, 2] = np.nan
    original.positions[19, 0] = np.nan
    found = resample_table(original, 100.0)
    assert found.names == NAMES
    unknown = np.isnan(found.positions).all(2)
    assert np.isnan(found.positions).any(2).sum() == unknown.sum()
    assert np.flatnonzero(unknown[:, 2]).tolist() == [9, 10, 11, 12, 13]
    assert np.flatnonzero(unknown[:, 0]).tolist() == [37, 38]
    np.testing.assert_allclose(found.positions[::2], original.positions, atol=1e-12)


def test_a_single_known_frame_stays():
    wanted, values = resample([0.0, 0.1, 0.2], [np.nan, 4.0, np.nan], 10.0)
    np.testing.assert_allclose(wanted, [0, 0.1, 0.2])
    np.testing.assert_array_equal(values, [np.nan, 4.0, np.nan])


@pytest.mark.parametrize(("times", "values"), [([], []), ([0.0, 1.0], [1.0]), ([0.0, 0.0], [1.0, 1.0]), ([0.0, np.nan], [1.0, 1.0])])
def test_times_that_do_not_fit_are_said(times, values):
    with pytest.raises(ShadowPuppetError, match=r"times: found .* expected a finite, increasing one for each value"):
        resample(times, values, 5.0)


@pytest.mark.parametrize("rate", [0.0, -5.0, np.nan, np.inf])
def test_rates_that_cannot_be_are_said(rate):
    with pytest.raises(ShadowPuppetError, match=r"rate: found .* expected frames a second, more than zero"):
        resample([0.0, 1.0], [1.0, 1.0], rate)


# Gaps


def test_parts_without_gaps():
    clip = np.arange(20.0).reshape(10, 2)
    clip[[0, 3], [0, 1]] = np.nan
    clip[5] = np.inf
    assert [part[:, 0].tolist() for part in without_gaps(clip)] == [[2.0, 4.0], [12.0, 14.0, 16.0, 18.0]]
    assert [len(part) for part in without_gaps(clip, shortest=1)] == [2, 1, 4]
    assert without_gaps(np.full((4, 2), np.nan)) == []
    assert [len(part) for part in without_gaps(np.ones((4, 2)))] == [4]
