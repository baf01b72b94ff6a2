"""Kernels of the corrections against plain NumPy."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.silhouette.correction import _kernels as kernels
from shadowpuppet.silhouette.correction.registration import BENT, Registration

pytestmark = pytest.mark.kernels


def interpolated(image: np.ndarray, matrix: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The image (H, W, C) at moved places, linear between pixels, and the distance (H, W) of each place to the border, negative outside."""
    height, width = image.shape[:2]
    y, x = np.mgrid[:height, :width]
    u, v, w = np.tensordot(matrix, np.stack([x, y, np.ones_like(x)]), 1)
    u, v = u / w, v / w
    j, i = np.clip(np.floor(u).astype(int), 0, width - 2), np.clip(np.floor(v).astype(int), 0, height - 2)
    p, q = (u - j)[..., None], (v - i)[..., None]
    above, below = (image[r, j] * (1 - p) + image[r, j + 1] * p for r in (i, i + 1))
    return above * (1 - q) + below * q, np.min([u, v, width - 1 - u, height - 1 - v], axis=0)


@settings(max_examples=30, deadline=None)
@given(turn=st.floats(-0.3, 0.3), shift=st.tuples(st.floats(-20, 20), st.floats(-20, 20)), bend=st.floats(-0.05, 0.05),
       channels=st.sampled_from([1, 3]), seed=st.integers(0, 9))
def test_a_picture_is_moved_back_as_by_plain_interpolation(turn, shift, bend, channels, seed):
    rng = np.random.default_rng(seed)
    image = np.repeat(np.repeat(rng.integers(0, 256, (6, 9, channels)), 8, 0), 8, 1).astype(np.uint8)
    movement = np.array([[np.cos(turn), -np.sin(turn), shift[0] / 36], [np.sin(turn), np.cos(turn), shift[1] / 36], [bend, bend, 1]])
    with np.errstate(over="ignore"):  # as in compiled kernels
        back, gap = Registration(image).undone(image, movement)
    to_pixels = np.array([[36, 0, 35.5], [0, 36, 23.5], [0, 0, 1]])
    plain, inside = interpolated(image.astype(float), to_pixels @ movement @ np.linalg.inv(to_pixels))
    assert np.abs(back - plain)[inside > 0.1].max(initial=0) <= 0.06 * 510 + 1  # places are right to 0.03 pixels in each direction
    assert (back[inside < -0.1] == 0).all()
    assert (inside[gap.unseen == 0] > -1).all()  # the outline of the gap has whole pixels as corners


@pytest.mark.parametrize("bend", [-2e-4, 5e-5, 1e-4, 2e-4])
def test_a_steep_picture_under_a_faint_tilt_is_moved_back_to_three_hundredths_of_a_pixel(bend):
    """Places along a row hardly drift apart, so that only the length of the pieces over which they count as linear holds the error."""
    steep = np.abs((np.arange(400) * 50) % 500 - 250).astype(np.uint8)  # up and down by 50 grey levels a pixel
    image = np.repeat(steep[None], 20, axis=0)
    movement = np.array([[1, 0, 0], [0, 1, 0], [200 * bend, 0, 1]])
    with np.errstate(over="ignore"):
        back, _ = Registration(image).undone(image, movement)
    to_pixels = np.array([[200, 0, 199.5], [0, 200, 9.5], [0, 0, 1]])
    plain, inside = interpolated(image[..., None].astype(float), to_pixels @ movement @ np.linalg.inv(to_pixels))
    assert np.abs(back - plain[..., 0])[inside > 0.1].max() <= BENT * 50 + 0.6  # rounded


@pytest.mark.parametrize("slope", [1e-17, 1e-19, 1e-25, 1e-300])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_movement_next_to_none_leaves_the_picture(slope, sign):
    image = np.random.default_rng(0).integers(0, 256, (9, 50), dtype=np.uint8)
    out, matrix = np.empty_like(image), np.eye(3)
    matrix[1, 0] = sign * slope
    with np.errstate(over="ignore"):
        kernels.moved_back(image, matrix, 1, np.arange(32, dtype=np.float32), out)
    inside = slice(int(sign < 0), -1)  # a place above the first row is outside
    np.testing.assert_array_equal(out[inside, :-1], image[inside, :-1])


def test_points_differ_as_by_plain_interpolation(rng):
    height, width, number = 20, 30, 200
    picture = rng.uniform(-1, 1, (height, width)).astype(np.float32)
    xy, value = rng.uniform(-1.1, 1.1, (number, 2)).astype(np.float32), rng.uniform(-1, 1, number).astype(np.float32)
    movement = (np.eye(3) + rng.normal(0, 0.03, (3, 3))).astype(np.float32)
    out = np.empty(number, np.float32)
    kernels.point_differences(xy, value, picture, movement, np.float32(9), out)
    x, y, w = (movement.astype(float) @ np.column_stack([xy, np.ones(number)]).T).astype(float)
    x, y = (x / w + 1) * width / 2 - 0.5, y / w * width / 2 + height / 2 - 0.5
    inside = (x >= 0) & (x < width - 1) & (y >= 0) & (y < height - 1)
    clear = np.minimum(np.abs(x - np.rint(x)), np.abs(y - np.rint(y))) > 1e-4
    j, i = np.clip(x.astype(int), 0, width - 2), np.clip(y.astype(int), 0, height - 2)
    p, q = x - j, y - i
    above, below = (picture[r, j] * (1 - p) + picture[r, j + 1] * p for r in (i, i + 1))
    wanted = np.where(inside, above * (1 - q) + below * q - value, 9)
    assert 0.2 < inside.mean() < 0.9
    np.testing.assert_allclose(out[clear], wanted[clear], atol=1e-3)


@pytest.mark.parametrize("bands", [1, 2, 24])
@pytest.mark.parametrize("clips", [False, True])
def test_a_picture_is_divided_as_by_plain_arithmetic(bands, clips):
    rng = np.random.default_rng(bands)
    image, scene = (rng.integers(0, 256, (50, 33)).astype(np.uint8) for _ in range(2))
    factors, out = rng.uniform(0.5, 2, (bands, 33)).astype(np.float32), np.empty_like(image)
    kernels.divided(image, scene, factors, clips, out)
    middles, rows = (np.arange(bands) + 0.5) / bands * 50, np.arange(50) + 0.5
    factor = np.column_stack([np.interp(rows, middles, column) for column in factors.T])
    plain = image * factor + (np.maximum(scene - 255 * factor, 0) if clips else 0)
    assert np.abs(out - np.clip(plain, 0, 255)).max() <= 0.502


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 100), spread=st.floats(0.005, 0.3), number=st.integers(40, 300))
def test_weights_are_those_of_the_plain_median(seed, spread, number):
    rng = np.random.default_rng(seed)
    beyond, use = rng.normal(0, spread, (3, number)).astype(np.float32), (rng.random((3, number)) < 0.8).astype(np.float32)
    fit = rng.normal(0, 0.01, number).astype(np.float32)
    weights, (total, moment) = np.empty_like(beyond), np.empty((2, number), np.float32)
    kernels.surface_weights(beyond, use, fit, (0.03, 0.15), np.empty(128, np.float32), weights, total, moment)
    scale = np.clip(1.4826 * np.median(np.abs(beyond - fit)[use > 0]), 0.03, 0.15)
    plain = use / np.square(1 + np.square((beyond - fit) / (2 * scale)))
    np.testing.assert_allclose(weights, plain, atol=0.04)
    np.testing.assert_allclose(total, weights.sum(0), rtol=1e-5)
    np.testing.assert_allclose(moment, (weights * beyond).sum(0), atol=1e-5)


def test_shifts_cost_what_plain_loops_find():
    rng = np.random.default_rng(1)
    picture, reach, cap = rng.normal(size=(12, 16)).astype(np.float32), 3, np.float32(0.8)
    x, y, value = rng.integers(0, 16, 20), rng.integers(0, 12, 20), rng.normal(size=20).astype(np.float32)
    costs, numbers = (np.empty((7, 7), np.float32) for _ in range(2))
    kernels.shift_costs(x, y, value, np.pad(picture, reach), np.pad(np.ones_like(picture), reach), cap, costs, numbers)
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            inside = (x + dx >= 0) & (x + dx < 16) & (y + dy >= 0) & (y + dy < 12)
            there = np.minimum(np.abs(picture[y[inside] + dy, x[inside] + dx] - value[inside]), cap)
            assert costs[dy + reach, dx + reach] == pytest.approx(there.mean(), rel=1e-5)


def test_normal_equations_are_the_plain_ones():
    rng = np.random.default_rng(2)
    jacobian, difference = rng.normal(size=(60, 8)).astype(np.float32), rng.normal(size=60).astype(np.float32)
    left, right = np.empty((8, 8)), np.empty(8)
    kernels.normal_equations(jacobian, difference, np.float32(0.5), left, right)
    weight = 1 / ((1 + np.square(difference / 1.0)) * 0.5) ** 2
    np.testing.assert_allclose(left, (jacobian * weight[:, None]).T @ jacobian, rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(right, difference @ (jacobian * weight[:, None]), rtol=1e-4, atol=1e-4)
