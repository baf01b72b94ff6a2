"""Where a person ends: the outline set by contrast, and how blurred outlines are in a film."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.uint8]
"""Of shape (H, W), 0 or 1."""
Contrast = NDArray[np.float32]
"""Difference to the background, of shape (H, W), grey levels."""

HALF = 0.5
"""Share of the contrast around it that a pixel on the outline must have: one that the person covers by half has half of it."""
AROUND = 2
"""How much farther (pixels) than the outline is wide the mean contrast around a pixel is taken from."""
PEAK = 0.3
"""What the greatest contrast counts beside the mean: limbs as thin as the blur hardly reach their own."""
BLED = 0.3
"""Share of the contrast around it below which a pixel inside is colour that compression bled over a narrow gap."""
FULL = 0.7
"""Share of the contrast around it from which on a pixel stays, though it stick out alone: a fingertip."""
REACH = 1
"""How far (pixels) the outline may move outward: into rims that were taken for shadow."""
SHARP = 2
"""Width (pixels) of an outline that only the codec's halved colour resolution blurs; the least that is assumed."""
WIDEST = 8
"""The most that is assumed."""
THIN = 0.04
"""The most over the root of the person's area, half a forearm: what is blurred wider has no limb inside. In small pictures the folds and
stripes of clothes are as narrow as outlines, and are taken for them."""
RISEN = 0.88
"""Share of the contrast deep inside at which an outline's blur ends."""


class Outline(NamedTuple):
    """What the film's quality says of outlines."""

    width: int
    """Over how many pixels they are blurred."""
    least: float
    """Least contrast of a pixel that shows something, grey levels."""


def at_half_contrast(mask: Mask, contrast: Contrast, outline: Outline) -> Mask:
    """Move the outline to where the contrast has fallen to half of what it is further inside.

    Blur and compression mix person and background over some pixels; any fixed threshold puts the outline of a strong contrast too
    far outside and that of a weak one too far inside.
    """
    import cv2

    inner = np.asarray(cv2.erode(mask, disc(outline.width), borderValue=1), np.uint8)
    around = _around(mask, inner, contrast, outline.width)
    core = (inner > 0) & (contrast >= np.minimum(BLED * around, 2 * outline.least))
    rim = (cv2.dilate(mask, disc(REACH)) > 0) & (contrast >= np.maximum(HALF * around, outline.least))
    found = (core | rim).astype(np.uint8)
    return np.asarray(cv2.medianBlur(found, 3), np.uint8) | (found & (contrast > FULL * around))


def _around(mask: Mask, inner: Mask, contrast: Contrast, width: int) -> Contrast:
    """What contrast the person has near each pixel: mostly the mean over the mask's inner part, and the greatest where there is none.

    The greatest alone would take an arm for the blurred outline of a brighter shirt beside it.
    """
    import cv2

    side = 2 * (width + AROUND) + 1
    total, count = (cv2.boxFilter(values, cv2.CV_32F, (side, side), normalize=False) for values in (contrast * inner, inner))
    greatest = cv2.dilate(contrast * mask, np.ones((2 * width + 1, 2 * width + 1), np.uint8))
    mean = np.where(count > 0.5, np.minimum(total / np.maximum(count, 1), greatest), greatest)
    return np.float32(PEAK) * greatest + np.float32(1 - PEAK) * mean


def outline_width(people: Iterable[tuple[Mask, Contrast]]) -> int:
    """Over how many pixels outlines are blurred, from masks that reach too far out and the contrast in them.

    The contrast, over the greatest near by, climbs from the mask's border inward; the width is where it comes near to its height
    deep inside. Layers are taken together over all pictures, so folds and shading, which are anywhere, do not matter.
    """
    import cv2

    layers: list[list[NDArray[np.floating]]] = [[] for _ in range(WIDEST + 1)]
    areas = list[int]()
    for mask, contrast in people:
        areas.append(int(np.count_nonzero(mask)))
        highest = cv2.dilate(contrast * mask, np.ones((2 * WIDEST + 1, 2 * WIDEST + 1), np.uint8))
        # Outside the picture the person goes on, so the picture's border is no outline.
        depth = cv2.distanceTransform(np.pad(mask, WIDEST + 1, mode="edge"), cv2.DIST_L2, 3)
        depth = np.rint(depth[WIDEST + 1 : -WIDEST - 1, WIDEST + 1 : -WIDEST - 1]).astype(int)
        for n, layer in enumerate(layers, start=1):
            layer.append(contrast[depth == n] / np.maximum(highest[depth == n], 1e-3))
    joined = [np.concatenate(layer) if layer else np.zeros(0) for layer in layers]
    if min(map(len, joined)) < 30:
        return SHARP
    heights = np.array([np.median(layer) for layer in joined])
    widest = min(max(SHARP, math.ceil(THIN * np.median(areas) ** 0.5)), WIDEST)
    return int(np.clip(np.argmax(heights >= RISEN * heights[-1]), SHARP, widest))


def disc(radius: int) -> Mask:
    """A round structuring element."""
    import cv2

    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1)), np.uint8)
