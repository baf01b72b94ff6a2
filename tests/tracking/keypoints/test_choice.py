"""Which detection is the person: that in the silhouette, or nearest to the body; guesses outside the picture are no sights; the front."""

from __future__ import annotations

import actor
import numpy as np
import pytest

from benchmarks.detector import EXACT, detected
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.tracking.keypoints.choice import people_at, people_between, people_in, people_of, person_between
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.keypoints.front import front_of
from shadowpuppet.tracking.keypoints.sights import OUTLYING, sights_of
from shadowpuppet.tracking.keypoints.stature import height_by_bones

BODY = actor.body()
MARKS = landmarks_of(BODY)
CAMERAS = actor.cameras()
POSES = actor.walk(BODY.skeleton, 2)
OWN, OTHER = (BODY.skeleton.points(POSES[:1], MARKS.joints, MARKS.places)[0] + shift for shift in (0, np.array([0.5, 0.6, 0.0])))


def both(confidence: float = 0.6) -> list[Keypoints]:
    """The other person, confident, before the own one."""
    found = [detected(np.random.default_rng(0), CAMERAS, np.zeros(1), MARKS.names, each[None], EXACT)[0] for each in (OTHER, OWN)]
    return [Keypoints(MARKS.names, np.concatenate([a.xy, b.xy]), np.array([[0.99], [confidence]]) * np.ones((1, len(MARKS.names))),
                      np.array([7, 8]), "made") for a, b in zip(*found)]


def test_the_person_is_the_one_in_the_silhouette_not_the_most_confident():
    masks = actor.masks(BODY, POSES[0])
    assert people_in(masks, CAMERAS, both()) == (1,) * len(CAMERAS)
    assert people_in([np.zeros_like(mask) for mask in masks], CAMERAS, both()) == (None,) * len(CAMERAS)
    assert people_in([None, *masks[1:]], CAMERAS, [*both()[:2], None, *both()[3:]]) == (None, 1, None, 1, 1)


def test_the_person_is_the_one_nearest_to_the_body_on_whichever_side():
    assert people_at(OWN, CAMERAS, both(), MARKS) == (1,) * len(CAMERAS)
    assert people_at(OTHER, CAMERAS, both(), MARKS) == (0,) * len(CAMERAS)
    assert people_at(OWN[MARKS.mirrored], CAMERAS, both(), MARKS) == (1,) * len(CAMERAS)
    nobody = Keypoints(MARKS.names, np.zeros((0, len(MARKS.names), 2)), np.zeros((0, len(MARKS.names))), np.zeros(0, np.int64), "made")
    assert people_at(OWN, CAMERAS, [nobody, None, *both()[2:]], MARKS) == (None, None, 1, 1, 1)


def of(*bodies: np.ndarray) -> list[Keypoints]:
    """Persons at the landmarks of bodies (K, 3), by camera, in another order in every second one."""
    every = [detected(np.random.default_rng(0), CAMERAS, np.zeros(1), MARKS.names, each[None], EXACT)[0] for each in bodies]
    found = []
    for n, seen in enumerate(zip(*every)):
        order = seen[::-1] if n % 2 else seen
        xy, sure = (np.concatenate([getattr(each, what) for each in order]) for what in ("xy", "confidence"))
        found.append(Keypoints(MARKS.names, xy, sure, np.arange(len(bodies)), "made"))
    return found


def test_people_who_cross_do_not_have_the_same_person():
    """Both predicted bodies are nearest to the same person: one of them is a step behind."""
    along = np.array([1.0, 0, 0])
    keypoints = of(OWN, OWN + 0.3 * along)
    bodies = [OWN + 0.2 * along, OWN + 0.5 * along]
    assert [people_at(each, CAMERAS, keypoints, MARKS) for each in bodies] == [(1, 0, 1, 0, 1)] * 2
    assert people_of(bodies, CAMERAS, keypoints, MARKS) == [(0, 1, 0, 1, 0), (1, 0, 1, 0, 1)]
    assert people_of(bodies[::-1], CAMERAS, keypoints, MARKS) == [(1, 0, 1, 0, 1), (0, 1, 0, 1, 0)]
    assert people_of([bodies[0][MARKS.mirrored], bodies[1]], CAMERAS, keypoints, MARKS)[0] == (0, 1, 0, 1, 0)


def test_a_body_without_a_person_near_it_has_none():
    assert people_of([OWN, OTHER], CAMERAS, of(OTHER), MARKS) == [(None,) * 5, (0,) * 5]
    assert people_of([OWN], CAMERAS, of(OTHER), MARKS) == [(None, None, None, 0, None)]  # one camera sees one behind the other
    nobody = both()[0].only(None)
    assert people_of([OWN, OTHER], CAMERAS, [nobody, None, *both()[2:]], MARKS) == [(None, None, 1, 1, 1), (None, None, 0, 0, 0)]
    assert people_of([OWN], CAMERAS, [nobody] * 5, MARKS) == [(None,) * 5]


def test_people_are_groups_of_persons_whose_rays_meet():
    third = OWN + np.array([-0.6, 0.4, 0.0])
    keypoints = of(OWN, OTHER, third)
    groups = people_between(CAMERAS, keypoints, MARKS)
    assert sorted(people for people, _ in groups) == [(0, 2, 0, 2, 0), (1, 1, 1, 1, 1), (2, 0, 2, 0, 2)]
    for people, places in groups:
        np.testing.assert_allclose(places, [OWN, OTHER, third][people[0]], atol=1e-3)
    unseen = people_between(CAMERAS, [keypoints[0].without([1]), keypoints[1].only(2), *keypoints[2:]], MARKS)
    assert {people for people, _ in unseen} == {(0, 0, 0, 2, 0), (None, None, 1, 1, 1), (2, None, 2, 0, 2)}


def test_one_camera_alone_and_nobody_are_no_group():
    keypoints = of(OWN, OTHER)
    assert people_between(CAMERAS, [keypoints[0], *[None] * 4], MARKS) == []
    assert people_between(CAMERAS, [keypoints[0].only(0), keypoints[1].only(0), *[None] * 3], MARKS) == []  # two people, one each
    assert people_between(CAMERAS, [each.only(None) for each in keypoints], MARKS) == []


def test_without_silhouettes_the_person_is_one_whose_rays_meet_in_all_cameras():
    keypoints, order = both(), [1, 0]
    keypoints[2] = Keypoints(MARKS.names, keypoints[2].xy[order], keypoints[2].confidence[order], np.array([8, 7]), "made")
    people, middle = person_between(CAMERAS, keypoints, MARKS)
    assert people in ((0, 0, 1, 0, 0), (1, 1, 0, 1, 1))
    assert np.abs(middle - (OTHER if people[0] == 0 else OWN).mean(0)).max() < 1e-3
    small = 100 + 0.5 * keypoints[0].xy[:1]
    both_sizes = Keypoints(MARKS.names, np.concatenate([small, keypoints[0].xy[:1]]), keypoints[0].confidence, np.array([1, 2]), "made")
    assert person_between(CAMERAS, [both_sizes, *[None] * 4], MARKS)[0] == (1, *[None] * 4)


def test_the_height_follows_from_the_bones_between_landmarks():
    frames = [detected(np.random.default_rng(0), CAMERAS, np.zeros(1), MARKS.names, OWN[None], EXACT)[0]] * 3
    found = height_by_bones(CAMERAS, frames, MARKS)
    assert found == pytest.approx(1.75, abs=0.03)
    assert height_by_bones(CAMERAS[:1], [each[:1] for each in frames], MARKS) is None


def test_points_outside_the_picture_and_missing_ones_are_no_sights():
    keypoints = both(1.0)
    xy, confidence = keypoints[0].xy.copy(), keypoints[0].confidence.copy()
    xy[1, 0], xy[1, 1], confidence[1, 2] = (-30, 5), np.nan, 0
    keypoints[0] = Keypoints(MARKS.names, xy, confidence, keypoints[0].person, "made")
    found = sights_of(CAMERAS, keypoints, (1, None, 1, 1, 1), MARKS, OWN.mean(0))
    assert found.landmarks[found.cameras == 0].tolist() == list(range(3, len(MARKS.names)))
    assert not (found.cameras == 1).any()
    assert found.outlying.max() < OUTLYING + 1e-9
    assert np.abs(np.einsum("mij,mj->mi", found.across, found.rays)).max() < 1e-12


def test_a_detector_that_is_less_confident_has_wider_errors_and_more_outliers():
    sure, unsure = (sights_of(CAMERAS, both(confidence), (1,) * 5, MARKS, OWN.mean(0)) for confidence in (1.0, 0.5))
    assert (unsure.squares > sure.squares).all()
    assert (unsure.outlying > sure.outlying).all()


def test_the_front_is_that_of_the_best_pose_by_the_best_that_faces_the_other_way():
    front = front_of(np.array([0.1, 3.0, 0.2, -2.8]), np.array([10.0, 30.0, 12.0, 25.0]))
    assert front is not None
    assert (front.heading, front.odds, front.is_certain) == (0.1, 15.0, True)
    same = front_of(np.array([0.1, 0.2]), np.array([1.0, 90.0]))
    assert same is not None
    assert not same.is_certain
    assert front_of(np.zeros(0), np.zeros(0)) is None
