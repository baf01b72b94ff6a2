"""Corners by registration of the print: hundredths of a pixel, small and slanted squares, nothing where the board is covered."""

from __future__ import annotations

from dataclasses import replace

import boards
import numpy as np
import pytest

from shadowpuppet.calibration.boards.board import board_from
from shadowpuppet.calibration.boards.detection import BoardDetector
from shadowpuppet.calibration.boards.registration import TEXELS, _Warp, print_of, registered
from shadowpuppet.geometry import rigid, rotation_from_vector

SIZE = (480, 360)
MATRIX = np.array([[465.0, 0, 241], [0, 466.0, 178], [0, 0, 1]])
PRINT = print_of(boards.BOARD)


def camera():
    return replace(boards.ring(1)[0], size=SIZE, matrix=MATRIX, distortion=np.zeros(4), T_camera_world=np.eye(4))


def seen(slant: float, away: float, board=boards.BOARD):
    """A picture of a board turned by `slant` degrees, with some noise, and where its corners are."""
    T = rigid(rotation_from_vector([np.radians(slant), 0.1, 0.2]), np.array([0.03, -0.05, away]))
    larger = np.array([[4.0, 0, 1.5], [0, 4.0, 1.5], [0, 0, 1]]) @ MATRIX  # drawn four times as large, as `drawn` is coarse
    large = boards.drawn(replace(camera(), size=(4 * SIZE[0], 4 * SIZE[1]), matrix=larger), T, board)
    grey = large.reshape(SIZE[1], 4, SIZE[0], 4).mean((1, 3)) + np.random.default_rng(1).normal(0, 2, SIZE[::-1])
    return np.clip(grey, 0, 255).astype(np.uint8), replace(camera(), T_camera_world=T).project(board.points)


def test_a_print_is_black_where_the_board_is():
    np.testing.assert_array_equal(PRINT.texture.shape, (5 * TEXELS, 7 * TEXELS))
    squares = PRINT.texture.reshape(5, TEXELS, 7, TEXELS).mean((1, 3))
    assert (squares[boards.BOARD.squares()] == 0).all()
    assert ((squares[~boards.BOARD.squares()] > 0.4) & (squares[~boards.BOARD.squares()] < 1)).all()  # markers


@pytest.mark.parametrize(("slant", "away"), [(0, 1.2), (35, 2.4), (62, 1.9)])
def test_corners_to_hundredths_of_a_pixel(slant, away):
    grey, true = seen(slant, away)
    rough = true[[0, 5, 18, 23]] + [[0.6, -0.5], [-0.7, 0.4], [0.5, 0.6], [0.4, -0.6]]
    ids, pixels = registered(PRINT, grey, boards.BOARD.points[[0, 5, 18, 23], :2], rough)
    np.testing.assert_array_equal(ids, np.arange(24))
    assert np.sqrt(((pixels - true) ** 2).sum(1).mean()) < 0.05


def test_a_detector_finds_all_corners_of_small_slanted_squares():
    grey, true = seen(60, 2.6)  # squares of 20 by 10 pixels
    view = BoardDetector(boards.BOARD).find(grey)
    assert view is not None
    assert len(view.ids) == 24
    assert np.abs(view.pixels - true).max() < 0.15


def test_what_is_covered_is_left_out():
    grey, true = seen(20, 1.2)
    x, y = np.rint(true[0]).astype(int)
    grey[y - 20 : y + 20, x - 20 : x + 20] = 140
    ids, pixels = registered(PRINT, grey, boards.BOARD.points[:, :2], true)
    assert 0 not in ids
    assert len(ids) >= 20
    assert np.abs(pixels - true[ids]).max() < 0.15


def test_nothing_is_laid_over_another_picture():
    rng = np.random.default_rng(2)
    _, true = seen(20, 1.2)
    for grey in (rng.integers(0, 255, SIZE[::-1]).astype(np.uint8), np.full(SIZE[::-1], 90, np.uint8),
                 seen(20, 1.2, replace(boards.BOARD, dictionary="5X5_100"))[0][:, ::-1].copy()):
        assert len(registered(PRINT, grey, boards.BOARD.points[:, :2], true)[0]) < 4
    assert len(registered(PRINT, grey, boards.BOARD.points[:3, :2], true[:3])[0]) == 0


def test_a_map_bends_as_lenses_do():
    points = boards.BOARD.points[:, :2]
    pixels = np.array([320.0, 240.0]) + 400 * points
    bent = pixels + 1e-4 * (pixels - [100, 100]) ** 2
    warp = _Warp.of(points, bent)
    assert warp is not None
    assert np.abs(warp(bent) - points).max() < 2e-4
    np.testing.assert_allclose(warp(warp.pixel_of(points[8])), points[8], atol=1e-7)
    few = _Warp.of(points[::3], bent[::3])
    assert few is not None
    assert not few.bend.any()
    assert _Warp.of(points[:6], bent[:6]) is None  # along a line


def test_a_checkerboard_s_corners():
    board = board_from("checkerboard 8x5", 0.09)
    grey, true = seen(40, 1.5, board)
    view = BoardDetector(board).find(grey)
    assert view is not None
    assert np.sqrt(((view.pixels - true[view.ids]) ** 2).sum(1).mean()) < 0.06
