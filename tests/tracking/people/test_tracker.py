"""People followed among others: whose bodies are known, and which way they face."""

from __future__ import annotations

from dataclasses import replace

import actor
import numpy as np
import pytest

from benchmarks.detector import EXACT, detected_together
from shadowpuppet.camera.bits import count, pack
from shadowpuppet.camera.mask import Seen
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.people import tracker as module
from shadowpuppet.tracking.people.evidence import draw_person, other_keypoints
from shadowpuppet.tracking.people.figures import Figure, find_people
from shadowpuppet.tracking.people.floor import Floor
from shadowpuppet.tracking.people.front import Front, face
from shadowpuppet.tracking.people.tracker import Person, at_pose, start, step, tells_front, turn_round

POSE = actor.stance(actor.body().skeleton, 0.3, 0.2)
HEADING = 3


def person() -> MultiviewTracker:
    return MultiviewTracker(actor.body(), actor.cameras(), MultiviewSettings(particles=8))


def at(tracker: MultiviewTracker, pose, overlap: float = 0.8) -> MultiviewState:
    return at_pose(tracker, MultiviewState(pose, 0 * pose, None, 0.0, overlap, "tracked"), pose)


@pytest.mark.parametrize(("overlap", "other", "tells"), [
    (0.87, 0.83, True), (0.83, 0.87, True), (0.87, 0.86, False), (0.6, 0.71, True), (0.74, 0.77, False), (0.8, np.nan, False)])
def test_a_front_is_told_by_bodies_that_fit_well_or_very_differently(overlap, other, tells):
    assert tells_front(overlap, other) == tells


def test_a_body_beside_takes_its_points(rng):
    """What another's known body explains is no evidence; where it is far it takes nothing."""
    tracker, masks = person(), actor.masks(actor.body(), POSE)
    points = actor.hull().points(masks)
    body = draw_person(tracker, POSE)
    away = body._replace(bits=tuple(map(np.zeros_like, body.bits)), centres=body.centres + np.array([5.0, 0, 0]))
    alone, beside = (step({1: Person(tracker, np.random.default_rng(0), at(tracker, POSE))}, points, masks, others)[1]
                     for others in ({}, {2: away}))  # fmt: skip
    assert len(beside.points.points) == len(alone.points.points) > 0.9 * len(points.points)
    np.testing.assert_array_equal(beside.state.pose, alone.state.pose)
    wider = body._replace(radii=body.radii + 0.05)
    share = step({1: Person(tracker, rng, at(tracker, POSE))}, points, masks, {2: wider})[1]
    assert len(share.points.points) < 0.1 * len(alone.points.points)
    assert all(count(ignored & pack(mask[::2, ::2])) > 0.9 * mask[::2, ::2].sum() for ignored, mask in zip(share.ignored, masks))


def test_the_other_way_is_searched_for(rng):
    tracker, masks = person(), actor.masks(actor.body(), POSE)
    points = actor.hull().points(masks)
    wrong = POSE.copy()
    wrong[HEADING] += np.pi  # with the sides of the right way
    share = step({1: Person(tracker, rng, at(tracker, POSE))}, points, masks)[1]
    found = turn_round(tracker, rng, share._replace(state=at(tracker, wrong)))
    assert np.cos(found.pose[HEADING] - POSE[HEADING]) > 0.9
    assert actor.apart(actor.body(), found.pose, POSE)[0] < 0.04
    assert found.overlap > 0.85


def test_a_body_that_comes_round_again_does_not_face_the_other_way(monkeypatch, rng):
    tracker, masks = person(), actor.masks(actor.body(), POSE)
    share = step({1: Person(tracker, rng, at(tracker, POSE))}, actor.hull().points(masks), masks)[1]
    monkeypatch.setattr(module, "settle", lambda state, cycle: share.state)
    monkeypatch.setattr(MultiviewTracker, "search", lambda self, rng, observation, facing: share.state)
    found = turn_round(tracker, rng, share)
    assert found.status == "lost"
    assert found.overlap == 0


def keypoints_of(*poses):
    """What a detector finds in each camera of people in poses (D,), in any order."""
    marks, skeleton = landmarks_of(actor.body()), actor.body().skeleton
    people = [skeleton.points(pose[None], marks.joints, marks.places) for pose in poses]
    return detected_together(np.random.default_rng(3), actor.cameras(), np.zeros(1), marks.names, people, EXACT)[0]


def together(*poses):
    """Surface points and masks of people in poses (D,)."""
    masks = [np.logical_or.reduce(each) for each in zip(*(actor.masks(actor.body(), pose) for pose in poses))] or [None] * actor.CAMERAS
    return actor.hull().points(masks), masks


def test_each_person_has_the_keypoints_that_are_theirs():
    other = actor.stance(actor.body().skeleton, -0.2, 2.0, (0.2, 0.8))
    points, masks = together(POSE, other)
    keypoints, tracker = keypoints_of(POSE, other), person()
    people = {n: Person(tracker, np.random.default_rng(n), at(tracker, pose)) for n, pose in ((1, POSE), (2, other))}
    shares = step(people, points, masks, keypoints=keypoints)
    for share, pose in zip(shares.values(), (POSE, other)):
        for own, alone in zip(share.keypoints, keypoints_of(pose)):
            shown = np.nan_to_num(own.confidence) > 0
            np.testing.assert_allclose(own.xy[shown], alone.xy[shown])
            assert len(own.person) == 1
        assert share.state.support > 0.95


def test_a_lost_person_has_the_keypoints_that_are_left(rng):
    tracker = person()
    there, lost = at(tracker, POSE), at(tracker, POSE)._replace(status="lost")
    people = {n: Person(tracker, rng, state) for n, state in ((1, lost), (2, there))}
    aside = actor.stance(actor.body().skeleton, 0.3, 0.2, (0.0, 0.3))
    for keypoints, number in ((keypoints_of(POSE), 0), (keypoints_of(POSE, aside), 1)):
        shares = step(people, *together(), keypoints=keypoints)
        assert [len(each.person) for each in shares[2].keypoints] == [1] * actor.CAMERAS
        assert {len(each.person) for each in shares[1].keypoints} == {number}
    assert shares[1].state.status == "tracked"


@pytest.mark.parametrize("turned", [0, np.pi])
def test_keypoints_tell_the_first_front(rng, turned):
    pose, tracker = actor.stance(actor.body().skeleton, 0.0, 0.2 + turned), person()
    found = start(tracker, rng, Figure(np.zeros(2), 1.75), {}, *together(pose), keypoints_of(pose))
    assert found is not None
    assert found.is_shown
    assert np.cos(found.state.pose[HEADING] - pose[HEADING]) > 0.9
    assert found.state.support > 0.9


def test_a_body_that_faces_the_other_way_than_keypoints_is_turned_round(rng):
    wrong, tracker = POSE.copy(), person()
    wrong[HEADING] += np.pi
    share = step({1: Person(tracker, rng, at(tracker, POSE))}, *together(POSE), keypoints=keypoints_of(POSE))[1]
    front, state = face(Front(0.0, False), tracker, rng, share._replace(state=at(tracker, wrong)), 0.0)
    assert front.is_known
    assert np.cos(state.pose[HEADING] - POSE[HEADING]) > 0.9


def test_people_are_found_in_keypoints_where_there_are_no_silhouettes(rng):
    """Not the same person twice, nor one of another size than people's; and of people who are tracked nothing is known any more."""
    other = actor.stance(actor.body().skeleton, -0.2, 2.0, (0.2, 0.8))
    keypoints, tracker, nothing = keypoints_of(POSE, other, POSE), person(), [None] * actor.CAMERAS
    floor = Floor(actor.cameras(), 0.0, np.zeros((0, 2)), 0.0, np.zeros((0, 0, 0, 0), np.int32))
    figures = find_people(floor, Seen(tuple(nothing), keypoints=tuple(keypoints)))
    assert len(figures) == 2
    by_place = sorted(figures, key=lambda figure: figure.place[1])
    np.testing.assert_allclose([figure.place for figure in by_place], [(0, 0), (0.2, 0.8)], atol=0.1)
    np.testing.assert_allclose([figure.height for figure in figures], 1.75, atol=0.05)
    assert find_people(floor._replace(cameras=tuple(map(smaller, actor.cameras()))), Seen(tuple(nothing), keypoints=tuple(keypoints))) == []
    rest = other_keypoints(tracker, {1: draw_person(tracker, POSE)}, keypoints_of(POSE, other))
    (alone,) = find_people(floor, Seen(tuple(nothing), keypoints=rest))
    np.testing.assert_allclose(alone.place, (0.2, 0.8), atol=0.1)
    begun = start(tracker, rng, alone, {}, *together(), rest)
    assert begun is not None
    assert begun.is_shown
    assert actor.apart(actor.body(), begun.state.pose, other)[0] < 0.03
    share = step({1: Person(tracker, rng, begun.state)}, *together(), keypoints=rest)[1]
    assert share.state.status == "tracked"
    assert start(tracker, rng, alone, {}, *together(), [each if n == 0 else None for n, each in enumerate(rest)]) is None


def smaller(camera):
    """The camera in a world a fifth as large."""
    T = camera.T_camera_world.copy()
    T[:3, 3] /= 5
    return replace(camera, T_camera_world=T)
