"""Bodies: what each of the 18 sizes means, the papers' counts, mirror symmetry, and what is no body."""

from __future__ import annotations

import math
from collections import Counter
from itertools import pairwise

import numpy as np
import pytest
from mirror import mirrored
from people import BODIES, SIZES, random_poses, shapes_of

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body, Hulls, Quads  # fmt: skip
from shadowpuppet.body.sizes import SUBSETS, CardboxSizes
from shadowpuppet.body.skeleton import SIDES  # fmt: skip
from shadowpuppet.body.upper_body import FOREARM, HALF_BREADTH, HAND_POINT, TO_TIP, boxes, cardbox, cardbox_bends, rounded  # fmt: skip
from shadowpuppet.camera.bits import count
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import rigid, rotation_from_vector

NAMES = CardboxSizes.names()


def corners(body: Body, pose: np.ndarray, part: str) -> np.ndarray:
    """Corners of a part's quads (n, 3) in the body's frame."""
    assert isinstance(body.shapes, Quads)
    T = body.skeleton.forward(pose[None])[0]
    which = shapes_of(body, part)
    frames, local = T[body.shapes.joints[which, 0]], body.shapes.corners[which]
    return (local @ np.swapaxes(frames[..., :3], 1, 2) + frames[:, None, :, 3]).reshape(-1, 3)


def extent(body: Body, part: str, axis: str) -> float:
    return float(np.ptp(corners(body, body.skeleton.pose(), part)[:, "xyz".index(axis)]))


# Sizes ----------------------------------------------------------------------------------------------------------------


def test_the_18_sizes_of_the_paper_in_three_groups():
    assert [len(names) for names in SUBSETS.values()] == [8, 4, 6]
    assert sum(SUBSETS.values(), ()) == NAMES
    assert len(set(NAMES)) == 18


def test_sizes_go_to_arrays_and_mappings_and_back():
    assert CardboxSizes.from_array(SIZES.to_array()) == SIZES
    assert CardboxSizes.from_mapping(dict(zip(NAMES, SIZES.to_array().tolist()))) == SIZES
    assert SIZES.with_values(neck_gap=-0.01).neck_gap == -0.01
    assert SIZES.with_values(neck_gap=-0.01).with_values(neck_gap=SIZES.neck_gap) == SIZES


@pytest.mark.parametrize(("values", "said"), [
    ({"hat": 0.2}, "person.toml: unknown hat; the sizes are: elbow_width"),
    ({"head_width": None}, "person.toml: missing head_width; the sizes are"),
    ({"head_width": "0.2"}, "person.toml: head_width: found '0.2', expected a number of metres"),
    ({"head_width": True}, "person.toml: head_width: found True"),
    ({"head_width": 0.0}, "size head_width: found 0.0, expected 0.005 to 2.0 metres"),
    ({"head_width": -0.1}, "size head_width"),
    ({"upper_arm_length": 30.0}, "size upper_arm_length: found 30.0, expected 0.005 to 2.0 metres"),
    ({"neck_gap": -0.3}, "size neck_gap: found -0.3, expected -0.2"),
    ({"waist_width": math.nan}, "size waist_width: found nan"),
    ({"waist_width": math.inf}, "waist_width: found inf"),
])
def test_what_is_no_size_is_said(values, said):
    mapping = {**dict(zip(NAMES, SIZES.to_array().tolist())), **values}
    with pytest.raises(ShadowPuppetError) as error:
        CardboxSizes.from_mapping({name: value for name, value in mapping.items() if value is not None}, "person.toml")
    assert said in str(error.value)


@pytest.mark.parametrize(("part", "axis", "size"), [
    ("head", "y", "head_width"), ("head", "z", "head_height"), ("head", "x", "head_depth"),
    ("torso", "y", "shoulder_width"), ("torso", "z", "torso_height"), ("torso", "x", "torso_bottom_depth"),
    ("waist", "y", "waist_width"), ("waist", "z", "waist_height"), ("waist", "x", "waist_depth"),
    ("left_upper_arm", "z", "upper_arm_length"), ("left_upper_arm", "y", "upper_arm_width"), ("right_upper_arm", "x", "upper_arm_width"),
    ("left_forearm", "z", "forearm_length"), ("left_forearm", "y", "elbow_width"), ("right_forearm", "x", "elbow_width"),
])  # fmt: skip
@pytest.mark.parametrize("make", [cardbox, boxes])
def test_a_part_is_as_long_wide_and_deep_as_its_size_says(make, part, axis, size):
    assert extent(make(SIZES), part, axis) == pytest.approx(getattr(SIZES, size))


def test_where_parts_begin_and_how_they_narrow():
    body, pose = cardbox(SIZES), cardbox(SIZES).skeleton.pose()
    torso, head, arm = corners(body, pose, "torso"), corners(body, pose, "head"), corners(body, pose, "left_forearm")
    assert head[:, 2].min() == pytest.approx(SIZES.torso_height + SIZES.neck_gap)
    for axis, top, bottom in ((1, SIZES.shoulder_width, SIZES.torso_bottom_width), (0, SIZES.torso_top_depth, SIZES.torso_bottom_depth)):
        assert np.ptp(torso[np.isclose(torso[:, 2], SIZES.torso_height), axis]) == pytest.approx(top)
        assert np.ptp(torso[np.isclose(torso[:, 2], 0), axis]) == pytest.approx(bottom)
    assert np.ptp(arm[np.isclose(arm[:, 2], arm[:, 2].min()), 1]) == pytest.approx(SIZES.hand_width)
    shoulder = body.points(pose[None], names=["left_shoulder"])[0, 0]
    assert shoulder[1] == pytest.approx(SIZES.shoulder_width / 2 - SIZES.shoulder_inset)
    level = corners(body, body.skeleton.pose(left_shoulder_abduction=np.pi / 2), "left_upper_arm")
    assert level[:, 2].max() == pytest.approx(SIZES.torso_height)  # a level arm's upper edge lies on the torso's


def measures(body: Body) -> np.ndarray:
    """All lengths that a body is made of, as one array."""
    return np.concatenate([np.ravel([joint.offset for joint in body.skeleton.joints]), *(a.ravel() for a in body.shapes.arrays)])


@pytest.mark.parametrize("name", BODIES)
def test_bodies_are_linear_in_their_sizes_and_use_every_one(name, rng):
    one, other = (SIZES.to_array() * rng.uniform(0.8, 1.2, 18) for _ in range(2))
    a, b, both = (measures(make_body(name, CardboxSizes.from_array(x))) for x in (one, other, (one + other) / 2))
    np.testing.assert_allclose((a + b) / 2, both, atol=1e-12)
    np.testing.assert_allclose(measures(make_body(name, CardboxSizes.from_array(one / 2))), a / 2, atol=1e-12)
    for i, size in enumerate(NAMES):
        changed = measures(make_body(name, CardboxSizes.from_array(one + 0.01 * np.eye(18)[i])))
        assert np.abs(changed - a).max() > 1e-4, size


def test_elbows_of_two_bends_reach_what_hinges_reach(rng):
    """Every place of a hand up to a flexion of 135 degrees, from the same upper arm; straight arms among them."""
    hinge, bends = cardbox(SIZES), cardbox_bends(SIZES)
    poses = random_poses(rng, hinge.skeleton, 400)
    names, (low, high) = hinge.skeleton.dof_names, bends.skeleton.limits
    found = poses.copy()
    for side in SIDES:
        roll, flexion = (names.index(f"{side}_elbow_{what}") for what in ("roll", "flexion"))
        poses[:, flexion] = np.minimum(poses[:, flexion], np.radians(135))
        poses[:, roll] = np.clip(poses[:, roll], *np.radians([-93, 93]))  # beyond, a bent forearm is farther back than its limit
        poses[:10, flexion] = 0.0
        x, y, z = (np.sin(poses[:, flexion]) * np.cos(poses[:, roll]), np.sin(poses[:, flexion]) * np.sin(poses[:, roll]),
                   np.cos(poses[:, flexion]))
        over = np.abs(np.arctan2(y, z)) > high[roll]  # bent forward beyond a right angle
        forward = np.where(over, np.pi - np.arcsin(x), np.arcsin(x))
        found[:, roll], found[:, flexion] = np.where(over, np.arctan2(-y, -z), np.arctan2(y, z)), forward
    assert (found >= low - 1e-9).all()
    assert (found <= high + 1e-9).all()
    hands = ["left_hand", "right_hand"]
    np.testing.assert_allclose(bends.points(found, names=hands), hinge.points(poses, names=hands), atol=1e-12)


# Shapes ---------------------------------------------------------------------------------------------------------------


def test_the_fifteen_cards():
    count = Counter(cardbox(SIZES).parts)
    limbs = {f"{side}_{part}": 2 for side in SIDES for part in ("upper_arm", "forearm")}
    assert count == {"head": 2, "torso": 3, "waist": 2, **limbs}


def test_the_torso_s_third_card_lies_across_it_at_mid_height():
    body = cardbox(SIZES)
    assert isinstance(body.shapes, Quads)
    third = body.shapes.corners[shapes_of(body, "torso")[2]]
    np.testing.assert_allclose(third[:, 2], SIZES.torso_height / 2)
    assert np.ptp(third[:, 1]) == pytest.approx((SIZES.shoulder_width + SIZES.torso_bottom_width) / 2)
    assert np.ptp(third[:, 0]) == pytest.approx((SIZES.torso_top_depth + SIZES.torso_bottom_depth) / 2)


@pytest.mark.parametrize("make", [cardbox, boxes])
def test_cards_are_flat_and_convex(make):
    shapes = make(SIZES).shapes
    for quad in shapes.corners:
        edges = np.roll(quad, -1, 0) - quad
        normals = np.cross(edges, np.roll(edges, -1, 0))
        assert np.linalg.matrix_rank(quad - quad[0], tol=1e-9) == 2
        assert (normals @ normals[0] > 0).all()


def test_crossed_cards_are_perpendicular_and_share_the_part_s_axis():
    body = cardbox(SIZES)
    for part in dict.fromkeys(body.parts):
        quads = body.shapes.corners[shapes_of(body, part)]  # type: ignore[union-attr]
        normals = np.cross(quads[:, 1] - quads[:, 0], quads[:, 3] - quads[:, 0])
        for a, b in pairwise([*normals, normals[0]] if len(normals) > 2 else normals):
            assert a @ b == pytest.approx(0, abs=1e-12)
        np.testing.assert_allclose(quads.mean(1)[:, :2], 0, atol=1e-12)


def test_boxes_are_closed():
    body = boxes(SIZES)
    assert Counter(body.parts) == dict.fromkeys(cardbox(SIZES).parts, 6)
    for part in set(body.parts):
        faces = np.round(body.shapes.corners[shapes_of(body, part)], 9)  # type: ignore[union-attr]
        edges = Counter(frozenset((tuple(a), tuple(b))) for face in faces for a, b in zip(face, np.roll(face, -1, 0)))
        assert len(edges) == 12
        assert set(edges.values()) == {2}


def test_rounded_parts_reach_as_far_as_their_sizes_say():
    body = rounded(SIZES)
    assert isinstance(body.shapes, Hulls)
    T = body.skeleton.forward(body.skeleton.pose()[None])[0]

    def reach(part: str, axis: int) -> tuple[float, float]:
        i = shapes_of(body, part)[0]
        centres = (T[body.shapes.joints[i], :, :3] @ body.shapes.centres[i][..., None])[..., 0] + T[body.shapes.joints[i], :, 3]
        radii = body.shapes.radii[i]  # all frames have the body's axes in the zero pose
        return (centres - radii)[:, axis].min(), (centres + radii)[:, axis].max()

    chin = SIZES.torso_height + SIZES.neck_gap
    assert reach("head", 2) == pytest.approx((chin, chin + SIZES.head_height))
    assert np.ptp(reach("head", 1)) == pytest.approx(SIZES.head_width)
    assert np.ptp(reach("head", 0)) == pytest.approx(SIZES.head_depth)
    assert reach("waist", 2)[0] == pytest.approx(-SIZES.waist_height)
    elbow = body.points(body.skeleton.pose()[None], names=["left_elbow"])[0, 0, 2]
    assert reach("left_hand", 2)[0] == pytest.approx(elbow - SIZES.forearm_length)
    assert np.ptp(reach("left_upper_arm", 0)) == pytest.approx(max(SIZES.upper_arm_width, SIZES.elbow_width))
    assert np.ptp(reach("left_hand", 1)) == pytest.approx(SIZES.hand_width)
    assert np.ptp(reach("left_hand", 0)) == pytest.approx(2 * HALF_BREADTH / TO_TIP * SIZES.forearm_length)


def test_a_hand_looks_thin_palm_down_and_broad_palm_forward():
    """Level arms, palms down, show the thickness; a forearm bent upward beside a level upper arm shows the breadth."""
    person = rounded(SIZES.with_values(forearm_length=0.45, hand_width=0.03))
    camera = Camera("cam", (320, 240), np.array([[300.0, 0, 160], [0, 300, 120], [0, 0, 1]]))
    picture = Picture(person, camera, place(camera, 2.0, -0.2))
    hand = shapes_of(person, "left_hand")
    level = {"left_shoulder_abduction": np.pi / 2}
    down = count(picture.draw(person.skeleton.pose(**level), hand))
    forward = count(picture.draw(person.skeleton.pose(**level, left_elbow_roll=np.pi / 2, left_elbow_flexion=np.pi / 2), hand))
    assert forward > 1.8 * down


@pytest.mark.parametrize("name", BODIES)
def test_all_bodies_stand_on_the_same_skeleton_and_have_the_same_landmarks(name):
    body, paper = make_body(name, SIZES), cardbox(SIZES)
    assert body.name == name
    assert body.skeleton.joints == paper.skeleton.joints
    with_other_elbows = name == "cardbox_bends"
    assert [dof for dof in body.skeleton.dofs if "elbow" not in dof.name] == [dof for dof in paper.skeleton.dofs if "elbow" not in dof.name]
    assert (body.skeleton.dofs == paper.skeleton.dofs) is not with_other_elbows
    assert body.landmarks == paper.landmarks
    np.testing.assert_array_equal(body.hem, paper.hem)
    assert len(body.parts) == len(body.shapes.joints)
    assert bool(body.skeleton.couplings) == (name == "rounded")


# Landmarks and symmetry -----------------------------------------------------------------------------------------------


def test_landmarks_lie_along_the_arm_at_published_shares():
    body = cardbox(SIZES)
    pose = body.skeleton.pose(left_shoulder_abduction=0.4, left_elbow_flexion=1.1, left_elbow_roll=0.3)
    names = [f"left_{name}" for name in ("shoulder", "elbow", "wrist", "hand", "fist")]
    shoulder, elbow, wrist, hand, fist = body.points(pose[None], names=names)[0]
    assert np.linalg.norm(elbow - shoulder) == pytest.approx(SIZES.upper_arm_length)
    assert np.linalg.norm(fist - elbow) == pytest.approx(SIZES.forearm_length)
    for point, share in ((wrist, FOREARM / TO_TIP), (hand, (FOREARM + HAND_POINT) / TO_TIP)):
        np.testing.assert_allclose(point - elbow, share * (fist - elbow), atol=1e-12)


def test_points_are_chosen_by_name_and_moved_by_the_root(rng):
    body = rounded(SIZES)
    poses = random_poses(rng, body.skeleton, 4)
    root = rigid(rotation_from_vector([0.2, 0.1, -2.0]), [1.0, 2.0, 3.0])
    everything = body.points(poses)
    names = ["right_hand", "head"]
    np.testing.assert_array_equal(body.points(poses, names=names), everything[:, [body.landmark_names.index(n) for n in names]])
    np.testing.assert_allclose(body.points(poses, root), everything @ root[:3, :3].T + root[:3, 3], atol=1e-12)


@pytest.mark.parametrize("name", BODIES)
def test_a_mirrored_pose_has_mirrored_points(name, rng):
    body = make_body(name, SIZES)
    poses = random_poses(rng, body.skeleton, 20)
    swap = [n.replace("left", "L").replace("right", "left").replace("L", "right") for n in body.landmark_names]
    np.testing.assert_allclose(body.points(mirrored(body.skeleton, poses), names=swap), body.points(poses) * [1, -1, 1], atol=1e-12)
    np.testing.assert_array_equal(mirrored(body.skeleton, mirrored(body.skeleton, poses)), poses)


def test_unknown_names_are_said_with_what_there_is():
    with pytest.raises(ShadowPuppetError, match="unknown body 'ball'; there are: anatomical, boxes, cardbox, cardbox_bends, cyl"):
        make_body("ball", SIZES)
