"""Errors of joint angles: a joint that is turned further by an angle is off by that angle, and no other joint is."""

from __future__ import annotations

import numpy as np
import pytest
import runs
from scipy.spatial.transform import Rotation

from shadowpuppet.evaluation.joint_angles import UNOBSERVABLE, dof_errors, frame_aligned, turn_errors


@pytest.mark.parametrize("name", runs.BODIES)
def test_a_joint_that_is_turned_by_an_angle_is_off_by_it_alone(name, rng):
    body = runs.body_of(name)
    skeleton, ours = body.skeleton, runs.smooth_poses(body, 4, rng)
    seen = [joint.name for joint in skeleton.joints if not joint.name.endswith(UNOBSERVABLE)]
    for d, dof in enumerate(skeleton.dofs):
        if dof.kind != "rotation" or dof.joint not in seen:
            continue
        turned, theirs = np.radians(rng.uniform(-170, 170, len(ours))), ours.copy()
        theirs[:, d] -= turned
        off = np.degrees(np.sqrt(np.mean(turned**2)))
        expected = dict.fromkeys(seen, 0.0) | {dof.joint: off, "all": off / np.sqrt(len(seen))}
        assert turn_errors(skeleton, ours, theirs) == pytest.approx(expected, abs=1e-4)  # an arc cosine near zero
        found = dof_errors(skeleton, ours, theirs)[dof.name]
        assert found == pytest.approx({"bias": np.degrees(turned.mean()), "mean": np.degrees(np.abs(turned).mean()), "rmse": off,
                                       "aligned": np.degrees(turned.std())})


def test_a_component_of_a_rotation_vector_is_no_angle_and_heads_and_ankles_are_left_out():
    skeleton = runs.body_of("anatomical").skeleton
    pose = np.zeros((2, len(skeleton.dofs)))
    named = set(dof_errors(skeleton, pose, pose))
    assert named == {dof.name for dof in skeleton.dofs if dof.kind == "rotation" and not dof.joint.endswith(UNOBSERVABLE)}
    assert not any(name.startswith(("head", "left_ankle", "right_ankle")) for name in turn_errors(skeleton, pose, pose))


def test_frames_that_are_defined_otherwise_are_no_error_once_aligned(rng):
    """Each joint's rotations before a constant turn and after another one; what moves otherwise stays an error."""
    theirs = Rotation.from_rotvec(np.cumsum(rng.normal(0, 0.2, (60, 3)), 0)).as_matrix()
    above, below = Rotation.from_rotvec(rng.uniform(-0.6, 0.6, (2, 3))).as_matrix()
    np.testing.assert_allclose(frame_aligned(above @ theirs @ below, theirs), theirs, atol=1e-3)
    wobble = Rotation.from_rotvec(np.outer(np.tile([0.1, -0.1], 30), [1, 0, 0])).as_matrix()
    left = Rotation.from_matrix(frame_aligned(above @ theirs @ wobble @ below, theirs).swapaxes(1, 2) @ theirs).magnitude()
    assert np.sqrt((left**2).mean()) == pytest.approx(0.1, rel=0.1)


def test_aligned_errors_are_never_larger_and_lack_a_constant_turn(rng):
    body = runs.body_of("anatomical")
    ours = runs.smooth_poses(body, 50, rng)
    theirs = ours.copy()
    knee = body.skeleton.dof_names.index("left_knee_flexion")
    theirs[:, knee] += 0.2
    raw, aligned = (turn_errors(body.skeleton, ours, theirs, way) for way in (False, True))
    assert raw["left_knee"] == pytest.approx(np.degrees(0.2))
    assert aligned["left_knee"] == pytest.approx(0, abs=1e-3)
    assert dof_errors(body.skeleton, ours, theirs)["left_knee_flexion"]["aligned"] == pytest.approx(0, abs=1e-6)
    theirs = ours + rng.normal(0, 0.1, ours.shape)
    raw, aligned = (turn_errors(body.skeleton, ours, theirs, way) for way in (False, True))
    assert all(aligned[name] <= raw[name] + 1e-6 for name in raw)
