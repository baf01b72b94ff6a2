"""Eq. 2 by the XOR of drawn masks, partial costs by whole ones, what does not count."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import BODIES, camera, picture, random_poses, shapes_of

from shadowpuppet.body import forward_kinematics
from shadowpuppet.body.segments import parts_of
from shadowpuppet.body.shapes import Body, Quads
from shadowpuppet.body.skeleton import Coupling, Dof, Joint, Skeleton
from shadowpuppet.camera import projection, rasterize, scanline
from shadowpuppet.camera.bits import pack, unpack
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.jit import BLOCK
from shadowpuppet.tracking.silhouette_cost import Observation, PartialCost, silhouette_costs

STAGES = {"torso": "torso_", "left arm": "left_", "right arm": "right_", "both arms": ("left_", "right_"), "elbow": "left_elbow", "all": ""}


def dofs_of(view: Picture, start: str | tuple[str, ...]) -> np.ndarray:
    return np.flatnonzero([name.startswith(start) for name in view.body.skeleton.dof_names])


def around(rng: np.random.Generator, view: Picture, pose: np.ndarray, dofs: np.ndarray, number: int = 12) -> np.ndarray:
    """Poses (N, D) like `pose` but for `dofs`."""
    poses = np.repeat(pose[None], number, axis=0)
    poses[:, dofs] = random_poses(rng, view.body.skeleton, number)[:, dofs]
    return poses


def noisy(rng: np.random.Generator, mask: np.ndarray, share: float = 0.1) -> np.ndarray:
    return mask ^ (rng.random(mask.shape) < share)


# Eq. 2 ----------------------------------------------------------------------------------------------------------------


@pytest.mark.kernels
@pytest.mark.parametrize("body", BODIES)
def test_the_cost_is_the_number_of_pixels_that_differ(body, rng):
    view = picture(body, camera((100, 75)))
    poses = random_poses(rng, view.body.skeleton, 6)
    mask, ignore = noisy(rng, view.mask(poses[0])), rng.random((75, 100)) < 0.1
    costs = silhouette_costs(view, Observation.of(mask), poses)
    ignoring = silhouette_costs(view, Observation.of(mask, ignore), poses)
    for n, pose in enumerate(poses):
        drawn, doubtful = naive.silhouette(view, pose)
        assert abs(costs[n] - naive.cost(drawn, mask)) <= doubtful.sum()
        assert costs[n] == naive.cost(view.mask(pose), mask)
        assert ignoring[n] == naive.cost(view.mask(pose), mask, ignore)


def test_a_pose_costs_nothing_in_its_own_mask_and_all_it_draws_in_an_empty_one(rng):
    view = picture("rounded")
    poses = random_poses(rng, view.body.skeleton, 5)
    for pose in poses:
        mask = view.mask(pose)
        assert silhouette_costs(view, Observation.of(mask), pose[None]) == 0
        assert silhouette_costs(view, Observation.of(np.zeros_like(mask)), pose[None]) == mask.sum()
        assert silhouette_costs(view, Observation.of(~mask), pose[None]) == mask.size


@given(st.integers(0, 2**32 - 1), st.permutations(range(6)))
@settings(max_examples=20, deadline=None)
def test_a_cost_depends_on_its_own_pose_only(seed, order):
    rng = np.random.default_rng(seed)
    view = picture("cardbox", camera((65, 48)))
    poses = random_poses(rng, view.body.skeleton, 6)
    observation = Observation.of(noisy(rng, view.mask(poses[2])))
    costs = silhouette_costs(view, observation, poses)
    np.testing.assert_array_equal(silhouette_costs(view, observation, poses[list(order)]), costs[list(order)])
    np.testing.assert_array_equal(silhouette_costs(view, observation, poses[3:4]), costs[3:4])


@pytest.mark.kernels
@pytest.mark.parametrize("distance", [2.5, 0.5, 0.25])  # near enough that in some poses arms cross the near plane, or are behind it
@pytest.mark.parametrize("body", BODIES)
def test_costs_do_not_depend_on_the_block_that_a_pose_is_in(body, distance, rng):
    """Poses are worked on in blocks, side by side: full ones, a part of one, one alone."""
    view = picture(body, camera((65, 48)), distance)
    poses = random_poses(rng, view.body.skeleton, 2 * BLOCK + 5)
    observation = Observation.of(noisy(rng, view.mask(poses[2])))
    costs = silhouette_costs(view, observation, poses)
    assert len(set(costs)) > BLOCK / 2
    some = [*range(0, len(poses), 5), BLOCK - 1, BLOCK, len(poses) - 1]
    np.testing.assert_array_equal(costs[some], [naive.cost(view.mask(poses[n]), unpack(observation.silhouette, 65)) for n in some])
    np.testing.assert_array_equal(silhouette_costs(view, observation, poses[BLOCK - 3 :])[[3, 8]], costs[[BLOCK, BLOCK + 5]])


# Partial costs --------------------------------------------------------------------------------------------------------


@pytest.mark.kernels
@pytest.mark.parametrize("stage", STAGES)
@pytest.mark.parametrize("body", BODIES)
def test_partial_costs_are_whole_costs(body, stage, rng):
    view = picture(body, camera((100, 75)))
    dofs = dofs_of(view, STAGES[stage])
    pose = random_poses(rng, view.body.skeleton, 1)[0] * 0.4
    poses = around(rng, view, pose, dofs)
    mask = noisy(rng, view.mask(0.8 * pose))
    for observation in (Observation.of(mask), Observation.without_legs(mask, view, pose)):
        partial = PartialCost(view, dofs).costs(observation, pose)(poses)
        np.testing.assert_array_equal(partial, silhouette_costs(view, observation, poses))
        skipped = unpack(observation.ignore, 100)
        np.testing.assert_array_equal(partial, [naive.cost(view.mask(p), mask, skipped) for p in poses])


@pytest.mark.parametrize("stage", ["torso", "left arm"])
@pytest.mark.parametrize("body", BODIES)
def test_hidden_parts_are_not_drawn_neither_fixed_nor_moved(body, stage, rng):
    view = picture(body)
    dofs, hidden = dofs_of(view, STAGES[stage]), parts_of(view.body, "left_arm") + parts_of(view.body, "right_arm")[:1]
    pose = random_poses(rng, view.body.skeleton, 1)[0] * 0.5
    poses, mask = around(rng, view, pose, dofs, 5), view.mask(pose)
    drawn = np.flatnonzero([part not in hidden for part in view.body.parts])
    found = PartialCost(view, dofs, hidden).costs(Observation.of(mask), pose)(poses)
    np.testing.assert_array_equal(found, [naive.cost(unpack(view.draw(p, drawn), 160), mask) for p in poses])


def test_an_arm_s_stage_moves_that_arm_s_shapes_only():
    view = picture("cardbox")
    partial = PartialCost(view, dofs_of(view, "left_"))
    assert {view.body.parts[i] for i in partial.moving} == {"left_upper_arm", "left_forearm"}
    assert sorted([*partial.moving, *partial.still]) == list(range(15))
    assert {view.body.parts[i] for i in PartialCost(view, dofs_of(view, "left_elbow")).moving} == {"left_forearm"}
    assert len(PartialCost(view, dofs_of(view, "torso_")).moving) == 15
    none = PartialCost(view, np.array([], np.int64))
    assert len(none.moving) == 0
    pose = np.zeros(12)
    assert none.costs(Observation.of(view.mask(pose)), pose)(pose[None]) == 0


def test_the_shoulders_hull_moves_with_either_arm():
    view = picture("rounded")
    moving = PartialCost(view, dofs_of(view, "left_")).moving
    assert "shoulders" in {view.body.parts[i] for i in moving}


def test_what_follows_another_joint_s_angle_moves_with_it(rng):
    """A coupling is a way to move a joint, too."""
    square = np.array([[0, -0.2, -0.2], [0, 0.2, -0.2], [0, 0.2, 0.2], [0, -0.2, 0.2]])
    joints = (Joint("a", None), Joint("b", None, (0.0, 0.5, 0.0)))
    tree = Skeleton(joints, (Dof("turn", "a", "x"),), (Coupling("b", "turn", (0.0, 0.0, 0.4)),))
    body = Body("two", tree, Quads(np.array([[0], [1]]), np.stack([square, square])), ("a", "b"), {}, np.zeros((2, 3)))
    view = Picture(body, camera(), picture().T_camera_base)
    poses = rng.uniform(-1, 1, (5, 1))
    found = PartialCost(view, np.array([0])).costs(Observation.of(view.mask(poses[0])), poses[0])(poses)
    np.testing.assert_array_equal(found, [naive.cost(view.mask(p), view.mask(poses[0])) for p in poses])


# What does not count --------------------------------------------------------------------------------------------------


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_nothing_that_is_ignored_changes_anything(seed):
    rng = np.random.default_rng(seed)
    view = picture("cardbox", camera((65, 48)))
    poses = random_poses(rng, view.body.skeleton, 4)
    mask, ignore = noisy(rng, view.mask(poses[0])), rng.random((48, 65)) < 0.3
    one, other = Observation.of(mask, ignore), Observation.of(mask ^ (ignore & (rng.random(ignore.shape) < 0.5)), ignore)
    np.testing.assert_array_equal(silhouette_costs(view, one, poses), silhouette_costs(view, other, poses))
    assert one.area == other.area == (mask & ~ignore).sum()
    assert one.cost_and_overlap(view.draw(poses[1])) == other.cost_and_overlap(view.draw(poses[1]))


def test_what_is_ignored_is_seen_and_under_the_waist_only(rng):
    view = picture("rounded", camera((200, 220)), elevation=0.3)
    pose = np.zeros(12)
    legs = view.legs(pose)
    mask = view.mask(pose) | (legs & (rng.random(legs.shape) < 0.5))
    observation = Observation.without_legs(mask, view, pose)
    skipped = unpack(observation.ignore, 200)
    np.testing.assert_array_equal(skipped, mask & legs)
    torso = unpack(view.draw(pose, shapes_of(view.body, "torso", "head")), 200)
    assert not (skipped & torso).any()
    # A person with legs costs as little as one without; a waist over empty ground still costs.
    assert observation.cost_and_overlap(view.draw(pose))[0] == 0
    empty = Observation.without_legs(view.mask(pose) & ~legs, view, pose)
    low = pose.copy()
    assert empty.cost_and_overlap(view.draw(low) | pack(legs))[0] == legs.sum()


def test_cost_and_overlap_agree_with_their_definitions(rng):
    view = picture("cardbox")
    poses = random_poses(rng, view.body.skeleton, 2)
    drawn, mask = view.mask(poses[0]), noisy(rng, view.mask(poses[1]), 0.02)
    cost, overlap = Observation.of(mask).cost_and_overlap(view.draw(poses[0]))
    assert cost == naive.cost(drawn, mask)
    assert overlap == pytest.approx((drawn & mask).sum() / (drawn | mask).sum())
    assert Observation.of(mask).cost_and_overlap(pack(mask)) == (0, 1)
    nothing = np.zeros_like(mask)
    assert Observation.of(nothing).cost_and_overlap(pack(nothing)) == (0, 0)  # nobody drawn over nobody seen overlaps by nothing


# Speed ----------------------------------------------------------------------------------------------------------------


def test_kernels_are_compiled_once_for_arrays_that_are_contiguous(rng):
    """Each kind of memory layout is compiled again and runs slower: whatever a caller hands over, kernels get one kind."""
    view = picture("cardbox")
    poses = random_poses(rng, view.body.skeleton, 8)
    observation = Observation.of(view.mask(poses[0]))
    cost = PartialCost(view, np.arange(12)).costs(observation, poses[0])
    for odd in (np.asfortranarray(poses), np.repeat(poses, 2, 0)[::2], poses.tolist()):
        silhouette_costs(view, observation, odd)
    np.testing.assert_array_equal(cost(np.asfortranarray(poses)), cost(poses))
    for kernel in (forward_kinematics.place_all, forward_kinematics.place_points, projection.project_quads, rasterize._compare,
                   scanline.find_edges):
        for signature in getattr(kernel, "signatures", []):
            layouts = {kind.layout for kind in signature if hasattr(kind, "layout")}
            assert layouts <= {"C"}, (kernel, signature)
