"""Two passes over a film: the likelier one is taken, by the overlaps of all frames, and what the other says is doubt."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import body_of, root_of
from smoothers import RATE, motion_of

from shadowpuppet.tracking.smoothing.likelier_pass import backward_odds, likelier
from shadowpuppet.tracking.status import PER_OVERLAP

NAME, FRAMES = "anatomical", 60
BODY = body_of(NAME)
NAMES = BODY.skeleton.dof_names
HEADING = NAMES.index("root_heading")
NONE = np.zeros(FRAMES, bool)
LIMITS = {"trunk": 0.3, "arm": 0.15, "leg": 0.15}


def points(poses: np.ndarray) -> np.ndarray:
    return BODY.points(poses, root_of(BODY))


def passing(headings, overlaps, lost=()):
    """A pass of a person who stands and faces `headings` (rad), and overlaps the silhouettes so."""
    poses = np.zeros((FRAMES, len(NAMES)))
    poses[:, HEADING] = headings
    return replace(motion_of(NAME, poses, lost), overlap=np.broadcast_to(np.asarray(overlaps, float), FRAMES).copy())


def evidence_of(forward, backward):
    return PER_OVERLAP * (backward.overlap - forward.overlap)


def blended(forward, backward, averaged=False, limits=LIMITS, alone=None):
    return likelier(forward, backward, evidence_of(forward, backward), points, averaged=averaged, limits=limits, alone=alone)


def test_the_pass_that_fits_better_over_the_film_is_taken_in_every_frame():
    forward, backward = passing(0.0, 0.80), passing(np.pi, 0.85)
    worse = backward.overlap.copy()
    worse[20:25] -= 0.07  # in some frames it fits worse: people do not turn round in a frame
    both, share = blended(forward, replace(backward, overlap=worse))
    assert share.tolist() == [1.0] * FRAMES
    np.testing.assert_array_equal(both.joints, backward.joints)
    assert (both.limb_status == "tracked").all()


def test_odds_are_those_of_all_frames():
    forward, backward = passing(0.0, 0.8), passing(np.pi, 0.801)
    odds = backward_odds(forward, backward, evidence_of(forward, backward), NONE)
    np.testing.assert_allclose(odds, PER_OVERLAP * 1e-3 * FRAMES / RATE, rtol=0.05)


def test_each_half_is_taken_from_the_pass_that_is_right_there_where_both_meet():
    overlap = np.where(np.arange(FRAMES) < 30, 0.8, 0.9)
    turn = np.pi * np.clip(np.abs(np.arange(FRAMES) - 30) / 15, 0, 1)  # they agree in frame 30 only
    forward, backward = passing(0.0, overlap), passing(turn, overlap[::-1])
    both, share = blended(forward, backward)
    assert share[:25].tolist() == [1.0] * 25
    assert share[35:].tolist() == [0.0] * 25
    np.testing.assert_array_equal(both.poses[:25], backward.poses[:25])
    np.testing.assert_array_equal(both.overlap[35:], forward.overlap[35:])


def test_poses_are_means_by_weight_where_they_are_averaged():
    """Angles by the shorter way round."""
    both, _ = blended(passing(0.0, 0.8), passing(0.8, 0.8), averaged=True)
    np.testing.assert_allclose(both.poses[:, HEADING], 0.4)
    np.testing.assert_allclose(both.joints, points(both.poses))
    np.testing.assert_allclose(both.pose_sd[:, HEADING], np.hypot(0.06, 0.4))
    both, _ = blended(passing(np.pi - 0.01, 0.8), passing(0.01 - np.pi, 0.8), averaged=True)
    np.testing.assert_allclose(np.cos(both.poses[:, HEADING]), -1.0, atol=1e-4)


def test_what_is_between_two_fronts_is_neither():
    both, share = blended(passing(0.0, 0.8), passing(np.pi / 2, 0.8))
    np.testing.assert_array_equal(both.poses[:, HEADING], np.where(share > 0, np.pi / 2, 0.0))


def test_where_both_may_be_right_the_limbs_they_disagree_about_are_doubtful_and_deviations_reach_the_other():
    forward, backward = passing(0.0, 0.8), passing(2 * np.pi - np.pi / 2, 0.8)
    both, _ = blended(forward, backward)
    limbs = dict(zip(both.limbs, both.limb_status[30]))
    assert limbs["left_arm"] == limbs["right_arm"] == "uncertain"
    assert limbs["trunk"] == "tracked"  # it turns about itself
    assert both.pose_sd[30, HEADING] == pytest.approx(np.hypot(0.06, np.pi / 2 / np.sqrt(2)), rel=0.01)
    hand = BODY.landmark_names.index("left_hand")
    apart = np.linalg.norm(forward.joints[30, hand] - backward.joints[30, hand])
    assert np.linalg.norm(both.joint_sd[30, hand]) == pytest.approx(np.hypot(0.03 * np.sqrt(3), apart / np.sqrt(2)), rel=0.01)
    assert (blended(forward, backward, limits=None)[0].limb_status == "tracked").all()  # without limits


def test_where_one_pass_is_lost_the_other_counts_alone():
    forward, backward = passing(0.0, 0.8, lost=[3, 4]), passing(np.pi, 0.7, lost=[4, 5])
    both, share = blended(forward, backward)
    assert share[[3, 5]].tolist() == [1.0, 0.0]
    assert both.status[[3, 4, 5]].tolist() == ["tracked", "lost", "tracked"]
    np.testing.assert_array_equal(both.joint_sd[3], backward.joint_sd[3])
    assert np.isnan(both.poses[4]).all()
    assert np.isfinite(np.delete(both.joints, 4, 0)).all()


def test_where_the_forward_pass_counts_alone_it_is_taken_and_nothing_is_doubted():
    alone = np.arange(FRAMES) // 10 == 2
    both, share = blended(passing(0.0, 0.8), passing(np.pi / 2, 0.85), alone=alone)
    np.testing.assert_array_equal(share, ~alone)
    np.testing.assert_allclose(both.joint_sd[alone], 0.03)
    assert not both.poses[alone][:, HEADING].any()


def test_one_pass_may_be_certain():
    both, share = blended(passing(0.0, 0.9), passing(np.pi, 0.1))
    assert not share.any()
    np.testing.assert_allclose(both.joint_sd, 0.03)


def test_passes_that_agree_change_freely_and_doubt_nothing():
    overlap = np.where(np.arange(FRAMES) % 20 < 10, 0.7, 0.9)
    forward, backward = passing(0.0, overlap), passing(0.001, 0.8)
    both, share = blended(forward, backward)
    np.testing.assert_array_equal(share, overlap < 0.8)
    assert (both.limb_status == "tracked").all()
    np.testing.assert_allclose(both.joint_sd, forward.joint_sd, rtol=0.02)


@pytest.mark.parametrize("frames", [0, 1])
def test_films_without_time(frames):
    def motion(heading):
        poses = np.zeros((frames, len(NAMES)))
        poses[:, HEADING] = heading
        return motion_of(NAME, poses)

    both, share = blended(motion(0.0), motion(1.0))
    assert share.tolist() == [0.0] * frames
    assert len(both) == frames
