"""One pose's joints and screws: rotation vectors and their derivative near no turn and near half turns, and screws as derivatives."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import random_poses
from scans import make_body as random_tree
from scans import some_pose
from scipy.spatial.transform import Rotation

from benchmarks.speed import naive_multi as naive
from shadowpuppet.body.forward_kinematics import ROTATION, TRANSLATION, VECTOR
from shadowpuppet.body.jacobian import SMALL_ANGLE, exponential, make_chain, place_one
from shadowpuppet.body.models import WHOLE, average_sizes, make_body

pytestmark = pytest.mark.kernels
BODIES = {"tree": random_tree(), **{name: make_body(name, average_sizes(name, 1.75)) for name in WHOLE}}
ANGLES = (0.0, 1e-12, 1e-6, 0.99 * SMALL_ANGLE, 1.01 * SMALL_ANGLE, 1e-3, 0.5, 2.0, np.pi - 1e-6, np.pi, np.pi + 1e-6, 5.0,
          2 * np.pi - 1e-3)


def turned(v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    R, J = np.zeros((2, 3, 3))
    exponential(*v, R, J)
    return R, J


def placed(skeleton, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Transforms (J, 3, 4) and screws (D, 6)."""
    T, screws = np.zeros((len(skeleton.joints), 3, 4)), np.zeros((len(pose), 6))
    place_one(pose, make_chain(skeleton), T, screws, np.zeros((3, 3, 3)))
    return T, screws


def poses_of(body, rng: np.random.Generator, number: int) -> np.ndarray:
    """All over the limits, where there are some."""
    if body is BODIES["tree"]:
        return np.stack([some_pose(body, rng) for _ in range(number)])
    return random_poses(rng, body.skeleton, number)


# Rotation vectors -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("angle", ANGLES)
def test_rotation_vectors_turn_as_they_do_elsewhere_and_so_do_their_neighbours(angle, rng):
    for axis in (*np.eye(3), *rng.normal(size=(4, 3))):
        v = angle * axis / np.linalg.norm(axis)
        R, J = turned(v)
        np.testing.assert_allclose(R, Rotation.from_rotvec(v).as_matrix(), atol=1e-9)
        step = 1e-6
        for i, direction in enumerate(np.eye(3)):  # exp(v + d) = exp(J d) exp(v)
            ahead, behind = (Rotation.from_rotvec(v + sign * step * direction) for sign in (1, -1))
            np.testing.assert_allclose((ahead * behind.inv()).as_rotvec() / (2 * step), J[:, i], atol=1e-7)


@given(v=st.tuples(*[st.floats(-8, 8)] * 3))
@settings(max_examples=60, deadline=None)
def test_turns_are_turns_and_undone_by_their_opposite(v):
    R, J = turned(np.array(v))
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-9)
    assert np.linalg.det(R) == pytest.approx(1)
    np.testing.assert_allclose(turned(-np.array(v))[0], R.T, atol=1e-12)
    np.testing.assert_allclose(J @ np.array(v), v, atol=1e-8)  # a turn about the same axis adds up
    np.testing.assert_allclose(R @ turned(-np.array(v))[1], J, atol=1e-9)  # R times the right Jacobian is the left one
    np.testing.assert_allclose(J, naive.left_jacobian(np.array(v)), atol=1e-7)


# Joints and screws ----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", BODIES)
def test_joints_stand_where_the_skeleton_says(name, rng):
    skeleton = BODIES[name].skeleton
    for pose in poses_of(BODIES[name], rng, 6):
        np.testing.assert_allclose(placed(skeleton, pose)[0], skeleton.forward(pose[None])[0], atol=1e-9)


@pytest.mark.parametrize("name", BODIES)
def test_screws_are_the_derivatives_of_points(name, rng):
    """A point x that hangs on it moves by omega x x + (c x omega) for each unit of a turn; by the axis for each of a shift."""
    skeleton, step = BODIES[name].skeleton, 1e-6
    chain = make_chain(skeleton)
    moved = naive._moved(skeleton)
    places = rng.normal(0, 0.3, (len(skeleton.joints), 3))
    pose = poses_of(BODIES[name], rng, 1)[0]

    def points(pose):
        T = skeleton.forward(pose[None])[0]
        return (T[:, :, :3] @ places[:, :, None])[..., 0] + T[:, :, 3]

    screws = placed(skeleton, pose)[1]
    for d, screw in enumerate(screws):
        nudge = step * np.eye(len(pose))[d]
        found = (points(pose + nudge) - points(pose - nudge)) / (2 * step)
        wanted = np.cross(screw[:3], points(pose)) + screw[3:] if chain.kinds[d] != TRANSLATION else np.tile(screw[3:], (len(places), 1))
        np.testing.assert_allclose(found, np.where(moved[d][:, None], wanted, 0), atol=1e-7, err_msg=skeleton.dof_names[d])
        assert chain.kinds[d] != TRANSLATION or not screw[:3].any()


@pytest.mark.parametrize("name", BODIES)
def test_screws_are_the_motions_of_the_plain_version(name, rng):
    skeleton = BODIES[name].skeleton
    pose = poses_of(BODIES[name], rng, 1)[0]
    screws, motions = placed(skeleton, pose)[1], naive.place(skeleton, pose)[1]
    shifts = motions.shifts[:, None]
    np.testing.assert_allclose(screws[:, :3], np.where(shifts, 0, motions.axes), atol=1e-9)
    np.testing.assert_allclose(screws[:, 3:], np.where(shifts, motions.axes, np.cross(motions.centres, motions.axes)), atol=1e-9)


@pytest.mark.parametrize("name", BODIES)
def test_a_chain_is_the_skeleton_in_arrays(name):
    skeleton = BODIES[name].skeleton
    chain = make_chain(skeleton)
    kinds = {TRANSLATION: "translation", ROTATION: "rotation", VECTOR: "vector"}
    assert [kinds[kind] for kind in chain.kinds] == [dof.kind for dof in skeleton.dofs]
    assert [skeleton.joint_names[owner] for owner in chain.owners] == [dof.joint for dof in skeleton.dofs]
    assert [("-" if sign < 0 else "") + "xyz"[axis] for axis, sign in zip(chain.axes, chain.signs)] == [dof.axis for dof in skeleton.dofs]
    np.testing.assert_array_equal([chain.low, chain.high], skeleton.limits)
    for j, joint in enumerate(skeleton.joints):
        assert (chain.parents[j] == -1) if joint.parent is None else (skeleton.joint_names[chain.parents[j]] == joint.parent)
        np.testing.assert_array_equal(chain.offsets[j], joint.offset)
        assert all(chain.owners[d] == j for d in range(chain.first[j], chain.first[j + 1]))
    assert chain.first[-1] == len(skeleton.dofs)
