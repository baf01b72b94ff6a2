"""Frames of two people who were exchanged are given back."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame
from shadowpuppet.tracking.people.exchanges import given_back
from shadowpuppet.tracking.people.identity import Exchange

TALL, SHORT = (average_sizes("anatomical", height) for height in (1.85, 1.6))
PEOPLE = {1: (make_body("anatomical", TALL), TALL), 2: (make_body("anatomical", SHORT), SHORT)}
TIMES = np.arange(10) / 10


def motion(number: int, begin: int, at: dict[int, int], absent: int | None = None) -> Motion:
    """A person who walks in lane `number`, or from one frame on in another's; the table begins in frame `begin`."""
    body = PEOPLE[number][0]
    built = MotionBuilder(body.name, body.skeleton.dof_names, body.landmark_names)
    for n, time in list(enumerate(TIMES))[begin:]:
        if n == absent:
            built.append(MotionFrame(time, "absent"))
            continue
        other = PEOPLE[at.get(n, number)][0]
        pose = other.skeleton.pose(root_x=0.1 * n, root_y=float(at.get(n, number)), root_z=0.95, left_knee_flexion=0.5)
        sd = np.full((len(body.landmark_names), 3), 0.01 * at.get(n, number))
        built.append(MotionFrame(time, "tracked", pose, other.points(pose[None])[0], np.full(len(pose), 0.1), sd, 0.0, 0.9))
    return built.build()


def lanes(found: Motion) -> list[float]:
    return found.joints[:, found.joint_names.index("pelvis"), 1].round(1).tolist()


def test_frames_of_an_exchange_are_given_back():
    crossed = dict.fromkeys(range(4, 7), 2), dict.fromkeys(range(4, 7), 1)
    before = {1: motion(1, 0, crossed[0], absent=5), 2: motion(2, 2, crossed[1])}
    found = given_back(before, [Exchange(0.4, 0.7, 1, 2)], PEOPLE)
    assert lanes(found[1]) == [1.0] * 10
    assert np.isnan(lanes(found[2])[3])
    assert np.delete(lanes(found[2]), 3).tolist() == [2.0] * 7
    assert found[1].status.tolist() == ["tracked"] * 4 + ["uncertain"] * 3 + ["tracked"] * 3
    assert found[2].status.tolist() == ["tracked"] * 2 + ["uncertain", "absent", "uncertain"] + ["tracked"] * 3
    assert (found[1].joint_sd[:, 0, 0] == 0.01).all()
    for number, one in found.items():
        known = np.isfinite(one.poses[:, 0])
        np.testing.assert_allclose(PEOPLE[number][0].points(one.poses[known]), one.joints[known], atol=1e-9)  # each with their own sizes


def test_without_an_exchange_all_stays():
    before = {1: motion(1, 0, {}), 2: motion(2, 0, {})}
    assert given_back(before, [], PEOPLE) == before
    assert given_back(before, [Exchange(5.0, 6.0, 1, 2)], PEOPLE) == before
