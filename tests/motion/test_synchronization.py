"""Tables at the same times: laws of interpolation, what is never made up, and clocks that are told apart by speeds."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured import moved, person
from numpy.testing import assert_allclose, assert_array_equal

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import rotation_from_vector
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.synchronization import at_common_times, at_times, find_offset, step_of

steps = st.lists(st.floats(0.8, 1.2), min_size=3, max_size=20)


def line(times) -> JointTable:
    """A joint on a straight way at constant speed."""
    times = np.asarray(times, float)
    return JointTable(times, ("neck",), (times[:, None, None] - 5) * np.array([1.0, -2.0, 0.5]))


@given(steps, st.lists(st.floats(0, 1), min_size=1, max_size=20))
def test_a_straight_way_is_found_exactly_and_nothing_beyond_its_ends(parts, shares):
    table = line(np.cumsum(parts))
    first, last = table.times[0], table.times[-1]
    inside = np.unique(np.concatenate([first + np.array(shares) * (last - first), [first, last]]))
    found = at_times(table, inside)
    assert_allclose(found.positions, line(inside).positions, atol=1e-9)
    outside = [first - 0.2 * step_of(table.times), last + 0.2 * step_of(table.times)]
    assert np.isnan(at_times(table, outside).positions).all()


@given(steps)
def test_at_its_own_times_a_table_is_itself_to_the_bit(parts):
    rng = np.random.default_rng(len(parts))
    places = rng.normal(size=(len(parts), 2, 3))
    places[rng.random((len(parts), 2)) < 0.3] = np.nan
    table = JointTable(np.cumsum(parts), ("neck", "head"), places)
    assert_array_equal(at_times(table, table.times).positions, places)
    assert_array_equal(at_common_times(table, table)[0].positions, places)


def test_gaps_are_not_bridged():
    times = np.array([0, 1, 2, 3, 5, 6, 7.0])
    table = line(times)
    gap = table.positions.copy()
    gap[1] = np.nan
    known = np.isfinite(at_times(JointTable(times, ("neck",), gap), [0.5, 1.5, 2.5, 4, 5.5]).positions).all((1, 2))
    assert_array_equal(known, [False, False, True, False, True])
    near = at_times(table, [-0.05, 3.05, 4.95, 7.05])  # a tenth of a step is rounding
    assert_array_equal(near.positions[:, 0], table.positions[[0, 3, 4, 6], 0])


def test_a_table_of_one_frame_or_none_knows_no_other_time():
    one = line([2.0])
    assert_array_equal(np.isfinite(at_times(one, [1.9, 2.0, 2.1]).positions).all((1, 2)), [False, True, False])
    none = JointTable(np.zeros(0), ("neck",), np.zeros((0, 1, 3)))
    assert np.isnan(at_times(none, [1.0]).positions).all()


@pytest.mark.parametrize(("run_rate", "truth_rate", "used"), [(30, 30, 30), (60, 25, 25), (15, 120, 15), (30, 29.97, 29.97), (30, 100, 30)])
def test_the_slower_one_s_times_are_used_and_the_motion_is_that_of_the_faster(run_rate, truth_rate, used):
    run, truth = person(4, run_rate), person(4, truth_rate)
    ours, theirs = at_common_times(run, truth)
    assert step_of(ours.times) == pytest.approx(1 / used)
    assert_array_equal(ours.times, theirs.times)
    off = np.linalg.norm(ours.positions - theirs.positions, axis=2)
    coarse = 0.15 * 7**2 * max(1 / run_rate, 1 / truth_rate) ** 2 / 8 * 3  # acceleration times step squared by eight
    assert np.nanmax(off) < coarse
    assert np.isfinite(off).mean() > 0.95


def test_frames_that_a_run_leaves_out_are_not_forgotten():
    """Of a truth with more frames than the run, those remain that the run does not have, as many a second as it has elsewhere."""
    run, truth = person(4, 20), person(6, 100)
    some = (run.times < 1) | (run.times > 2)
    ours, theirs = at_common_times(JointTable(run.times[some], run.names, run.positions[some]), truth)
    lost = ~np.isfinite(ours.positions).all((1, 2))
    assert np.isfinite(theirs.positions).all()
    assert abs(lost.sum() - 60) <= 3  # a second in the middle, two at the end
    assert abs(len(lost) - 120) <= 3


@settings(max_examples=12, deadline=None)
@given(st.floats(-1.5, 1.5), st.sampled_from([25.0, 60.0, 100.0]), st.integers(0, 9), st.integers(0, 60), st.integers(0, 60))
def test_an_offset_is_found_whatever_the_world_and_the_rate(offset, rate, seed, later, earlier):
    """Of a run that begins some frames later, and a truth that does."""
    truth = person(8, rate, seed=seed)
    truth = JointTable(truth.times[earlier:], truth.names, truth.positions[earlier:])
    R = rotation_from_vector([0.2, seed / 3, 1.0])
    truth = JointTable(truth.times - offset, truth.names, truth.positions @ R.T + [1.0, 2.0, 0.3])
    run = person(8, 30, seed=seed)
    run = JointTable(run.times[later:], run.names, run.positions[later:])
    noise = np.random.default_rng(seed).normal(size=run.positions.shape) * 0.004
    found = find_offset(moved(run, noise), truth)
    assert found.seconds == pytest.approx(offset, abs=0.012)
    assert found.error < 0.1
    assert found.rival is None


def test_a_motion_that_repeats_itself_is_reported():
    times = np.arange(0, 12, 1 / 30)
    swing = np.sin(2 * np.pi * times)[:, None, None] * np.array([0.3, 0.1, 0]) + 0.2 * np.sin(4 * np.pi * times + 1)[:, None, None]
    table = JointTable(times, ("left_wrist",), swing)
    found = find_offset(table, moved(table, times=times + 0.2))
    assert found.seconds == pytest.approx(-0.2, abs=0.01)  # of many as good, the smallest
    assert found.rival is not None
    assert abs(found.rival + 0.2) > 0.3


@pytest.mark.parametrize(("run", "truth", "said"), [
    (person(3, names=("neck",)), person(3, names=("head",)), "no joint that run and truth share"),
    (person(0.1), person(0.1), "share fewer than"),
    (line(np.arange(0, 5, 0.1)), line(np.arange(0, 5, 0.1)), "none stands out; give --offset"),
])
def test_where_no_offset_can_be_reported_that_is_said(run, truth, said):
    with pytest.raises(ShadowPuppetError, match=said):
        find_offset(run, truth)
