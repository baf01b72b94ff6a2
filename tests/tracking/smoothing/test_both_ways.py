"""Two passes over a film blended: the one that fits better over a moment weighs more, and doubt grows where they differ."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import body_of, root_of
from smoothers import RATE, motion_of

from shadowpuppet.tracking.smoothing.both_ways import PROFILE, TEMPERATURE, backward_share, blended, near_profile

NAME, FRAMES = "rounded", 40
BODY = body_of(NAME)
NAMES = BODY.skeleton.dof_names
ARM = NAMES.index("left_shoulder_forward")
TIMES, NONE = np.arange(FRAMES) / RATE, np.zeros(FRAMES, bool)


def passing(forward: float, cost: float, lost=()):
    """A pass that has the left arm so far in front (rad) at a cost (pixels)."""
    poses = np.zeros((FRAMES, len(NAMES)))
    poses[:, NAMES.index("left_shoulder_abduction")] = 1.0
    poses[:, ARM] = forward
    return replace(motion_of(NAME, poses, lost), cost=np.full(FRAMES, cost))


def points(poses: np.ndarray) -> np.ndarray:
    return BODY.points(poses, root_of(BODY))


def test_passes_that_cost_the_same_weigh_the_same_and_less_cost_weighs_e_times_more():
    cost = np.full(FRAMES, 500.0)
    np.testing.assert_allclose(backward_share(TIMES, cost, cost, NONE), 0.5)
    better = backward_share(TIMES, cost, cost - 2 * TEMPERATURE, NONE, scale=2.0)
    np.testing.assert_allclose(better / (1 - better), np.e)


def test_the_cost_of_a_moment_counts_and_not_of_a_frame():
    cost = np.full(FRAMES, 500.0)
    other = cost.copy()
    other[20] -= 1000
    share = backward_share(TIMES, cost, other, NONE)
    assert share[20] == pytest.approx(share[22])
    assert share[0] == 0.5
    assert share[20] < 0.9999


def test_where_one_pass_is_lost_the_other_counts():
    forward, backward = passing(0.2, 500, lost=[3, 4]), passing(0.6, 400, lost=[4, 5])
    both, share = blended(forward, backward, points)
    assert share[[3, 5]].tolist() == [1, 0]
    assert both.status[[3, 4, 5]].tolist() == ["tracked", "lost", "tracked"]
    np.testing.assert_allclose(both.poses[[3, 5], ARM], [0.6, 0.2])
    assert np.isnan(both.poses[4]).all()
    assert np.isfinite(np.delete(both.joints, 4, 0)).all()


def test_blended_poses_have_the_joints_that_follow_from_them_and_the_deviations_of_a_mixture():
    forward, backward = passing(0.0, 500), passing(0.8, 500)
    both, _ = blended(forward, backward, points)
    np.testing.assert_allclose(both.poses[:, ARM], 0.4)
    np.testing.assert_allclose(both.joints, points(both.poses))
    hand, hip = BODY.landmark_names.index("left_hand"), BODY.landmark_names.index("pelvis")
    np.testing.assert_allclose(both.joint_sd[:, hip], forward.joint_sd[:, hip])
    between = ((forward.joints - both.joints) ** 2 + (backward.joints - both.joints) ** 2)[:, hand] / 2
    np.testing.assert_allclose(both.joint_sd[:, hand] ** 2, forward.joint_sd[:, hand] ** 2 + between)
    np.testing.assert_allclose(both.pose_sd[:, ARM] ** 2, forward.pose_sd[:, ARM] ** 2 + 0.4**2)


def test_about_a_profile_the_forward_pass_alone_counts():
    """There the passes may be mirror images of each other."""
    forward, backward = passing(0.2, 500), passing(0.2, 300)
    poses = forward.poses.copy()
    poses[20, NAMES.index("torso_twist")] = np.radians(80)
    forward = replace(forward, poses=poses, joints=points(poses))
    assert np.flatnonzero(near_profile(NAMES, poses)).tolist() == [20]
    _, share = blended(forward, backward, points)
    near = np.abs(TIMES - TIMES[20]) <= PROFILE + 1e-6
    assert (share[near] == 0).all()
    assert (share[~near] > 0.9).all()
    _, other = blended(backward, forward, points)
    assert (other[near] == 0).all()
