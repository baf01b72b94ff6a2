"""Corners of a board to hundredths of a pixel: the print around each is laid over the picture by least squares.

As a board's print is known, all edges near a corner tell its place, not only the two that cross there (image registration of Lucas and
Kanade 1981; patterns drawn as the camera sees them as control points, Datta, Kim and Kanade 2009). Small and slanted squares, whose markers
leave the usual saddle point hardly any room, give a corner nearly as well as large ones. Corners that no detector found are tried where the
others have them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.calibration.boards.board import Board
from shadowpuppet.calibration.boards.printing import rectangles
from shadowpuppet.geometry import Array

TEXELS = 32
"""Texels of the print along a square."""
REACH, MOST_PIXELS = 0.75, 12
"""Half the width of what is laid over the picture, squares, and its greatest value, pixels."""
SAMPLES = 2
"""Samples of the print along a pixel."""
BLUR = 0.5
"""Standard deviation of the picture's blur that is assumed, pixels."""
ROUNDS, STEPS, SMALL_STEP = 3, 5, 0.003
"""Rounds, after each of which corners still missing are predicted again; steps of each corner, and the last one's length, pixels."""
MIN_LIKENESS = 0.8
"""Least correlation of print and picture around a corner: hands, glare and other boards are below."""
MAX_MOVE = 0.3
"""Greatest distance of a corner from where the others predict it, squares."""
BENDS = ((20, 10), (12, 6))
"""Least numbers of corners for which the map from the picture to the board bends as lenses do, and how many terms it has then."""
RECENTRED, WELL_CENTRED = 3, 0.5
"""Times that the window is laid around the corner, and the distance, pixels, within which it is: what is wrong with the slope of the map
cancels around the middle."""
FAR = 0.008
"""Distance of a marker's corner from the markers' homography, over the picture's longer side, from which on it is taken to be misread."""
MIN_AREA = 20
"""Least number of pixels that are compared."""


class Print(NamedTuple):
    """A board as it is printed."""

    board: Board
    texture: NDArray[np.float32]
    """0 black, 1 white, of shape (H, W), `TEXELS` a square."""


def print_of(board: Board) -> Print:
    """The print of a board."""
    texture, texel = np.ones((board.rows * TEXELS, board.columns * TEXELS), np.float32), board.square / TEXELS
    for x, y, w, h in rectangles(board):
        left, top, right, bottom = (round(edge / texel) for edge in (x, y, x + w, y + h))
        texture[top:bottom, left:right] = 0
    return Print(board, texture)


def registered(printed: Print, grey: NDArray[np.uint8], points: Array, pixels: Array) -> tuple[NDArray[np.int64], Array]:
    """Numbers (K,) and pixels (K, 2) of the board's corners in a picture (H, W), as good as it shows them.

    points, pixels: of shape (N, 2), places on the board (metres from its middle) and in the picture that are known roughly, at least four.
    """
    corners, picture = printed.board.points[:, :2], grey.astype(np.float32)
    found: dict[int, Array] = {}
    for n in range(ROUNDS):
        warp = _Warp.of(points, pixels, FAR * max(grey.shape) if n == 0 else np.inf)
        if warp is None:
            break
        tried = {k: at for k, corner in enumerate(corners) if (at := _laid(printed, picture, warp, corner)) is not None}
        grown, found = len(tried) > len(found), tried
        if len(found) < 4 or (n and not grown):
            break
        points, pixels = corners[list(found)], np.array(list(found.values()))
    return np.array(sorted(found), np.int64), np.array([found[k] for k in sorted(found)]).reshape(-1, 2)


class _Warp(NamedTuple):
    """The map from a picture to a board: a homography and, with many corners, the bend of the lens."""

    H: Array
    """Pixels to metres, of shape (3, 3)."""
    bend: Array
    """Of shape (10, 2): coefficients of the products of x and y up to the third degree, of pixels, normalised."""
    middle: Array
    scale: float

    @staticmethod
    def of(points: Array, pixels: Array, far: float = np.inf) -> _Warp | None:
        """The map that fits places on the board (N, 2) and in the picture (N, 2), without those that are `far` off, pixels; None if none
        does."""
        import cv2

        if len(points) < 4:
            return None
        H, kept = cv2.findHomography(points, pixels, cv2.RANSAC, far) if np.isfinite(far) else cv2.findHomography(points, pixels)
        if H is None or kept.sum() < 4 or abs(np.linalg.det(H)) < 1e-12:
            return None
        use = kept.ravel() > 0
        middle, scale = pixels[use].mean(0), max(float(np.ptp(pixels[use], axis=0).max()), 1.0)
        plain = _Warp(np.asarray(np.linalg.inv(H), float), np.zeros((10, 2)), middle, scale)
        terms = next((terms for least, terms in BENDS if use.sum() >= least), 0)
        if not terms:
            return plain
        off, table = points[use] - plain(pixels[use]), _terms((pixels[use] - middle) / scale)[:, :terms]
        bend = np.asarray(np.linalg.lstsq(table, off, rcond=1e-6)[0], float)
        return plain._replace(bend=np.pad(bend, ((0, 10 - terms), (0, 0))))

    def __call__(self, pixels: Array) -> Array:
        """Places on the board (..., 2), metres, of pixels (..., 2)."""
        x, y, w = np.moveaxis(pixels @ self.H[:, :2].T + self.H[:, 2], -1, 0)
        flat = np.stack([x / w, y / w], -1)
        return flat + _terms((pixels - self.middle) / self.scale) @ self.bend if self.bend.any() else flat

    def slope(self, pixel: Array) -> Array:
        """Derivatives (2, 2) of the place on the board by the pixel."""
        step = 0.5 * np.eye(2)
        return (self(pixel + step) - self(pixel - step)).T

    def pixel_of(self, point: Array) -> Array:
        """The pixel (2,) of a place on the board (2,)."""
        x, y, w = np.linalg.inv(self.H) @ [*point, 1.0]
        at = np.array([x / w, y / w])
        for _ in range(4 if self.bend.any() else 0):
            at = at + np.asarray(np.linalg.solve(self.slope(at), point - self(at)), float)
        return at


def _terms(at: Array) -> Array:
    x, y = at[..., 0], at[..., 1]
    xx, yy = x * x, y * y
    return np.stack([np.ones_like(x), x, y, xx, x * y, yy, xx * x, xx * y, x * yy, yy * y], -1)


def _laid(printed: Print, picture: NDArray[np.float32], warp: _Warp, corner: Array) -> Array | None:
    """The pixel (2,) of a corner (2,), metres, at which the print fits the picture best; None if it fits nowhere near."""
    try:
        start = warp.pixel_of(corner)
        slope = warp.slope(start)
        spread = np.abs(np.linalg.inv(slope)).sum(1) * REACH * printed.board.square  # of the print around the corner, pixels
    except np.linalg.LinAlgError:
        return None
    if not (np.isfinite(start).all() and np.isfinite(spread).all()) or np.abs(start).max() > 1e5:
        return None
    reach, at = np.minimum(np.ceil(spread), MOST_PIXELS).astype(int), start
    for _ in range(RECENTRED):
        found = _laid_around(printed, picture, warp, corner, (start, at, reach))
        if found is None or np.linalg.norm(slope @ (found - start)) > MAX_MOVE * printed.board.square:
            return None
        moved, at = np.linalg.norm(found - at), found
        if moved < WELL_CENTRED:
            break
    return at


def _laid_around(printed: Print, picture: NDArray[np.float32], warp: _Warp, corner: Array,
                 where: tuple[Array, Array, Array]) -> Array | None:
    """As `_laid`, in a window around a pixel. where: the corner's pixel by the map, the pixel, and half the window's sides."""
    import cv2

    start, around, reach = where
    low = np.rint(around).astype(int) - reach
    high = low + 2 * reach + 1
    if (low < 0).any() or high[0] > picture.shape[1] or high[1] > picture.shape[0]:
        return None
    window = picture[low[1] : high[1], low[0] : high[0]]
    x, y = ((np.arange(-SAMPLES, (high[k] - low[k] + 1) * SAMPLES) + 0.5) / SAMPLES - 0.5 + low[k] for k in (0, 1))
    board = warp(np.stack(np.meshgrid(x, y), -1) - (around - start))
    texels = (board + np.array(printed.board.size) / 2) * (TEXELS / printed.board.square) - 0.5
    near = (np.abs(board - corner) < REACH * printed.board.square).all(-1)
    weights = _per_pixel(np.asarray(near, np.float32))[1:-1, 1:-1]
    if weights.sum() < MIN_AREA:
        return None
    moved, by_pixel, likeness = np.zeros(2), warp.slope(start) * (TEXELS / printed.board.square), 0.0
    for _ in range(STEPS):
        at = (texels - by_pixel @ moved).astype(np.float32)
        drawn = cv2.remap(printed.texture, at[..., 0], at[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=1)
        drawn = _per_pixel(np.asarray(cv2.GaussianBlur(drawn, (0, 0), BLUR * SAMPLES), np.float32))
        step, likeness = _step(drawn, window, weights)
        if step is None:
            return None
        moved = moved + step
        if np.linalg.norm(step) < SMALL_STEP:
            break
    return around + moved if likeness >= MIN_LIKENESS else None


def _per_pixel(samples: NDArray[np.float32]) -> NDArray[np.float32]:
    """Means (h, w) of the samples (h SAMPLES, w SAMPLES) of each pixel."""
    import cv2

    h, w = samples.shape
    return np.asarray(cv2.resize(samples, (w // SAMPLES, h // SAMPLES), interpolation=cv2.INTER_AREA), np.float32)


def _step(drawn: NDArray[np.float32], window: NDArray[np.float32], weights: NDArray[np.float32]) -> tuple[Array | None, float]:
    """The move (2,) of a drawn print (h + 2, w + 2) that fits a window (h, w) of the picture best, with its light, to first order, and how
    alike they are; None if the print is plain there."""
    inner = drawn[1:-1, 1:-1]
    plain = np.stack([drawn[1:-1, :-2] - drawn[1:-1, 2:], drawn[:-2, 1:-1] - drawn[2:, 1:-1]]) / 2
    total = float(weights.sum())
    means = float((weights * inner).sum()) / total, float((weights * window).sum()) / total
    print_off, picture_off = inner - means[0], window - means[1]
    own, both = float((weights * print_off**2).sum()), float((weights * print_off * picture_off).sum())
    power = float((weights * picture_off**2).sum())
    if own <= 1e-6 * total or power <= 0 or both <= 0:
        return None, 0.0
    gain = both / own
    A = np.stack([gain * plain[0].ravel(), gain * plain[1].ravel(), inner.ravel(), np.ones(inner.size)], -1).astype(float)
    weighted = A * weights.reshape(-1, 1)
    try:
        return np.asarray(np.linalg.solve(A.T @ weighted, weighted.T @ window.ravel()), float)[:2], both / float(np.sqrt(own * power))
    except np.linalg.LinAlgError:
        return None, 0.0
