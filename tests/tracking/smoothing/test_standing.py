"""What stands neither slides nor sinks: the terms of the path's cost, against finite differences, and their effect."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.evaluation.standing import slide
from shadowpuppet.motion.motion import Motion
from shadowpuppet.tracking.smoothing.fixed_interval import differences
from shadowpuppet.tracking.smoothing.pose_path import PathCost
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother
from shadowpuppet.tracking.smoothing.standing import standing

TIMES = np.arange(60) / 30


def test_gradient_and_curvature_are_those_of_the_cost(rng):
    T, R = 6, 2
    cost = PathCost(rng.standard_normal((T, R)), rng.random((T, R)), differences(TIMES[:T]) / 1e4, 1 + rng.random((T - 3, R)),
                    rng.random((T - 1, R)))  # fmt: skip
    at, step = rng.standard_normal((T, R)), 1e-5
    downhill = cost.downhill(at)
    for t in range(T):
        move = np.zeros((T, R))
        move[t, 0] = step
        slope = (cost(at + move) - cost(at - move)) / (2 * step)
        np.testing.assert_allclose(-2 * downhill[t, 0], slope, rtol=1e-5, atol=1e-6)
        change = (cost.downhill(at - move) - cost.downhill(at + move)) / (2 * step)
        for apart in range(4):
            if t >= apart:
                np.testing.assert_allclose(cost.curvature(apart)[t - apart, 0], change[t - apart, 0], rtol=1e-5, atol=1e-6)


def test_only_soles_in_contact_are_held():
    markers = np.zeros((60, 3, 3))
    markers[:, 1, 2] = 0.5  # a heel in the air
    markers[:, 2] = 0.7  # no joint
    found = standing(TIMES, ("left_heel", "right_heel"), markers, 0.0)
    assert found is not None
    assert (found.still[:, 0] > 0).all()
    assert (found.still[:, 1:] == 0).all()
    assert (found.level[:, 0, 2] > 0).all()
    assert (found.level[..., :2] == 0).all()
    assert standing(TIMES, ("left_hand",), markers, 0.0) is None


def test_a_standing_person_who_is_tracked_unsteadily_stands_still(rng):
    body = make_body("anatomical", average_sizes("anatomical", 1.75))
    skeleton, names = body.skeleton, body.landmark_names
    poses = np.repeat(skeleton.clamp(np.zeros((1, len(skeleton.dofs)))), 60, 0)
    poses[:, :3] += np.cumsum(rng.normal(0, 0.004, (60, 3)), 0)  # the whole person drifts
    poses[:, 3:] += rng.normal(0, 0.02, (60, len(skeleton.dofs) - 3))
    poses = skeleton.clamp(poses)
    joints, unknown = body.points(poses), np.full(60, np.nan)
    motion = Motion(body_name="anatomical", dof_names=skeleton.dof_names, joint_names=names, times=TIMES, poses=poses,
                    pose_sd=np.full(poses.shape, 0.03), joints=joints, joint_sd=np.full(joints.shape, 0.02), cost=unknown, overlap=unknown,
                    status=np.full(60, "tracked"))  # fmt: skip
    found = MotionSmoother(skeleton, body.points)(motion).motion
    heel, all_ = names.index("left_heel"), np.ones((60, 1), bool)
    before, after = (slide(TIMES, each[:, heel : heel + 1], all_) for each in (joints, found.joints))
    assert after < 0.03 < 0.1 < before
