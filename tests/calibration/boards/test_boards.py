"""Boards: described, printed and found."""

from __future__ import annotations

import re
from pathlib import Path

import cv2
import numpy as np
import pytest

from shadowpuppet.calibration.boards.board import Board, board_from, board_text, read_board
from shadowpuppet.calibration.boards.detection import BoardDetector
from shadowpuppet.calibration.boards.printing import POINTS_PER_METRE, board_pdf, rectangles, sheet_of, write_board
from shadowpuppet.errors import CalibrationError, ShadowPuppetError

BOARDS = [board_from("charuco 7x5", 0.04), board_from("charuco 6x8", 0.03), board_from("charuco 6x8", 0.03, legacy=True),
          board_from("charuco 5x4", 0.04, dictionary="6X6_250", marker=0.032), board_from("checkerboard 9x6", 0.03)]
NAMES = ["charuco", "even", "legacy", "6x6", "checkerboard"]


def picture(board: Board, scale: float = 1500.0, border: int = 40) -> np.ndarray:
    """The rectangles of the print as a picture."""
    wide, high = (round(side * scale) + 2 * border for side in board.size)
    image = np.full((high, wide), 255, np.uint8)
    for x, y, w, h in rectangles(board):
        a, b, c, d = (round(v * scale) + border for v in (x, y, x + w, y + h))
        image[b:d, a:c] = 0
    return image


@pytest.mark.parametrize("board", BOARDS, ids=NAMES)
def test_a_printed_board_is_found_where_it_was_printed(board):
    view = BoardDetector(board).find(picture(board))
    assert view is not None
    assert len(view.ids) == len(board.points)
    expected = 1500 * (board.points[:, :2] + np.array(board.size) / 2) + 40 - 0.5
    np.testing.assert_allclose(view.pixels, expected, atol=0.6)


@pytest.mark.parametrize("board", BOARDS, ids=NAMES)
def test_corners_keep_their_numbers_when_the_board_is_turned(board):
    image = picture(board)
    straight = BoardDetector(board).find(image)
    turned = BoardDetector(board).find(np.ascontiguousarray(image[::-1, ::-1]))
    assert straight is not None
    assert turned is not None
    np.testing.assert_allclose(turned.pixels, np.array(image.shape[::-1]) - 1 - straight.pixels, atol=0.6)


@pytest.mark.parametrize("board", BOARDS, ids=NAMES)
def test_a_board_printed_inverted_is_found_and_said(board):
    image = picture(board)
    straight, inverted = BoardDetector(board).find(image), BoardDetector(board).find(~image)
    assert straight is not None
    assert not straight.inverted
    assert inverted is not None
    pixels = inverted.pixels
    if board.kind == "checkerboard":  # inverted, it is the same board after half a turn
        pixels = pixels[::-1]
    else:
        assert inverted.inverted
    np.testing.assert_array_equal(inverted.ids, straight.ids)
    np.testing.assert_allclose(pixels, straight.pixels, atol=0.1)


def test_a_board_once_found_is_looked_for_as_it_is_printed():
    detector, image = BoardDetector(BOARDS[0]), picture(BOARDS[0])
    assert detector.find(np.full((100, 100), 128, np.uint8)) is None
    assert detector.find(~image) is not None
    assert detector.find(image) is None
    assert detector.find(~image) is not None


def test_a_mirrored_board_and_an_empty_picture_show_nothing():
    image = picture(BOARDS[0])
    assert BoardDetector(BOARDS[0]).find(np.ascontiguousarray(image[:, ::-1])) is None
    assert BoardDetector(BOARDS[0]).find(np.full((100, 100), 128, np.uint8)) is None


def test_a_blurred_board_is_less_sharp():
    image = picture(BOARDS[0])
    sharp, soft = (BoardDetector(BOARDS[0]).find(each) for each in (image, np.asarray(cv2.GaussianBlur(image, (0, 0), 2), np.uint8)))
    assert sharp is not None
    assert soft is not None
    assert soft.sharpness < 0.7 * sharp.sharpness


def test_the_pdf_has_true_size(tmp_path):
    board = BOARDS[0]
    assert write_board(tmp_path / "b.pdf", board) == "A3"
    text = (tmp_path / "b.pdf").read_bytes()
    assert text.startswith(b"%PDF-1.4")
    boxes = np.array([[float(v) for v in box] for box in re.findall(rb"([\d.]+) ([\d.]+) ([\d.]+) ([\d.]+) re", text)]) / POINTS_PER_METRE
    squares = boxes[np.isclose(boxes[:, 2], 0.04, atol=1e-5) & np.isclose(boxes[:, 3], 0.04, atol=1e-5)]
    assert len(squares) == 18
    assert np.ptp(squares[:, 0]) == pytest.approx(6 * 0.04, abs=1e-5)
    for place, number in re.findall(rb"(\d{10}) 00000 n", text) and zip(re.findall(rb"(\d{10}) 00000 n", text), range(1, 9)):
        assert text[int(place) :].startswith(b"%d 0 obj" % number)


def test_large_boards_get_a_sheet_of_their_own():
    assert sheet_of(board_from("charuco 7x5", 0.11))[0] == "A1"
    assert sheet_of(board_from("charuco 12x9", 0.2))[0] == "2424 x 1838 mm"
    assert len(board_pdf(board_from("charuco 12x9", 0.2), 2.5, 1.9)) > 1000


def test_files_that_cannot_be_written_are_named(tmp_path):
    with pytest.raises(CalibrationError, match=r"found the ending '.png', expected .pdf"):
        write_board(tmp_path / "b.png", BOARDS[0])
    with pytest.raises(ShadowPuppetError, match="cannot be written"):
        write_board(Path("/proc/none/b.pdf"), BOARDS[0])


def test_board_files_come_back(tmp_path):
    for board in BOARDS:
        (tmp_path / "board.toml").write_text(board_text(board))
        assert read_board(tmp_path / "board.toml") == board


@pytest.mark.parametrize(("text", "message"), [
    ("kind = 'charuco'", "columns: is missing"),
    ("columns = 7\nrows = 5\nsquare = 40", r"square: found 40, expected 0.002 to 1 metres"),
    ("columns = 7.5\nrows = 5\nsquare = 0.04", "columns: found 7.5, expected a whole number"),
    ("columns = 7\nrows = 2\nsquare = 0.04", "rows: found 2"),
    ("columns = 7\nrows = 5\nsquare = 0.04\nmarker = 0.05", "marker: found 0.05, expected under the square's side"),
    ("columns = 7\nrows = 5\nsquare = 0.04\ndictionary = '9X9'", "dictionary: found '9X9', expected one of"),
    ("columns = 20\nrows = 20\nsquare = 0.04\ndictionary = '4X4_50'", "expected one of at least 200 markers; 4X4_50 has 50"),
    ("columns = 7\nrows = 5\nsquare = 0.04\nkind = 'dots'", "kind: found 'dots', expected charuco or checkerboard"),
    ("columns = 7\nrows = 5\nsquare = 0.04\nsize = 3", "size: no such value; possible are kind"),
    ("columns = 7\nrows = 5\nsquare = nan", "square: found nan"),
])  # fmt: skip
def test_wrong_values_are_named(tmp_path, text, message):
    (tmp_path / "board.toml").write_text(text)
    with pytest.raises(CalibrationError, match=message):
        read_board(tmp_path / "board.toml")


def test_boards_in_words():
    assert board_from("chessboard 9 x 6", 0.03) == board_from("Checkerboard 9x6", 0.03)
    assert board_from("checkerboard 9x7", 0.03).symmetric
    assert not board_from("checkerboard 9x6", 0.03).symmetric
    with pytest.raises(CalibrationError, match="found 'dots 7x5', expected for example"):
        board_from("dots 7x5", 0.03)
