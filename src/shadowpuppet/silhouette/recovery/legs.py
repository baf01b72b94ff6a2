"""Legs that keep still: pixels below the trunk, connected with it, in colours that the scene does not show elsewhere.

The legs of a person who stands sway by less than a pixel, so that nothing tells them from the floor by movement; the trunk and the arms
above them do move.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats
from shadowpuppet.silhouette.recovery.colours import UNKNOWN, colour_model, known
from shadowpuppet.silhouette.recovery.movement import Mask, Movement

WAIST = 20
"""Rows of the trunk over those, above its centre, in which its width is measured."""
SPREAD = 0.5
"""Width of the zone of the legs beside that of the trunk, over the trunk's width, on either side: feet point outward."""
LEAST_TRUNK = 0.002
"""Least area of the trunk over the picture's: smaller parts are no trunk of someone who stands."""
LEAST_LEGS = 0.02
"""Least area of the legs over the trunk's."""


def still_legs(still: Floats, movement: Movement, covered: Mask) -> Mask | None:
    """Pixels (H, W) of legs outside the region of movement; None if there are none.

    still: median Y, Cr, Cb (H, W, 3); covered: pixels (H, W) taken for covered in all frames, whose largest part is the trunk.
    """
    import cv2

    trunk = largest_part(covered)
    if trunk is None:
        return None
    zone = _zone(trunk) & ~movement.region
    around = still[~movement.region & ~zone]
    if not zone.any() or not len(around):
        return None
    strange = np.zeros(zone.shape, np.uint8)
    strange[zone] = known(still[zone], colour_model(around, np.ones(len(around)))) < UNKNOWN
    pair = np.ones((2, 2), np.uint8)
    legs = cv2.dilate(cv2.erode(strange, pair, anchor=(0, 0)), pair, anchor=(1, 1)) > 0  # without lines one pixel wide
    joined = cv2.dilate((legs | trunk).astype(np.uint8), np.ones((3, 3), np.uint8))
    _, parts = cv2.connectedComponents(joined, connectivity=4)
    legs &= np.asarray(parts) == np.asarray(parts)[trunk][0]
    if np.count_nonzero(legs) < LEAST_LEGS * np.count_nonzero(trunk):
        return None
    return np.asarray(cv2.dilate(legs.astype(np.uint8), np.ones((3, 3), np.uint8)), np.uint8) > 0


def largest_part(covered: Mask) -> Mask | None:
    """The largest part of covered pixels (H, W); None if it is smaller than a trunk."""
    import cv2

    _, parts, stats, _ = cv2.connectedComponentsWithStats(covered.astype(np.uint8), connectivity=4)
    if len(stats) < 2 or stats[1:, cv2.CC_STAT_AREA].max() < LEAST_TRUNK * covered.size:
        return None
    return np.asarray(parts) == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())


def waist(trunk: Mask) -> tuple[int, NDArray[np.bool_]]:
    """The row of a trunk's (H, W) centre, and the columns (W,) that it covers there or just above."""
    rows = trunk.sum(axis=1)
    middle = int(np.average(np.arange(len(rows)), weights=rows))
    return middle, np.any(trunk[middle - np.count_nonzero(rows) // WAIST : middle + 1], axis=0)


def _zone(trunk: Mask) -> NDArray[np.bool_]:
    """The pixels (H, W) below the middle of the trunk (H, W), and somewhat beside it."""
    middle, across = waist(trunk)
    columns = np.flatnonzero(across)
    out = np.zeros(trunk.shape, bool)
    if len(columns):
        margin = round(SPREAD * (columns[-1] - columns[0] + 1))
        out[middle:, max(columns[0] - margin, 0) : columns[-1] + margin + 1] = True
    return out
