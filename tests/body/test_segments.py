"""Torso, arms and legs: what belongs to which, and coarse postures of a limb, which are the same directions for every body."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.body.models import MODELS, WHOLE, average_sizes, make_body
from shadowpuppet.body.segments import (
    PULLED_POINTS,
    SEGMENT_JOINTS,
    coarse_arms,
    coarse_limbs,
    dofs_of,
    limbs_of,
    parts_of,
    segments_of,
)

BODY = {name: make_body(name, average_sizes(name, 1.75)) for name in MODELS}


@pytest.mark.parametrize("name", MODELS)
def test_every_angle_belongs_to_one_segment(name):
    body = BODY[name]
    segments = segments_of(body.skeleton)
    upper, legs = ("torso", "left_arm", "right_arm"), ("left_leg", "right_leg")
    assert segments == (upper + legs if name in WHOLE else upper)
    assert limbs_of(body.skeleton) == segments[1:]
    owned = np.concatenate([dofs_of(body.skeleton, segment) for segment in segments])
    assert sorted(owned.tolist()) == list(range(len(body.skeleton.dofs)))
    assert {name for segment in segments for name in PULLED_POINTS[segment]} <= set(body.landmark_names)


@pytest.mark.parametrize("name", MODELS)
def test_a_limb_s_parts_are_those_that_move_wholly_with_its_dof(name, rng):
    body = BODY[name]
    for limb in limbs_of(body.skeleton):
        poses = np.repeat(body.skeleton.clamp(np.full((1, len(body.skeleton.dofs)), 0.1)), 2, axis=0)
        poses[1, dofs_of(body.skeleton, limb)] += rng.uniform(0.1, 0.3, len(dofs_of(body.skeleton, limb)))
        before, after = body.skeleton.forward(poses)
        moved = np.abs(after - before).max((1, 2)) > 1e-6
        whole = {part for part, joints in zip(body.parts, body.shapes.joints) if moved[joints].all()}
        assert set(parts_of(body, limb)) == whole
        assert len(whole) >= 2


def pointing(name: str, limb: str, postures: np.ndarray) -> np.ndarray:
    """Directions (K, 2, 3) of a limb's upper and lower half."""
    body, points = BODY[name], {"arm": ("shoulder", "elbow", "hand"), "leg": ("hip", "knee", "ankle")}
    side, kind = limb.split("_")
    poses = np.zeros((len(postures), len(body.skeleton.dofs)))
    poses[:, dofs_of(body.skeleton, limb)] = postures
    at = body.points(poses, names=[f"{side}_{point}" for point in points[kind]])
    bones = np.diff(at, axis=1)
    return bones / np.linalg.norm(bones, axis=2, keepdims=True)


@pytest.mark.parametrize("limb", ["left_arm", "right_arm"])
@pytest.mark.parametrize("name", WHOLE)
def test_coarse_arms_point_where_an_upper_body_s_do(name, limb):
    mine, theirs = (pointing(body, limb, coarse_limbs(BODY[body].skeleton, limb)) for body in (name, "cardbox"))
    low, high = BODY[name].skeleton.limits
    np.testing.assert_array_equal(coarse_limbs(BODY["cardbox"].skeleton, limb), coarse_arms())
    assert (np.abs(mine[:, 0] - theirs[:, 0]).max(1) < 1e-9).mean() > 0.95
    near = (mine[:, 1] * theirs[:, 1]).sum(1)
    assert (near > 1 - 1e-9).mean() > 0.85  # an arm that turns farther than the limits is cut
    library = coarse_limbs(BODY[name].skeleton, limb)
    dofs = dofs_of(BODY[name].skeleton, limb)
    assert ((library >= low[dofs]) & (library <= high[dofs])).all()


@pytest.mark.parametrize("name", WHOLE)
def test_coarse_legs_are_mirrored_and_of_use(name):
    left, right = (pointing(name, limb, coarse_limbs(BODY[name].skeleton, limb)) for limb in ("left_leg", "right_leg"))
    np.testing.assert_allclose(right, left * [1, -1, 1], atol=1e-9)
    wanted = np.array([[0, 0, -1], [0, 0.5, -0.87], [1, 0.1, 0]])
    wanted /= np.linalg.norm(wanted, axis=1, keepdims=True)
    assert np.degrees(np.arccos((wanted @ left[:, 0].T).max(1))).max() < 20
    assert np.degrees(np.arccos((left[:, 0] * left[:, 1]).sum(1).clip(-1, 1))).max() > 100  # knees bend far


def test_joints_of_segments_do_not_overlap():
    every = [joint for joints in SEGMENT_JOINTS.values() for joint in joints]
    assert len(set(every)) == len(every)
