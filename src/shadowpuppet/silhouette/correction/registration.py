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
from shadowpuppet.silhouette.correction.points import (
    OFFSET,
    Homography,
    Points,
    compared,
    matrix_of,
    median_of,
    refined,
    searched_shift,
    solved_step,
    textured_points,
)

WIDTH = 160
"""Width of the reduced picture, pixels, about."""
FINE, COARSE = 1.0, 8.0
"""Standard deviations of the smoothing, pixels of the reduced picture: noise is taken off, and what changes more slowly."""
STILL = 0.4
"""Greatest movement, pixels of the frame at its corners, up to which it is left unchanged."""
UNLIKE, SEARCHED_FROM = 0.9, 0.6
"""Median difference of points over their median value: from which on picture and scene do not match, and a movement is searched for. Noise
and light reach 0.7, pictures that have nothing in common 1.4, a nudge in a room with few details 0.8."""
LEAST_SHOWN = 0.05
"""Least share of the points that people leave for a frame to show the scene."""
BETTER = 0.6
"""Greatest such difference under a movement, over that without it: compression leaves 0.65 under a movement that is none."""
WELL = 0.25
"""Share of the points, those that fit best, which must fit better under a movement, too: of a camera that stands still, what people and
their shadows leave of the scene fits best as it is, however much of the rest a movement explains by chance."""
PIECE, BENT = 64, 0.03
"""Greatest number of pixels in a row over which a movement is taken for linear, and its greatest error by that, pixels."""
ROUGH, SETTLED = 0.3, 0.05
"""Movement of a step, pixels of the frame, at which the refinement in half of the reduced picture, and in all of it, ends."""
SPARSE, FEWER = 3, 0.5
"""Step over the points in the first test for a movement, and its limits over those of the second, which has all points."""
NONE = np.eye(3)
"""No movement."""


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
        if not self._moved(self._some, picture, FEWER):
            return None
        if not self._moved(fine, picture):
            return None
        small = _halved(picture)
        pixel = 2 / self.scene.shape[1]
        found = refined(coarse, small, searched_shift(coarse, small), True, ROUGH * pixel)
        found = refined(fine, picture, found, False, SETTLED * pixel)
        moved, still = (np.abs(compared(fine, picture, each)) for each in (found, NONE))
        better = median_of(moved) < BETTER * min(median_of(still), fine.typical) and np.quantile(moved, WELL) < np.quantile(still, WELL)
        return found if better and self.pixels(found) >= STILL else None

    def _moved(self, points: Points, picture: Floats, margin: float = 1.0) -> bool:
        """Whether points look like those of a camera that moved: a little, by the first step; far, by the size of their differences; both
        over `margin` of the limits."""
        difference = compared(points, picture, NONE)
        typical = median_of(np.abs(difference))
        if typical >= margin * SEARCHED_FROM * points.typical:
            return True
        return self.pixels(matrix_of(solved_step(points, difference, typical, NONE, rigid=True))) >= margin * STILL

    def matches(self, image: Image, movement: Homography | None, people: NDArray[np.bool_] | None = None) -> bool:
        """Whether a frame under a movement looks like the scene where no people (H, W) hide it; true if the scene has too little texture
        to tell."""
        if self._levels is None:
            return True
        points = self._levels[0]
        picture = self._reduced(image)
        difference, values = compared(points, picture, NONE if movement is None else movement), points.value
        if people is not None:
            shown = ~_about(people, picture.shape)[points.places[1], points.places[0]]
            if np.count_nonzero(shown) < LEAST_SHOWN * len(values):
                return False
            difference, values = difference[shown], values[shown]
        return median_of(np.abs(difference)) / median_of(np.abs(values)) < UNLIKE

    def pixels(self, movement: Homography) -> float:
        """The greatest displacement of a corner by a movement, pixels of the frame."""
        return float(np.hypot(*(_mapped(movement, self._corners) - self._corners).T).max()) * self.scene.shape[1] / 2

    def undone(self, image: Image, movement: Homography) -> tuple[Image, Gap]:
        """The frame as the camera would see it without a movement, and the pixels that it does not show."""
        from shadowpuppet.silhouette.correction._kernels import moved_back

        height, width = self.scene.shape[:2]
        to_pixels = np.array([[width / 2, 0, (width - 1) / 2], [0, width / 2, (height - 1) / 2], [0, 0, 1]])
        matrix = to_pixels @ movement @ np.linalg.inv(to_pixels)
        channels = image.size // (height * width)
        piece = int(np.clip(2 * np.sqrt(BENT / max(np.abs(matrix[2, :2]).max(), 1e-9)), 8, PIECE))
        ramp = np.repeat(np.arange(piece, dtype=np.float32), channels)
        image, out = np.ascontiguousarray(image), np.empty(self.scene.shape, np.uint8)
        moved_back(image.reshape(height, -1), matrix, channels, ramp, out.reshape(height, -1))
        return out, _gap(matrix, width, height)

    @cached_property
    def _corners(self) -> NDArray[np.float64]:
        tall = self.scene.shape[0] / self.scene.shape[1]
        return np.array([[-1, -tall], [1, -tall], [-1, tall], [1, tall]])

    @cached_property
    def _levels(self) -> tuple[Points, Points] | None:
        """Points of the reduced scene and of its half; None if it has too little texture."""
        fine, grey = self._reduced(self.scene), self._reduced_grey(self.scene).astype(np.float32)
        points = textured_points(fine, grey)
        return None if points is None else (points, textured_points(_halved(fine), _halved(grey)) or points)

    @cached_property
    def _some(self) -> Points:
        """Some of the points of the reduced scene."""
        assert self._levels is not None
        return self._levels[0].some(SPARSE)

    def _reduced_grey(self, image: Image) -> Image:
        import cv2

        factor = max(1, round(image.shape[1] / WIDTH))
        out = to_brightness(image)
        while factor % 2 == 0 and out.shape[0] % 2 == 0 and out.shape[1] % 2 == 0:  # several times as fast as at once
            out, factor = _halved(out), factor // 2
        size = max(out.shape[1] // factor, 8), max(out.shape[0] // factor, 8)
        return out if out.shape == size[::-1] else np.asarray(cv2.resize(out, size, interpolation=cv2.INTER_AREA), np.uint8)

    def _reduced(self, image: Image) -> Floats:
        import cv2

        logs = np.asarray(cv2.LUT(self._reduced_grey(image), LOGS), np.float32)
        return np.asarray(cv2.subtract(cv2.GaussianBlur(logs, (0, 0), FINE), cv2.blur(logs, (2 * round(COARSE) + 1,) * 2)), np.float32)


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


def _halved(picture: np.ndarray) -> np.ndarray:
    import cv2

    return np.asarray(cv2.resize(picture, (picture.shape[1] // 2, picture.shape[0] // 2), interpolation=cv2.INTER_AREA))


def _about(people: NDArray[np.bool_], shape: tuple[int, ...]) -> NDArray[np.bool_]:
    """Pixels of a reduced picture of a shape (h, w) whose values a mask (H, W) of people changes."""
    import cv2

    small = cv2.resize(people.view(np.uint8), shape[::-1], interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.dilate(small, np.ones((2 * round(COARSE) + 1,) * 2, np.uint8)), np.uint8) > 0


def _mapped(movement: Homography, xy: NDArray[np.float64]) -> NDArray[np.float64]:
    out = np.column_stack([xy, np.ones(len(xy))]) @ movement.T
    return out[:, :2] / out[:, 2:]
