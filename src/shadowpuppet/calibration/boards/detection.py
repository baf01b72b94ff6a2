"""Corners of a board in a picture."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.boards.board import Board
from shadowpuppet.calibration.boards.registration import print_of, registered
from shadowpuppet.geometry import Array

MIN_CORNERS = 8
"""Least number of corners of a view."""
MIN_SPREAD = 0.02
"""Least ratio of a view's extent across its longest direction to that along it: corners in a line give no pose."""
QUICK_SIDE = 960
"""Longer side, pixels, of the picture in which a checkerboard is looked for."""
MANY_MARKERS, ENLARGED = 0.8, 2
"""Share of a board's markers under which they are looked for in the enlarged picture as well, and by how much it is enlarged."""


class View(NamedTuple):
    """A board as one picture shows it."""

    time: float
    """Seconds after the film's first frame."""
    ids: NDArray[np.int64]
    """Numbers of the corners seen, of shape (K,), as in `Board.points`."""
    pixels: Array
    """The corners, of shape (K, 2)."""
    sharpness: float
    """Steepness of its edges: share of the board's contrast that the steepest pixels change by, from one pixel to the next."""
    inverted: bool = False
    """Whether the board is printed inverted, white where black is expected."""


class BoardDetector:
    """Finds a board in the grey pictures of one film; one for each thread."""

    def __init__(self, board: Board) -> None:
        """Of a board."""
        import cv2

        self.board, self._print = board, print_of(board)
        self._prints = (False, True) if board.kind == "charuco" else (False,)  # an inverted checkerboard is one after half a turn
        self._markers = cv2.aruco.ArucoDetector(board.aruco_dictionary) if board.kind == "charuco" else None

    def find(self, grey: NDArray[np.uint8], time: float = 0.0) -> View | None:
        """The view of the board in a picture (H, W); None if it shows fewer than `MIN_CORNERS`. Until a ChArUco board is found for the
        first time, negatives are tried, too: it may be printed inverted."""
        for inverted in self._prints:
            view = self._found(~grey if inverted else grey, time)
            if view is not None:
                self._prints = (inverted,)
                return view._replace(inverted=inverted)
        return None

    def _found(self, grey: NDArray[np.uint8], time: float) -> View | None:
        found = self._charuco_corners(grey) if self._markers is not None else self._checker_corners(grey)
        if found is None:
            return None
        ids, pixels = found
        if len(ids) < MIN_CORNERS or not _spans_a_plane(self.board.points[ids]):
            return None
        return View(time, ids, pixels, _sharpness(grey, pixels))

    def _charuco_corners(self, grey: NDArray[np.uint8]) -> tuple[NDArray[np.int64], Array] | None:
        places = self._marker_corners(grey, 1)
        if places is not None and len(places[0]) < MANY_MARKERS * 4 * self.board.markers:  # markers may be too small for the detector
            places = self._marker_corners(grey, ENLARGED) or places
        return None if places is None else registered(self._print, grey, *places)

    def _marker_corners(self, grey: NDArray[np.uint8], zoom: int) -> tuple[Array, Array] | None:
        """Places of the markers' corners on the board and in the picture, of shape (4 K, 2), as found in the picture enlarged."""
        import cv2

        assert self._markers is not None
        large = cv2.resize(grey, None, fx=zoom, fy=zoom, interpolation=cv2.INTER_CUBIC) if zoom > 1 else grey
        quads, ids, _ = self._markers.detectMarkers(large)
        on_board, numbers = self.board.marker_corners, [] if ids is None else [int(n) for n in np.asarray(ids, np.int64).ravel()]
        held = [(on_board[n], np.asarray(quad, float).reshape(4, 2)) for n, quad in zip(numbers, quads) if n < len(on_board)]
        if not held:
            return None
        return np.concatenate([place for place, _ in held]), (np.concatenate([quad for _, quad in held]) + 0.5) / zoom - 0.5

    def _checker_corners(self, grey: NDArray[np.uint8]) -> tuple[NDArray[np.int64], Array] | None:
        import cv2

        scale = max(1.0, max(grey.shape) / QUICK_SIDE)  # a quick look in a small picture, as most show no whole board
        small = cv2.resize(grey, None, fx=1 / scale, fy=1 / scale, interpolation=cv2.INTER_AREA) if scale > 1 else grey
        good, rough = cv2.findChessboardCornersSB(small, self.board.inner, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
        if not good:
            return None
        pixels = _in_order(self.board, grey, (np.asarray(rough, float).reshape(-1, 2) + 0.5) * scale - 0.5)
        better = registered(self._print, grey, self.board.points[:, :2], pixels)
        return better if len(better[0]) >= MIN_CORNERS else (np.arange(len(pixels)), pixels)


def _in_order(board: Board, grey: NDArray[np.uint8], pixels: Array) -> Array:
    """A checkerboard's corners in the order of `Board.points`: not mirrored, and its first square, which is black, first."""
    across, down = board.inner
    grid = pixels.reshape(down, across, 2)
    right, below = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    if right[0] * below[1] - right[1] * below[0] < 0:
        grid = grid[:, ::-1]
    if board.symmetric:
        return grid.reshape(-1, 2)
    first, last = 2 * grid[0, 0] - grid[0:2, 0:2].mean((0, 1)), 2 * grid[-1, -1] - grid[-2:, -2:].mean((0, 1))
    if _grey_at(grey, first) > _grey_at(grey, last):  # the first square is black, the last one white
        grid = grid[::-1, ::-1]
    return grid.reshape(-1, 2)


def _grey_at(grey: NDArray[np.uint8], pixel: Array) -> float:
    x, y = np.clip(np.rint(pixel).astype(int), 0, np.array(grey.shape[::-1]) - 1)
    return float(grey[max(0, y - 1) : y + 2, max(0, x - 1) : x + 2].mean())


def _spans_a_plane(points: Array) -> bool:
    extent = np.linalg.svd(points[:, :2] - points[:, :2].mean(0), compute_uv=False)
    return bool(extent[1] > max(MIN_SPREAD * extent[0], 1e-9))


def _sharpness(grey: NDArray[np.uint8], pixels: Array) -> float:
    low, high = np.floor(pixels.min(0)).astype(int), np.ceil(pixels.max(0)).astype(int) + 1
    part = grey[max(0, low[1]) : high[1], max(0, low[0]) : high[0]].astype(np.float32)
    if min(part.shape) < 3:
        return 0.0
    steps = np.maximum(np.abs(part[1:, 1:] - part[:-1, 1:]), np.abs(part[1:, 1:] - part[1:, :-1]))
    contrast = float(np.percentile(part, 95) - np.percentile(part, 5))
    return float(np.percentile(steps, 98)) / max(contrast, 1.0)
