"""Where the frames of a film differ: the pixels that something moved over, and those that are enclosed by them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats

CALM_SHARE = 30
"""Percentile of the pixels' standard deviations over time that counts as the film's noise: those of the person are among the greatest."""
GREATEST_NOISE = 15.0
"""Greatest noise, grey levels, that a film's calm pixels can have: beyond it, they are not calm."""
LEAST_NOISE = np.array([0.7, 0.5, 0.5])
"""Least noise of Y, Cr, Cb, grey levels: compression leaves none at all in places."""
MOVED, STIRRED = 3.0, 2.0
"""Standard deviation over time, over the noise, from which on something moved over a pixel; and over a pixel and its neighbours, next to
such pixels: the outline of someone who stands still."""
DEPTH = 2
"""Pixels from its border from which on a calm pixel is inside a region."""
PART_SHARE, PART_PIXELS = 0.1, 30
"""Least size of a part that moves, over the largest part's, and in pixels."""
BORDER_SHARE = 0.5
"""Share of moving pixels at the picture's upper corners and sides from which on it is the camera, or the light, that changes."""

Mask = NDArray[np.bool_]


class Movement(NamedTuple):
    """What moves in a film."""

    noise: NDArray[np.float64]
    """Standard deviation (3,) of Y, Cr, Cb where nothing moves, grey levels."""
    region: Mask
    """Pixels that something moved over, and those that these enclose, of shape (H, W)."""
    enclosed: Mask
    """Pixels well inside the region in which the frames agree, of shape (H, W): the trunk and legs of a person who stands, or the wall
    between arm and body."""


def find_movement(planes: Floats) -> Movement:
    """The movement in frames (N, H, W, 3), smoothed Y, Cr, Cb; its region is empty if nothing moves."""
    import cv2

    deviation = planes.std(axis=0)
    noise = np.maximum(np.percentile(deviation.reshape(-1, 3), CALM_SHARE, axis=0), LEAST_NOISE)
    variance = ((deviation / noise) ** 2).max(axis=2)
    moved = _large_parts(_without_specks(variance > MOVED**2))
    stirred = _without_specks(cv2.blur(variance, (3, 3)) > STIRRED**2) | moved
    region = np.asarray(cv2.dilate(_touching(stirred, moved), np.ones((3, 3), np.uint8)), np.uint8) > 0
    region |= _enclosed(region)
    # The picture's lower border cuts a person off: what lies there is as deep inside as above it.
    inside = np.pad(region.astype(np.uint8), DEPTH, mode="edge")
    inside = cv2.erode(inside, np.ones((2 * DEPTH + 1, 2 * DEPTH + 1), np.uint8))[DEPTH:-DEPTH, DEPTH:-DEPTH] > 0
    return Movement(noise, region, inside & ~(cv2.dilate(moved, np.ones((3, 3), np.uint8)) > 0))


def unsteady(movement: Movement) -> bool:
    """Whether the picture's left, right and upper border move, or nearly all of it, as if the camera, and not a person, had moved."""
    region = movement.region
    border = np.concatenate([region[:-1, 0], region[:-1, -1], region[0]])
    return float(border.mean()) > BORDER_SHARE or float(movement.noise.max()) > GREATEST_NOISE


def _without_specks(moved: Mask) -> NDArray[np.uint8]:
    import cv2

    return np.asarray(cv2.morphologyEx(moved.astype(np.uint8), cv2.MORPH_OPEN, np.ones((2, 2), np.uint8)), np.uint8)


def _touching(stirred: NDArray[np.uint8], moved: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The connected parts of `stirred` that have pixels of `moved`."""
    import cv2

    number, parts = cv2.connectedComponents(stirred)
    found = np.zeros(number, np.uint8)
    found[np.asarray(parts, np.intp)[moved > 0]] = 1
    found[0] = 0
    return found[np.asarray(parts, np.intp)]


def _large_parts(moved: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """The moving parts without specks; parts up to four pixels apart count as one."""
    import cv2

    _, parts, stats, _ = cv2.connectedComponentsWithStats(cv2.dilate(moved, np.ones((5, 5), np.uint8)))
    areas = np.bincount(np.asarray(parts)[moved > 0], minlength=len(stats))
    areas[0] = 0
    return moved & (areas >= max(PART_SHARE * areas.max(), PART_PIXELS)).astype(np.uint8)[np.asarray(parts, np.intp)]


def _enclosed(region: Mask) -> Mask:
    """The pixels (H, W) from which every way to the left, right or upper border leads through the region."""
    import cv2

    around = np.pad(~region, ((1, 0), (1, 1)), constant_values=True).astype(np.uint8)
    _, parts = cv2.connectedComponents(around, connectivity=4)
    outside = np.asarray(parts) == np.asarray(parts)[0, 0]
    return ~outside[1:, 1:-1] & ~region
