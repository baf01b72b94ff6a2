"""Joints to poses: known poses and sizes come back, whatever is missing or wrong; what is no person's motion is said."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.body.models import WHOLE, average_sizes, make_body
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.geometry import Array, euler_angles, rotation_about
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.ik_initial_guess import _limb
from shadowpuppet.motion.inverse_kinematics import (
    SMOOTH_PULL,
    TRUNK_SMOOTH_PULL,
    _at_limits,
    _Equations,
    _Problem,
    _solve_chain,
    _solve_step,
    fit_poses,
)
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.plausibility import NEEDED_JOINTS
from shadowpuppet.motion.prior.training import mirrored
from shadowpuppet.synthetic.person.mannequin import JOINTS

LIMBS = [f"{side}_{name}" for side in ("left", "right") for name in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle")]
SOMEONE = {"upper_arm_length": 0.27, "forearm_length": 0.25, "thigh_length": 0.41, "shank_length": 0.39, "hip_distance": 0.19,
           "shoulder_distance": 0.32}  # fmt: skip


def person(name: str):
    return average_sizes(name, 1.68).with_values(**SOMEONE)


def motion(name: str, frames: int = 40, seed: int = 0, rate: float = 30.0) -> tuple[Array, JointTable]:
    """A person of `SOMEONE`'s bones who walks about and moves everything slowly, and the joints."""
    rng, body = np.random.default_rng(seed), make_body(name, person(name))
    t = np.arange(frames) / rate
    poses = np.zeros((frames, len(body.skeleton.dofs)))
    for d, dof in enumerate(body.skeleton.dofs):
        wide = 0.5 * min(dof.spread[1], 0.8) if dof.kind != "translation" else 0.0
        wave = np.sin(2 * np.pi * rng.uniform(0.3, 0.8) * t + rng.uniform(0, 6))
        poses[:, d] = dof.rest + wide * wave
        if dof.name.endswith(("elbow_flexion", "knee_flexion")):
            poses[:, d] = 0.7 + 0.5 * wave
        if dof.name.startswith("head"):
            poses[:, d] *= not dof.name.endswith(("_z", "_twist"))
        if "ankle" in dof.name:
            poses[:, d] = 0.0
    poses[:, :4] = np.stack([0.8 * t, 0.1 * t, 0.9 + 0 * t, 2.5 * t], 1)
    poses = body.skeleton.clamp(poses)
    return poses, JointTable(t, JOINTS, body.points(poses, names=JOINTS))


def with_gaps(table: JointTable, frames: slice | list[int], *names: str) -> JointTable:
    positions = table.positions.copy()
    columns = [table.names.index(name) for name in names or table.names]
    positions[np.arange(len(table.times))[frames][:, None], columns] = np.nan
    return JointTable(table.times, table.names, positions)


# What is known comes back ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WHOLE)
def test_poses_and_bones_come_back_from_their_joints(name):
    poses, table = motion(name)
    fitted = fit_poses(table, name)
    assert fitted.residual < 2e-3
    assert fitted.by_frame.max() < 4e-3
    assert set(fitted.by_joint) == set(JOINTS)
    for bone, length in SOMEONE.items():
        assert getattr(fitted.sizes, bone) == pytest.approx(length, abs=4e-3), bone
    body = fitted.body
    off = np.abs(fitted.poses - poses)
    shown = [not dof.name.startswith(("chest", "head", "root_bow")) and not dof.name.endswith("z") for dof in body.skeleton.dofs]
    assert np.degrees(np.median(off[:, shown], axis=0)).max() < 4
    np.testing.assert_allclose(body.points(fitted.poses, names=fitted.joints.names), fitted.joints.positions)
    off = fitted.joints.positions - table.select(fitted.joints.names).positions
    np.testing.assert_allclose(np.linalg.norm(off, axis=2), fitted.distances)
    assert (body.skeleton.clamp(fitted.poses) == fitted.poses).all()


@pytest.mark.parametrize("name", WHOLE)
def test_with_the_true_sizes_joints_are_met_closely(name):
    poses, table = motion(name, 25, seed=3)
    fitted = fit_poses(table, name, sizes=person(name))
    assert fitted.sizes == person(name)
    assert fitted.residual < 6e-4
    np.testing.assert_allclose(np.degrees(fitted.poses - poses)[:, 3], 0, atol=1.5)  # the heading


@pytest.mark.parametrize("name", WHOLE)
def test_a_person_who_stands_elsewhere_and_faces_elsewhere_has_the_same_angles(name):
    _, table = motion(name, 12)
    R = rotation_about([0, 0, 1], 2.1)
    moved = JointTable(table.times, table.names, table.positions @ R.T + [3.0, -1.0, 0.1])
    one, other = fit_poses(table, name).poses, fit_poses(moved, name).poses
    turned = (other[:, 3] - one[:, 3]) % (2 * np.pi)
    np.testing.assert_allclose(turned, 2.1, atol=1e-3)
    np.testing.assert_allclose(other[:, 4:], one[:, 4:], atol=2e-3)


@pytest.mark.parametrize("name", WHOLE)
def test_a_mirrored_motion_has_the_mirrored_angles(name):
    _, table = motion(name, 12, seed=5)
    a, b = fit_poses(table, name), fit_poses(mirrored(table), name)
    np.testing.assert_allclose(a.sizes.to_array(), b.sizes.to_array(), atol=1e-4)
    names = a.body.skeleton.dof_names
    for left in (n for n in names if n.startswith("left") and n.endswith("flexion")):
        right = left.replace("left", "right")
        np.testing.assert_allclose(a.poses[:, names.index(left)], b.poses[:, names.index(right)], atol=1e-2)


@pytest.mark.parametrize("name", WHOLE)
def test_angles_do_not_jump_in_turns_nor_with_arms_overhead(name):
    body = make_body(name, person(name))
    t = np.linspace(0, 1, 60)
    arms = {"anatomical": {"left_shoulder_y": -3.2 * t, "right_shoulder_x": -3.3 * t},
            "cylinders": {"left_shoulder_flexion": 3.2 * t, "right_shoulder_flexion": 3.3 * t}}[name]  # fmt: skip
    poses = np.zeros((60, len(body.skeleton.dofs)))
    for dof, values in {"root_heading": 13 * t, "root_z": 0.9 + 0 * t, **arms}.items():
        poses[:, body.skeleton.dof_names.index(dof)] = values
    fitted = fit_poses(JointTable(2 * t, JOINTS, body.points(poses, names=JOINTS)), name)
    assert fitted.residual < 2e-3
    assert np.abs(np.diff(fitted.poses, axis=0)).max() < 0.3
    assert np.ptp(fitted.poses[:, 3]) == pytest.approx(13, abs=0.05)


def test_a_short_trunk_bends_forward_not_backward():
    body, t = make_body("anatomical", person("anatomical")), np.linspace(0, 1, 30)
    poses = np.zeros((30, 32))
    for dof, values in {"root_bow": 0.4 + 0.3 * t, "chest_y": 0.4 + 0.4 * t, "root_z": 0.9 + 0 * t}.items():
        poses[:, body.skeleton.dof_names.index(dof)] = values
    fitted = fit_poses(JointTable(t, JOINTS, body.points(poses, names=JOINTS)))
    assert fitted.residual < 4e-3
    assert np.abs(fitted.poses[:, body.skeleton.dof_names.index("chest_y")] - 0.4 - 0.4 * t).max() < 0.35


# What is missing or wrong ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("left_out", [
    ("pelvis",), ("left_hip", "right_hip"), ("neck", "head"), ("left_wrist", "right_wrist", "left_hand", "right_hand"),
    ("left_ankle", "right_ankle"), tuple(set(JOINTS) - set(NEEDED_JOINTS) - {"left_hip", "right_hip"}),
])  # fmt: skip
@pytest.mark.parametrize("name", WHOLE)
def test_any_joints_will_do_that_show_a_person(name, left_out):
    _, table = motion(name, 15)
    fitted = fit_poses(table.select([n for n in JOINTS if n not in left_out]), name)
    assert set(fitted.by_joint) == set(JOINTS) - set(left_out)
    assert fitted.residual < 3e-3
    assert np.isfinite(fitted.poses).all()


@pytest.mark.parametrize("name", WHOLE)
def test_frames_without_joints_have_no_pose_and_those_with_some_have_one(name):
    poses, table = motion(name)
    gappy = with_gaps(with_gaps(with_gaps(table, slice(10, 14)), slice(20, 26), "left_elbow", "left_wrist", "left_hand"), [30], *JOINTS[4:])
    whole, fitted = fit_poses(table, name), fit_poses(gappy, name)
    known = np.isfinite(fitted.poses).all(1)
    assert np.flatnonzero(~known).tolist() == [10, 11, 12, 13]
    assert np.isnan(fitted.joints.positions[10:14]).all()
    assert np.isnan(fitted.by_frame[10:14]).all()
    assert fitted.residual < 3e-3
    others = [fitted.joints.names.index(n) for n in fitted.joints.names if not n.startswith("left")]
    off = np.linalg.norm(fitted.joints.positions - whole.joints.positions, axis=2)
    assert off[known][:, others].max() < 0.06
    arm = [fitted.joints.names.index(f"left_{n}") for n in ("elbow", "wrist")]
    assert off[20:26][:, arm].max() < 0.15  # between the frames before and after
    assert len(poses) == len(fitted.poses)


@pytest.mark.parametrize("name", WHOLE)
def test_a_joint_measured_wrongly_does_not_carry_the_body_away(name):
    _, table = motion(name, 30)
    positions = table.positions.copy()
    positions[12, JOINTS.index("left_wrist")] += [0.4, -0.6, 0.5]
    clean, fitted = fit_poses(table, name), fit_poses(JointTable(table.times, JOINTS, positions), name)
    off = np.linalg.norm(fitted.joints.positions - clean.joints.positions, axis=2)
    assert np.delete(off, 12, axis=0).max() < 0.02
    assert fitted.by_frame.argmax() == 12
    assert fitted.sizes.forearm_length == pytest.approx(clean.sizes.forearm_length, abs=3e-3)


@pytest.mark.parametrize("axes", [(0, 1, 2), (1, 0, 2), (2, 1, 0), (1, 2, 0)])
def test_three_turns_make_the_rotation_again_in_the_singular_place_too(axes, rng):
    angles = rng.uniform(-3, 3, (60, 3)) * [1, 0.5, 1]
    angles[:20, 1] = rng.choice([-1, 1], 20) * np.pi / 2
    turned = [rotation_about(np.eye(3)[axis], column) for axis, column in zip(axes, angles.T)]
    R = turned[0] @ turned[1] @ turned[2]
    first, second, third = (rotation_about(np.eye(3)[axis], column) for axis, column in zip(axes, euler_angles(R, axes).T))
    np.testing.assert_allclose(first @ second @ third, R, atol=1e-6)
    np.testing.assert_array_equal(euler_angles(R, axes)[:20, 0], 0)


def test_one_frame_is_enough():
    _, table = motion("anatomical", 1)
    assert fit_poses(table).residual < 5e-3


def scaled(table: JointTable, factor) -> JointTable:
    return JointTable(table.times, table.names, table.positions * factor)


def swapped(table: JointTable, *names: str) -> JointTable:
    """Left and right of some joints in each other's place."""
    order = [JOINTS.index(n.replace("left", "*").replace("right", "left").replace("*", "right")) if n.split("_")[-1] in names else i
             for i, n in enumerate(JOINTS)]
    return JointTable(table.times, JOINTS, table.positions[:, order])


@pytest.mark.parametrize(("spoil", "said"), [
    (lambda t: scaled(t, 1000), "joints: found [45]..*hips to shoulders, expected 0.2 to 0.8 metres .are these millimetres"),
    (lambda t: scaled(t, 100), "are these centimetres"),
    (lambda t: scaled(t, (1, 1, -1)), "found the shoulders under the hips"),
    (lambda t: scaled(t, (-1, 1, 1)), "knees bend forward in [0-9]+ of [0-9]+ places.*have left and right"),
    (lambda t: swapped(t, "shoulder", "elbow", "wrist", "hand", "hip", "knee", "ankle"), "knees bend forward"),
    (lambda t: swapped(t, "shoulder", "elbow", "wrist", "hand"), "found the left shoulder over the right hip"),
    (lambda t: t.select([n for n in JOINTS if n != "left_knee"]), "no joint left_knee; needed are left_elbow, .*found: head"),
    (lambda t: t.select([n for n in JOINTS if n not in ("left_hip", "pelvis")]), "no joint pelvis .or left_hip and right_hip"),
    (lambda t: with_gaps(t, slice(None), "left_shoulder"), "no frame in which hips and shoulders are known"),
])  # fmt: skip
def test_what_is_no_motion_of_a_person_is_said(spoil, said):
    _, table = motion("anatomical", 40)
    with pytest.raises(ShadowPuppetError, match=said):
        fit_poses(spoil(table), source="joints")


def test_mirrored_arms_are_seen_where_no_knee_is_bent():
    body = make_body("anatomical", person("anatomical"))
    poses = np.repeat(body.skeleton.pose(left_elbow_flexion=1.2, right_elbow_flexion=1.0, root_z=0.9)[None], 12, axis=0)
    table = JointTable(np.arange(12) / 30, JOINTS, body.points(poses, names=JOINTS))
    assert fit_poses(table).residual < 3e-3
    with pytest.raises(ShadowPuppetError, match="the elbows of hanging arms bend backward in 24 of 24 places"):
        fit_poses(JointTable(table.times, JOINTS, table.positions * (-1, 1, 1)))


def test_a_world_with_y_up_is_doubted():
    _, table = motion("anatomical", 5)
    with pytest.warns(ShadowPuppetWarning, match="train: the trunk lies level most of the time: is the world's Z up"):
        fit_poses(JointTable(table.times, JOINTS, table.positions[..., [2, 0, 1]] * (1, 1, 1)), source="train")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        fit_poses(table)


def test_a_body_without_legs_is_refused():
    with pytest.raises(ShadowPuppetError, match="body 'rounded': found a body without legs or none, expected one of anatomical, cylinders"):
        fit_poses(motion("anatomical", 3)[1], "rounded")


# Equations -------------------------------------------------------------------------------------------------------------


@given(st.integers(1, 6), st.integers(1, 4), st.integers(0, 3), st.integers(0, 2**32 - 1))
@settings(max_examples=40, deadline=None)
def test_the_chain_is_solved_as_the_whole_matrix(T, D, S, seed):
    rng = np.random.default_rng(seed)
    J = rng.standard_normal((T, 3 * D, D + S))
    H = np.swapaxes(J, 1, 2) @ J
    equations = _Equations(H[:, :D, :D], H[:, :D, D:], H[:, D:, D:].sum(0) + np.eye(S), rng.standard_normal((T, D)), rng.standard_normal(S))
    links, held, damping = rng.uniform(0, 2, (T - 1, D)), rng.random((T, D)) < 0.2, 0.1
    M = np.zeros((T * D + S, T * D + S))
    for t in range(T):
        rows = slice(t * D, t * D + D)
        M[rows, rows], M[rows, T * D :], M[T * D :, rows] = equations.A[t], equations.B[t], equations.B[t].T
    for t in range(T - 1):
        for d in range(D):
            a, b = t * D + d, t * D + D + d
            M[[a, b], [a, b]] += links[t, d]
            M[[a, b], [b, a]] -= links[t, d]
    M[T * D :, T * D :] = equations.C
    M += damping * np.eye(len(M))
    right, free = np.concatenate([equations.g.ravel(), equations.h]), np.append(~held.ravel(), np.ones(S, bool))
    expected = np.zeros(len(right))
    expected[free] = np.linalg.solve(M[np.ix_(free, free)], right[free])
    step, change = _solve_step(equations, links, damping, held)
    np.testing.assert_allclose(np.append(step.ravel(), change), expected, rtol=1e-6, atol=1e-9)


def test_a_chain_of_one_block():
    np.testing.assert_allclose(_solve_chain(np.array([[[2.0]]]), np.zeros((0, 1)), np.array([[[4.0]]])), [[[2.0]]])


# On recordings ----------------------------------------------------------------------------------------------------------


@pytest.mark.shared
@pytest.mark.parametrize(("name", "floors"), [("anatomical", (2.5, 2.5, 3.2)), ("cylinders", (6.5, 8.0, 13.3))])
def test_how_near_the_skeleton_can_come_to_people(name, floors, shared):
    for recording, floor in zip(("walking", "jogging", "boxing"), floors):
        table = read_joints(Path(shared) / "recordings" / recording / "truth.csv")
        every = JointTable(table.times[::5], table.names, table.positions[::5])
        fitted = fit_poses(every, name)
        limbs = 1000 * np.sqrt(np.mean([fitted.by_joint[joint] ** 2 for joint in LIMBS]))
        assert limbs < floor, recording
        assert np.abs(np.diff(fitted.poses, axis=0)).max() < 1.5


def problem(name: str = "anatomical", rate: float = 60.0, free: tuple[str, ...] = ()) -> tuple[_Problem, Array]:
    """The problem of a motion's joints, and its true poses."""
    poses, table = motion(name, frames=5, rate=rate)
    return _Problem(name, table, person(name), free), poses


@pytest.mark.parametrize("rate", [15.0, 60.0, 240.0])
def test_a_steady_turn_costs_the_same_in_every_frame_whatever_the_rate(rate):
    made, poses = problem(rate=rate)
    speed = np.linspace(0.5, 1.5, poses.shape[1])
    cost = made.smooth * (speed * np.diff(made.table.times)[:, None]) ** 2
    slow = [dof.name.startswith(("chest", "root_bow", "root_tilt")) for dof in make_body("anatomical", person("anatomical")).skeleton.dofs]
    np.testing.assert_allclose(cost, np.tile(np.where(slow, TRUNK_SMOOTH_PULL, SMOOTH_PULL) * (speed / 60) ** 2, (4, 1)))


@pytest.mark.parametrize("name", WHOLE)
def test_the_equations_right_side_is_the_cost_s_slope_near_and_far(name, rng):
    """Half the descent of the cost, by central differences: also of joints far off, whose robust weight falls with the distance."""
    made, poses = problem(name, free=("upper_arm_length", "thigh_length"))
    far = rng.normal(0, 1, made.wanted.shape) * rng.choice([0.01, 0.05, 0.2], (*made.wanted.shape[:2], 1))
    made.wanted = made.wanted + far
    values = person(name).to_array()
    values[made.free] += [0.03, -0.02]
    equations, step = made._equations(poses, values), 1e-6
    for t, d in [(t, int(d)) for t in (0, 2, 4) for d in rng.integers(poses.shape[1], size=8)]:
        moved = np.zeros_like(poses)
        moved[t, d] = step
        slope = (made.cost(poses + moved, values) - made.cost(poses - moved, values)) / (2 * step)
        assert equations.g[t, d] == pytest.approx(-slope / 2, rel=1e-3, abs=1e-5)
    for k, column in enumerate(made.free):
        moved = step * (np.arange(len(values)) == column)
        slope = (made.cost(poses, values + moved) - made.cost(poses, values - moved)) / (2 * step)
        assert equations.h[k] == pytest.approx(-slope / 2, rel=1e-3, abs=1e-5)


def test_only_what_would_leave_its_limits_is_held_there(rng):
    low, high = np.full(5, -1.0), np.ones(5)
    poses, downhill = np.array([[-1.0, -1.0, 0.3, 1.0, 1.0]]), np.array([[-2.0, 2.0, -2.0, -2.0, 2.0]])
    held = _at_limits(poses, downhill, low, high)
    np.testing.assert_array_equal(held, [[True, False, False, False, True]])
    half = rng.normal(size=(5, 5))
    equations = _Equations((half @ half.T + np.eye(5))[None], np.zeros((1, 5, 0)), np.zeros((0, 0)), downhill, np.zeros(0))
    step, _ = _solve_step(equations, np.zeros((0, 5)), 0.0, held)
    np.testing.assert_array_equal(step[held], 0)
    free = ~held[0]
    np.testing.assert_allclose(step[0, free], np.linalg.solve(equations.A[0][np.ix_(free, free)], downhill[0, free]))


def test_a_limb_whose_bend_is_unknown_is_placed_as_a_straight_one(rng):
    parent = np.repeat(np.eye(3)[None], 6, axis=0)
    along = rng.normal(size=(6, 3)) - [0, 0, 3]
    along /= np.linalg.norm(along, axis=1)[:, None]
    np.testing.assert_array_equal(_limb(parent, along, np.full((6, 3), np.nan)), _limb(parent, along, np.zeros((6, 3))))
