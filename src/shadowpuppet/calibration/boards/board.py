"""A calibration board: a checkerboard, or a ChArUco board, whose white squares carry markers."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, fields
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import CalibrationError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import read_toml

MARKER_SHARE = 0.75
"""Side of a marker over that of its square, if not stated."""
SQUARES = (3, 60)
"""Least and greatest number of squares along a side."""
SIDES = (0.002, 1.0)
"""Least and greatest side of a square, metres."""
MAX_THICKNESS = 0.2
"""Greatest thickness of a board, metres."""
DICTIONARIES = ("4X4_50", "4X4_100", "4X4_250", "4X4_1000", "5X5_50", "5X5_100", "5X5_250", "5X5_1000", "6X6_50", "6X6_100", "6X6_250",
                "6X6_1000", "7X7_50", "7X7_100", "7X7_250", "7X7_1000", "ARUCO_ORIGINAL", "APRILTAG_16H5", "APRILTAG_25H9",
                "APRILTAG_36H10", "APRILTAG_36H11")
"""Sets of markers of OpenCV, without the prefix DICT_."""
KIND_AND_SIZE = re.compile(r"\s*(charuco|checkerboard|chessboard)\s+(\d+)\s*[x×]\s*(\d+)\s*", re.IGNORECASE)


@dataclass(frozen=True, kw_only=True)
class Board:
    """A flat board. Its frame: origin in the middle of its squares, x along its rows to the right, y along its columns downward, z into the
    board, as seen by a reader. Raises `CalibrationError`, naming the field, for impossible values."""

    kind: Literal["charuco", "checkerboard"] = "charuco"
    """charuco: black and white squares, a marker in each white one; checkerboard: black and white squares."""
    columns: int = 7
    """Squares along a row."""
    rows: int = 5
    """Squares along a column."""
    square: float = 0.04
    """Side of a square, metres; measured on the printed board."""
    marker: float = 0.0
    """Side of a marker, metres; 0: three quarters of a square."""
    dictionary: str = ""
    """Set of markers, such as 4X4_50; empty: 4X4_50, or 4X4_250 for more than 50 markers."""
    legacy: bool = False
    """Whether the board was made by OpenCV before 4.6, with a white square first where the number of rows is even."""
    thickness: float = 0.0
    """Height of the printed side over the floor when the board lies on it, metres."""

    def __post_init__(self) -> None:
        """Check every field, and fill in marker and dictionary."""
        _check("kind", self.kind, self.kind in ("charuco", "checkerboard"), "charuco or checkerboard")
        for name, value in (("columns", self.columns), ("rows", self.rows)):
            whole = isinstance(value, int) and not isinstance(value, bool)
            _check(name, value, whole and SQUARES[0] <= value <= SQUARES[1], f"a whole number from {SQUARES[0]} to {SQUARES[1]} squares")
        for name, value, low, high in (("square", self.square, *SIDES), ("thickness", self.thickness, 0.0, MAX_THICKNESS)):
            number = isinstance(value, int | float) and not isinstance(value, bool)
            _check(name, value, number and low <= value <= high, f"{low:g} to {high:g} metres")
        _check("legacy", self.legacy, isinstance(self.legacy, bool), "true or false")
        if self.kind == "charuco":
            number = isinstance(self.marker, int | float) and not isinstance(self.marker, bool)
            _check("marker", self.marker, number and 0 <= self.marker < self.square, f"under the square's side, {self.square:g} metres")
            name = str(self.dictionary).upper().removeprefix("DICT_") or ("4X4_50" if self.markers <= 50 else "4X4_250")
            _check("dictionary", self.dictionary, name in DICTIONARIES, f"one of {choices(DICTIONARIES)}")
            object.__setattr__(self, "marker", float(self.marker) or round(MARKER_SHARE * self.square, 6))
            object.__setattr__(self, "dictionary", name)
            held = len(self.aruco_dictionary.bytesList)
            _check("dictionary", name, self.markers <= held, f"one of at least {self.markers} markers; {name} has {held}")

    @property
    def markers(self) -> int:
        """Number of markers."""
        return self.columns * self.rows // 2 if self.kind == "charuco" else 0

    @property
    def inner(self) -> tuple[int, int]:
        """Corners between four squares, along a row and along a column."""
        return self.columns - 1, self.rows - 1

    @property
    def symmetric(self) -> bool:
        """Whether it looks the same after half a turn, so that cameras cannot know which corner is which."""
        return self.kind == "checkerboard" and (self.columns + self.rows) % 2 == 0

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of all squares, metres."""
        return self.columns * self.square, self.rows * self.square

    @property
    def text(self) -> str:
        """In words, such as `charuco 7x5, squares of 40 mm`."""
        return f"{self.kind} {self.columns}x{self.rows}, squares of {1000 * self.square:g} mm"

    @cached_property
    def points(self) -> Array:
        """The corners between four squares in the board's frame, row by row, of shape (N, 3), metres."""
        across, down = self.inner
        x, y = np.meshgrid(np.arange(across) - (across - 1) / 2, np.arange(down) - (down - 1) / 2)
        return np.asarray(self.square * np.stack([x.ravel(), y.ravel(), np.zeros(x.size)], axis=1), float)

    @property
    def aruco_dictionary(self) -> Any:
        """OpenCV's set of markers."""
        import cv2

        return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{self.dictionary}"))

    @property
    def aruco_board(self) -> Any:
        """OpenCV's ChArUco board."""
        import cv2

        board = cv2.aruco.CharucoBoard((self.columns, self.rows), self.square, self.marker, self.aruco_dictionary)
        board.setLegacyPattern(self.legacy)
        return board

    def squares(self) -> NDArray[np.bool_]:
        """Whether each square is black, of shape (rows, columns)."""
        first = 1 if self.legacy and self.rows % 2 == 0 else 0
        return np.add.outer(np.arange(self.rows), np.arange(self.columns)) % 2 == first

    def marker_bits(self) -> list[tuple[int, int, NDArray[np.bool_]]]:
        """Row and column of each marker's square, and the marker's black cells with its border, of shape (K, K)."""
        import cv2

        if self.kind != "charuco":
            return []
        cells = self.aruco_dictionary.markerSize + 2
        places = np.argwhere(~self.squares()).tolist()
        return [(row, column, np.asarray(cv2.aruco.generateImageMarker(self.aruco_dictionary, n, cells)) < 128)
                for n, (row, column) in enumerate(places)]

    @cached_property
    def marker_corners(self) -> Array:
        """The markers' corners in the board's frame, clockwise from the upper left one as seen, of shape (markers, 4, 2), metres."""
        side = self.marker / 2 * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
        middles = [((column + 0.5) * self.square, (row + 0.5) * self.square) for row, column, _ in self.marker_bits()]
        return np.asarray(np.reshape(middles, (-1, 1, 2)) - np.array(self.size) / 2 + side, float)


def _check(name: str, value: object, good: bool, expected: str) -> None:
    if not good:
        raise CalibrationError(f"{name}: found {value!r}, expected {expected}")


def board_from(kind: str, square: float | None = None, **more: Any) -> Board:
    """A board from text such as `charuco 7x5` and the side of a square, metres. Raises `CalibrationError`."""
    found = KIND_AND_SIZE.fullmatch(kind)
    if found is None:
        raise CalibrationError(f"board: found {kind!r}, expected for example 'charuco 7x5' or 'checkerboard 9x6': squares along a row, and "
                               "along a column")
    name = found[1].lower().replace("chessboard", "checkerboard")
    values = {"square": square} if square is not None else {}
    return Board(kind=name, columns=int(found[2]), rows=int(found[3]), **values, **more)  # pyright: ignore[reportArgumentType]


def check_turned(board: Board) -> None:
    """Raise `CalibrationError` if a board looks the same after half a turn."""
    if board.symmetric:
        other = board.columns + (1 if board.columns < SQUARES[1] else -1)
        raise CalibrationError(f"the {board.text} looks the same after half a turn, so that two cameras cannot know which corner is "
                               f"which: take one with an odd and an even number of squares, such as {other}x{board.rows}, or a ChArUco "
                               "board")


def read_board(path: Path) -> Board:
    """The board that a file board.toml describes. Raises `CalibrationError` with the file and the field."""
    values = read_toml(path, CalibrationError)
    return board_of(values, path)


def board_of(values: Mapping[str, Any], path: Path) -> Board:
    """A board from the values of a file. Raises `CalibrationError` with the file and the field."""
    known = [field.name for field in fields(Board)]
    for name in values:
        if name not in known:
            raise CalibrationError(f"{path}: {name}: no such value; possible are {', '.join(known)}")
    for name in ("columns", "rows", "square"):
        if name not in values:
            raise CalibrationError(f"{path}: {name}: is missing; a board needs kind, columns, rows and square (metres)")
    try:
        return Board(**values)
    except CalibrationError as error:
        raise CalibrationError(f"{path}: {error}") from None


def board_text(board: Board) -> str:
    """The board as board.toml."""
    lines = [f'kind = "{board.kind}"', f"columns = {board.columns}", f"rows = {board.rows}",
             f"square = {board.square:g}  # metres, as measured on the print"]
    if board.kind == "charuco":
        lines += [f"marker = {board.marker:g}", f'dictionary = "{board.dictionary}"']
        lines += ["legacy = true"] if board.legacy else []
    return "\n".join([*lines, f"thickness = {board.thickness:g}  # metres, of the board as it lies on the floor", ""])
