"""Projection by OpenCV's, by rays and by points on surfaces: the near plane, lenses, outlines of hulls."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from people import BODIES, LENSES, camera, picture, random_poses

from shadowpuppet.body.shapes import Body, Quads
from shadowpuppet.body.skeleton import Joint, Skeleton
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.projection import DIRECTIONS, FARTHEST, NEAR_PLANE, make_lens, pixel_nearest
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.jit import kernel

seeds = st.integers(0, 2**32 - 1)


def one_quad(corners: np.ndarray, cam: Camera) -> Picture:
    """A quad (4, 3) given in the camera's frame, as a body."""
    shapes = Quads(np.zeros((1, 1), np.int64), corners[None])
    body = Body("quad", Skeleton((Joint("root", None),), ()), shapes, ("part",), {}, np.zeros((2, 3)))
    return Picture(body, cam, np.eye(4))


def quad_at(rng: np.random.Generator, depth: tuple[float, float] = (-0.3, 1.5)) -> np.ndarray:
    """A flat convex quad (4, 3), a trapezium as all cards are, of any attitude at any place near the axis."""
    w, h, x = rng.uniform(0.05, 1.0, 3)
    flat = np.array([[-w, -h, 0], [w, -h, 0], [x * w, h, 0], [-x * w, h, 0]])
    T = rigid(rotation_from_vector(rng.standard_normal(3) * 1.5), [*rng.uniform(-0.4, 0.4, 2), rng.uniform(*depth)])
    return flat @ T[:3, :3].T + T[:3, 3]


@kernel
def all_nearest(points, T, lens, out):
    for p in range(points.shape[0]):
        out[p] = pixel_nearest(T, lens, points[p, 0], points[p, 1], points[p, 2])


@pytest.mark.kernels
@pytest.mark.parametrize("lens", LENSES)
@given(seeds)
@settings(max_examples=30, deadline=None)
def test_the_nearest_pixel_is_that_of_the_camera(lens, seed):
    rng = np.random.default_rng(seed)
    cam, points = camera((70, 50), lens), rng.normal(scale=2, size=(50, 3))
    found, pixels = np.zeros((50, 2), np.int64), cam.project(points)
    all_nearest(points, cam.T_camera_world, make_lens(cam), found)
    ahead = np.isfinite(pixels[:, 0])
    assert (found[~ahead] == -1).all()
    assert (np.abs(found[ahead] - np.clip(pixels[ahead], -FARTHEST, FARTHEST)) < 0.5 + 1e-6).all()


def projected(view: Picture, poses=None) -> tuple[np.ndarray, np.ndarray]:
    poses = np.zeros((1, len(view.body.skeleton.dofs))) if poses is None else poses
    return view.polygons(view.transforms(poses), np.arange(len(view.body.parts)))


@pytest.mark.kernels
@given(seeds)
@settings(max_examples=100, deadline=None)
def test_cards_are_cut_at_the_near_plane(seed):
    rng = np.random.default_rng(seed)
    cam, quad = camera((40, 30)), quad_at(rng)
    corners, counts = projected(one_quad(quad, cam))
    kept = naive.clipped(quad)
    assert counts[0, 0] == len(kept)
    if kept:
        np.testing.assert_allclose(corners[0, 0, : len(kept)], naive.to_pixels(cam, kept), rtol=1e-9, atol=1e-9)


@given(seeds)
@settings(max_examples=100, deadline=None)
def test_a_card_is_the_pixels_whose_rays_hit_it(seed):
    """Nearly all of these cards cross the near plane, the picture's border or both; the oracle knows no projection."""
    rng = np.random.default_rng(seed)
    cam, quad = camera((70, 50)), quad_at(rng)
    hit, close = naive.seen_through(quad, cam)
    drawn = one_quad(quad, cam).mask([])
    np.testing.assert_array_equal(drawn[~close], hit[~close])


@pytest.mark.parametrize(("depths", "number"), [
    ([1, 1, 1, 1], 4), ([-1, -1, -1, -1], 0), ([0, 0, 0, 0], 0), ([NEAR_PLANE / 2] * 4, 0), ([NEAR_PLANE] * 4, 4),
    ([1, 1, -1, -1], 4), ([1, 1, 1, -1], 5), ([1, -1, -1, -1], 3), ([-1, 1, -1, -1], 3), ([0, 1, 1, 0], 4), ([-1, -1, -1, 1], 3),
])  # fmt: skip
def test_how_many_corners_are_left_in_front(depths, number):
    flat = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]], float)
    corners, counts = projected(one_quad(np.column_stack([flat, depths]), camera()))
    assert counts[0, 0] == number
    assert np.isfinite(corners[0, 0, :number]).all()


@pytest.mark.kernels
@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("body", BODIES)
def test_corners_are_where_opencv_sees_them(lens, body, rng):
    view = picture(body, camera(lens=lens))
    poses = random_poses(rng, view.body.skeleton, 6)
    corners, counts = projected(view, poses)
    for n, pose in enumerate(poses):
        joints = naive.forward(view.body.skeleton, pose, view.T_camera_base)
        for shape in range(len(view.body.parts)):
            expected = naive.polygon(view, joints, shape)
            assert counts[n, shape] == len(expected)
            np.testing.assert_allclose(corners[n, shape, : len(expected)], expected, atol=1e-7)


def test_an_equidistant_fisheye_is_no_pinhole():
    quad = np.array([[1.0, -0.1, 1], [1.2, -0.1, 1], [1.2, 0.1, 1], [1.0, 0.1, 1]])
    corners = [projected(one_quad(quad, camera(lens=lens)))[0][0, 0, 0] for lens in ("pinhole", "equidistant")]
    cam = camera()
    radius = np.hypot(1.0, 0.1)
    assert (corners[1] - cam.matrix[:2, 2]) / (corners[0] - cam.matrix[:2, 2]) == pytest.approx(np.arctan(radius) / radius)


FOLDING = [{"distortion": [-0.3, 0, 0, 0]}, {"distortion": [-0.05, 0, 0, 0]}, LENSES["rational"],
           {"distortion": [-0.25, 0, 0, 0], "fisheye": True}]


@pytest.mark.parametrize("lens", FOLDING)
def test_what_lies_outside_the_picture_is_not_bent_into_it(lens):
    """Polynomials turn back beyond the picture: without an end, k1 = -0.3 draws in its column 24 what stands at x = 2, z = 1."""
    cam = Camera("cam", (160, 120), camera().matrix, **lens)
    radii = np.linspace(0, 60, 500)
    quads = np.stack([radii, 0 * radii, 1 + 0 * radii], 1)
    x = np.concatenate([projected(one_quad(quads[i : i + 4], cam))[0][0, 0, :4, 0] for i in range(0, 500, 4)])
    assert (np.diff(x) > 0).all()
    reach = make_lens(cam)[4]
    assert 0.5 < reach < 60
    assert reach == pytest.approx(cam.reach)
    np.testing.assert_allclose(x, naive.to_pixels(cam, quads)[:, 0], atol=1e-6)


def test_only_bending_lenses_have_an_end():
    assert make_lens(camera())[3:] == (False, np.inf)
    assert make_lens(camera(lens="distorted"))[3:] == (True, np.inf)  # k2 holds k1's turn back
    assert make_lens(camera(lens="equidistant"))[3:] == (True, np.inf)


def ellipsoid_points(view: Picture, pose: np.ndarray, shape: int, number: int = 4000) -> np.ndarray:
    """Pixels of points all over the surfaces of a shape's ellipsoids."""
    i = np.arange(number) + 0.5
    polar, turn = np.arccos(1 - 2 * i / number), np.pi * (1 + 5**0.5) * i
    sphere = np.stack([np.cos(turn) * np.sin(polar), np.sin(turn) * np.sin(polar), np.cos(polar)], 1)
    shapes, T = view.body.shapes, view.transforms(pose[None])[0]
    ellipsoids = zip(shapes.joints[shape], shapes.centres[shape], shapes.radii[shape])
    points = [T[j, :, :3] @ (c + r * sphere).T + T[j, :, 3:] for j, c, r in ellipsoids]
    return naive.to_pixels(view.camera, np.concatenate(points, 1).T)


@pytest.mark.parametrize("distance", [1.2, 2.5])
def test_a_hull_s_corners_touch_the_outline_of_its_ellipsoids(distance, rng):
    view = picture("rounded", camera((640, 480)), distance)
    for pose in random_poses(rng, view.body.skeleton, 3) * 0.5:
        corners, counts = projected(view, pose[None])
        for shape in range(len(view.body.parts)):
            assert counts[0, shape] == len(DIRECTIONS)
            true = (ellipsoid_points(view, pose, shape) @ DIRECTIONS.T).max(0)
            mine = (corners[0, shape] @ DIRECTIONS.T).max(0)
            wide = np.ptp(corners[0, shape], axis=0).max()
            # An ellipsoid's outline is nearly that of the flat ellipse at its centre: nearly, the nearer the less.
            np.testing.assert_allclose(mine, true, atol=0.04 * wide)


def test_hulls_behind_the_camera_are_not_drawn():
    behind = picture("rounded", distance=-2.5)
    assert not projected(behind)[1].any()
    assert not behind.mask(np.zeros(12)).any()
