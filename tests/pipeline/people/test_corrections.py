"""Motions with what became known later: fronts, sizes, and frames of two people who were exchanged."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.people.corrections import given_back, put_right, with_frames
from shadowpuppet.pipeline.people.state import Measured, PeopleState, PersonState
from shadowpuppet.tracking.people.front import Front
from shadowpuppet.tracking.people.identity import Exchange

SHORT, TALL = average_sizes("anatomical", 1.6), average_sizes("anatomical", 1.8)
BODY = make_body("anatomical", TALL)
PEOPLE = {n: SimpleNamespace(body=make_body("anatomical", sizes), person=SimpleNamespace(sizes=sizes))
          for n, sizes in enumerate((TALL, SHORT), 1)}  # fmt: skip
TIMES = np.arange(10) / 10


def frames(sizes=TALL, heading: float = 0.0, status: str = "uncertain") -> list[MotionFrame]:
    """A person who walks along x, facing somewhere."""
    body, found = make_body("anatomical", sizes), []
    for n, time in enumerate(TIMES):
        pose = body.skeleton.pose(root_x=0.1 * n, root_z=0.95, root_heading=heading, left_knee_flexion=0.5)
        found.append(MotionFrame(time, status, pose, body.points(pose[None])[0], np.full(len(pose), 0.1),
                                 np.full((len(body.landmark_names), 3), 0.01), 0.0, 0.7))  # fmt: skip
    return found


def motion(made: list[MotionFrame]) -> Motion:
    built = MotionBuilder(BODY.name, BODY.skeleton.dof_names, BODY.landmark_names)
    for frame in made:
        built.append(frame)
    return built.build()


def righted(before: Motion, **more) -> Motion:
    people = PeopleState((PersonState(1, Measured(TALL.to_array(), 1.8, "", {}, True), 1.8, np.zeros(2), **more),))
    return put_right(people, {1: before}, lambda measured: PEOPLE[1])[1]


def test_frames_whose_front_was_decided_later_are_replaced():
    before, other = motion(frames()), frames(heading=np.pi, status="tracked")
    found = righted(before, front=Front(decided=(other[3], other[2], other[3])))
    np.testing.assert_array_equal(found.poses[2:4], motion(other).poses[2:4])
    np.testing.assert_array_equal(found.joints[2:4], motion(other).joints[2:4])
    rest = [0, 1, *range(4, 10)]
    np.testing.assert_array_equal(found.poses[rest], before.poses[rest])
    assert found.status.tolist() == ["uncertain"] * 2 + ["tracked"] * 2 + ["uncertain"] * 6


def test_a_person_turned_round_who_was_lost_has_no_pose():
    found = with_frames(motion(frames()), [MotionFrame(TIMES[1], "lost")])
    assert found.status[1] == "lost"
    assert np.isnan(found.poses[1]).all()


def test_the_body_measured_later_is_fitted_to_the_frames_before():
    before = motion(frames(SHORT))
    found = righted(before, measured_at=0.5)
    np.testing.assert_allclose(found.joints[:5], BODY.points(found.poses[:5]), atol=1e-9)
    np.testing.assert_array_equal(found.joints[5:], before.joints[5:])
    np.testing.assert_allclose(found.joints, before.joints, atol=0.12)


def test_without_corrections_all_stays():
    before = motion(frames())
    assert righted(before) is before


def walked(number: int, begin: int, at: dict[int, int], absent: int | None = None) -> Motion:
    """A person who walks in lane `number`, or from one frame on in another's; the table begins in frame `begin`."""
    body = PEOPLE[number].body
    built = MotionBuilder(body.name, body.skeleton.dof_names, body.landmark_names)
    for n, time in list(enumerate(TIMES))[begin:]:
        if n == absent:
            built.append(MotionFrame(time, "absent"))
            continue
        other = PEOPLE[at.get(n, number)].body
        pose = other.skeleton.pose(root_x=0.1 * n, root_y=float(at.get(n, number)), root_z=0.95, left_knee_flexion=0.5)
        sd = np.full((len(body.landmark_names), 3), 0.01 * at.get(n, number))
        built.append(MotionFrame(time, "tracked", pose, other.points(pose[None])[0], np.full(len(pose), 0.1), sd, 0.0, 0.9))
    return built.build()


def lanes(found: Motion) -> list[float]:
    return found.joints[:, found.joint_names.index("pelvis"), 1].round(1).tolist()


def test_frames_of_an_exchange_are_given_back():
    crossed = dict.fromkeys(range(4, 7), 2), dict.fromkeys(range(4, 7), 1)
    before = {1: walked(1, 0, crossed[0], absent=5), 2: walked(2, 2, crossed[1])}
    found = given_back(before, [Exchange(0.4, 0.7, 1, 2)], PEOPLE)
    assert lanes(found[1]) == [1.0] * 10
    assert np.isnan(lanes(found[2])[3])
    assert np.delete(lanes(found[2]), 3).tolist() == [2.0] * 7
    assert found[1].status.tolist() == ["tracked"] * 4 + ["uncertain"] * 3 + ["tracked"] * 3
    assert found[2].status.tolist() == ["tracked"] * 2 + ["uncertain", "absent", "uncertain"] + ["tracked"] * 3
    assert (found[1].joint_sd[:, 0, 0] == 0.01).all()
    for number, one in found.items():
        known = np.isfinite(one.poses[:, 0])
        np.testing.assert_allclose(PEOPLE[number].body.points(one.poses[known]), one.joints[known], atol=1e-9)  # each with their own sizes


def test_without_an_exchange_all_stays():
    before = {1: walked(1, 0, {}), 2: walked(2, 0, {})}
    assert given_back(before, [], PEOPLE) == before
    assert given_back(before, [Exchange(5.0, 6.0, 1, 2)], PEOPLE) == before
