"""The camera: projection by its formula, its inverse, scaling, and what is no camera."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import rigid, rotation_from_vector, transform

SIZE = (640, 480)
MATRIX = np.array([[550.0, 0, 322], [0, 545, 238], [0, 0, 1]])
LENSES = [[], [-0.09, 0.05, 0.0004, -0.0003], [-0.3, 0.1, 0.001, 0.001, 0.01], [-0.3, 0.12, 0, 0, 0, 0.05, 0.02, 0.01]]

pixels = st.lists(st.tuples(st.floats(0, SIZE[0] - 1), st.floats(0, SIZE[1] - 1)), max_size=20)


def camera(**changes) -> Camera:
    T = rigid(rotation_from_vector([1.4, 0.3, -0.2]), [0.1, 1.0, 4.0])
    return Camera(**({"name": "cam1", "size": SIZE, "matrix": MATRIX, "distortion": LENSES[1], "T_camera_world": T} | changes))


def naive_projection(cam: Camera, point: np.ndarray) -> np.ndarray:
    """OpenCV's documented formula, one point."""
    X, Y, Z = transform(cam.T_camera_world, point)
    x, y = X / Z, Y / Z
    k1, k2, p1, p2, k3, k4, k5, k6 = cam.distortion
    r2 = x * x + y * y
    radial = (1 + k1 * r2 + k2 * r2**2 + k3 * r2**3) / (1 + k4 * r2 + k5 * r2**2 + k6 * r2**3)
    xd = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x)
    yd = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y
    return np.array([cam.matrix[0, 0] * xd + cam.matrix[0, 2], cam.matrix[1, 1] * yd + cam.matrix[1, 2]])


@pytest.mark.parametrize("lens", LENSES)
def test_projection_is_the_documented_formula(lens, rng):
    cam = camera(distortion=lens)
    points = rng.uniform(-1, 1, (50, 3))
    np.testing.assert_allclose(cam.project(points), [naive_projection(cam, p) for p in points], atol=1e-9)


@given(st.sampled_from(LENSES), pixels, st.floats(0.1, 20))
def test_rays_undo_projection(lens, where, depth):
    cam = camera(distortion=lens, T_camera_world=np.eye(4))
    where = np.array(where, float).reshape(-1, 2)
    rays = cam.rays(where)
    np.testing.assert_array_equal(rays[:, 2], 1)
    np.testing.assert_allclose(cam.project(rays * depth), where, atol=1e-8)


@given(pixels)
def test_rays_undo_fisheye_projection(where):
    cam = camera(distortion=[-0.02, 0.01, 0.001, 0.0], fisheye=True, T_camera_world=np.eye(4))
    where = np.array(where, float).reshape(-1, 2)
    np.testing.assert_allclose(cam.project(cam.rays(where) * 3), where, atol=1e-6)


@pytest.mark.parametrize("fisheye", [False, True])
def test_rays_do_not_depend_on_how_pixels_lie_in_memory(rng, fisheye):
    cam = camera(distortion=[-0.02, 0.01, 0.001, 0.0], fisheye=fisheye, T_camera_world=np.eye(4))
    table = rng.uniform(5, 100, (6, 3))
    np.testing.assert_array_equal(cam.rays(table[:, :2]), cam.rays(table[:, :2].copy()))


def test_points_at_and_behind_the_camera_have_no_pixel():
    cam = camera(T_camera_world=np.eye(4))
    found = cam.project([[0, 0, 1.0], [0, 0, 0], [0.1, 0.1, -1]])
    np.testing.assert_array_equal(np.isnan(found).all(-1), [False, True, True])


BARRELS = [{"distortion": [-0.3, 0.0, 0.0, 0.0]}, {"distortion": [-0.25, 0.02, 0.001, -0.002, 0.0]},
           {"distortion": [-0.05, -0.2, 0.0, 0.0], "fisheye": True}]
"""Lenses whose formulas turn back: the first from x = 1.05 on, so that x = 1.8 comes back to the middle of the picture."""


@pytest.mark.parametrize("lens", BARRELS)
@given(angle=st.floats(0, 2 * math.pi), depth=st.floats(0.1, 20))
def test_what_is_farther_out_is_seen_farther_out(lens, angle, depth):
    cam = camera(**lens, T_camera_world=np.eye(4))
    radii = np.linspace(0, 30, 400)
    points = depth * np.stack([radii * math.cos(angle), radii * math.sin(angle), np.ones(400)], 1)
    out = np.linalg.norm((cam.project(points) - cam.matrix[:2, 2]) / cam.matrix[[0, 1], [0, 1]], axis=1)
    assert 0.5 < cam.reach < 3
    assert (np.diff(out[radii > 0.1]) > -1e-3).all()  # near the end of its reach a lens hardly leads outward
    assert (np.diff(out[radii > cam.reach]) > 0.01).all()


@pytest.mark.parametrize("lens", BARRELS)
def test_a_lens_ends_where_its_formula_turns_and_is_what_it_was_up_to_there(lens):
    cam = camera(**lens, T_camera_world=np.eye(4))
    inside, outside = (cam.project([[share * cam.reach, 0, 1.0]])[0] for share in (0.999, 2.0))
    np.testing.assert_allclose(inside, cam._bent(np.array([[0.999 * cam.reach, 0]]))[0])
    edge = cam._bent(np.array([[cam.reach, 0]]))[0]
    np.testing.assert_allclose(outside - cam.matrix[:2, 2], 2 * (edge - cam.matrix[:2, 2]))
    beyond = [cam._bent(np.array([[share * cam.reach, 0]]))[0, 0] for share in (1.01, 1.1)]
    assert edge[0] > beyond[0] > beyond[1]  # it does turn


def test_what_lies_beyond_a_strong_barrel_is_not_in_the_picture():
    cam = camera(distortion=[-0.3, 0, 0, 0], T_camera_world=np.eye(4))
    assert naive_projection(cam, np.array([1.8, 0, 1.0]))[0] == pytest.approx(350, abs=1)  # in its middle, by the formula alone
    assert cam.project([1.8, 0, 1.0])[0] > SIZE[0]
    assert cam.reach == pytest.approx(1 / math.sqrt(0.9), rel=0.01)


@pytest.mark.parametrize("lens", [{"distortion": []}, {"distortion": [0.1, 0, 0, 0]}, {"distortion": [0.0] * 4, "fisheye": True}])
def test_lenses_that_never_turn_have_no_end(lens):
    assert camera(**lens).reach == math.inf


@pytest.mark.parametrize("lens", [{"distortion": [0.0] * 4, "fisheye": True}, BARRELS[2]])
def test_a_fisheye_sees_half_the_world_and_no_more(lens):
    cam = camera(**lens, T_camera_world=np.eye(4))
    angles = np.radians([0, 45, 89.9, 90, 90.1, 135, 180])
    found = cam.project(np.stack([np.sin(angles), np.zeros(7), np.cos(angles)], 1))
    np.testing.assert_array_equal(np.isnan(found).all(1), angles >= np.radians(89.99))
    assert (np.diff(found[:3, 0]) > 0).all()


def test_shapes_are_kept_and_nothing_is_nothing():
    cam = camera()
    assert cam.project(np.zeros((2, 5, 3))).shape == (2, 5, 2)
    assert cam.rays(np.zeros((2, 5, 2))).shape == (2, 5, 3)
    assert cam.project(np.zeros((0, 3))).shape == (0, 2)
    assert cam.rays(np.zeros((0, 2))).shape == (0, 3)


def test_the_centre_is_where_the_camera_sees_itself_at_zero():
    cam = camera()
    np.testing.assert_allclose(transform(cam.T_camera_world, cam.centre), 0, atol=1e-12)


@given(st.integers(1, 2000), st.integers(1, 2000))
def test_scaling_maps_picture_corners_to_corners(width, height):
    # A picture covers [-0.5, size - 0.5] when pixel centres are at integers.
    cam = camera(distortion=[], T_camera_world=np.eye(4))
    small = cam.resized((width, height))
    corners = np.array([[-0.5, -0.5], [SIZE[0] - 0.5, SIZE[1] - 0.5]])
    np.testing.assert_allclose(small.project(cam.rays(corners)), [[-0.5, -0.5], [width - 0.5, height - 0.5]], atol=1e-6)
    assert small.size == (width, height)


def test_a_field_of_view_reaches_the_picture_s_edges_from_a_level_camera():
    cam = Camera.from_fov((320, 240), math.radians(60))
    left, right = cam.rays([[-0.5, 119.5], [319.5, 119.5]])
    assert math.degrees(math.atan(right[0])) == pytest.approx(30)
    assert left[0] == -right[0]
    assert not cam.oriented
    assert not cam.lens_measured
    assert replace(cam, distortion=np.array([0.1, 0, 0, 0])).lens_measured
    assert replace(cam, matrix=cam.matrix + np.array([[0, 0, 2.0], [0, 0, 0], [0, 0, 0]])).lens_measured
    above, ahead = cam.project([[0, 3.0, 1.0], [0, 3.0, 0]])  # z is up, y ahead
    assert above[1] < ahead[1]
    np.testing.assert_allclose(ahead, [159.5, 119.5])


R_TILTED = np.eye(4)
R_TILTED[0, 1] = 0.01
MIRROR = np.diag([-1.0, 1, 1, 1])


@pytest.mark.parametrize(("changes", "said"), [
    ({"size": (0, 480)}, "size: found [0.0, 480.0], expected two positive"),
    ({"size": (640.5, 480)}, "size"),
    ({"size": (640, 480, 3)}, "size: found [640.0, 480.0, 3.0], expected 2 finite"),
    ({"size": (math.nan, 480)}, "size"),
    ({"matrix": np.eye(4)}, "matrix"),
    ({"matrix": [[1, 2], [3]]}, "matrix: found [[1, 2], [3]], expected 3 x 3 finite numbers"),
    ({"matrix": MATRIX * np.nan}, "matrix"),
    ({"matrix": -MATRIX}, "positive focal lengths"),
    ({"matrix": MATRIX + np.eye(3)[:, [1, 2, 0]]}, "matrix"),
    ({"matrix": MATRIX + np.diag([2.0, 0], 1)}, "skew"),
    ({"distortion": [0.1] * 3}, "distortions: found 3 numbers, expected 0 or 4 or 5 or 8"),
    ({"distortion": [0.1] * 5, "fisheye": True}, "distortions: found 5 numbers, expected 4"),
    ({"distortion": [0.1, math.inf, 0, 0]}, "distortions"),
    ({"T_camera_world": np.eye(3)}, "rotation and translation"),
    ({"T_camera_world": np.full((4, 4), np.nan)}, "rotation and translation"),
    ({"T_camera_world": np.diag([1e200, 1, 1, 1])}, "rotation: found"),
    ({"T_camera_world": R_TILTED}, "rotation: found [[1.0, 0.01, 0.0]"),
    ({"T_camera_world": MIRROR}, "right-handed"),
])
def test_what_is_no_camera_is_said_with_name_and_field(changes, said):
    with pytest.raises(CalibrationError) as error:
        camera(**changes)
    assert "camera 'cam1'" in str(error.value)
    assert said in str(error.value)


@pytest.mark.parametrize("fov", [0, -1, math.pi, math.nan])
def test_an_impossible_field_of_view_is_said(fov):
    with pytest.raises(CalibrationError, match="between 0 and 180"):
        Camera.from_fov((320, 240), fov)
