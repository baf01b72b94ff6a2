"""Smoothed motions: poses of the body, nearer to the truth and as smooth; gaps bridged as `predicted`; blocks that leave no seam."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import BODIES, body_of, smooth_poses
from smoothers import RATE, motion_of, smoother

from shadowpuppet.tracking.smoothing import smoothing


def noisy(name: str, rng, frames: int = 60, noise: float = 0.01) -> tuple[np.ndarray, np.ndarray]:
    body = body_of(name)
    truth = body.skeleton.clamp(smooth_poses(body, frames, rng, reach=0.4))
    return truth, body.skeleton.clamp(truth + rng.normal(0, noise, truth.shape))


def jitter(joints: np.ndarray) -> float:
    return float(np.sqrt((np.diff(joints, n=2, axis=0) ** 2).sum(2).mean())) * RATE**2


@pytest.mark.parametrize("method", ["tracker", "butterworth"])
@pytest.mark.parametrize("name", BODIES)
def test_the_smoothed_motion_is_one_of_the_body_nearer_and_smoother(name, method, rng):
    truth, poses = noisy(name, rng)
    raw, make = motion_of(name, poses), smoother(name, method=method)
    found = make(raw).motion
    np.testing.assert_allclose(make.points(found.poses), found.joints, atol=1e-12)
    right = motion_of(name, truth).joints
    assert np.abs(found.joints - right).mean() < np.abs(raw.joints - right).mean()
    assert jitter(found.joints) < 0.7 * jitter(raw.joints)
    assert (found.status == "tracked").all()
    for field in ("times", "cost", "overlap", "joint_sd", "pose_sd"):
        np.testing.assert_array_equal(getattr(found, field), getattr(raw, field))


def test_blocks_leave_no_seam(rng, monkeypatch):
    _, poses = noisy("rounded", rng, 200)
    raw = motion_of("rounded", poses)
    whole = smoother("rounded")(raw).motion
    monkeypatch.setattr(smoothing, "BLOCK", 50)
    assert np.abs(smoother("rounded")(raw).motion.joints - whole.joints).max() < 1e-3


def test_short_gaps_are_predicted_and_long_ones_stay(rng):
    truth, poses = noisy("anatomical", rng, 90, 0.002)
    lost = [*range(20, 30), *range(50, 80)]
    raw, make = motion_of("anatomical", poses, lost), smoother("anatomical", gaps=0.5)
    found, inside, *_ = make(raw)
    assert np.flatnonzero(inside).tolist() == lost[:10]
    assert (found.status[inside] == "predicted").all()
    assert (found.limb_status[inside] == "predicted").all()
    assert (found.status[50:80] == "lost").all()
    assert np.isnan(found.joints[50:80]).all()
    right = motion_of("anatomical", truth).joints
    errors = np.abs(found.joints - right)[20:30]
    assert (errors <= 1.645 * found.joint_sd[20:30]).mean() > 0.9
    assert (found.joint_sd[25] > found.joint_sd[20]).all()
    assert (found.pose_sd[25] > found.pose_sd[19]).all()


def test_off_with_gaps_leaves_known_frames_as_they_are(rng):
    _, poses = noisy("rounded", rng, 40)
    raw = motion_of("rounded", poses, range(10, 14))
    found, inside, *_ = smoother("rounded", method="off")(raw)
    assert inside.sum() == 4
    np.testing.assert_array_equal(found.joints[~inside], raw.joints[~inside])
    assert np.isfinite(found.joints).all()


@pytest.mark.parametrize("lost", [(), (0,), range(5), (1, 2), (0, 1, 3, 4)])
def test_motions_of_a_few_frames(lost, rng):
    for frames in range(6):
        poses = smooth_poses(body_of("rounded"), frames, rng)
        raw = motion_of("rounded", poses, lost)
        for method in ("tracker", "butterworth", "off"):
            found = smoother("rounded", method=method)(raw).motion
            assert len(found) == frames
            assert (np.isfinite(found.joints).all((1, 2)) >= raw.known).all()


def test_a_person_who_turns_round_more_than_once_has_no_seam(rng):
    _, poses = noisy("anatomical", rng, 80)
    heading = body_of("anatomical").skeleton.dof_names.index("root_heading")
    wrapped = poses.copy()
    wrapped[:, heading] = (wrapped[:, heading] + np.pi) % (2 * np.pi) - np.pi
    one, other = (smoother("anatomical")(motion_of("anatomical", each)).motion.joints for each in (poses, wrapped))
    np.testing.assert_allclose(one, other, atol=1e-4)


def test_unstated_deviations_do_not_matter_much(rng):
    truth, poses = noisy("rounded", rng)
    raw = motion_of("rounded", poses)
    raw = replace(raw, joint_sd=np.full_like(raw.joint_sd, np.nan), pose_sd=np.full_like(raw.pose_sd, np.nan))
    found = smoother("rounded")(raw).motion
    right = motion_of("rounded", truth).joints
    assert np.abs(found.joints - right).mean() < np.abs(raw.joints - right).mean()


def test_degrees_of_freedom_that_never_change_stay(rng):
    truth, poses = noisy("rounded", rng)
    poses[:, 3] = truth[0, 3]
    assert (smoother("rounded")(motion_of("rounded", poses)).motion.poses[:, 3] == truth[0, 3]).all()


def test_what_was_done_is_said():
    assert smoother("rounded").summary == {"method": "tracker", "gaps_s": 0.5}
    found = smoother("rounded", method="butterworth", cutoff=8.0).summary
    assert found == {"method": "butterworth", "cutoff_hz": 8.0, "order": 4, "lag": 0, "gaps_s": 0.5}
