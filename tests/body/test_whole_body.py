"""Bodies of the whole person: counts, sizes, where each angle sends what, mirror symmetry, and that limbs and pictures agree."""

from __future__ import annotations

import numpy as np
import pytest
from people import random_poses
from scipy import ndimage

from shadowpuppet.body.anthropometry import ANATOMICAL_SHARES, BONE_SHARES, CYLINDER_SHARES, SOLE, stature_of
from shadowpuppet.body.models import MODELS, WHOLE, average_sizes, kind_of, make_body, sizes_kind
from shadowpuppet.body.shapes import Body, Hulls, Limbs
from shadowpuppet.body.sizes import HEIGHTS, expected_metres, is_within
from shadowpuppet.body.skeleton import Dof, Joint, Skeleton
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.synthetic.person.mannequin import JOINTS
from shadowpuppet.synthetic.truth import SOLES

BODY = {name: make_body(name, average_sizes(name, 1.75)) for name in WHOLE}


def limbs_of(body: Body) -> Limbs:
    assert body.limbs is not None
    return body.limbs


def swung(name: str, joint: str, forward: float = 0.0, outward: float = 0.0, twist: float = 0.0) -> dict[str, float]:
    """Named values of a shoulder or hip, degrees, where a single one of them is not zero (or abduction is)."""
    forward, outward, twist = np.radians([forward, outward, twist])
    if name == "cylinders":
        return {f"{joint}_flexion": forward, f"{joint}_abduction": outward, f"{joint}_twist": twist}
    side = 1 if joint.startswith("left") else -1
    return {f"{joint}_x": side * outward, f"{joint}_y": -forward, f"{joint}_z": side * twist}


def mirrored(skeleton: Skeleton, poses: np.ndarray) -> np.ndarray:
    """Poses as in a mirror that swaps left and right."""
    names, swap = skeleton.dof_names, {"left": "right", "right": "left"}
    order = [names.index("_".join([swap.get(first, first), *rest])) for first, *rest in (name.split("_") for name in names)]
    across = ["root_y", "root_heading", "root_tilt", "head_bend", "head_twist"]
    signs = [-1.0 if dof.name in across or (dof.kind == "vector" and dof.axis != "y") else 1.0 for dof in skeleton.dofs]
    return poses[:, order] * signs


# Counts and sizes -----------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "dofs", "parts", "soles"), [("anatomical", 32, 18, SOLES), ("cylinders", 25, 10, ())])
def test_as_many_dof_parts_and_joints_as_said(name, dofs, parts, soles):
    body = BODY[name]
    assert (len(body.skeleton.dofs), len(body.parts), limbs_of(body).parts) == (dofs, parts, body.parts)
    assert set(body.landmark_names) == {*JOINTS, *soles}
    assert body.hem is None


def test_heel_and_toe_lie_on_the_sole_and_move_with_the_foot():
    body = BODY["anatomical"]
    for side, out in (("left", 1.0), ("right", -1.0)):
        flat = body.points(np.zeros((1, 32)), names=[f"{side}_{name}" for name in ("ankle", "heel", "toe")])[0]
        ankle, heel, toe = flat
        assert heel[2] == toe[2] < ankle[2] - 0.05
        assert heel[0] < ankle[0] < toe[0]
        assert 0.18 < toe[0] - heel[0] < 0.25
        assert out * (toe[1] - heel[1]) > 0  # toes are turned out
        turned = body.points(body.skeleton.pose(**{f"{side}_ankle_flexion": 0.3})[None], names=[f"{side}_toe"])[0, 0]
        assert turned[2] < toe[2] - 0.03  # toes down


def test_the_shanks_middle_lies_outside_the_bone():
    body = BODY["anatomical"]
    limbs = limbs_of(body)
    for side, out in (("left", 1.0), ("right", -1.0)):
        n = limbs.parts.index(f"{side}_shank")
        assert (out * np.array([limbs.starts[n, 1], limbs.ends[n, 1]]) > 0.004).all()


def test_the_shoulders_slope_from_the_neck_to_the_joints_and_move_with_the_chest():
    body = BODY["anatomical"]
    limbs = limbs_of(body)
    left, right = (limbs.parts.index(f"{side}_shoulder") for side in ("left", "right"))
    joints = body.points(np.zeros((1, 32)), names=["left_shoulder", "neck"])[0]
    chest = body.skeleton.forward(np.zeros((1, 32)))[0][body.skeleton.joint_index("chest"), :, 3]
    assert {int(limbs.joints[n]) for n in (left, right)} == {body.skeleton.joint_index("chest")}
    np.testing.assert_allclose(limbs.ends[left] + chest, joints[0])
    np.testing.assert_allclose([limbs.ends[left], limbs.starts[left]], np.array([limbs.starts[right], limbs.ends[right]]) * [1, -1, 1])
    way = limbs.starts[left] - limbs.ends[left]
    np.testing.assert_allclose(way[2] / -way[1], 0.5)
    assert limbs.starts[left, 2] + chest[2] < joints[1, 2]  # its axis begins below the base of the neck


def measures(body: Body) -> np.ndarray:
    """All lengths that a body is made of, as one array."""
    offsets, places = [joint.offset for joint in body.skeleton.joints], [place for _, place in body.landmarks.values()]
    return np.concatenate([np.ravel(offsets), np.ravel(places), *(a.ravel() for a in (*body.shapes.arrays, *limbs_of(body).arrays))])


@pytest.mark.parametrize("name", WHOLE)
def test_bodies_are_linear_in_their_sizes_and_use_every_one(name, rng):
    kind, mean = sizes_kind(name), average_sizes(name, 1.75).to_array()
    one, other = (mean * rng.uniform(0.8, 1.2, len(mean)) for _ in range(2))
    a, b, both = (measures(make_body(name, kind.from_array(x))) for x in (one, other, (one + other) / 2))
    np.testing.assert_allclose((a + b) / 2, both, atol=1e-12)
    for i, size in enumerate(kind.names()):
        changed = measures(make_body(name, kind.from_array(one + 0.01 * np.eye(len(mean))[i])))
        assert np.abs(changed - a).max() > 4e-4, size


@pytest.mark.parametrize("name", WHOLE)
def test_sizes_are_kept_checked_and_grow_with_the_height(name):
    sizes, kind = average_sizes(name, 1.75), sizes_kind(name)
    assert kind.from_mapping(dict(zip(kind.names(), sizes.to_array().tolist()))) == sizes
    assert set(kind.names()) == set(ANATOMICAL_SHARES if name == "anatomical" else CYLINDER_SHARES)
    np.testing.assert_allclose(sizes.to_array() / (1.75 - SOLE), average_sizes(name, 1.4).to_array() / (1.4 - SOLE))
    assert sizes.with_values(hip_forward=-0.02, shoulder_drop=0.0).to_array() is not None
    with pytest.raises(ShadowPuppetError, match=r"size thigh_length: found 44\.0, expected 0\.005 to 2\.0 metres"):
        sizes.with_values(thigh_length=44.0)
    with pytest.raises(ShadowPuppetError, match=r"body 'cardbox': found .*Sizes, expected CardboxSizes"):
        make_body("cardbox", sizes)
    with pytest.raises(ShadowPuppetError, match="unknown body 'ball'; there are: anatomical, boxes, cardbox, cardbox_bends, cyl"):
        sizes_kind("ball")
    assert set(MODELS) > set(WHOLE)
    assert kind_of(sizes) == name


@pytest.mark.parametrize("name", WHOLE)
def test_who_stands_is_as_tall_as_said(name):
    body = BODY[name]
    low, high = (f(surface(body, np.zeros(len(body.skeleton.dofs)))[:, 2]) for f in (np.min, np.max))
    assert high - low == pytest.approx(1.75 - SOLE, abs=0.03)
    at = dict(zip(body.landmark_names, body.points(np.zeros((1, len(body.skeleton.dofs))))[0]))
    for lower, upper in (("left_ankle", "left_knee"), ("left_knee", "left_hip"), ("left_hip", "neck"), ("neck", "head"),
                         ("left_hand", "left_wrist"), ("left_wrist", "left_elbow"), ("left_elbow", "left_shoulder")):  # fmt: skip
        assert at[lower][2] < at[upper][2]
    assert at["left_hip"][1] > 0 > at["right_hip"][1]


# Angles ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("side", ["left", "right"])
@pytest.mark.parametrize("name", WHOLE)
@pytest.mark.parametrize(("angles", "start", "end", "wanted"), [
    ({"shoulder": {"forward": 90}}, "shoulder", "elbow", [1, 0, 0]),
    ({"shoulder": {"outward": 90}}, "shoulder", "elbow", [0, 1, 0]),
    ({"shoulder": {"forward": 180}}, "shoulder", "elbow", [0, 0, 1]),
    ({"hip": {"forward": 90}}, "hip", "knee", [1, 0, 0]),
    ({"hip": {"outward": 45}}, "hip", "knee", [0, np.sqrt(0.5), -np.sqrt(0.5)]),
    ({"elbow_flexion": np.pi / 2}, "elbow", "wrist", [1, 0, 0]),
    ({"elbow_flexion": np.pi / 2, "shoulder": {"twist": 90}}, "elbow", "wrist", [0, 1, 0]),
    ({"knee_flexion": np.pi / 2}, "knee", "ankle", [-1, 0, 0]),
    ({"knee_flexion": np.pi / 2, "hip": {"twist": 30}}, "knee", "ankle", [-np.sqrt(0.75), -0.5, 0]),
])  # fmt: skip
def test_where_a_limb_points(name, side, angles, start, end, wanted):
    body = BODY[name]
    values = {}
    for joint, value in angles.items():
        values |= swung(name, f"{side}_{joint}", **value) if isinstance(value, dict) else {f"{side}_{joint}": value}
    pose = body.skeleton.pose(**values)
    np.testing.assert_array_equal(body.skeleton.clamp(pose), pose)
    a, b = body.points(pose[None], names=[f"{side}_{start}", f"{side}_{end}"])[0]
    np.testing.assert_allclose((b - a) / np.linalg.norm(b - a), np.array(wanted) * [1, 1 if side == "left" else -1, 1], atol=1e-12)


@pytest.mark.parametrize("name", WHOLE)
@pytest.mark.parametrize(("values", "wanted"), [
    ({}, [0, 0, 1]), ({"root_bow": np.pi / 2}, [1, 0, 0]), ({"root_tilt": np.pi / 6}, [0, -0.5, np.sqrt(0.75)]),
    ({"root_heading": np.pi / 2, "root_bow": np.pi / 2}, [0, 1, 0]),
])  # fmt: skip
def test_where_the_trunk_points(name, values, wanted):
    a, b = BODY[name].points(BODY[name].skeleton.pose(**values, root_x=1.0, root_z=0.9)[None], names=["pelvis", "neck"])[0]
    np.testing.assert_allclose(a, [1, 0, 0.9])
    np.testing.assert_allclose((b - a) / np.linalg.norm(b - a), wanted, atol=1e-12)


def test_toes_point_forward_then_down_and_soles_turn_inward():
    body = BODY["anatomical"]

    def foot(**values: float) -> np.ndarray:
        return body.skeleton.forward(body.skeleton.pose(**values)[None])[0, body.skeleton.joint_index("left_ankle"), :, :3]

    np.testing.assert_allclose(foot()[:, 0], [1, 0, 0])
    np.testing.assert_allclose(foot(left_ankle_flexion=0.5)[:, 0], [np.cos(0.5), 0, -np.sin(0.5)], atol=1e-12)
    assert (foot(left_ankle_inversion=0.3) @ [0, 0, -1])[1] < 0  # the left sole shows to the right


@pytest.mark.parametrize("name", WHOLE)
def test_a_mirrored_pose_is_the_mirrored_person(name, rng):
    body = BODY[name]
    poses = random_poses(rng, body.skeleton, 20)
    other = [n.replace("left", "L").replace("right", "left").replace("L", "right") for n in body.landmark_names]
    swap = [body.landmark_names.index(n) for n in other]
    np.testing.assert_allclose(body.points(mirrored(body.skeleton, poses)), body.points(poses)[:, swap] * [1, -1, 1], atol=1e-12)
    low, high = body.skeleton.limits
    np.testing.assert_allclose(np.sort(mirrored(body.skeleton, np.stack([low, high])), axis=0), [low, high])
    np.testing.assert_allclose(body.skeleton.posture_penalty(mirrored(body.skeleton, poses)), body.skeleton.posture_penalty(poses))


def test_vectors_have_three_components_in_a_row():
    def vector(*axes: str) -> Skeleton:
        return Skeleton((Joint("a", None),), tuple(Dof(f"d{i}", "a", axis, kind="vector") for i, axis in enumerate(axes)))  # type: ignore[arg-type]

    assert len(vector(*"xyz").dofs) == 3
    for axes in ("x", "xy", "xzy", "yzx", "xyzx", ("x", "y", "-z")):
        with pytest.raises(ShadowPuppetError, match=r"degree of freedom 'd.': a rotation vector has three components in a row"):
            vector(*axes)
    split = (Dof("x", "a", "x", kind="vector"), Dof("y", "a", "y", kind="vector"), Dof("r", "a", "z"), Dof("z", "a", "z", kind="vector"))
    with pytest.raises(ShadowPuppetError, match="degree of freedom 'x'"):
        Skeleton((Joint("a", None),), split)


@pytest.mark.parametrize("name", WHOLE)
def test_a_limb_is_drawn_as_wide_and_deep_as_it_is(name):
    limbs, shapes = limbs_of(BODY[name]), BODY[name].shapes
    assert isinstance(shapes, Hulls)
    along = (np.abs(np.swapaxes(limbs.rotations, 1, 2))[:, None] @ shapes.radii[..., None])[..., 0]
    np.testing.assert_allclose(along[..., :2], limbs.radii)
    assert (along[..., 2] >= limbs.caps).all()
    np.testing.assert_allclose(shapes.centres, np.stack([limbs.starts, limbs.ends], 1))


# Limbs and pictures ---------------------------------------------------------------------------------------------------


def surface(body: Body, pose: np.ndarray, number: int = 40) -> np.ndarray:
    """Points (P, 3) on the limbs of a pose, as `Limbs` defines them: round rings along each limb and its domes."""
    limbs, T = limbs_of(body), body.skeleton.forward(pose[None])[0]
    turn = np.linspace(0, 2 * np.pi, number)
    points = []
    for s in range(len(limbs.parts)):
        rings = [(t, 1.0, 0.0) for t in np.linspace(0, 1, number)]
        rings += [(float(end), np.sqrt(1 - h * h), h * limbs.caps[s, end] * (2 * end - 1)) for end in (0, 1) for h in np.linspace(0, 1, 8)]
        for along, narrow, beyond in rings:
            radii = narrow * ((1 - along) * limbs.radii[s, 0] + along * limbs.radii[s, 1])
            middle = np.array([*(along * limbs.shears[s]), along * limbs.lengths[s] + beyond])
            ring = middle + np.stack([radii[0] * np.cos(turn), radii[1] * np.sin(turn), 0 * turn], 1)
            frame = T[limbs.joints[s]]
            points.append((limbs.starts[s] + ring @ limbs.rotations[s].T) @ frame[:, :3].T + frame[:, 3])
    return np.concatenate(points)


@pytest.mark.parametrize("name", WHOLE)
@pytest.mark.parametrize("view", [[0, 0.2, 0], [0, 1.2, 0.3], [0, -2.3, -0.2]])
def test_what_is_drawn_is_what_the_limbs_are(name, view, rng):
    turn = rotation_from_vector(view) @ np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]])
    camera = Camera("cam", (160, 160), np.array([[200, 0, 79.5], [0, 200, 79.5], [0, 0, 1]]), T_camera_world=rigid(turn, [0, 0, 3]))
    body = BODY[name]
    pose = body.skeleton.clamp(0.3 * random_poses(rng, body.skeleton, 1))[0]
    mask = Picture(body, camera, camera.T_camera_world).mask(pose)
    at = np.rint(camera.project(surface(body, pose))).astype(int)
    hit = np.zeros_like(mask)
    hit[at[:, 1], at[:, 0]] = True
    filled = ndimage.binary_fill_holes(hit)
    assert (mask & ~ndimage.binary_dilation(filled)).sum() == 0
    missing = filled & ~ndimage.binary_dilation(mask, iterations=2)  # the outline is a polygon of ten corners: round ends lose some
    assert missing.sum() < 0.01 * mask.sum()
    assert not Picture(body, camera, camera.T_camera_world).leg_bits(pose).any()


def test_the_likeliest_stature_is_between_those_of_the_bones_nearer_to_the_surer():
    assert stature_of({name: 1.7 * share for name, (share, _) in BONE_SHARES.items()}) == pytest.approx(1.7)
    thigh, ankle = BONE_SHARES["thigh_length"], BONE_SHARES["ankle_height"]
    lengths = {"thigh_length": 1.6 * thigh[0], "ankle_height": 1.8 * ankle[0], "trunk_width": 9.0}  # of the last nothing is known
    grid = np.linspace(1.5, 2.0, 5001)
    unlikely = sum(((grid * share - lengths[name]) / deviation) ** 2
                   for name, (share, deviation) in (("thigh_length", thigh), ("ankle_height", ankle)))
    assert stature_of(lengths) == pytest.approx(grid[unlikely.argmin()], abs=1e-4)


@pytest.mark.parametrize(("height", "fits", "hint"), [
    (1.75, True, ""), (0.5, True, ""), (2.5, True, ""), (2.51, False, ""), (0.4, False, ""), (175, False, " (175 cm are 1.75)"),
    (True, False, ""), ("1.75", False, "")])  # fmt: skip
def test_heights_are_metres_and_centimetres_get_a_hint(height, fits, hint):
    assert is_within(height, HEIGHTS) == fits
    assert expected_metres(height, HEIGHTS) == f"expected 0.5 to 2.5 metres{hint}"
