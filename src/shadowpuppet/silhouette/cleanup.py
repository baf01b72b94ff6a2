"""From labelled pixels to one person: specks and small holes removed, the largest part kept, the outline drawn by contrast."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.outlines import REACH, Contrast, Mask, Outline, at_half_contrast

Window = tuple[slice, slice]
"""Rows and columns."""
SMALL_HOLE = 0.004
"""Holes of up to this share of the person's area are filled."""


def clean(label: Mask, contrast: Callable[[Window], Contrast], outline: Outline) -> Mask:
    """The person among pixels (H, W) labelled 0, 1 or 2 (background, perhaps, surely); empty where nobody is."""
    mask = largest_part(label)
    out = np.zeros_like(mask)
    if mask.any():
        window = window_around(mask, outline.width + REACH + 1)
        inside = at_half_contrast(np.ascontiguousarray(mask[window]), contrast(window), outline)
        out[window] = without_holes(most(inside, inside > 0))
    return out


def largest_part(label: Mask) -> Mask:
    """Pixels labelled 1 or 2, without specks, that hang together with the most pixels labelled 2."""
    import cv2

    likely = cv2.medianBlur((label > 0).astype(np.uint8), 3)
    likely = np.asarray(cv2.morphologyEx(likely, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)
    return most(likely, (label == 2) & (likely > 0))


def most(mask: Mask, sure: NDArray[np.bool_]) -> Mask:
    """The connected part of a mask with the most `sure` pixels; empty where there is none."""
    import cv2

    n, parts = cv2.connectedComponents(mask, connectivity=8)
    counts = np.bincount(parts[sure], minlength=n)
    counts[0] = 0
    return (parts == counts.argmax()).astype(np.uint8) if counts.any() else np.zeros_like(mask)


def window_around(mask: Mask, margin: int) -> Window:
    """The box around what is set, with a margin (pixels)."""
    import cv2

    x, y, width, height = cv2.boundingRect(mask)
    return slice(max(y - margin, 0), y + height + margin), slice(max(x - margin, 0), x + width + margin)


def without_holes(mask: Mask) -> Mask:
    """The mask with its small holes filled; what touches the border is no hole."""
    import cv2

    _, labels, stats, _ = cv2.connectedComponentsWithStats(1 - mask, connectivity=4)
    parts = np.asarray(labels, np.intp)
    filled = stats[:, cv2.CC_STAT_AREA] <= SMALL_HOLE * np.count_nonzero(mask)
    for border in (parts[0], parts[-1], parts[:, 0], parts[:, -1]):
        filled[border] = False
    return mask | filled[parts]
