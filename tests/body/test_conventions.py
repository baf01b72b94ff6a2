"""Conventions of the angles: what is stated is what the body does."""

from __future__ import annotations

import numpy as np
import pytest
import runs

from shadowpuppet.body.conventions import BEND, LIES, MOVES, conventions

ANATOMY = {"hip flexion": ("ankle", 0, 1), "hip adduction": ("ankle", 1, -1), "knee flexion": ("ankle", 0, -1),
           "ankle dorsiflexion": ("toe", 2, 1), "ankle inversion": ("toe", 1, -1), "elbow flexion": ("hand", 0, 1)}  # fmt: skip
"""Where the angle of that name moves which point, by anatomy: axis, and its sign on the left side."""


def pose_of(skeleton, bent: str) -> np.ndarray:
    return skeleton.pose(**{bent: np.radians(BEND)} if bent else {})


@pytest.mark.parametrize("name", runs.BODIES)
def test_a_landmark_moves_the_way_that_is_stated_and_lies_where_it_is_stated(name):
    body = runs.body_of(name)
    found = conventions(body)
    assert [each.dof for each in found] == list(body.skeleton.dofs)
    for d, each in enumerate(found):
        pose = pose_of(body.skeleton, each.bent)
        more = pose.copy()
        more[d] += 0.05
        joint = body.skeleton.joint_index(each.dof.joint)
        if each.dof.kind == "translation":
            before, after = (body.skeleton.forward(p[None])[0, joint, :, 3] for p in (pose, more))
        else:
            before, after = (body.points(p[None], names=[each.landmark])[0, 0] for p in (pose, more))
            from_joint = before - body.skeleton.forward(pose[None])[0, joint, :, 3]
            k, sign = next((k, 1 - 2 * pair.index(each.lies)) for k, pair in enumerate(LIES) if each.lies in pair)
            assert sign * from_joint[k] > 0, each
        k, sign = next((k, 1 - 2 * pair.index(each.moves)) for k, pair in enumerate(MOVES) if each.moves in pair)
        assert sign * (after - before)[k] > 0.7 * np.linalg.norm(after - before), each


@pytest.mark.parametrize("name", runs.BODIES)
def test_angles_turn_about_the_stated_axis_in_the_stated_order(name):
    """Against a naive product of rotations."""
    body, rng = runs.body_of(name), np.random.default_rng(1)
    skeleton, found = body.skeleton, conventions(body)
    pose = rng.uniform(-0.5, 0.5, len(skeleton.dofs))
    frames = skeleton.forward(pose[None])[0, :, :, :3]
    for j, joint in enumerate(skeleton.joints):
        own = [(each, value) for each, value in zip(found, pose) if each.dof.joint == joint.name and each.dof.kind != "translation"]
        R = np.eye(3)
        for order in sorted({each.order for each, _ in own}):
            R = R @ turned(np.sum([value * each.axis for each, value in own if each.order == order], axis=0))
        parent = frames[skeleton.joint_index(joint.parent)] if joint.parent else np.eye(3)
        np.testing.assert_allclose(frames[j], parent @ R, atol=1e-9)
        assert {each.parent for each, _ in own} <= {joint.parent or ""}


def turned(vector: np.ndarray) -> np.ndarray:
    """Rodrigues' formula."""
    angle = np.linalg.norm(vector)
    x, y, z = vector / angle
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K


@pytest.mark.parametrize("name", runs.BODIES)
def test_names_of_the_society_have_the_signs_that_anatomy_gives_them(name):
    body = runs.body_of(name)
    for d, each in enumerate(conventions(body)):
        called, sign = each.isb
        if called not in ANATOMY:
            continue
        side = each.dof.name.split("_")[0]
        point, k, outward = ANATOMY[called]
        pose = np.zeros((2, len(body.skeleton.dofs)))
        pose[1, d] = 0.05 * sign
        before, after = body.points(pose, names=[f"{side}_{point}"])[:, 0]
        assert (after - before)[k] * outward * (-1 if k == 1 and side == "right" else 1) > 0, each


def test_both_sides_mirror_each_other():
    found = {each.dof.name: each for each in conventions(runs.body_of("cylinders"))}
    mirrored = {"to the left": "to the right", "to the right": "to the left"}
    for name, each in found.items():
        if name.startswith("left_"):
            other = found[name.replace("left_", "right_")]
            assert other.moves == mirrored.get(each.moves, each.moves)
            assert (other.isb, other.order, other.landmark) == (each.isb, each.order, each.landmark.replace("left_", "right_"))
