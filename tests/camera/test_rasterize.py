"""Drawing against a half-plane oracle, to the pixel: borders, words, whole coordinates, whole people, and where they stand."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from mirror import mirrored
from people import BODIES, SIZES, camera, draw_polygon, picture, random_poses, shapes_of

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.upper_body import upper_body_skeleton
from shadowpuppet.camera.bits import pack, unpack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.jit import BLOCK

UNIT = 64
"""Polygons have corners at 64ths of a pixel, so that the oracle can count in whole numbers."""
SIZES_OF_PICTURES = [(1, 1), (1, 7), (7, 1), (63, 9), (64, 9), (65, 9), (130, 11), (192, 5)]
seeds = st.integers(0, 2**32 - 1)


@st.composite
def polygons(draw, whole: bool = False) -> tuple[np.ndarray, tuple[int, int]]:
    """A convex polygon (K, 2), in 64ths of a pixel, and a picture's size that it may lie in, stick out of, cover or miss."""
    width, height = size = draw(st.sampled_from(SIZES_OF_PICTURES))
    step = UNIT if whole else draw(st.sampled_from([1, 8, UNIT]))
    x = st.integers(-40 * UNIT // step, (width + 40) * UNIT // step).map(lambda v: v * step)
    y = st.integers(-10 * UNIT // step, (height + 10) * UNIT // step).map(lambda v: v * step)
    corners = np.array(naive.convex_hull(draw(st.lists(st.tuples(x, y), min_size=1, max_size=8)) + [(0, 0)] * draw(st.booleans())))
    if draw(st.booleans()):
        corners = corners[::-1]
    return np.roll(corners, draw(st.integers(0, len(corners))), 0), size


# Polygons -------------------------------------------------------------------------------------------------------------


@pytest.mark.kernels
@given(polygons())
@settings(max_examples=200, deadline=None)
def test_a_polygon_is_the_pixels_whose_centres_it_holds(made):
    corners, size = made
    np.testing.assert_array_equal(draw_polygon(corners / UNIT, size), naive.half_planes(corners, size, UNIT)[0])


@pytest.mark.kernels
@given(polygons(whole=True))
@settings(max_examples=120, deadline=None)
def test_corners_and_edges_on_pixel_centres_are_half_open(made):
    corners, size = made
    np.testing.assert_array_equal(draw_polygon(corners / UNIT, size), naive.half_planes(corners, size, UNIT)[0])


@pytest.mark.kernels
@given(polygons(whole=True), st.data())
@settings(max_examples=100, deadline=None)
def test_a_fan_of_triangles_around_a_whole_point_leaves_no_gap_and_overlaps_nowhere(made, data):
    corners, size = made
    low, high = corners.min(0), corners.max(0)
    inside = [st.integers(int(a) // UNIT, int(b) // UNIT).map(lambda v: v * UNIT) for a, b in zip(low, high)]
    middle = np.array(data.draw(st.tuples(*inside)))
    edges = list(zip(corners, np.roll(corners, -1, 0)))
    sides = [np.linalg.det(np.stack([b - a, middle - a]).astype(float)) for a, b in edges]
    if len(corners) < 3 or not (min(sides) >= 0 or max(sides) <= 0):
        return  # the point lies outside
    fan = sum(draw_polygon(np.array([a, b, middle]) / UNIT, size).astype(int) for a, b in edges)
    np.testing.assert_array_equal(fan, draw_polygon(corners / UNIT, size))


def test_a_grid_of_crooked_quads_covers_a_picture_once(rng):
    size = (150, 70)
    x, y = np.meshgrid(np.linspace(-10, 160, 9), np.linspace(-10, 80, 7))
    knots = np.stack([x, y], -1) + rng.integers(-4, 5, (7, 9, 2))
    cells = [knots[[i, i, i + 1, i + 1], [j, j + 1, j + 1, j]] for i in range(6) for j in range(8)]
    np.testing.assert_array_equal(sum(draw_polygon(cell, size).astype(int) for cell in cells), 1)


@pytest.mark.parametrize("corners", [
    [], [[3, 3]], [[1, 1], [9, 9]], [[1, 1], [5, 5], [9, 9]], [[1, 1], [9, 1], [5, 1]], [[4, 2]] * 4, [[1, 1], [1, 1], [9, 9], [9, 9]],
    [[-9, 2], [-3, 2], [-3, 8]], [[2, 99], [9, 99], [9, 120]], [[2, -9], [9, -9], [9, 0]], [[300, 2], [310, 2], [310, 8]],
    [[2.2, 2.2], [2.8, 2.2], [2.8, 2.8], [2.2, 2.8]], [[np.nan, 1], [5, 5], [1, 9]], [[1, np.nan], [5, 5], [1, 9]],
])  # fmt: skip
def test_what_holds_no_centre_draws_nothing(corners):
    assert not draw_polygon(np.array(corners, float).reshape(-1, 2), (100, 20)).any()


def test_what_covers_all_draws_all():
    for width in (1, 63, 64, 65, 200):
        assert draw_polygon([[-1e6, -1e6], [1e6, -1e6], [1e6, 1e6], [-1e6, 1e6]], (width, 5)).all()


@pytest.mark.kernels
@given(st.lists(st.tuples(*[st.sampled_from([np.nan, np.inf, -np.inf, 1e300, -1e300, 1e19, -1e9, 1e9, 0, 5.5, 63, 64, 1e-300])] * 2),
                min_size=1, max_size=5))
@settings(max_examples=100, deadline=None)
def test_nonsense_stays_inside_the_picture_and_draws_nothing(corners):
    with np.errstate(all="ignore"):
        drawn = draw_polygon(corners, (70, 9))  # with NUMBA_BOUNDSCHECK=1 a write past the end is an error
    assert drawn.shape == (9, 70)
    if not np.isfinite(corners).all():
        assert not drawn.any()


# Whole people ---------------------------------------------------------------------------------------------------------


@pytest.mark.kernels
@pytest.mark.parametrize("body", BODIES)
@pytest.mark.parametrize(("lens", "distance", "size"), [
    ("pinhole", 2.5, (160, 120)), ("distorted", 2.5, (130, 100)), ("equidistant", 1.5, (64, 48)),
    ("pinhole", 0.5, (97, 60)),  # the arms cross the near plane
    ("pinhole", 1.0, (1, 1)), ("pinhole", 3.0, (200, 7)),
])  # fmt: skip
def test_the_mask_is_the_union_of_all_parts(body, lens, distance, size, rng):
    view = picture(body, camera(size, lens), distance)
    poses = random_poses(rng, view.body.skeleton, 4)
    for pose in poses:
        drawn, doubtful = naive.silhouette(view, pose)
        assert doubtful.mean() < 0.01 or size == (1, 1)
        np.testing.assert_array_equal(view.mask(pose)[~doubtful], drawn[~doubtful])


def test_a_close_person_does_cross_the_near_plane(rng):
    view = picture("cardbox", camera((97, 60)), 0.5)
    T = view.transforms(random_poses(rng, view.body.skeleton, 50))
    counts = view.polygons(T, np.arange(15))[1]
    assert {0, 3, 4, 5} <= set(counts.ravel())


@pytest.mark.parametrize("body", BODIES)
def test_a_mirrored_pose_draws_a_mirrored_mask(body, rng):
    view = picture(body, camera((161, 120)))
    poses = random_poses(rng, view.body.skeleton, 10)
    for pose, other in zip(poses, mirrored(view.body.skeleton, poses)):
        a, b = view.mask(pose), view.mask(other)[:, ::-1]
        assert a.sum() > 100
        # Of a row's two ends on pixel centres one counts, the left: nothing else may differ.
        assert (a != b).sum() <= 2
    assert (view.mask(poses[0]) != view.mask(mirrored(view.body.skeleton, poses[:1])[0])).any()


def test_some_shapes_are_drawn_by_number_and_the_whole_is_their_union(rng):
    view = picture("rounded")
    pose = random_poses(rng, view.body.skeleton, 1)[0]
    parts = [view.draw(pose, np.array([i])) for i in range(len(view.body.parts))]
    np.testing.assert_array_equal(np.bitwise_or.reduce(parts), view.draw(pose))
    assert not view.draw(pose, np.array([], np.int64)).any()


@pytest.mark.kernels
@pytest.mark.parametrize("body", BODIES)
def test_added_counts_what_drawing_adds(body, rng):
    view = picture(body, camera((100, 75)))
    poses = random_poses(rng, view.body.skeleton, 6)
    silhouette, fixed = rng.random((75, 100)) < 0.5, rng.random((75, 100)) < 0.5
    which = np.array([1, 4, 5])
    found = view.added(poses, which, pack(silhouette), pack(fixed))
    for n, pose in enumerate(poses):
        new = unpack(view.draw(pose, which), 100) & ~fixed
        assert found[n] == (new & ~silhouette).sum() - (new & silhouette).sum()


@pytest.mark.parametrize("name", BODIES)
def test_people_of_different_sizes_are_drawn_at_once(name, rng):
    """More of them than a block holds; each as if alone."""
    view = picture(name)
    widths = rng.uniform(0.06, 0.2, BLOCK + 3)
    people = [SIZES.with_values(upper_arm_width=width, head_height=2 * width, torso_height=0.3 + width) for width in widths]
    poses = 0.5 * random_poses(rng, view.body.skeleton, len(people))
    bodies = [BODIES[name](sizes) for sizes in people]
    offsets = np.array([[joint.offset for joint in body.skeleton.joints] for body in bodies])
    measures = (offsets, *(np.array([b.shapes.arrays[i] for b in bodies]) for i in range(len(view.body.shapes.arrays))))
    which, none = np.arange(len(view.body.parts)), view.empty()
    found = view.added(poses, which, none, none, measures=measures)
    corners = view.polygons(view.transforms(poses), which, measures[1:])[0]
    for n in (0, 1, BLOCK - 1, BLOCK, BLOCK + 2):
        alone = Picture(bodies[n], view.camera, view.T_camera_base)
        assert found[n] == alone.mask(poses[n]).sum()
        with_own_joints = Picture(Body("b", view.body.skeleton, bodies[n].shapes, view.body.parts, {}, view.body.hem), view.camera,
                                  view.T_camera_base)  # fmt: skip
        expected = with_own_joints.polygons(view.transforms(poses[n : n + 1]), which)[0][0]
        np.testing.assert_array_equal(corners[n], expected)


def test_masks_of_another_size_are_refused():
    view = picture(cam=camera((100, 75)))
    good, wide, high = view.empty(), pack(np.zeros((75, 200))), pack(np.zeros((80, 100)))
    for silhouette, fixed in ((wide, good), (good, wide), (high, high)):
        with pytest.raises(ShadowPuppetError, match=r"words x rows, expected the camera's \(2, 75\)"):
            view.added(np.zeros((1, 12)), np.arange(3), silhouette, fixed)


def test_poses_of_another_length_are_refused():
    view = picture(cam=camera((100, 75)))
    for wrong in (np.zeros((3, 11)), np.zeros(12), np.zeros((2, 3, 12))):
        with pytest.raises(ShadowPuppetError, match=r"poses have shape .*, expected \(N, 12\)"):
            view.added(wrong, np.arange(3), view.empty(), view.empty())
    with pytest.raises(ShadowPuppetError, match="poses have shape"):
        view.draw(np.zeros(13))


# Where the body and its legs are --------------------------------------------------------------------------------------


def test_the_body_s_frame_is_the_paper_s():
    cam = camera()
    T = place(cam, 2.0, 0.3)
    np.testing.assert_allclose(T[:3, :3].T @ [0, 0, -1], [1, 0, 0], atol=1e-12)  # X toward the camera
    np.testing.assert_allclose(T[:3, :3].T @ [1, 0, 0], [0, 1, 0], atol=1e-12)  # Y to the image's right
    np.testing.assert_allclose(T[:3, 3], [0, -0.3, 2.0], atol=1e-12)


@given(st.floats(-1.0, 1.0), st.floats(0, 6.28), st.floats(0.5, 5), st.floats(-1, 1))
def test_the_body_stands_upright_in_the_world_however_the_camera_is_pitched(pitch, heading, distance, elevation):
    level = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])
    R = rotation_from_vector([pitch, 0, 0]) @ level @ rotation_from_vector([0, 0, heading])
    cam = Camera("cam", (160, 120), camera().matrix, T_camera_world=rigid(R, [0.3, 0.2, 1.0]))
    T = place(cam, distance, elevation)
    np.testing.assert_allclose(T[:3, 2], R @ [0, 0, 1], atol=1e-9)  # Z is the world's up
    np.testing.assert_allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-9)
    assert np.linalg.det(T[:3, :3]) > 0
    assert T[0, 3] == pytest.approx(0, abs=1e-9)  # straight ahead
    assert T[:3, 3] @ T[:3, 2] == pytest.approx(elevation, abs=1e-9)
    assert np.linalg.norm(T[:3, 3] - elevation * T[:3, 2]) == pytest.approx(distance)
    if pitch == 0:
        assert T[2, 3] == pytest.approx(distance)


def test_a_camera_that_looks_straight_down_uses_its_own_frame():
    cam = Camera("cam", (160, 120), camera().matrix, T_camera_world=rigid(rotation_from_vector([np.pi, 0, 0]), [0, 0, 3.0]))
    np.testing.assert_allclose(place(cam, 2.0, 0.0), place(camera(), 2.0, 0.0), atol=1e-12)


def test_points_in_the_world_are_those_in_the_camera_s_frame(rng):
    cam = Camera("cam", (160, 120), camera().matrix, T_camera_world=rigid(rotation_from_vector([1.4, 0.2, 0]), [0.3, 0.2, 1.0]))
    view = picture(cam=cam)
    poses = random_poses(rng, view.body.skeleton, 3)
    np.testing.assert_allclose(cam.project(view.points_world(poses)), naive.to_pixels(cam, view.points(poses)), atol=1e-9)


@pytest.mark.parametrize("twist", [0.0, 0.7, -1.2])
def test_legs_hang_from_the_waist_and_widen(twist):
    view = picture("rounded", camera((200, 220)), elevation=0.3)
    pose = view.body.skeleton.pose(torso_twist=twist)
    legs, waist = view.legs(pose), unpack(view.draw(pose, shapes_of(view.body, "waist")), 200)
    rows = np.flatnonzero(legs.any(1))
    assert abs(rows[0] - np.flatnonzero(waist.any(1))[-1]) <= 3
    assert rows[-1] == 219
    widths = legs[rows].sum(1)
    assert (np.diff(widths) >= 0).all()
    assert widths[-1] - widths[0] == pytest.approx(2 * np.tan(np.radians(25)) * (len(rows) - 1), abs=3)


@pytest.mark.parametrize("twist", [1.2, -1.2])
def test_legs_begin_in_the_middle_of_a_hem_that_is_seen_aslant(twist):
    view = picture("rounded", camera((200, 220)), distance=1.0, elevation=0.0)
    pose = view.body.skeleton.pose(torso_twist=twist)
    T = view.transforms(pose[None])[0, view.body.skeleton.joint_index("pelvis")]
    hem = view.body.hem
    assert hem is not None
    ends = naive.to_pixels(view.camera, hem @ T[:, :3].T + T[:, 3])[:, 1]
    assert np.ptp(ends) > 8
    assert abs(np.flatnonzero(view.legs(pose).any(1))[0] - ends.mean()) <= 1


def test_legs_out_of_the_picture_or_behind_the_camera_are_nowhere():
    assert not picture(elevation=-2.0).legs(np.zeros(12)).any()
    assert not picture(distance=-2.0).legs(np.zeros(12)).any()


def test_the_upper_body_has_no_other_measures_than_its_skeleton():
    assert upper_body_skeleton(SIZES) == picture().body.skeleton


def test_threads_that_share_a_picture_draw_what_one_alone_draws(rng):
    of = picture(cam=camera((320, 240)))
    poses, every = random_poses(rng, of.body.skeleton, 200), np.arange(len(of.body.parts))
    silhouette = of.draw(np.zeros(len(of.body.skeleton.dofs)))
    alone = of.added(poses, every, silhouette, of.empty())
    with ThreadPoolExecutor(4) as pool:
        for found in pool.map(lambda _: of.added(poses, every, silhouette, of.empty()), range(40)):
            assert (found == alone).all()
