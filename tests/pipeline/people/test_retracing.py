"""People followed backwards through frames in which their front or sizes were not known yet."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame
from shadowpuppet.pipeline.people import retracing
from shadowpuppet.pipeline.people.retracing import Packed, Stretch, packed, retraced, stretches, with_final_bodies
from shadowpuppet.tracking.people.facing import Part
from shadowpuppet.tracking.people.identity import Exchange
from shadowpuppet.tracking.people.tracker import Share

SHORT, TALL = average_sizes("anatomical", 1.6), average_sizes("anatomical", 1.8)
BODY = make_body("anatomical", TALL)
TIMES = np.arange(10) / 10
HEADING = BODY.skeleton.dof_names.index("root_heading")


def motion(sizes=TALL, heading: float = 0.0, absent: tuple[int, ...] = ()) -> Motion:
    """Somebody who walks along x, facing somewhere."""
    body = make_body("anatomical", sizes)
    built = MotionBuilder(body.name, body.skeleton.dof_names, body.landmark_names)
    for n, time in enumerate(TIMES):
        pose = body.skeleton.pose(root_x=0.1 * n, root_z=0.95, root_heading=heading, left_knee_flexion=0.5)
        found = MotionFrame(time, "uncertain", pose, body.points(pose[None])[0], np.full(len(pose), 0.1),
                            np.full((len(body.landmark_names), 3), 0.01), 0.0, 0.7)  # fmt: skip
        built.append(MotionFrame(time, "absent") if n in absent else found)
    return built.build()


def group(*parts: Part, measured_at: float = -np.inf, exchanges=(), doubted=()):
    subject = SimpleNamespace(body=BODY, person=SimpleNamespace(sizes=TALL), tracker=SimpleNamespace(body=BODY, number=4))
    facing = SimpleNamespace(parts=list(parts), doubted=dict.fromkeys(doubted))
    member = SimpleNamespace(number=1, facing=facing, measured_at=measured_at, subject=subject, rng=None, share=None, observation=None)
    return SimpleNamespace(members=[member], exchanges=list(exchanges), hull=SimpleNamespace(points=lambda masks: None))


@pytest.mark.parametrize(("parts", "measured_at", "expected"), [
    ((Part(0.2, 0.6, True), Part(0.6, 0.8)), -np.inf, [(0.2, 0.8)]),
    ((Part(0.2),), -np.inf, []),
    ((Part(0.7, 0.9),), 0.5, [(0.0, 0.5), (0.7, 0.9)]),
    ((Part(0.3, 0.9),), 0.5, [(0.0, 0.9)]),
])
def test_what_became_known_later_is_followed_back(parts, measured_at, expected):
    found = stretches(group(*parts, measured_at=measured_at), {1: motion()})
    assert found == [Stretch(1, *each) for each in expected]


def test_through_parts_whose_front_stayed_unknown():
    parts = Part(0.0), Part(0.3), Part(0.6, 0.8)
    assert stretches(group(*parts, doubted=TIMES[2:8].tolist()), {1: motion()}) == [Stretch(1, 0.2, 0.8)]
    assert stretches(group(*parts, doubted=[*TIMES[:4].tolist(), *TIMES[6:8].tolist()]), {1: motion()}) == [Stretch(1, 0.6, 0.8)]


def test_not_through_an_exchange():
    known = Part(0.2, 0.6)
    assert stretches(group(known, exchanges=[Exchange(0.7, 0.9, 1, 2)]), {1: motion()})
    assert not stretches(group(known, exchanges=[Exchange(0.5, 0.9, 1, 2)]), {1: motion()})


def test_no_longer_than_some_seconds(monkeypatch):
    monkeypatch.setattr(retracing, "LONGEST", 0.3)
    assert stretches(group(Part(0.0, 0.8)), {1: motion()}) == [Stretch(1, 0.8 - 0.3, 0.8)]


def test_the_body_measured_later_is_fitted_to_the_frames_before():
    before = motion(SHORT)
    (found,) = with_final_bodies(group(measured_at=0.5), {1: before}).values()
    np.testing.assert_allclose(found.joints[:5], BODY.points(found.poses[:5]), atol=1e-9)
    np.testing.assert_array_equal(found.joints[5:], before.joints[5:])
    np.testing.assert_allclose(found.joints, before.joints, atol=0.12)


def test_masks_are_kept_as_they_are(rng):
    masks = [rng.random((7, 9)) > 0.5, None]
    (first, second) = packed(0.5, masks).masks()
    np.testing.assert_array_equal(first, masks[0])
    assert second is None


def followed(monkeypatch, fits, **values):
    """Followed back from the seventh frame, as the body facing +x, which fits as `fits` says; the motion faces -x."""
    def step(people, points, masks, beside):
        (number,), (person,) = people, people.values()
        state = person.state._replace(pose=person.state.pose + person.state.velocity, overlap=0.8, status="tracked")
        return {number: Share(state, None, [], None)}

    def frame(subject, time, state, observation, before):
        pose = state.pose
        return MotionFrame(time, "tracked", pose, BODY.points(pose[None])[0], np.zeros(len(pose)),
                           np.zeros((len(BODY.landmark_names), 3)), 0.0, state.overlap), None  # fmt: skip

    there = motion(**{"heading": np.pi} | values)
    poses = there.poses.copy()
    poses[6:, HEADING] = 0.0
    there = Motion(**{name: getattr(there, name) for name in there.__dataclass_fields__} | {"poses": poses})
    monkeypatch.setattr(retracing, "step", step)
    monkeypatch.setattr(retracing, "keep_front", lambda tracker, rng, before, share: share)
    monkeypatch.setattr(retracing, "motion_frame", frame)
    monkeypatch.setattr(retracing, "observed", lambda tracker, share: SimpleNamespace(overlap=lambda pose: fits(pose)))
    frames = [Packed(time, (None,), (None,)) for time in TIMES[1:]]
    return there, retraced(group(), {1: there}, [Stretch(1, 0.1, 0.6)], frames)[1]


def test_frames_are_replaced_by_those_followed_back(monkeypatch):
    there, found = followed(monkeypatch, lambda pose: 0.8)
    np.testing.assert_allclose(found.poses[1:6, HEADING], 0.0)
    np.testing.assert_allclose(found.poses[:, 0], there.poses[:, 0], atol=1e-9)  # the way they came
    np.testing.assert_array_equal(found.poses[[0, 6, 7]], there.poses[[0, 6, 7]])
    assert set(found.status[1:6]) == {"uncertain"}  # forwards and backwards do not agree
    assert set(found.status[6:]) == {"uncertain"}


def test_frames_that_agree_are_tracked(monkeypatch):
    _, found = followed(monkeypatch, lambda pose: 0.8, heading=0.0)
    assert found.status.tolist() == ["uncertain"] + ["tracked"] * 5 + ["uncertain"] * 4


def test_only_as_far_back_as_they_fit(monkeypatch):
    there, found = followed(monkeypatch, lambda pose: 0.8 if pose[0] > 0.35 or abs(pose[HEADING]) > 1 else 0.3)
    np.testing.assert_array_equal(found.poses[:4], there.poses[:4])
    np.testing.assert_allclose(found.poses[4:6, HEADING], 0.0)


def test_who_was_not_there_is_found(monkeypatch):
    _, found = followed(monkeypatch, lambda pose: 0.8, absent=(3, 4))
    assert set(found.status[1:6]) <= {"tracked", "uncertain"}
    assert found.known[3:5].all()
