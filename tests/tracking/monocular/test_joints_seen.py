"""A detector's joints before one camera: whose they are, what they cost each stage, and what they add to silhouettes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from people import camera, picture

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.doubt.monocular import MonocularDoubt
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.monocular.joints_seen import JointsSeen
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.monocular.tracker import MonocularTracker

UPPER = picture("rounded")
CAMERA = camera((200, 240), focal=1.0)
WHOLE = Picture(make_body("anatomical", average_sizes("anatomical", 1.7)), CAMERA, place(CAMERA, 3.0, -0.1))
BEFORE_TRUNK = UPPER.body.skeleton.pose(left_shoulder_abduction=0.3, left_elbow_roll=-1.0, left_elbow_flexion=1.9,
                                        right_shoulder_abduction=0.5, right_elbow_flexion=0.2)  # fmt: skip


def detected(view: Picture, *poses: Array, without: tuple[str, ...] = ()) -> Keypoints:
    """Exact keypoints of some people."""
    marks, body = landmarks_of(view.body), view.body.skeleton
    points = body.points(np.array(poses), marks.joints, marks.places)
    xy = replace(view.camera, T_camera_world=view.T_camera_base).project(points)
    sure = np.where([name in without for name in marks.names], 0.0, np.ones(xy.shape[:2]))
    return Keypoints(marks.names, xy, sure, np.full(len(poses), -1), "made")


def seen(view: Picture, pose: Array, **more) -> JointsSeen:
    found = JointsSeen.of(view, detected(view, pose, **more), pose)
    assert found is not None
    return found


def errors(view: Picture, found: Array, pose: Array) -> Array:
    """Distances (L,), metres, of the joints."""
    return np.linalg.norm(view.points(found[None])[0] - view.points(pose[None])[0], axis=1)


def test_the_pose_that_was_seen_is_the_least_surprise():
    rng = np.random.default_rng(0)
    others = BEFORE_TRUNK + 0.2 * rng.standard_normal((50, len(BEFORE_TRUNK)))
    found = seen(UPPER, BEFORE_TRUNK).surprises(np.vstack([BEFORE_TRUNK, others]))
    assert found.argmin() == 0
    assert found[1:].min() > found[0] + 0.1


def test_of_several_people_the_one_in_the_mask_is_taken_and_then_the_nearest():
    other = BEFORE_TRUNK + 0.5 * (np.array(UPPER.body.skeleton.dof_names) == "torso_y")
    both, alone = detected(UPPER, other, BEFORE_TRUNK), seen(UPPER, BEFORE_TRUNK)
    for chosen in (JointsSeen.of(UPPER, both, other, UPPER.mask(BEFORE_TRUNK)), JointsSeen.of(UPPER, both, BEFORE_TRUNK)):
        assert chosen is not None
        assert chosen.sights.rays == pytest.approx(alone.sights.rays)
    assert JointsSeen.of(UPPER, None, BEFORE_TRUNK) is None
    assert JointsSeen.of(UPPER, both.without([0, 1]), BEFORE_TRUNK) is None


def test_a_stage_that_hides_the_arms_does_not_ask_for_their_joints():
    turned = BEFORE_TRUNK + np.array([name.startswith("left") for name in UPPER.body.skeleton.dof_names])
    joints, stage = seen(UPPER, BEFORE_TRUNK), MonocularTracker(UPPER, make_settings()).stages[0]
    told = [joints.surprises(np.array([BEFORE_TRUNK, turned]), hidden) for hidden in ((), stage.hidden_joints)]
    assert np.diff(told[0]) > 1
    assert np.diff(told[1]) == pytest.approx(0)


def test_how_large_a_whole_person_is_seen_does_not_tell_the_distance():
    pose, joints = WHOLE.body.skeleton.pose(), seen(WHOLE, WHOLE.body.skeleton.pose())
    x, y, z = -0.2 * joints.sights.rays.mean(0)
    nearer, aside = WHOLE.body.skeleton.pose(root_x=x, root_y=y, root_z=z), WHOLE.body.skeleton.pose(root_y=0.2)
    told = joints.surprises(np.array([pose, nearer, aside]))
    assert told[1] - told[0] < 1
    assert told[2] > 10


def test_the_way_that_a_whole_person_faces_is_told_by_sides_and_one_frame_is_not_certain():
    pose = WHOLE.body.skeleton.pose(left_shoulder_x=0.6)
    tracker = MonocularTracker(WHOLE, make_settings())
    turned = tracker.turned(pose)
    joints = seen(WHOLE, turned)
    assert joints.against(turned) == pytest.approx(-np.log(0.98 / 0.02), abs=0.01)
    assert joints.against(pose) == pytest.approx(np.log(0.98 / 0.02), abs=0.01)
    names = WHOLE.body.skeleton.dof_names
    assert dict(zip(names, turned - WHOLE.body.skeleton.pose()))["root_heading"] == pytest.approx(np.pi)
    assert turned[names.index("left_shoulder_x")] == 0


def test_a_whole_person_seen_from_behind_is_found_so():
    pose = WHOLE.body.skeleton.pose(root_heading=np.pi, left_shoulder_x=1.2, right_shoulder_x=-0.4)
    mask, keypoints = WHOLE.mask(pose), detected(WHOLE, pose)
    tracker = MonocularTracker(WHOLE, make_settings(), moves=False, rate=10.0)
    heading = WHOLE.body.skeleton.dof_names.index("root_heading")
    state = tracker.start(np.random.default_rng(0), mask, keypoints=keypoints)
    assert np.cos(state.pose[heading]) < 0
    assert state.support > 0.9
    away = tracker.start(np.random.default_rng(0), mask)
    assert np.cos(away.pose[heading]) > 0
    for _ in range(15):
        away = tracker.step(np.random.default_rng(1), away, mask, keypoints=keypoints)
    assert np.cos(away.pose[heading]) < 0


def test_an_arm_before_the_trunk_is_found_by_its_joints_and_vouched_for():
    mask, found = UPPER.mask(BEFORE_TRUNK), dict[bool, float]()
    for known in (False, True):
        tracker, rng = MonocularTracker(UPPER, make_settings()), np.random.default_rng(0)
        keypoints = detected(UPPER, BEFORE_TRUNK) if known else None
        state = tracker.start(rng, mask, keypoints=keypoints)
        for _ in range(5):
            state = tracker.step(rng, state, mask, keypoints=keypoints)
        off = dict(zip(UPPER.body.landmark_names, errors(UPPER, state.pose, BEFORE_TRUNK)))
        found[known] = off["left_wrist"]
        hidden = MonocularDoubt(tracker).evidence(state, mask, 0.0, None)[0].components["hidden"]
        shown = dict(zip(UPPER.body.landmark_names, hidden[:, 0]))
        assert (shown["left_wrist"] < 0.02) == known
    assert found[True] < 0.06
    assert found[True] < 0.5 * found[False]


def test_what_keypoints_miss_and_a_front_that_they_contradict_are_doubt():
    pose, rng = WHOLE.body.skeleton.pose(left_shoulder_x=1.2), np.random.default_rng(0)
    tracker, mask = MonocularTracker(WHOLE, make_settings(), moves=False), WHOLE.mask(pose)
    found, names = dict[str, dict[str, Array]](), WHOLE.body.landmark_names
    for title, keypoints in (("seen", detected(WHOLE, pose)), ("missed", detected(WHOLE, pose, without=("left_wrist",))),
                             ("turned", detected(WHOLE, tracker.turned(pose))), ("none", None)):  # fmt: skip
        state = tracker.start(rng, mask, keypoints=keypoints, about=WHOLE.body.skeleton.pose())._replace(pose=pose)
        found[title] = MonocularDoubt(tracker).evidence(state, mask, 0.0, None)[0].components
    hand = names.index("left_hand")
    assert found["missed"]["missed"][hand, 0] > 10 * found["seen"]["missed"][hand, 0]
    assert found["turned"]["exchanged"][hand].max() > 5 * found["seen"]["exchanged"][hand].max()
    assert "missed" not in found["none"]


def test_a_limb_misses_what_no_keypoint_shows_near_it():
    joints = seen(UPPER, BEFORE_TRUNK, without=("left_wrist",))
    missed = joints.missed(BEFORE_TRUNK)
    assert missed["left_arm"] == pytest.approx(0.51, abs=0.02)
    assert missed["right_arm"] == pytest.approx(0.02, abs=0.01)
    assert joints.support(BEFORE_TRUNK) == 1


def test_silhouettes_alone_are_tracked_as_before():
    mask = UPPER.mask(BEFORE_TRUNK)
    nobody = detected(UPPER, BEFORE_TRUNK).without([0])
    states = [MonocularTracker(UPPER, make_settings()).start(np.random.default_rng(0), mask, keypoints=each) for each in (None, nobody)]
    assert np.array_equal(states[0].pose, states[1].pose)
    assert np.isnan(states[1].support)
