"""Meshes of bodies: closed, seen from outside, where the limbs are, and carried by the joints that the shapes hang on."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
import runs

from shadowpuppet.camera.drawing import SIDE_COLOURS
from shadowpuppet.geometry import rigid
from shadowpuppet.motion.body_animation import TO_REST, BodyTree
from shadowpuppet.motion.mesh import Mesh, body_mesh, bone_mesh

WHOLE = ("anatomical", "cylinders")


def edges(mesh: Mesh) -> Counter:
    pairs = np.concatenate([mesh.triangles[:, [a, b]] for a, b in ((0, 1), (1, 2), (2, 0))])
    return Counter(map(tuple, pairs.tolist()))


def volume(mesh: Mesh) -> float:
    a, b, c = (mesh.points[mesh.triangles[:, n]] for n in range(3))
    return float(np.einsum("ij,ij->i", np.cross(a, b), c).sum() / 6)


@pytest.mark.parametrize("name", ["rounded", *WHOLE])
def test_solids_are_closed_and_their_normals_point_outward(name):
    mesh = body_mesh(runs.body_of(name))
    found = edges(mesh)
    assert all(count == 1 and found[b, a] == 1 for (a, b), count in found.items())
    assert 0.02 < volume(mesh) < 0.13  # cubic metres
    np.testing.assert_allclose(np.linalg.norm(mesh.normals, axis=1), 1, atol=1e-12)
    a, b, c = (mesh.points[mesh.triangles[:, n]] for n in range(3))
    areas = np.cross(b - a, c - a)
    facing = np.einsum("fi,fi->f", areas, mesh.normals[mesh.triangles].mean(1))
    assert (facing > -1e-12).all()


@pytest.mark.parametrize("name", ["cardbox", "boxes"])
def test_cards_are_sheets_seen_from_both_sides(name):
    body = runs.body_of(name)
    mesh = body_mesh(body)
    assert mesh.two_sided
    assert len(mesh.triangles) == 2 * len(body.parts)


@pytest.mark.parametrize("name", WHOLE)
def test_a_limbs_mesh_has_its_volume_and_ends(name):
    body = runs.body_of(name)
    mesh, limbs, tree = body_mesh(body), body.limbs, BodyTree(body)
    assert limbs is not None
    rest = tree.animation(np.zeros(1), np.zeros((1, len(body.skeleton.dofs))), np.eye(4)).rest
    (a, b), (c, d) = limbs.radii[:, 0].T, limbs.radii[:, 1].T  # at the start, at the end
    tubes = np.pi * limbs.lengths * (a * b / 3 + c * d / 3 + (a * d + b * c) / 6)
    domes = 2 / 3 * np.pi * (a * b * limbs.caps[:, 0] + c * d * limbs.caps[:, 1])
    assert volume(mesh) == pytest.approx((tubes + domes).sum(), rel=0.04)
    for joint, place in zip(limbs.joints, limbs.ends):
        node = tree.node_of(int(joint))
        tip = rest[node] + TO_REST @ place
        own = mesh.points[mesh.joints == node]
        assert np.linalg.norm(own - tip, axis=1).min() < 0.11


@pytest.mark.parametrize("name", runs.BODIES)
def test_in_any_pose_the_mesh_lies_where_the_bodys_shapes_are(name, rng):
    """Silhouette-free check: each corner of a card, or each ellipsoid's centre, moved by the body, lies in the moved mesh's box."""
    body = runs.body_of(name)
    mesh, tree = body_mesh(body), BodyTree(body)
    pose = runs.smooth_poses(body, 20, rng)[7:8]
    animation = tree.animation(np.zeros(1), pose, np.eye(4))
    places, turns = animation.world()
    local = mesh.points - animation.rest[mesh.joints]
    moved = places[0, mesh.joints] + (turns[0, mesh.joints] @ local[..., None])[..., 0]
    frames = body.skeleton.forward(pose)[0]
    shapes = body.shapes
    centres = shapes.corners if hasattr(shapes, "corners") else shapes.centres
    joints = np.broadcast_to(shapes.joints, centres.shape[:2])
    for joint in np.unique(joints):
        own = (frames[joint, :, :3] @ centres[joints == joint].T + frames[joint, :, 3:]).T
        box = moved[mesh.joints == tree.node_of(int(joint))]
        assert (np.maximum(box.min(0) - own, own - box.max(0)) < 0.02).all()


def test_left_and_right_differ_in_colour():
    mesh = body_mesh(runs.body_of("anatomical"))
    left, right = (mesh.colours[mesh.points[:, 0] * side > 0.22] for side in (1, -1))
    assert len(left)
    for side, colour in ((left, SIDE_COLOURS["left"]), (right, SIDE_COLOURS["right"])):  # linear; the overlay's, blue green red
        assert 255 * side[0] ** (1 / 2.2) == pytest.approx(colour[::-1], abs=6)


def test_a_skeleton_alone_has_a_stick_along_every_bone(rng):
    body = runs.body_of("anatomical")
    animation = BodyTree(body).animation(np.zeros(1), np.zeros((1, 32)), rigid(np.eye(3), np.zeros(3)))
    mesh = bone_mesh(animation)
    found = edges(mesh)
    assert all(found[b, a] == 1 for a, b in found)
    assert volume(mesh) > 0
    for parent, along in zip(animation.parents, animation.offsets):
        if parent >= 0 and np.linalg.norm(along) > 0:
            middle = animation.rest[parent] + along / 2
            assert np.linalg.norm(mesh.points[mesh.joints == parent] - middle, axis=1).min() < 0.06
