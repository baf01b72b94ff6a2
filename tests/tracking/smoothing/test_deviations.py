"""Deviations of a smoothed motion: root mean squares about each frame, and the statuses of limbs that follow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from runs import body_of
from smoothers import RATE, motion_of, smoother

from shadowpuppet.motion.limbs import joints_of_limbs
from shadowpuppet.tracking.smoothing.deviations import REACH, moving_deviations, restated

NAME, FRAMES = "anatomical", 60
NAMES = body_of(NAME).landmark_names
LIMITS = {"trunk": 0.3, "arm": 0.1, "leg": 0.3}
HALF = round(REACH * RATE)
ARM = joints_of_limbs(NAMES)["left_arm"]


def stood(lost=()):
    return motion_of(NAME, np.zeros((FRAMES, len(body_of(NAME).skeleton.dofs))), lost)


def with_arm(sd: np.ndarray, **changes):
    """A motion of a person who stands, whose left hand's deviation along x is `sd` (T,)."""
    motion = stood()
    joint_sd = np.full_like(motion.joint_sd, 0.01)
    joint_sd[:, ARM[-1], 0] = sd
    return replace(motion, joint_sd=joint_sd, **changes)


def arm_of(motion):
    return motion.limb_status[:, motion.limbs.index("left_arm")].tolist()


@given(st.lists(st.one_of(st.floats(0, 1), st.just(np.nan)), min_size=1, max_size=80), st.integers(0, 1_000))
def test_a_deviation_is_the_root_mean_square_of_the_known_ones_about_it(values, seed):
    times = np.cumsum(np.random.default_rng(seed).uniform(0.01, 0.3, len(values)))
    sd, near = np.array(values), np.abs(times[:, None] - times) <= REACH + 1e-6
    naive = [np.nan if np.isnan(own) else np.sqrt(np.nanmean(sd[which] ** 2)) for own, which in zip(sd, near)]
    np.testing.assert_allclose(moving_deviations(times, sd), naive, atol=1e-7)
    np.testing.assert_allclose(moving_deviations(times, sd[:, None, None])[:, 0, 0], naive, atol=1e-7)


def test_a_moment_of_doubt_is_no_doubt_and_one_that_lasts_is():
    brief, lasting = np.full(FRAMES, 0.01), np.full(FRAMES, 0.01)
    brief[30], lasting[20:40] = 0.2, 0.2
    assert arm_of(restated(with_arm(brief), LIMITS)) == ["tracked"] * FRAMES
    found = arm_of(restated(with_arm(lasting), LIMITS))
    assert found[30] == "uncertain"
    assert found[0] == found[-1] == "tracked"
    assert restated(with_arm(lasting), LIMITS).joint_sd[30, ARM[-1], 0] == pytest.approx(np.sqrt((20 * 0.2**2 + 11 * 0.01**2) / 31))


def test_a_limb_is_vouched_for_again_only_where_its_frame_is_tracked_and_something_shows_it():
    limbs = stood().limb_status.copy()
    limbs[:, stood().limbs.index("left_arm")] = np.repeat(["uncertain", "predicted"], FRAMES // 2)
    found = restated(with_arm(np.full(FRAMES, 0.01), limb_status=limbs), LIMITS)
    assert arm_of(found) == ["tracked"] * (FRAMES // 2) + ["predicted"] * (FRAMES // 2)
    doubted = with_arm(np.full(FRAMES, 0.01), limb_status=limbs, status=np.full(FRAMES, "uncertain"))
    assert arm_of(restated(doubted, LIMITS)) == arm_of(doubted)


def test_frames_without_a_pose_stay_so_and_count_for_none():
    lost = range(20, 50)
    found = restated(stood(lost), LIMITS)
    assert np.isnan(found.joint_sd[lost]).all()
    known = np.setdiff1d(np.arange(FRAMES), lost)
    np.testing.assert_allclose(found.joint_sd[known], stood().joint_sd[known])
    assert (found.limb_status[lost] == "lost").all()


def test_a_smoother_restates_a_motion_where_it_is_given_limits():
    motion = with_arm(np.full(FRAMES, 0.2))
    plain, limited = (smoother(NAME, limits=limits)(motion).motion for limits in (None, LIMITS))
    np.testing.assert_array_equal(plain.joints, limited.joints)
    assert arm_of(plain) == ["tracked"] * FRAMES
    assert arm_of(limited) == ["uncertain"] * FRAMES
    assert arm_of(smoother(NAME, limits=LIMITS, method="off")(motion).motion) == ["tracked"] * FRAMES
