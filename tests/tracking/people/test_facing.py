"""Frames before a walk that showed the front: the sides of those that faced the wrong way are exchanged, others get their status."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.skeleton import other_side
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame
from shadowpuppet.tracking.people.facing import Doubted, Facing, Trial

SIZES = average_sizes("anatomical", 1.75)
BODY = make_body("anatomical", SIZES)
TIMES = np.arange(12) / 10


def walk() -> Motion:
    """Somebody who walks with swinging arms and bent knees; doubted throughout."""
    built = MotionBuilder(BODY.name, BODY.skeleton.dof_names, BODY.landmark_names)
    for n, time in enumerate(TIMES):
        pose = BODY.skeleton.pose(root_x=0.1 * n, root_z=0.95, root_heading=0.0, left_hip_y=-0.4 + 0.05 * n, right_hip_y=0.2 - 0.03 * n,
                                  left_knee_flexion=0.7, right_knee_flexion=0.8, right_elbow_flexion=0.7, left_shoulder_y=0.3)  # fmt: skip
        sd = np.arange(len(BODY.landmark_names) * 3).reshape(-1, 3) / 1000
        built.append(MotionFrame(time, "uncertain", pose, BODY.points(pose[None])[0], np.abs(pose) + 0.1, sd, 0.0, 0.9))
    return built.build()


def as_taken_the_wrong_way(motion: Motion, frames: slice) -> Motion:
    """What a tracker sees that takes the back for the front: the joints of the other side where the person's are."""
    joints = motion.joints.copy()
    joints[frames] = joints[frames][:, other_side(motion.joint_names)]
    return replace(motion, joints=joints)


def test_the_sides_of_frames_that_face_the_wrong_way_are_exchanged():
    truth, facing = walk(), Facing()
    facing.begin(TIMES[0], is_known=False)
    facing.show(TIMES[8], wrong=True)
    found = facing.corrected(as_taken_the_wrong_way(truth, slice(0, 8)), BODY, SIZES)
    assert np.linalg.norm(found.joints - truth.joints, axis=2).mean() < 0.01
    assert np.abs(found.poses[:8] - truth.poses[:8]).max() > 0  # fitted anew
    np.testing.assert_array_equal(found.poses[8:], truth.poses[8:])
    left, right = (truth.joint_names.index(f"{side}_knee") for side in ("left", "right"))
    np.testing.assert_array_equal(found.joint_sd[:8, left], truth.joint_sd[:8, right])
    np.testing.assert_array_equal(found.joint_sd[8:], truth.joint_sd[8:])
    assert (found.status == "uncertain").all()


def test_knees_that_bent_for_the_wrong_front_are_no_error():
    motion, facing = walk(), Facing()
    facing.begin(TIMES[0], is_known=False)
    facing.show(TIMES[10], wrong=True)
    found = facing.corrected(motion, BODY, SIZES)  # as it is, the knees bend backwards once the sides are exchanged
    low, high = BODY.skeleton.limits
    assert (found.poses[:10] >= low - 1e-9).all()
    assert (found.poses[:10] <= high + 1e-9).all()
    pelvis = motion.joint_names.index("pelvis")
    assert np.linalg.norm(found.joints[:10, pelvis] - motion.joints[:10, pelvis], axis=1).max() < 0.1


def test_frames_that_faced_the_right_way_get_the_status_that_they_would_have_had():
    truth, facing = walk(), Facing()
    facing.begin(TIMES[0], is_known=False)
    for time in TIMES[:5]:
        facing.doubted[float(time)] = Doubted("tracked", ("tracked",) * (len(truth.limbs) - 1) + ("uncertain",))
    facing.show(TIMES[5], wrong=False)
    found = facing.corrected(truth, BODY, SIZES)
    assert found.status.tolist() == ["tracked"] * 5 + ["uncertain"] * 7
    assert (found.limb_status[:5, -1] == "uncertain").all()
    np.testing.assert_array_equal(found.poses, truth.poses)


@pytest.mark.parametrize("sure", [True, False])
def test_what_is_not_known_stays(sure):
    """The front was known from the beginning, or never."""
    truth, facing = walk(), Facing()
    facing.begin(TIMES[0], is_known=sure)
    if sure:
        facing.show(TIMES[6], wrong=True)
    found = facing.corrected(truth, BODY, SIZES)
    np.testing.assert_array_equal(found.joints, truth.joints)
    assert found.status.tolist() == truth.status.tolist()


def test_only_the_part_since_the_last_search_is_corrected():
    truth, facing = walk(), Facing()
    facing.begin(TIMES[0], is_known=False)
    facing.begin(TIMES[4], is_known=False)
    facing.show(TIMES[8], wrong=True)
    facing.show(TIMES[10], wrong=True)  # the first says what was before
    known, wrong = facing.known_later(truth.times)
    assert known.tolist() == wrong.tolist() == [False] * 4 + [True] * 4 + [False] * 4


def tried(lead: float, seconds: float = 1.6, early: float = 0.0) -> Trial:
    """A trial in which the body as it is overlaps by `lead` more than the one turned round, and `early` more in the first moments."""
    trial = Trial(5.0, SimpleNamespace(overlap=0.7))
    for n in range(round(seconds * 10)):
        more = early if n < 4 else lead
        trial.add(5.0 + n / 10, SimpleNamespace(overlap=0.7), 0.7 + more)
    return trial


@pytest.mark.parametrize(("lead", "right"), [(0.05, True), (-0.05, False), (0.01, None), (-0.01, None)])
def test_a_trial_decides_what_is_clear(lead, right):
    assert tried(lead).is_right(6.6) is right


def test_a_trial_needs_time_and_its_first_moments_do_not_count():
    assert tried(0.05, seconds=0.9).is_right(5.9) is None
    assert tried(0.05, early=-2.0).is_right(6.6) is True


def test_a_body_that_is_lost_loses_the_trial():
    trial = Trial(0.0, SimpleNamespace(overlap=0.7))
    for n in range(16):
        trial.add(n / 10, SimpleNamespace(overlap=np.nan), 0.6)
    assert trial.is_right(1.6) is True


@pytest.mark.parametrize(("late", "right"), [(0.05, True), (0.0, None), (-0.05, None)])
def test_a_trial_whose_difference_fades_goes_on(late, right):
    """The body turned round needs a while to settle: until then it fits worse, whichever way the person faces."""
    trial = Trial(0.0, SimpleNamespace(overlap=0.7))
    for n in range(16):
        trial.add(n / 10, SimpleNamespace(overlap=0.7), 0.7 + (0.08 if n < 12 else late))
    assert trial.is_right(1.6) is right
