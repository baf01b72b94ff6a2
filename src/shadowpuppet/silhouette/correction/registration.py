"""Registration of frames to the empty scene: how far a nudged or shaking camera has turned, and the frame as it would be without it.

Textured points of the empty scene, spread over the picture, are found again in the frame (Lucas and Kanade, inverse compositional, with
robust weights against the person). Both pictures are reduced, and compared in the logarithm of brightness without its slow changes over
the picture, which are light.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats, Image, to_brightness

Homography = NDArray[np.float64]
"""Of shape (3, 3): pixels of the empty scene to pixels of the frame, in coordinates about the middle over half the width."""

WIDTH = 160
"""Width of the reduced picture, pixels, about."""
BLOCKS = 8, 6
"""Number of blocks across and down; points are taken from each."""
POINTS = 40
"""Greatest number of points in a block."""
MIN_SLOPE = 2.5
"""Least slope of a point's brightness, grey levels per pixel of the reduced picture: below, it is noise, rounding or a faint shadow."""
MIN_BLOCKS = 0.25
"""Least share of blocks with points: a plain wall shows no movement, and moves no silhouette."""
OFFSET = 16
"""Added to grey levels before the logarithm: noise of dark pixels counts less."""
FINE, COARSE = 1.0, 8.0
"""Standard deviations of the smoothing, pixels of the reduced picture: noise is taken off, and what changes more slowly."""
REACH = 0.1
"""Greatest shift that is searched, over the width."""
MIN_SCALE = 0.01
"""Least assumed standard deviation of a point's difference, log brightness."""
STILL = 0.4
"""Greatest movement, pixels of the frame at its corners, up to which it is left unchanged."""
UNLIKE, SEARCHED_FROM = 0.9, 0.6
"""Median difference of points over their median value: from which on picture and scene do not match, and a movement is searched for. Noise
and light reach 0.7, pictures that have nothing in common 1.4, a nudge in a room with few details 0.8."""
BETTER = 0.6
"""Greatest such difference under a movement, over that without it: compression leaves 0.65 under a movement that is none."""
BEND = 0.04
"""Standard deviation of the corners, over half the width, that is assumed for a change of view beyond shift and roll."""
OUTSIDE = 1e3
"""Difference of a point outside the picture."""
CORRELATION = 4.0
"""Number of neighbouring points whose differences count as one."""
STEPS = 8
"""Greatest number of steps of a refinement."""
ROUGH, SETTLED = 0.3, 0.05
"""Movement of a step, pixels of the frame, at which the refinement in half of the reduced picture, and in all of it, ends."""
SEARCHED = 3
"""Step over the points in the search of shifts."""
SHIFTS = np.zeros((8, 3))
SHIFTS[2, 0] = SHIFTS[5, 1] = 1
SHIFTS[1, 2], SHIFTS[3, 2] = -1, 1


class Points(NamedTuple):
    """Textured points of the empty scene at one reduction."""

    xy: Floats
    """Their places (N, 2), coordinates about the middle over half the width."""
    value: Floats
    """Values of the reduced scene (N,)."""
    jacobian: Floats
    """Derivatives of the values with respect to the eight parameters of a homography (N, 8)."""


class Gap(NamedTuple):
    """Pixels of the empty scene that a frame of a moved camera does not show."""

    unseen: Image
    """255 for them, else 0, of shape (H, W)."""
    seen: tuple[int, int, int, int]
    """Top, bottom, left and right border of a rectangle that is shown whole, pixels."""

    def blanked(self, image: Image, scene: Image) -> Image:
        """An image (H, W, 3) or (H, W) with the scene where it is not shown."""
        import cv2

        return np.asarray(cv2.copyTo(scene, self.unseen, image), np.uint8)

    def filled(self, mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """A mask (H, W) that continues over the pixels that are not shown: a body that the border cuts does not end there."""
        import cv2

        (top, bottom, left, right), (height, width) = self.seen, mask.shape
        inner = np.ascontiguousarray(mask[top:bottom, left:right]).view(np.uint8)
        around = cv2.copyMakeBorder(inner, top, height - bottom, left, width - right, cv2.BORDER_REPLICATE)
        return np.asarray(cv2.copyTo(around, self.unseen, mask.astype(np.uint8)), np.uint8).view(np.bool_)


@dataclass(frozen=True, eq=False)
class Registration:
    """Finds the movement of a camera since the empty scene, and undoes it."""

    scene: Image
    """Mean picture of the empty scene, of shape (H, W, 3), blue green red, or (H, W)."""

    def movement(self, image: Image) -> Homography | None:
        """The movement of the camera in a frame like the scene; None if it stands still, or if the scene has too little texture to tell."""
        levels = self._levels
        if levels is None:
            return None
        fine, coarse = levels
        picture = self._reduced(image)
        difference = _compared(fine, picture, np.eye(3))
        if not self._moved(fine, difference):
            return None
        small = _halved(picture)
        pixel = 2 / self.scene.shape[1]
        found = _refined(coarse, small, _searched(coarse, small), True, ROUGH * pixel)
        found = _refined(fine, picture, found, False, SETTLED * pixel)
        better = _unlike(fine, _compared(fine, picture, found)) < BETTER * min(_unlike(fine, difference), 1)
        return found if better and self.pixels(found) >= STILL else None

    def _moved(self, points: Points, difference: Floats) -> bool:
        """Whether points' differences (N,) look like those of a camera that moved: a little, by the first step; far, by their size."""
        step = _solved(*_equations(points, difference), np.eye(3), rigid=True)
        return _unlike(points, difference) >= SEARCHED_FROM or self.pixels(_matrix(step)) >= STILL

    def matches(self, image: Image, movement: Homography | None) -> bool:
        """Whether a frame under a movement looks like the scene; true if the scene has too little texture to tell."""
        if self._levels is None:
            return True
        points = self._levels[0]
        return _unlike(points, _compared(points, self._reduced(image), np.eye(3) if movement is None else movement)) < UNLIKE

    def pixels(self, movement: Homography) -> float:
        """The greatest displacement of a corner by a movement, pixels of the frame."""
        return float(np.hypot(*(_mapped(movement, self._corners) - self._corners).T).max()) * self.scene.shape[1] / 2

    def undone(self, image: Image, movement: Homography) -> tuple[Image, Gap]:
        """The frame as the camera would see it without a movement, and the pixels that it does not show."""
        import cv2

        height, width = self.scene.shape[:2]
        to_pixels = np.array([[width / 2, 0, (width - 1) / 2], [0, width / 2, (height - 1) / 2], [0, 0, 1]])
        matrix = to_pixels @ movement @ np.linalg.inv(to_pixels)
        out = cv2.warpPerspective(image, matrix, (width, height), flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP)
        return np.asarray(out, np.uint8), _gap(matrix, width, height)

    @cached_property
    def _corners(self) -> NDArray[np.float64]:
        tall = self.scene.shape[0] / self.scene.shape[1]
        return np.array([[-1, -tall], [1, -tall], [-1, tall], [1, tall]])

    @cached_property
    def _levels(self) -> tuple[Points, Points] | None:
        """Points of the reduced scene and of its half; None if it has too little texture."""
        fine, grey = self._reduced(self.scene), self._reduced_grey(self.scene).astype(np.float32)
        points = _points(fine, grey)
        return None if points is None else (points, _points(_halved(fine), _halved(grey)) or points)

    def _reduced_grey(self, image: Image) -> Image:
        import cv2

        height, width = image.shape[:2]
        factor = max(1, round(width / WIDTH))
        size = max(width // factor, 8), max(height // factor, 8)
        return np.asarray(cv2.resize(to_brightness(image), size, interpolation=cv2.INTER_AREA), np.uint8)

    def _reduced(self, image: Image) -> Floats:
        import cv2

        logs = LOGS[self._reduced_grey(image)]
        return np.asarray(cv2.GaussianBlur(logs, (0, 0), FINE) - cv2.blur(logs, (2 * round(COARSE) + 1,) * 2), np.float32)


LOGS = np.log(np.arange(256) + OFFSET).astype(np.float32)


def _gap(matrix: Homography, width: int, height: int) -> Gap:
    """The pixels that a frame does not show under a movement, pixels of the empty scene to pixels of the frame."""
    import cv2

    corners = np.array([[1, 1], [width - 2, 1], [width - 2, height - 2], [1, height - 2]], float)
    corners = np.rint(_mapped(np.asarray(np.linalg.inv(matrix), float), corners)).astype(np.int32)
    unseen = cv2.fillConvexPoly(np.full((height, width), 255, np.uint8), corners, 0)
    x, y = np.clip(corners, 0, (width - 1, height - 1)).T.tolist()
    left, top = max(x[0], x[3]), max(y[0], y[1])
    return Gap(np.asarray(unseen, np.uint8), (top, max(min(y[2], y[3]), top) + 1, left, max(min(x[1], x[2]), left) + 1))


def _halved(picture: Floats) -> Floats:
    import cv2

    return np.asarray(cv2.resize(picture, (picture.shape[1] // 2, picture.shape[0] // 2), interpolation=cv2.INTER_AREA), np.float32)


def _points(picture: Floats, grey: Floats) -> Points | None:
    """The points of steepest slope in each block of a reduced picture (H, W), of brightness `grey` (H, W), grey levels; None if too few
    blocks have any."""
    height, width = picture.shape
    down, across = (np.asarray(slope) for slope in np.gradient(picture))
    slope = np.hypot(down, across)
    slope[slope * (grey + OFFSET) < MIN_SLOPE] = 0
    slope[:2], slope[-2:], slope[:, :2], slope[:, -2:] = 0, 0, 0, 0
    rows, columns, filled = list[NDArray[np.intp]](), list[NDArray[np.intp]](), 0
    for ys in np.array_split(np.arange(height), BLOCKS[1]):
        for xs in np.array_split(np.arange(width), BLOCKS[0]):
            block = slope[np.ix_(ys, xs)].ravel()
            order = np.argsort(-block, kind="stable")[: min(POINTS, len(block) // 3)]
            best = order[block[order] > 0]
            filled += len(best) >= 3
            rows.append(ys[best // len(xs)])
            columns.append(xs[best % len(xs)])
    if filled < MIN_BLOCKS * BLOCKS[0] * BLOCKS[1]:
        return None
    y, x = np.concatenate(rows), np.concatenate(columns)
    half = width / 2
    u, v = (x + 0.5) / half - 1, (y + 0.5 - height / 2) / half
    a, b = across[y, x] * half, down[y, x] * half
    along = a * u + b * v
    jacobian = np.column_stack([a * u, a * v, a, b * u, b * v, b, -along * u, -along * v])
    return Points(np.column_stack([u, v]).astype(np.float32), picture[y, x], jacobian.astype(np.float32))


def _searched(points: Points, picture: Floats) -> Homography:
    """The shift under which most points look alike, to a pixel of a reduced picture (H, W)."""
    from shadowpuppet.silhouette.correction._kernels import shift_costs

    reach = round(REACH * picture.shape[1])
    cap = np.float32(np.median(np.abs(points.value)))
    costs = shift_costs(points.xy[::SEARCHED], points.value[::SEARCHED], picture, reach, cap)
    y, x = np.unravel_index(np.argmin(costs), costs.shape)
    out = np.eye(3)
    out[:2, 2] = (int(x) - reach, int(y) - reach)
    out[:2, 2] /= picture.shape[1] / 2
    return out


def _refined(points: Points, picture: Floats, movement: Homography, rigid: bool, tolerance: float) -> Homography:
    """A movement refined by Gauss-Newton steps; `rigid`: shift and roll alone."""
    for _ in range(STEPS):
        step = _solved(*_equations(points, _compared(points, picture, movement)), movement, rigid)
        movement = movement @ np.linalg.inv(_matrix(step))
        movement = movement / movement[2, 2]
        if np.abs(step).sum() < tolerance:
            break
    return movement


def _equations(points: Points, difference: Floats) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Normal equations (8, 8) and (8,) of a step that takes differences (N,) away, in units of their standard deviation.

    Weights are Geman and McClure's.
    """
    scale = np.float32(max(1.4826 * float(np.median(np.abs(difference))), MIN_SCALE))
    weight = 1 / ((1 + np.square(difference / (2 * scale))) * scale) ** 2
    weighted = points.jacobian * weight[:, None]
    return (weighted.T @ points.jacobian).astype(float), (difference @ weighted).astype(float)


def _unlike(points: Points, difference: Floats) -> float:
    """Median of the differences (N,) of points over that of their values: near 0 for pictures that match, 1.4 for strangers."""
    return float(np.median(np.abs(difference)) / np.median(np.abs(points.value)))


def _compared(points: Points, picture: Floats, movement: Homography) -> Floats:
    """Differences (N,) of a reduced picture (H, W) and points under a movement; a point outside the picture has a very large one."""
    from shadowpuppet.silhouette.correction._kernels import point_differences

    out = np.empty(len(points.value), np.float32)
    point_differences(points.xy, points.value, picture, movement.astype(np.float32), np.float32(OUTSIDE), out)
    return out


def _solved(left: NDArray[np.float64], right: NDArray[np.float64], movement: Homography, rigid: bool) -> NDArray[np.float64]:
    """The step (8,) that solves normal equations."""
    prior = CORRELATION / BEND**2
    if rigid:
        left, right = SHIFTS.T @ left @ SHIFTS, SHIFTS.T @ right
        return SHIFTS @ np.linalg.solve(left + np.eye(3), right)
    beyond = prior * (np.eye(8) - SHIFTS @ np.linalg.pinv(SHIFTS))
    now = (movement - np.eye(3)).ravel()[:8]
    return np.asarray(np.linalg.solve(left + beyond + np.eye(8), right + beyond @ now), float)


def _matrix(step: NDArray[np.float64]) -> Homography:
    return np.eye(3) + np.append(step, 0).reshape(3, 3)


def _mapped(movement: Homography, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.column_stack([xy, np.ones(len(xy))]) @ movement.T
    return out[:, :2] / out[:, 2:]
