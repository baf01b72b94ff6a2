"""Placement of a person's outline at half the contrast, and the width of the outlines' blur in a film."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Labels = NDArray[np.uint8]
"""Of shape (H, W): 0 background, 1 perhaps a person, 2 surely; in clean-up 0 or 1."""
Contrast = NDArray[np.float32]
"""Difference to the background, of shape (H, W), grey levels."""

OUTLINE_SHARE = 0.5
"""Share of the surrounding contrast at the outline: a pixel half covered by the person has half of it."""
SURROUND_MARGIN = 2
"""Pixels by which the surroundings of a pixel reach beyond the width of the outline."""
PEAK_WEIGHT = 0.3
"""Weight of the greatest contrast against the mean: limbs as thin as the blur hardly reach their full contrast. If the greatest were always
used, an arm next to a brighter shirt would count as the shirt's blurred outline."""
BLEED_SHARE = 0.3
"""Share of the surrounding contrast below which a pixel inside is colour bled by compression over a narrow gap."""
FULL_SHARE = 0.7
"""Share of the surrounding contrast from which on a pixel stays even if it sticks out alone: a fingertip."""
SHARES = tuple(map(np.float32, (OUTLINE_SHARE, BLEED_SHARE, FULL_SHARE, PEAK_WEIGHT)))
"""These shares in single precision, as kernels take them."""
OUTWARD_REACH = 1
"""Pixels by which the outline may move outward, into rims that were taken for shadow."""
SHARP_WIDTH = 2
"""Least width of outlines, pixels: blurred only by the codec's halved colour resolution."""
MAX_WIDTH = 8
"""Greatest width of outlines, pixels."""
LIMB_WIDTH_SHARE = 0.04
"""Greatest width over the square root of the person's area: half a forearm. In small pictures folds and stripes of clothes are as narrow as
outlines and look like blur."""
RISE_END_SHARE = 0.88
"""Share of the inner contrast at which an outline's blur ends."""


class EdgeProfile(NamedTuple):
    """Blur of the outlines in a film."""

    width: int
    """Width of the blur, pixels."""
    least: float
    """Least contrast of a pixel on the outline, grey levels."""


def at_half_contrast(mask: Labels, contrast: Callable[[Labels], Contrast], outline: EdgeProfile) -> Labels:
    """Move the outline of a mask (H, W) to where the contrast is half of that further inside; `contrast` is asked for pixels (H, W) alone.

    Blur and compression mix person and background over some pixels; a fixed threshold would put outlines of strong contrast too far
    outside and those of weak contrast too far inside.
    """
    import cv2

    from shadowpuppet.silhouette._kernels import inside, outlined

    inner, wide = np.asarray(cv2.erode(mask, disc(outline.width), borderValue=1), np.uint8), cv2.dilate(mask, disc(OUTWARD_REACH))
    here = contrast(np.asarray(wide, np.uint8))
    deep, within = np.empty_like(here), np.empty_like(here)
    inside(here, inner, mask, deep, within)
    side = 2 * (outline.width + SURROUND_MARGIN) + 1
    total, number = (cv2.boxFilter(values, cv2.CV_32F, (side, side), normalize=False) for values in (deep, inner))
    greatest = cv2.dilate(within, np.ones((2 * outline.width + 1,) * 2, np.uint8))
    found, full = np.empty_like(mask), np.empty_like(mask)
    outlined(here, inner, wide, total, number, greatest, np.float32(outline.least), SHARES, found, full)
    return np.asarray(cv2.medianBlur(found, 3), np.uint8) | full


def outline_width(people: Iterable[tuple[Labels, Contrast]]) -> int:
    """Width of the blur of outlines, pixels, from masks that reach too far out and the contrast in them.

    The contrast, relative to the greatest nearby, rises from the mask's border inward; the width is the depth at which it approaches its
    inner level. Medians over all frames by depth make folds and shading cancel out.
    """
    import cv2

    layers: list[list[NDArray[np.floating]]] = [[] for _ in range(MAX_WIDTH + 1)]
    areas = list[int]()
    for mask, contrast in people:
        if mask.all():
            continue
        areas.append(int(np.count_nonzero(mask)))
        highest = cv2.dilate(contrast * mask, np.ones((2 * MAX_WIDTH + 1, 2 * MAX_WIDTH + 1), np.uint8))
        # The person continues outside the picture, so its border is no outline.
        depth = cv2.distanceTransform(np.pad(mask, MAX_WIDTH + 1, mode="edge"), cv2.DIST_L2, 3)
        depth = np.rint(depth[MAX_WIDTH + 1 : -MAX_WIDTH - 1, MAX_WIDTH + 1 : -MAX_WIDTH - 1]).astype(int)
        for n, layer in enumerate(layers, start=1):
            layer.append(contrast[depth == n] / np.maximum(highest[depth == n], 1e-3))
    joined = [np.concatenate(layer) if layer else np.zeros(0) for layer in layers]
    if min(map(len, joined)) < 30:
        return SHARP_WIDTH
    heights = np.array([np.median(layer) for layer in joined])
    widest = min(max(SHARP_WIDTH, math.ceil(LIMB_WIDTH_SHARE * np.median(areas) ** 0.5)), MAX_WIDTH)
    return int(np.clip(np.argmax(heights >= RISE_END_SHARE * heights[-1]), SHARP_WIDTH, widest))


def disc(radius: int) -> Labels:
    """A round structuring element."""
    import cv2

    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1)), np.uint8)
