"""The skeleton: kinematics by its 4x4 twin and by laws, limits, couplings, strain; what is no skeleton."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import SIZES, random_poses

from shadowpuppet.body.forward_kinematics import sines
from shadowpuppet.body.skeleton import AXES, SIDES, Coupling, Dof, Joint, Skeleton
from shadowpuppet.body.upper_body import SHOULDER_RISE, upper_body_skeleton
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import inverse, rigid, rotation_from_vector
from shadowpuppet.jit import BLOCK

UPPER = {"plain": upper_body_skeleton(SIZES), "clavicles": upper_body_skeleton(SIZES, clavicles=True)}
ROOT = rigid(rotation_from_vector([0.3, -1.2, 0.5]), [0.1, -0.4, 2.5])


@st.composite
def skeletons(draw) -> Skeleton:
    """Any tree of up to five joints with any DOF and couplings."""
    lengths = st.tuples(*[st.floats(-1, 1)] * 3)
    joints, dofs, couplings = [Joint("j0", None, draw(lengths))], [], []
    for i in range(1, draw(st.integers(1, 5))):
        joints.append(Joint(f"j{i}", draw(st.sampled_from([None, *(j.name for j in joints)])), draw(lengths)))
    for joint in joints:
        for _ in range(draw(st.integers(0, 3))):
            kind = draw(st.sampled_from(["rotation", "translation", "vector"]))
            axes = "xyz" if kind == "vector" else [draw(st.sampled_from(list(AXES)))]
            dofs += [Dof(f"d{len(dofs) + n}", joint.name, axis, kind=kind) for n, axis in enumerate(axes)]  # type: ignore[arg-type]
    for dof in dofs:
        if draw(st.booleans()):
            couplings.append(Coupling(draw(st.sampled_from(joints)).name, dof.name, draw(lengths)))
    return Skeleton(tuple(joints), tuple(dofs), tuple(couplings))


def stacked(skeleton: Skeleton, poses, root=None) -> np.ndarray:
    frames = [naive.forward(skeleton, pose, root) for pose in poses]
    return np.array([[frame[name][:3] for name in skeleton.joint_names] for frame in frames])


@pytest.mark.kernels
@given(skeletons(), st.integers(0, 2**32 - 1))
@settings(max_examples=60, deadline=None)
def test_kinematics_are_products_of_matrices(skeleton, seed):
    poses = np.random.default_rng(seed).uniform(-4, 4, (3, len(skeleton.dofs)))
    np.testing.assert_allclose(skeleton.forward(poses, ROOT), stacked(skeleton, poses, ROOT), atol=1e-12)


@pytest.mark.kernels
@pytest.mark.parametrize("skeleton", UPPER.values(), ids=UPPER)
def test_kinematics_of_the_upper_body(skeleton, rng):
    poses = random_poses(rng, skeleton, 20)
    np.testing.assert_allclose(skeleton.forward(poses, ROOT), stacked(skeleton, poses, ROOT), atol=1e-12)


def test_transforms_are_rigid_and_the_root_moves_all_alike(rng):
    skeleton = UPPER["clavicles"]
    poses = random_poses(rng, skeleton, 10)
    T = skeleton.forward(poses, ROOT)
    R = T[..., :3]
    np.testing.assert_allclose(R @ np.swapaxes(R, -1, -2), np.broadcast_to(np.eye(3), R.shape), atol=1e-12)
    np.testing.assert_allclose(np.linalg.det(R), 1, atol=1e-12)
    back = inverse(ROOT)[:3, :3] @ T
    back[..., 3] += inverse(ROOT)[:3, 3]
    np.testing.assert_allclose(back, skeleton.forward(poses), atol=1e-12)


def test_a_pose_does_not_depend_on_its_neighbours_nor_on_how_the_array_lies_in_memory(rng):
    skeleton = UPPER["plain"]
    poses = random_poses(rng, skeleton, 8)
    whole = skeleton.forward(poses)
    np.testing.assert_array_equal(np.concatenate([skeleton.forward(pose[None]) for pose in poses]), whole)
    np.testing.assert_array_equal(skeleton.forward(np.asfortranarray(poses)), whole)
    np.testing.assert_array_equal(skeleton.forward(np.repeat(poses, 2, axis=0)[::2]), whole)
    assert skeleton.forward(np.zeros((0, 12))).shape == (0, len(skeleton.joints), 3, 4)


@pytest.mark.kernels
@pytest.mark.parametrize(("scale", "tolerance"), [(1.0, 3e-16), (10.0, 3e-16), (1e5, 1e-15)])
def test_sines_are_those_of_the_c_library(scale, tolerance, rng):
    angles = np.concatenate([rng.uniform(-scale, scale, 200), np.arange(-8, 9) * np.pi / 4, [0.0, -0.0, 1e-300, np.nan]])
    sine, cosine = np.full((2, len(angles)), -7.0)
    sines(angles, sine, cosine)
    np.testing.assert_allclose(sine, np.sin(angles), rtol=0, atol=tolerance)
    np.testing.assert_allclose(cosine, np.cos(angles), rtol=0, atol=tolerance)


@pytest.mark.kernels
def test_more_poses_than_a_block_are_placed_as_one_by_one(rng):
    skeleton = UPPER["clavicles"]
    poses = random_poses(rng, skeleton, BLOCK + 3)
    whole = skeleton.forward(poses, ROOT)
    for n in (0, BLOCK - 1, BLOCK, BLOCK + 2):
        expected = naive.forward(skeleton, poses[n], ROOT)
        np.testing.assert_allclose(whole[n], [expected[name][:3] for name in skeleton.joint_names], atol=1e-12)
    joints, places = np.array([5, 0]), rng.standard_normal((2, 3))
    points = skeleton.points(poses, joints, places, ROOT)
    T = whole[:, joints]
    np.testing.assert_allclose(points, (T[..., :3] @ places[:, :, None])[..., 0] + T[..., 3], atol=1e-12)


def test_some_joints_are_recomputed_over_what_stands(rng):
    skeleton = UPPER["clavicles"]
    old, new = random_poses(rng, skeleton, 2)
    arm = np.array([skeleton.joint_index("left_shoulder"), skeleton.joint_index("left_elbow")])
    T = skeleton.forward(old[None], ROOT)
    skeleton.forward_some(new[None], arm, T, ROOT)
    mixed = np.where([name.startswith("left") for name in skeleton.dof_names], new, old)
    np.testing.assert_allclose(T, skeleton.forward(mixed[None], ROOT), atol=1e-12)


def test_every_pose_may_have_a_skeleton_of_its_own_measures(rng):
    people = [SIZES, SIZES.with_values(upper_arm_length=0.4, torso_height=0.6), SIZES.with_values(shoulder_width=0.5)]
    skeletons = [upper_body_skeleton(sizes) for sizes in people]
    poses = random_poses(rng, skeletons[0], 3)
    T = np.empty((3, len(skeletons[0].joints), 3, 4))
    offsets = np.array([[joint.offset for joint in skeleton.joints] for skeleton in skeletons])
    skeletons[0].forward_some(poses, np.arange(T.shape[1]), T, ROOT, offsets)
    for n, skeleton in enumerate(skeletons):
        np.testing.assert_allclose(T[n], skeleton.forward(poses[n : n + 1], ROOT)[0], atol=1e-12)


@pytest.mark.parametrize(("name", "other"), [("left", "right"), ("right", "left")])
def test_clavicles_lift_and_advance_the_shoulder_with_its_arm_only(name, other):
    skeleton = UPPER["clavicles"]
    rest = skeleton.forward(skeleton.pose()[None])[0, :, :, 3]
    raised = skeleton.forward(skeleton.pose(**{f"{name}_shoulder_abduction": 1.5, f"{name}_shoulder_forward": 0.5})[None])[0, :, :, 3]
    moved = (raised - rest)[skeleton.joint_index(f"{name}_shoulder")]
    np.testing.assert_allclose(moved, [0.5 * SHOULDER_RISE, 0, 1.5 * SHOULDER_RISE], atol=1e-12)
    np.testing.assert_allclose((raised - rest)[skeleton.joint_index(f"{other}_shoulder")], 0)
    assert not UPPER["plain"].couplings


# The upper body's angles ----------------------------------------------------------------------------------------------


def upper_arm(side: str, abduction, forward) -> np.ndarray:
    """Directions (N, 3) of an upper arm in the torso's frame."""
    skeleton = UPPER["plain"]
    poses = np.zeros((np.size(abduction), 12))
    poses[:, skeleton.dof_indices([f"{side}_shoulder_abduction", f"{side}_shoulder_forward"])] = np.stack([abduction, forward], -1)
    places = skeleton.forward(poses)[..., 3]
    along = places[:, skeleton.joint_index(f"{side}_elbow")] - places[:, skeleton.joint_index(f"{side}_shoulder")]
    return along / np.linalg.norm(along, axis=1, keepdims=True)


@pytest.mark.parametrize("side", SIDES)
@given(st.floats(np.radians(-40), np.radians(190)), st.floats(np.radians(-30), np.radians(90)))
def test_every_direction_of_the_upper_arm_is_reached_by_two_angles(side, abduction, forward):
    out = 1 if side == "left" else -1
    wanted = [np.sin(forward), out * np.cos(forward) * np.sin(abduction), -np.cos(forward) * np.cos(abduction)]
    np.testing.assert_allclose(upper_arm(side, [abduction], [forward])[0], wanted, atol=1e-12)


def rank(forward: float) -> int:
    """In how many directions two small turns at the shoulder move the arm."""
    h = 1e-6
    at, a, f = upper_arm("left", [0.7, 0.7 + h, 0.7], [forward, forward, forward + h])
    return np.linalg.matrix_rank(np.stack([a - at, f - at]) / h, tol=1e-3)


def test_the_one_singular_direction_is_straight_ahead():
    assert [rank(f) for f in (-0.5, 0.0, 0.8, 1.4)] == [2, 2, 2, 2]
    assert rank(np.pi / 2) == 1


@pytest.mark.parametrize(("angles", "wanted"), [
    ({}, [0, 0, -1]),
    ({"elbow_flexion": np.pi / 2}, [1, 0, 0]),
    ({"shoulder_abduction": np.pi / 2}, [0, 1, 0]),
    ({"shoulder_abduction": np.pi / 2, "elbow_flexion": np.pi / 2}, [1, 0, 0]),
    ({"shoulder_abduction": np.pi / 2, "elbow_roll": np.pi / 2, "elbow_flexion": np.pi / 2}, [0, 0, 1]),
    ({"shoulder_forward": np.pi / 2}, [1, 0, 0]),
    ({"shoulder_forward": np.pi / 2, "elbow_flexion": np.pi / 2}, [0, 0, 1]),
])
@pytest.mark.parametrize("side", SIDES)
def test_where_the_forearm_points(side, angles, wanted):
    skeleton = UPPER["plain"]
    pose = skeleton.pose(**{f"{side}_{name}": value for name, value in angles.items()})
    R = skeleton.forward(pose[None])[0, skeleton.joint_index(f"{side}_elbow"), :, :3]
    np.testing.assert_allclose(R @ [0, 0, -1], np.array(wanted) * [1, 1 if side == "left" else -1, 1], atol=1e-12)


@pytest.mark.parametrize(("name", "wanted"), [  # where the middle of the torso's top goes
    ("torso_bow", [1, 0, 0]), ("torso_bend", [0, -1, 0]), ("torso_y", [0, 1, 0]),
])
def test_where_the_torso_goes(name, wanted):
    skeleton = UPPER["plain"]
    T = skeleton.forward(np.array([skeleton.pose(), skeleton.pose(**{name: 0.1})]))[:, skeleton.joint_index("torso")]
    tops = T[:, :, :3] @ [0, 0, 1] + T[:, :, 3]
    moved = tops[1] - tops[0]
    np.testing.assert_allclose(moved / np.linalg.norm(moved), wanted, atol=0.06)


# Limits, strain, names ------------------------------------------------------------------------------------------------


@given(st.integers(0, 2**32 - 1), st.floats(0.1, 100))
def test_clamping_is_idempotent_and_changes_only_what_is_outside(seed, spread):
    skeleton = UPPER["plain"]
    poses = np.random.default_rng(seed).standard_normal((5, 12)) * spread
    low, high = skeleton.limits
    kept = skeleton.clamp(poses)
    inside = (poses >= low) & (poses <= high)
    np.testing.assert_array_equal(kept[inside], poses[inside])
    np.testing.assert_array_equal(skeleton.clamp(kept), kept)
    assert ((kept >= low) & (kept <= high)).all()


def test_limits_hold_rest_and_the_zero_pose():
    skeleton = UPPER["plain"]
    low, high = skeleton.limits
    rest = np.array([dof.rest for dof in skeleton.dofs])
    assert (low < high).all()
    for pose in (rest, skeleton.pose()):
        np.testing.assert_array_equal(skeleton.clamp(pose), pose)


@given(st.integers(0, 2**32 - 1), st.floats(0, 50))
def test_strain_is_zero_at_rest_and_at_most_nine_a_dof_and_grows_with_the_distance(seed, factor):
    skeleton = UPPER["plain"]
    rest = np.array([dof.rest for dof in skeleton.dofs])
    away = np.random.default_rng(seed).standard_normal((4, 12))
    near, far = skeleton.posture_penalty(rest + factor * away), skeleton.posture_penalty(rest + (factor + 0.1) * away)
    limited = sum(np.isfinite(dof.spread).all() for dof in skeleton.dofs)
    assert skeleton.posture_penalty(rest[None]) == 0
    assert (near >= 0).all()
    assert (near < far + 1e-9).all()
    assert (far < 9 * limited).all()


def test_strain_is_measured_from_rest_in_deviations_of_the_side_on_which_a_value_lies():
    one = Skeleton((Joint("a", None),), (Dof("d", "a", "x", rest=1.0, spread=(0.5, 2.0)), Dof("free", "a", "y")))
    found = one.posture_penalty([[1.0, 7], [0.5, 0], [3.0, -9], [1 - 1.5, 0], [1e9, 0]])
    np.testing.assert_allclose(found, [0, 0.9, 0.9, 4.5, 9], rtol=1e-6)


def test_poses_are_made_by_name():
    skeleton = UPPER["plain"]
    pose = skeleton.pose(left_elbow_flexion=0.4, torso_y=-0.1)
    assert pose[skeleton.dof_names.index("left_elbow_flexion")] == 0.4
    assert pose[skeleton.dof_names.index("torso_y")] == -0.1
    assert np.count_nonzero(pose) == 2


def test_the_twelve_dof_of_the_paper():
    assert UPPER["plain"].dof_names == (
        "torso_y", "torso_twist", "torso_bow", "torso_bend",
        *(f"{side}_{name}" for side in SIDES for name in ("shoulder_abduction", "shoulder_forward", "elbow_roll", "elbow_flexion")),
    )  # fmt: skip


@pytest.mark.parametrize(("call", "said"), [
    (lambda s: s.dof_indices(["torso_y", "torso_z"]), "unknown degree of freedom 'torso_z'; there are: left_elbow_flexion"),
    (lambda s: s.pose(knee=1.0), "unknown degree of freedom 'knee'"),
    (lambda s: s.joint_index("knee"), "unknown joint 'knee'; there are: left_elbow"),
    (lambda s: s.forward(np.zeros(12)), "poses have shape (12,), expected (N, 12)"),
    (lambda s: s.forward(np.zeros((2, 11))), "poses have shape (2, 11), expected (N, 12)"),
    (lambda s: Skeleton((Joint("a", "b"), Joint("b", None)), ()), "joint 'a': its parent 'b' must stand before it"),
    (lambda s: Skeleton((Joint("a", None), Joint("b", "a"), Joint("b", "a")), ()), "joint 'b': found 2 of this name, expected one"),
    (lambda s: Skeleton((Joint("a", None), Joint("b", "a")), (Dof("x", "a", "x"), Dof("y", "a", "y"), Dof("x", "b", "x"))),
     "degree of freedom 'x': found 2 of this name, expected one"),
    (lambda s: Skeleton((Joint("a", None), Joint("b", "a")), (Dof("x", "b", "x"), Dof("y", "a", "x"))), "grouped by joint"),
    (lambda s: Skeleton((Joint("a", None),), (Dof("x", "c", "x"),)), "unknown joint 'c'; there are: a"),
])
def test_what_is_wrong_is_said_with_what_there_is(call, said):
    with pytest.raises(ShadowPuppetError) as error:
        call(UPPER["plain"])
    assert said in str(error.value)
