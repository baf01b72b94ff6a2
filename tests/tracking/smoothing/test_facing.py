"""A person who turns round before one camera: the mirrored pose draws the same, but a turn can be distinguished from a look aside."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from runs import body_of, root_of
from smoothers import motion_of, smoother

from shadowpuppet.tracking.smoothing.facing import BESIDE, LONGEST, about_profile, mirror, turned_on, turns

NAME = "rounded"
NAMES = body_of(NAME).skeleton.dof_names
TWIST = NAMES.index("torso_twist")


def poses_of(*angles: float, frames: int = 120) -> np.ndarray:
    poses = np.zeros((frames, len(NAMES)))
    poses[:, NAMES.index("left_shoulder_abduction")] = 0.7
    poses[:, NAMES.index("right_shoulder_abduction")] = 0.2
    poses[:, TWIST] = np.interp(np.arange(frames), np.linspace(0, frames - 1, len(angles)), np.radians(angles))
    return poses


def seen(turned: np.ndarray) -> np.ndarray:
    """Twist as a tracker of one camera takes it for (rad)."""
    return np.arcsin(np.sin(turned))


def passing(seconds: float = 0.6, frames: int = 120) -> np.ndarray:
    """Frontal, half a turn by a quick passing of the profile, frontal."""
    poses = poses_of(0, 0, frames=frames)
    times = np.arange(frames) / 30 - 2.0
    poses[:, TWIST] = np.radians(90) + np.radians(90) * np.clip(times / seconds, -1, 1)
    return poses


@pytest.mark.parametrize("name", ["cardbox", "boxes", "rounded"])
def test_the_mirrored_pose_is_the_reflection_in_depth_with_sides_exchanged(name, rng):
    body = body_of(name)
    low, high = body.skeleton.limits
    poses = rng.uniform(np.maximum(low, -1), np.minimum(high, 1), (5, len(low)))
    poses[:, [d for d, dof in enumerate(body.skeleton.dofs) if dof.kind == "translation"]] *= 0
    names = body.landmark_names
    other = [names.index(each.replace("left", "*").replace("right", "left").replace("*", "right")) for each in names]
    reflected = body.points(poses)[:, other] * [-1, 1, 1]
    np.testing.assert_allclose(body.points(mirror(body.skeleton.dof_names, poses)), reflected, atol=1e-9)


def test_half_a_turn_is_followed_and_all_that_comes_after():
    truth = passing()
    poses = truth.copy()
    poses[:, TWIST] = seen(truth[:, TWIST])
    away = truth[:, TWIST] > np.pi / 2
    poses[away] = mirror(NAMES, truth[away])  # the side's arms that the silhouette shows
    poses[:, TWIST] = (poses[:, TWIST] + np.pi) % (2 * np.pi) - np.pi
    found, mirrored, _ = turned_on(motion_of(NAME, poses))
    assert np.abs(np.diff(mirrored.astype(int))).sum() == 1
    right = motion_of(NAME, truth).joints
    joints = body_of(NAME).points(found.poses, root_of(body_of(NAME)))
    np.testing.assert_allclose(joints[mirrored == away], right[mirrored == away], atol=1e-6)
    assert (mirrored != away).sum() <= 2
    assert np.abs(np.diff(found.poses[:, TWIST])).max() < 0.5


@pytest.mark.parametrize("angles", [(0, 40, 0), (0, 65, 0), (0, 0, 60, 60, 0, 0), (-60, 80, 80, -60), (0, 85, 85, 85, 85, 0)])
def test_twists_slow_turns_aside_and_standing_in_profile_are_left(angles):
    assert turns(motion_of(NAME, poses_of(*angles))) == []


def test_a_profile_that_lasts_is_no_turn():
    quick, slow = (passing(seconds) for seconds in (0.6, 2 * LONGEST))
    for poses, number in ((quick, 1), (slow, 0)):
        poses[:, TWIST] = seen(poses[:, TWIST])
        assert len(turns(motion_of(NAME, poses))) == number


def test_who_looks_away_first_is_mirrored_throughout(rng):
    poses = poses_of(0, 10, 0)
    found, mirrored, _ = turned_on(motion_of(NAME, poses), away=True)
    assert mirrored.all()
    assert np.abs(np.abs(found.poses[:, TWIST]) - np.pi).max() < 0.2
    smoothed = smoother(NAME, away=True)(motion_of(NAME, poses))
    np.testing.assert_allclose(smoother(NAME).points(smoothed.motion.poses), smoothed.motion.joints, atol=1e-9)
    assert smoothed.mirrored.all()


def test_doubt_goes_with_the_limb():
    motion = motion_of(NAME, poses_of(0, 0))
    limbs = motion.limb_status.copy()
    limbs[:, motion.limbs.index("left_arm")] = "uncertain"
    found, *_ = turned_on(replace(motion, limb_status=limbs), away=True)
    assert (found.limb_status[:, found.limbs.index("right_arm")] == "uncertain").all()
    assert (found.limb_status[:, found.limbs.index("left_arm")] == "tracked").all()


def test_whole_bodies_and_empty_motions_are_left(rng):
    body = body_of("anatomical")
    motion = motion_of("anatomical", np.zeros((5, len(body.skeleton.dofs))))
    assert turned_on(motion, away=True)[0] is motion
    assert turns(motion_of(NAME, np.zeros((0, len(NAMES))))) == []


def half_turn() -> tuple[np.ndarray, np.ndarray]:
    """Half a turn by the profile that faces the image's right, and what a tracker makes of it that takes it for one to the left."""
    truth = passing()
    poses = truth.copy()
    away = truth[:, TWIST] > np.pi / 2
    poses[away] = mirror(NAMES, truth[away])
    poses[:, TWIST] = -np.abs(np.arcsin(np.sin(truth[:, TWIST])))
    return truth, poses


@pytest.mark.parametrize(("lean", "turned"), [(0.1, True), (-0.1, False), (0.02, False), (np.nan, False)])
def test_a_profile_is_turned_to_the_side_of_the_head(lean, turned):
    truth, poses = half_turn()
    motion, leans = motion_of(NAME, poses), np.where(np.abs(poses[:, TWIST]) > np.radians(50), lean, np.nan)
    found, mirrored, reversed_ = turned_on(motion, leans=leans)
    assert reversed_.any() == turned
    assert mirrored.any()
    off = (found.poses[:, TWIST] - truth[:, TWIST] + np.pi) % (2 * np.pi) - np.pi
    assert (np.abs(off) > np.radians(25)).any() == (not turned)
    assert np.abs(np.diff(found.poses[:, TWIST])).max() < 0.6


def test_a_profile_too_brief_counts_only_if_the_head_shows_it():
    _, poses = half_turn()
    angles = np.abs(poses[:, TWIST])
    brief = angles.argmax() + np.arange(-2, 3)
    poses[:, TWIST] = np.where(angles > np.radians(50), np.radians(-40), poses[:, TWIST])
    poses[brief, TWIST] = np.radians(-75)
    motion, leans = motion_of(NAME, poses), np.full(len(poses), np.nan)
    assert turns(motion) == []
    leans[brief] = -0.1
    assert len(turns(motion, leans)) == 1


def test_a_head_that_leans_wrongly_in_few_frames_turns_nobody():
    _, poses = half_turn()
    profile = np.flatnonzero(np.abs(poses[:, TWIST]) > np.radians(50))
    leans = np.full(len(poses), np.nan)
    leans[profile] = -0.08
    leans[profile[: len(profile) // 3]] = 0.4
    assert not turned_on(motion_of(NAME, poses), leans=leans).reversed.any()


def test_few_leans_are_not_enough():
    _, poses = half_turn()
    leans = np.full(len(poses), np.nan)
    leans[np.abs(poses[:, TWIST]).argmax()] = 0.1
    assert not turned_on(motion_of(NAME, poses), leans=leans).reversed.any()


def test_a_turn_is_smoothed_the_way_that_the_head_says():
    truth, poses = half_turn()
    right = motion_of(NAME, truth).joints
    both = [smoother(NAME)(motion_of(NAME, poses), leans) for leans in (None, np.full(len(poses), 0.1))]
    without, found = (np.abs(each.motion.joints - right).mean() for each in both)
    assert found < 0.3 * without
    assert both[1].reversed.any()


def test_frames_about_a_profile():
    poses = poses_of(0, 0)
    poses[60, TWIST] = np.radians(-80)
    motion = motion_of(NAME, poses, lost=[5])
    np.testing.assert_array_equal(about_profile(motion), np.abs(np.arange(120) - 60) <= round(BESIDE * 30))
    assert not about_profile(motion_of("anatomical", np.zeros((20, len(body_of("anatomical").skeleton.dofs))))).any()
