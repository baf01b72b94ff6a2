"""From labelled pixels to one person: specks removed, the largest part kept, the outline placed by contrast, small holes filled."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Window, bounding_window
from shadowpuppet.silhouette.boundary import OUTWARD_REACH, Contrast, EdgeProfile, Labels, at_half_contrast, disc

MIN_PART_SHARE = 0.02
"""Least size of another part of the person (a hand), or of another person, over the largest part's: a person five times as far away as two
who are seen as one part."""
MAX_PART_GAP = 0.06
"""Greatest distance of such a part (half a neck), over the square root of the largest part's area."""
MAX_HOLE_SHARE = 0.004
"""Holes of up to this share of the person's area are filled."""


def clean(label: Labels, contrast: Callable[[Window, Labels], Contrast], outline: EdgeProfile, several: bool = False) -> Labels:
    """The person among pixels (H, W) labelled 0, 1 or 2 (background, perhaps, surely), or `several` people: 1 for theirs; empty if there is
    none. `contrast`: of pixels (h, w) of a window of rows and columns."""
    mask = coarse_person(label, several)
    outlined, window = np.zeros_like(mask), bounding_window(mask, outline.width + OUTWARD_REACH + 1)
    if mask[window].any():
        outlined[window] = at_half_contrast(np.ascontiguousarray(mask[window]), lambda where: contrast(window, where), outline)
    around, person = bounding_window(outlined, 1), np.zeros_like(mask)
    if outlined[around].any():
        person[around] = fill_small_holes(main_part(outlined[around], outlined[around] > 0, several))
    return person


def coarse_person(label: Labels, several: bool = False) -> Labels:
    """The connected part, without specks, with the most pixels labelled 2; with `several` all but small ones."""
    import cv2

    around, out = bounding_window(label, 3), np.zeros(label.shape, np.uint8)
    if not (inner := label[around]).any():
        return out
    likely = cv2.medianBlur((inner > 0).astype(np.uint8), 3)
    likely = np.asarray(cv2.morphologyEx(likely, cv2.MORPH_CLOSE, np.ones((3, 3), np.uint8)), np.uint8)
    window = bounding_window(likely, 0)
    if likely[window].size:
        out[around][window] = main_part(likely[window], (inner[window] == 2) & (likely[window] > 0), several)
    return out


def main_part(mask: Labels, sure: NDArray[np.bool_], several: bool = False) -> Labels:
    """The connected part with the most `sure` pixels, and parts that nearly touch it, such as a head if the neck is lost; with `several`
    all parts but small ones.

    Empty if no pixel is sure.
    """
    import cv2

    from shadowpuppet.silhouette._kernels import part_sizes

    number, parts = connected(mask, 8)
    counts = np.zeros(number, np.int64)
    part_sizes(parts, sure, counts)
    if counts[1:].sum() == 0:
        return np.zeros_like(mask)
    if number == 2:
        return mask.copy()
    counts[0] = 0
    large = counts >= MIN_PART_SHARE * counts.max()
    if several:
        return chosen_parts(parts, large)
    kept = chosen_parts(parts, np.arange(number) == counts.argmax())
    large[counts.argmax()] = False
    if large.any():
        near, touching = cv2.dilate(kept, disc(max(1, round(MAX_PART_GAP * counts.max() ** 0.5)))), np.zeros(number, np.int64)
        part_sizes(parts, near, touching)
        kept |= chosen_parts(parts, large & (touching > 0))
    return kept


def connected(mask: Labels, connectivity: int) -> tuple[int, NDArray[np.int32]]:
    """The number of a mask's connected parts and of the background, and each pixel's part (H, W); 0 is the background."""
    import cv2

    # OpenCV's function that also counts pixels takes ten times as long.
    number, parts = cv2.connectedComponents(mask, connectivity=connectivity)
    return number, np.asarray(parts, np.int32)


def chosen_parts(parts: NDArray[np.int32], chosen: NDArray[np.bool_]) -> Labels:
    """1 for pixels of the parts that `chosen` (K,) has, else 0, of parts' numbers (H, W)."""
    from shadowpuppet.silhouette._kernels import some_parts

    out = np.empty(parts.shape, np.uint8)
    some_parts(parts, chosen, out)
    return out


def fill_small_holes(mask: Labels) -> Labels:
    """The mask with its small holes filled; background that touches the border is no hole."""
    from shadowpuppet.silhouette._kernels import part_sizes

    number, parts = connected(1 - mask, 4)
    sizes = np.zeros(number, np.int64)
    part_sizes(parts, np.ones_like(mask), sizes)
    filled = sizes <= MAX_HOLE_SHARE * np.count_nonzero(mask)
    for border in (parts[0], parts[-1], parts[:, 0], parts[:, -1]):
        filled[border] = False
    return mask | chosen_parts(parts, filled)
