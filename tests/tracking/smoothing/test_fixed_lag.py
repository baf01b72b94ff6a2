"""Fixed-lag smoothing: frames come out in order, smoother and no farther off, some frames later; without a pose they pass as they are."""

from __future__ import annotations

import numpy as np
import pytest
from runs import BODIES, body_of, smooth_poses
from smoothers import RATE, motion_of, smoother

from shadowpuppet.tracking.smoothing.fixed_lag import FixedLag


def tracked(name: str, rng, frames: int = 60, lost=()):
    body = body_of(name)
    truth = body.skeleton.clamp(smooth_poses(body, frames, rng, reach=0.4))
    poses = body.skeleton.clamp(truth + rng.normal(0, 0.01, truth.shape))
    return motion_of(name, truth).joints, motion_of(name, poses, lost)


def given(motion, name, lag):
    """For each frame the frames given out with it; and those at the end."""
    follow = FixedLag(smoother(name), lag)
    return [follow(frame) for frame in motion.frames()], follow.rest()


def jitter(joints: np.ndarray) -> float:
    return float(np.sqrt((np.diff(joints, n=2, axis=0) ** 2).sum(2).mean())) * RATE**2


@pytest.mark.parametrize("name", BODIES)
def test_motion_is_smoother_and_nearer_to_the_truth_and_of_the_body(name, rng):
    truth, raw = tracked(name, rng)
    out, rest = given(raw, name, 0.2)
    frames = [*(frame for each in out for frame in each), *rest]
    joints = np.array([frame.joints for frame in frames])
    assert [frame.time for frame in frames] == raw.times.tolist()
    assert np.abs(joints - truth).mean() < np.abs(raw.joints - truth).mean()
    assert jitter(joints) < 0.6 * jitter(raw.joints)
    np.testing.assert_allclose(smoother(name).points(np.array([frame.pose for frame in frames])), joints, atol=1e-12)


@pytest.mark.parametrize(("lag", "late"), [(0.01, 1), (0.1, 3), (0.2, 6)])
def test_the_lag_is_of_whole_frames_and_at_least_one(lag, late, rng):
    _, raw = tracked("rounded", rng, 20)
    out, rest = given(raw, "rounded", lag)
    assert [len(each) for each in out] == [0] * late + [1] * (20 - late)
    assert [each[0].time for each in out[late:]] == raw.times[:-late].tolist()
    assert len(rest) == late


def test_a_lag_halfway_between_two_frames_is_rounded_down(rng):
    _, raw = tracked("rounded", rng, 6)
    follow = FixedLag(smoother("rounded"), 0.375)
    assert [len(follow(frame._replace(time=n / 4))) for n, frame in enumerate(raw.frames())] == [0, 1, 1, 1, 1, 1]


def test_what_follows_cannot_change_what_was_given(rng):
    _, raw = tracked("rounded", rng, 20)
    whole, _ = given(raw, "rounded", 0.1)
    part, _ = given(raw[:15], "rounded", 0.1)
    for first, second in zip(whole, part):
        for one, other in zip(first, second):
            np.testing.assert_array_equal(one.pose, other.pose)


@pytest.mark.parametrize("lost", [(0, 1), (10,), tuple(range(8, 30)), (3, 5, 7, 9), tuple(range(40))])
def test_frames_without_a_pose_pass_in_their_place(lost, rng):
    _, raw = tracked("rounded", rng, 40, lost)
    out, rest = given(raw, "rounded", 0.1)
    frames = [*(frame for each in out for frame in each), *rest]
    assert [frame.time for frame in frames] == raw.times.tolist()
    assert [n for n, frame in enumerate(frames) if frame.status == "lost"] == list(lost)
    assert all(np.isfinite(np.asarray(frame.pose)).all() == (frame.status != "lost") for frame in frames)


def test_after_a_pause_the_motion_begins_again(rng):
    _, raw = tracked("rounded", rng, 40, range(5, 30))
    out, rest = given(raw, "rounded", 0.1)
    after = [frame for frame in (*(frame for each in out for frame in each), *rest) if frame.time > 29.5 / RATE]
    alone, left = given(raw[30:], "rounded", 0.1)
    for one, other in zip(after, (*(frame for each in alone for frame in each), *left), strict=True):
        np.testing.assert_allclose(one.pose, other.pose, atol=1e-9)


def test_frames_whose_deviations_are_unknown(rng):
    _, raw = tracked("rounded", rng, 10)
    follow = FixedLag(smoother("rounded"), 0.1)
    frames = [frame for each in raw.frames() for frame in follow(each._replace(joint_sd=None, pose_sd=None))]
    assert len(frames) == 7
    assert all(np.isfinite(np.asarray(frame.pose)).all() for frame in frames)
