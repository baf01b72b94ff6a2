"""Textured points: where they are taken, their derivatives, and the steps that a movement is found by, against plain computation."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from shadowpuppet.silhouette.correction.points import (
    BEND,
    BLOCKS,
    CORRELATION,
    MIN_SCALE,
    OUTSIDE,
    POINTS,
    REACH,
    SHIFTS,
    compared,
    matrix_of,
    median_of,
    refined,
    searched_shift,
    solved_step,
    textured_points,
)

WIDTH, HEIGHT = 160, 96


def picture(shift=(0, 0)) -> np.ndarray:
    """A smooth reduced picture (H, W), shifted by whole pixels."""
    rough = np.random.default_rng(3).normal(size=(HEIGHT + 80, WIDTH + 80))
    smooth = 3 * cv2.GaussianBlur(rough, (0, 0), 3)
    x, y = shift
    return smooth[40 - y : 40 - y + HEIGHT, 40 - x : 40 - x + WIDTH].astype(np.float32)


GREY = np.full((HEIGHT, WIDTH), 100, np.float32)


def points():
    found = textured_points(picture(), GREY)
    assert found is not None
    return found


def test_the_steepest_points_of_each_block_are_taken():
    found, values = points(), picture()
    down, across = np.gradient(values)
    slope = np.hypot(down, across)
    slope[:2] = slope[-2:] = slope[:, :2] = slope[:, -2:] = 0
    columns, rows = found.places
    taken = np.zeros((HEIGHT, WIDTH), bool)
    taken[rows, columns] = True
    high, wide = HEIGHT // BLOCKS[1], WIDTH // BLOCKS[0]
    for y in range(BLOCKS[1]):
        for x in range(BLOCKS[0]):
            block = slice(y * high, (y + 1) * high), slice(x * wide, (x + 1) * wide)
            steepest = np.sort(slope[block].ravel())[::-1]
            assert taken[block].sum() == min(POINTS, high * wide // 3)
            assert slope[block][taken[block]].min() == steepest[taken[block].sum() - 1]
    np.testing.assert_array_equal(found.value, values[rows, columns])
    np.testing.assert_allclose(found.xy, np.column_stack([(columns + 0.5) / 80 - 1, (rows + 0.5 - 48) / 80]), atol=1e-6)
    assert found.typical == median_of(np.abs(found.value))


def test_faint_slopes_are_no_points_and_a_plain_wall_has_none():
    values = np.zeros((HEIGHT, WIDTH), np.float32)
    values[:, 45:55] = picture()[:, 45:55]
    assert textured_points(values, GREY) is None  # in one of eight columns of blocks
    values[:, 65:75] = picture()[:, 65:75]
    assert textured_points(values, GREY) is not None
    steps = np.where(np.arange(WIDTH) % 2, 0.0, 0.1)[None].repeat(HEIGHT, 0).cumsum(1).astype(np.float32) / 2
    slope = float(np.hypot(*np.gradient(steps))[5, 5])
    assert textured_points(steps, np.full_like(GREY, 2.5 / slope - 16 + 0.1)) is not None
    assert textured_points(steps, np.full_like(GREY, 2.5 / slope - 16 - 0.1)) is None


def test_some_of_the_points_are_every_third():
    found, some = points(), points().some(3)
    for name in ("xy", "value", "jacobian", "rigid"):
        np.testing.assert_array_equal(getattr(some, name), getattr(found, name)[::3])
    np.testing.assert_array_equal(some.places, found.places[:, ::3])
    assert some.typical == found.typical


@pytest.mark.parametrize("parameter", range(8))
def test_derivatives_are_those_of_the_picture_under_a_small_movement(parameter):
    found, step = points(), 1e-3
    inner = (np.abs(found.xy) < [0.9, 0.5]).all(1)
    sides = [compared(found, picture(), matrix_of(sign * step * np.eye(8)[parameter])) for sign in (1, -1)]
    slope = (sides[0] - sides[1]) / (2 * step)
    assert np.corrcoef(slope[inner], found.jacobian[inner, parameter])[0, 1] > 0.97
    assert np.polyfit(found.jacobian[inner, parameter], slope[inner], 1)[0] == pytest.approx(1, abs=0.06)
    np.testing.assert_allclose(found.rigid, found.jacobian @ SHIFTS, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("shift", [(0, 0), (5, -3), (-16, 9), (2, 16)])
def test_a_shift_is_found_to_the_pixel(shift):
    assert round(REACH * WIDTH) == 16
    np.testing.assert_allclose(searched_shift(points(), picture(shift)), [[1, 0, shift[0] / 80], [0, 1, shift[1] / 80], [0, 0, 1]])


@pytest.mark.parametrize("rigid", [True, False])
def test_a_step_is_the_weighted_least_squares_one(rigid):
    found = points()
    movement = np.eye(3) + np.random.default_rng(0).normal(0, 0.002, (3, 3))
    movement /= movement[2, 2]
    difference = compared(found, picture((1, 0)), movement)
    typical = median_of(np.abs(difference))
    jacobian = (found.rigid if rigid else found.jacobian).astype(float)
    scale = max(1.4826 * typical, MIN_SCALE)
    weights = 1 / ((1 + (difference / (2 * scale)) ** 2) * scale) ** 2  # of Geman and McClure
    left = jacobian.T @ (weights[:, None] * jacobian)
    right = jacobian.T @ (weights * difference)
    if rigid:
        wanted = SHIFTS @ np.linalg.solve(left + np.eye(3), right)
    else:
        off_rigid = np.eye(8) - SHIFTS @ np.linalg.pinv(SHIFTS)
        prior = CORRELATION / BEND**2 * off_rigid
        wanted = np.linalg.solve(left + prior + np.eye(8), right + prior @ (movement - np.eye(3)).ravel()[:8])
    np.testing.assert_allclose(solved_step(found, difference, typical, movement, rigid), wanted, rtol=1e-3, atol=1e-6)


@pytest.mark.parametrize("rigid", [True, False])
def test_steps_end_at_the_movement(rigid):
    found = refined(points(), picture((2, -1)), np.eye(3), rigid, 1e-6)
    np.testing.assert_allclose(found, [[1, 0, 2 / 80], [0, 1, -1 / 80], [0, 0, 1]], atol=2e-3)
    assert found[2, 2] == 1
    rough = refined(points(), picture((2, -1)), np.eye(3), rigid, 100.0)  # one step is enough
    assert 1e-3 < np.abs(rough - found).max() < 0.02


def test_a_point_outside_of_the_picture_differs_much():
    difference = compared(points(), picture(), np.array([[1, 0, 3.0], [0, 1, 0], [0, 0, 1]]))
    assert (difference == OUTSIDE).all()


def test_the_upper_median():
    assert [median_of(np.array(values, np.float32)) for values in ([3, 1, 2], [4, 1, 3, 2], [5])] == [2, 3, 5]
