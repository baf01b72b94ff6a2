"""Poses from keypoints: the person's own, however the body stood before; with sides exchanged turned round; what is unknown stays."""

from __future__ import annotations

import actor
import numpy as np
import pytest

from benchmarks.detector import EXACT, detected
from shadowpuppet.body.whole_body import heading_column
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.keypoints.candidates import (
    candidates,
    landmarks_with_exchanged,
    placed_by_rays,
    pose_at,
    triangulated_landmarks,
)
from shadowpuppet.tracking.keypoints.definitions import ARMS, LEGS, landmarks_of
from shadowpuppet.tracking.keypoints.sights import NO_SIGHTS, Sights, sights_of

BODY = actor.body()
MARKS = landmarks_of(BODY)
HEADING = heading_column(BODY.skeleton)
POSE = actor.stance(BODY.skeleton, 0.4, 2.0, (0.2, 0.1))


def places(pose: Array = POSE) -> Array:
    return BODY.skeleton.points(pose[None], MARKS.joints, MARKS.places)[0]


def seen(points: Array, count: int = actor.CAMERAS) -> Sights:
    cameras = actor.cameras()[:count]
    keypoints = detected(np.random.default_rng(0), cameras, np.zeros(1), MARKS.names, points[None], EXACT)[0]
    return sights_of(cameras, keypoints, (0,) * count, MARKS, np.nanmean(points, axis=0))


def test_exact_keypoints_give_the_places_and_the_pose():
    sights = seen(places())
    assert np.abs(triangulated_landmarks(sights, MARKS) - places()).max() < 1e-6
    (found, *_) = candidates(BODY, MARKS, sights)
    assert actor.apart(BODY, found, POSE)[0] < 0.03


def test_exchanged_in_all_cameras_the_body_faces_the_other_way():
    found = candidates(BODY, MARKS, seen(places()))
    assert np.cos(found[:, HEADING] - POSE[HEADING]).round(1).tolist()[0] == 1
    assert np.cos(found[3, HEADING] - POSE[HEADING]) < -0.9


def test_an_exchange_of_one_camera_that_is_known_is_undone():
    sights, order = seen(places()), landmarks_with_exchanged(MARKS, (LEGS,))
    wrong = sights._replace(landmarks=np.where(sights.cameras == 0, order[sights.landmarks], sights.landmarks))
    known = np.zeros((actor.CAMERAS, 2))
    known[0, LEGS] = 0.9
    assert np.abs(triangulated_landmarks(wrong, MARKS, known) - places()).max() < 1e-6
    assert np.abs(triangulated_landmarks(sights, MARKS, np.ones((actor.CAMERAS, 2))) - places()).max() < 1e-6
    two = wrong.without(4).without(3).without(2)
    assert np.abs(triangulated_landmarks(two, MARKS) - places()).max() > 0.05


def test_an_arm_that_is_not_seen_is_as_it_was():
    points, last = places(), actor.stance(BODY.skeleton, -0.4, 2.0)
    points[MARKS.names.index("left_elbow")] = np.nan
    found = pose_at(BODY, MARKS, points, last)
    assert found is not None
    arm = BODY.skeleton.dof_indices(["left_shoulder_y", "left_elbow_flexion"])
    other = BODY.skeleton.dof_indices(["right_shoulder_y"])
    assert (found[arm] == last[arm]).all()
    assert abs(found[other] - POSE[other]).max() < 0.2


def test_without_hips_or_a_second_camera_there_is_no_pose():
    points = places()
    points[MARKS.names.index("right_hip")] = np.nan
    assert pose_at(BODY, MARKS, points) is None
    assert not len(candidates(BODY, MARKS, seen(places(), 1)))
    assert not len(candidates(BODY, MARKS, NO_SIGHTS))


@pytest.mark.parametrize("count", [1, 2, 5])
def test_a_body_is_moved_to_where_its_landmarks_are_on_their_rays(count):
    away = POSE.copy()
    away[:3] += (1.0, -2.0, 0.5)
    found = placed_by_rays(BODY, np.stack([away, POSE]), MARKS, seen(places(), count))
    assert np.abs(found - POSE).max() < 1e-4


def test_both_sides_have_the_same_landmarks():
    left = {name.removeprefix("left_") for name in MARKS.names if name.startswith("left_")}
    assert left | {"nose"} == {name.removeprefix("right_") for name in MARKS.names if not name.startswith("left_")}
    nose, ear = (MARKS.names.index(name) for name in ("nose", "left_ear"))
    assert MARKS.mirrored[nose] == nose
    assert MARKS.names[MARKS.mirrored[ear]] == "right_ear"
    assert landmarks_with_exchanged(MARKS, (ARMS, LEGS)).tolist() == MARKS.mirrored.tolist()
    own = [MARKS.names.index(name) for name in ("left_shoulder", "right_ankle")]
    assert np.abs(places()[own] - BODY.points(POSE[None], names=["left_shoulder", "right_ankle"])[0]).max() < 1e-12
