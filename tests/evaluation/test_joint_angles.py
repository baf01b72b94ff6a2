"""Errors of joint angles: a joint that is turned further by an angle is off by that angle, and no other joint is."""

from __future__ import annotations

import numpy as np
import pytest
import runs

from shadowpuppet.evaluation.joint_angles import UNOBSERVABLE, dof_errors, turn_errors


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
        assert found == pytest.approx({"bias": np.degrees(turned.mean()), "mean": np.degrees(np.abs(turned).mean()), "rmse": off})


def test_a_component_of_a_rotation_vector_is_no_angle_and_heads_and_ankles_are_left_out():
    skeleton = runs.body_of("anatomical").skeleton
    pose = np.zeros((2, len(skeleton.dofs)))
    named = set(dof_errors(skeleton, pose, pose))
    assert named == {dof.name for dof in skeleton.dofs if dof.kind == "rotation" and not dof.joint.endswith(UNOBSERVABLE)}
    assert not any(name.startswith(("head", "left_ankle", "right_ankle")) for name in turn_errors(skeleton, pose, pose))
