"""Motions with what became known later: fronts and sizes."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.people.corrections import put_right, with_frames
from shadowpuppet.pipeline.people.state import Measured, PeopleState, PersonState
from shadowpuppet.tracking.people.front import Front

SHORT, TALL = average_sizes("anatomical", 1.6), average_sizes("anatomical", 1.8)
BODY = make_body("anatomical", TALL)
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
    subject = SimpleNamespace(body=BODY, person=SimpleNamespace(sizes=TALL))
    return put_right(people, {1: before}, lambda measured: subject)[1]


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
