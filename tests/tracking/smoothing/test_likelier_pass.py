"""Two passes over a film of two cameras: the likelier one is taken, by the costs of all frames, and what the other says is doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import body_of
from smoothers import RATE, motion_of

from shadowpuppet.tracking.smoothing.likelier_pass import backward_odds, likelier

NAME, FRAMES = "anatomical", 60
BODY = body_of(NAME)
NAMES = BODY.skeleton.dof_names
HEADING = NAMES.index("root_heading")
PER_COST = 1800.0
LIMITS = {"trunk": 0.3, "arm": 0.15, "leg": 0.15}


def passing(headings, costs, lost=()):
    """A pass of a person who stands and faces `headings` (rad) at costs (m^2)."""
    poses = np.zeros((FRAMES, len(NAMES)))
    poses[:, HEADING] = headings
    return replace(motion_of(NAME, poses, lost), cost=np.full(FRAMES, costs) if np.isscalar(costs) else np.asarray(costs, float))


def test_the_pass_that_costs_less_over_the_film_is_taken_in_every_frame():
    forward, backward = passing(0.0, 0.020), passing(np.pi, 0.015)
    dearer = backward.cost.copy()
    dearer[20:25] += 0.007  # some frames of it cost more: people do not turn round in a frame
    both, share = likelier(forward, replace(backward, cost=dearer), PER_COST, LIMITS)
    assert share.tolist() == [1.0] * FRAMES
    np.testing.assert_array_equal(both.joints, backward.joints)
    assert (both.limb_status == "tracked").all()


def test_odds_are_those_of_all_frames():
    odds = backward_odds(passing(0.0, 0.02), passing(np.pi, 0.02 - 1e-4), PER_COST)
    np.testing.assert_allclose(odds, PER_COST * 1e-4 * FRAMES / RATE, rtol=0.05)


def test_each_half_is_taken_from_the_pass_that_is_right_there_where_both_meet():
    cost = np.where(np.arange(FRAMES) < 30, 0.02, 0.01)
    turn = np.pi * np.clip(np.abs(np.arange(FRAMES) - 30) / 15, 0, 1)  # they agree in frame 30 only
    forward, backward = passing(0.0, cost), passing(turn, cost[::-1])
    both, share = likelier(forward, backward, PER_COST, LIMITS)
    assert share[:25].tolist() == [1.0] * 25
    assert share[35:].tolist() == [0.0] * 25
    np.testing.assert_array_equal(both.poses[:25], backward.poses[:25])
    np.testing.assert_array_equal(both.cost[35:], forward.cost[35:])


def test_where_both_may_be_right_the_limbs_they_disagree_about_are_doubtful_and_deviations_reach_the_other():
    forward, backward = passing(0.0, 0.02), passing(2 * np.pi - np.pi / 2, 0.02)
    both, _ = likelier(forward, backward, PER_COST, LIMITS)
    limbs = dict(zip(both.limbs, both.limb_status[30]))
    assert limbs["left_arm"] == limbs["right_arm"] == "uncertain"
    assert limbs["trunk"] == "tracked"  # it turns about itself
    assert both.pose_sd[30, HEADING] == pytest.approx(np.hypot(0.06, np.pi / 2 / np.sqrt(2)), rel=0.01)
    hand = BODY.landmark_names.index("left_hand")
    apart = np.linalg.norm(forward.joints[30, hand] - backward.joints[30, hand])
    assert np.linalg.norm(both.joint_sd[30, hand]) == pytest.approx(np.hypot(0.03 * np.sqrt(3), apart / np.sqrt(2)), rel=0.01)


def test_where_one_pass_is_lost_the_other_counts_alone():
    forward, backward = passing(0.0, 0.02, lost=[3, 4]), passing(np.pi, 0.03, lost=[4, 5])
    both, share = likelier(forward, backward, PER_COST, LIMITS)
    assert share[[3, 5]].tolist() == [1.0, 0.0]
    assert both.status[[3, 4, 5]].tolist() == ["tracked", "lost", "tracked"]
    np.testing.assert_array_equal(both.joint_sd[3], backward.joint_sd[3])
    assert np.isnan(both.poses[4]).all()
    assert np.isfinite(np.delete(both.joints, 4, 0)).all()


def test_one_pass_may_be_certain():
    both, share = likelier(passing(0.0, 0.02), passing(np.pi, 10.0), PER_COST, LIMITS)
    assert not share.any()
    np.testing.assert_allclose(both.joint_sd, 0.03)


def test_passes_that_agree_change_freely_and_doubt_nothing():
    cost = np.where(np.arange(FRAMES) % 20 < 10, 0.02, 0.01)
    forward, backward = passing(0.0, cost), passing(0.001, 0.015)
    both, share = likelier(forward, backward, PER_COST, LIMITS)
    np.testing.assert_array_equal(share, cost > 0.015)
    assert (both.limb_status == "tracked").all()
    np.testing.assert_allclose(both.joint_sd, forward.joint_sd, rtol=0.02)


@pytest.mark.parametrize("frames", [0, 1])
def test_films_without_time(frames):
    def motion(heading):
        poses = np.zeros((frames, len(NAMES)))
        poses[:, HEADING] = heading
        return motion_of(NAME, poses)

    both, share = likelier(motion(0.0), motion(1.0), PER_COST, LIMITS)
    assert share.tolist() == [0.0] * frames
    assert len(both) == frames
