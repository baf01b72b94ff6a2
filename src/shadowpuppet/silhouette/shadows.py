"""Distinguishes dark skin or clothes from a shadow on a background of the same hue.

Single pixels are alike: less light, the same colour. Connected parts differ. A limb is broadly connected to the rest of the person, or ends
at a sharp edge, and is shaded like a round object or of a slightly different hue. A shadow fades out, touches the person at the feet, or
darkens its surface evenly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import bounding_window
from shadowpuppet.jit import compiled
from shadowpuppet.silhouette.cleanup import chosen_parts, connected

if TYPE_CHECKING:
    from shadowpuppet.silhouette.background import Floats, Image
    from shadowpuppet.silhouette.boundary import Labels

MAYBE_SHADOW = 3
"""Label of pixels that may be either."""
MAX_SHADE = 0.92
"""Share of the background's light below which a pixel gets that label: faint borders of shadows have more."""
MAX_LIMB_LIGHT = 0.8
"""Greatest share of the background's light in a limb. Soft shadows in well-lit rooms leave more."""
NECK_CONTACT, BROAD_CONTACT = 0.1, 0.35
"""Least share of a part's edge that borders on the rest of the person: of a head at the neck, and of most limbs."""
SHARP_EDGE = 0.5
"""Share of the lost light regained across the edge of a part with little contact. Soft shadows have 0.1 to 0.35, limbs 0.4 to 0.8."""
MAX_EVEN_SPREAD, MAX_NEUTRAL_HUE, MIN_UNEVEN_SPREAD = 0.6, 0.4, 1.0
"""Standard deviation of brightness and difference of hue, over the assumed standard deviation, below which a part is only darkened
background; and the deviation of brightness from which on it surely is a limb."""
OUTWARD_STEP, INWARD_STEP = 2, 1
"""Distances from an edge, pixels, between which light is compared."""


def resolve_shadows(label: Labels, planes: Image, mean: Floats, inverse_sigma: Floats) -> Labels:
    """Labels (H, W) in which `MAYBE_SHADOW` is replaced by 1, perhaps a person, or 0, background.

    planes, mean, inverse_sigma: smoothed Y, Cr, Cb of frame and background and the inverse standard deviation, of shape (H, W, 3).
    """
    import cv2

    either = np.asarray(cv2.inRange(label, MAYBE_SHADOW, MAYBE_SHADOW), np.uint8)
    label = label & ~either
    firm = np.asarray(cv2.morphologyEx(either, cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)), np.uint8)
    window = bounding_window(firm, 1)
    if not firm[window].any():
        return label
    number, parts = connected(np.ascontiguousarray(firm[window]), 4)
    limbs = _limbs(_part_sums(parts, number, label, window[0].start, window[1].start, planes, mean, inverse_sigma))
    if limbs.any():
        found = chosen_parts(parts, limbs)
        label[window] |= np.asarray(cv2.dilate(found, np.ones((3, 3), np.uint8)), np.uint8) & (either[window] >> 7)
    return label


def _limbs(sums: np.ndarray) -> NDArray[np.bool_]:
    """Whether each part is a limb, of shape (K,); sums: `_part_sums` (K, 11)."""
    _, inner, light, square, cr, cb, sigma, edge, along, open_edge, across = sums.T
    inner, edge, open_edge = np.maximum(inner, 1), np.maximum(edge, 1), np.maximum(open_edge, 1)
    light, touching = light / inner, along / edge
    spread = np.sqrt(np.maximum(square / inner - light**2, 0)) * sigma / inner
    sharpness = across / open_edge / np.maximum(1 - light, 1e-3)
    shaded = (spread >= MAX_EVEN_SPREAD) | (np.hypot(cr, cb) / inner >= MAX_NEUTRAL_HUE)
    alone = (touching >= NECK_CONTACT) & (sharpness >= SHARP_EDGE) & (spread >= MIN_UNEVEN_SPREAD)
    return (light <= MAX_LIMB_LIGHT) & ((shaded & (touching >= BROAD_CONTACT)) | alone)


@compiled(nogil=True)
def _part_sums(parts, number, label, top, left, planes, mean, inverse_sigma):
    """Sums over each of `number` parts (int32, (h, w), at row `top` and column `left` of the picture), of shape (number, 11).

    Columns: 0 pixels. Over pixels well inside: 1 their number, 2 light (share of the background's brightness), 3 its square, 4 and 5
    difference of Cr and Cb from the darkened background, 6 the background's brightness, 4 to 6 in standard deviations. Sides of pixels
    on the edge: 7 their number, 8 those along the person, 9 others, 10 gain of light across those others.
    """
    out = np.zeros((number, 11))
    height, width = label.shape
    for row in range(parts.shape[0]):
        for column in range(parts.shape[1]):
            part = parts[row, column]
            if part == 0:
                continue
            y, x, inside = row + top, column + left, 0
            light = planes[y, x, 0] / max(mean[y, x, 0], np.float32(1))
            out[part, 0] += 1
            for dy, dx in ((-1, 0), (1, 0), (0, -1), (0, 1)):
                v, u = row + dy, column + dx
                if 0 <= v < parts.shape[0] and 0 <= u < parts.shape[1] and parts[v, u] == part:
                    inside += 1
                    continue
                if not (0 <= y + dy < height and 0 <= x + dx < width):
                    continue
                out[part, 7] += 1
                if label[y + dy, x + dx]:
                    out[part, 8] += 1
                    continue
                v, u, b, a = y + OUTWARD_STEP * dy, x + OUTWARD_STEP * dx, y - INWARD_STEP * dy, x - INWARD_STEP * dx
                if min(v, u, b, a) >= 0 and max(v, b) < height and max(u, a) < width:
                    out[part, 9] += 1
                    out[part, 10] += planes[v, u, 0] / max(mean[v, u, 0], np.float32(1))
                    out[part, 10] -= planes[b, a, 0] / max(mean[b, a, 0], np.float32(1))
            if inside == 4 and _well_inside(parts, row, column, part):
                out[part, 1] += 1
                out[part, 2] += light
                out[part, 3] += light * light
                for c in range(1, 3):
                    out[part, 3 + c] += (planes[y, x, c] - 128.0 - light * (mean[y, x, c] - 128.0)) * inverse_sigma[y, x, c]
                out[part, 6] += mean[y, x, 0] * inverse_sigma[y, x, 0]
    return out


@compiled(nogil=True)
def _well_inside(parts, row, column, part):
    """Whether the part reaches two pixels to every side: nearer to the edge its light is mixed with that beyond."""
    if row < 2 or column < 2 or row + 2 >= parts.shape[0] or column + 2 >= parts.shape[1]:
        return False
    return (parts[row - 2, column] == part and parts[row + 2, column] == part and parts[row, column - 2] == part
            and parts[row, column + 2] == part)
