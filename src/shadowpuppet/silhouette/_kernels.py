"""Per-pixel kernels. They release the GIL: several cameras are segmented in parallel."""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import compiled


@compiled(nogil=True, fastmath={"reassoc", "contract", "nsz", "arcp"})
def classify(planes, within, mean, inverse_sigma, keyed, shadowed, darkest, asked, weak, strong, label):
    """Label (H, W) pixels: 0 background, 1 differing by `weak` standard deviations, 2 by `strong`.

    `planes` uint8, `mean`, `inverse_sigma` float32, all of shape (H, W, 3): Y, Cr, Cb. The channels of `keyed` (3,), 0 or 1,
    are compared. A pixel is background if `within` (H, W) is not 0. It is also background, in shadow, if its channels of `shadowed` (3,)
    match the background darkened to a share of at least `darkest` (1: no darkening); such a pixel gets label 3 instead of 0 if it has
    less than `asked` of the background's brightness.
    """
    weak, strong, centre = weak * weak, strong * strong, np.float32(128)  # Cr and Cb of a grey pixel
    for y in range(planes.shape[0]):
        for x in range(planes.shape[1]):
            if within[y, x]:
                label[y, x] = 0
                continue
            s0, s1, s2 = inverse_sigma[y, x, 0], inverse_sigma[y, x, 1], inverse_sigma[y, x, 2]
            b0, b1, b2 = mean[y, x, 0] * s0, (mean[y, x, 1] - centre) * s1, (mean[y, x, 2] - centre) * s2
            i0 = np.float32(planes[y, x, 0]) * s0
            i1, i2 = (np.float32(planes[y, x, 1]) - centre) * s1, (np.float32(planes[y, x, 2]) - centre) * s2
            d0, d1, d2 = i0 - b0, i1 - b1, i2 - b2
            dark = False
            squared = keyed[0] * d0 * d0 + keyed[1] * d1 * d1 + keyed[2] * d2 * d2
            if squared >= weak and darkest < 1:
                own = shadowed[0] * b0 * b0 + shadowed[1] * b1 * b1 + shadowed[2] * b2 * b2
                shared = shadowed[0] * i0 * b0 + shadowed[1] * i1 * b1 + shadowed[2] * i2 * b2
                light = min(max(shared / max(own, np.float32(1e-6)), darkest), np.float32(1))
                d0, d1, d2 = i0 - light * b0, i1 - light * b1, i2 - light * b2
                dark = np.float32(planes[y, x, 0]) < asked * mean[y, x, 0]
                squared = min(squared, shadowed[0] * d0 * d0 + shadowed[1] * d1 * d1 + shadowed[2] * d2 * d2)
            label[y, x] = np.uint8(squared >= weak) + np.uint8(squared >= strong) if squared >= weak or not dark else np.uint8(3)


@compiled(nogil=True, fastmath={"reassoc", "contract", "nsz", "arcp"})
def contrast(planes, mean, seen, where, out):
    """Euclidean difference (H, W), grey levels, of `planes` uint8 and `mean` float32 (H, W, 3) in the channels of `seen` (3,), in pixels in
    which `where` (H, W) is not 0; 0 elsewhere."""
    for y in range(planes.shape[0]):
        for x in range(planes.shape[1]):
            if not where[y, x]:
                out[y, x] = 0
                continue
            d0 = np.float32(planes[y, x, 0]) - mean[y, x, 0]
            d1 = np.float32(planes[y, x, 1]) - mean[y, x, 1]
            d2 = np.float32(planes[y, x, 2]) - mean[y, x, 2]
            out[y, x] = np.sqrt(seen[0] * d0 * d0 + seen[1] * d1 * d1 + seen[2] * d2 * d2)


@compiled(nogil=True)
def inside(contrast, inner, mask, deep, within):
    """Contrast, float32 (H, W), in `deep` where `inner` is 1, and in `within` where `mask` is 1, both uint8 (H, W); else 0."""
    for y in range(contrast.shape[0]):
        for x in range(contrast.shape[1]):
            deep[y, x] = contrast[y, x] * np.float32(inner[y, x])
            within[y, x] = contrast[y, x] * np.float32(mask[y, x])


@compiled(nogil=True)
def outlined(contrast, inner, wide, total, number, greatest, least, shares, found, full):
    """The pixels that are the person's by their contrast: `found` (H, W), and in `full` those that are so even if they stick out alone.

    contrast: float32 (H, W); inner, wide: 1 well inside the person, and on or next to them, uint8; total, number: sum of the contrasts of
    inner pixels around each pixel, and their number; greatest: greatest contrast near it, float32. least: least contrast of an outline.
    shares: of the contrast around a pixel, at the outline, of bled colour, of full contrast; and the weight of the greatest against the
    mean in that contrast, which is the greatest alone if no inner pixel is near.
    """
    at_outline, bled, whole, weight = shares
    for y in range(contrast.shape[0]):
        for x in range(contrast.shape[1]):
            if not wide[y, x]:
                found[y, x] = full[y, x] = 0
                continue
            peak, here = greatest[y, x], contrast[y, x]
            mean = min(total[y, x] / max(number[y, x], np.float32(1)), peak) if number[y, x] > np.float32(0.5) else peak
            around = weight * peak + (np.float32(1) - weight) * mean
            core = inner[y, x] > 0 and here >= min(bled * around, np.float32(2) * least)
            rim = here >= max(at_outline * around, least)
            found[y, x] = np.uint8(core or rim)
            full[y, x] = np.uint8((core or rim) and here > whole * around)


@compiled(nogil=True)
def part_sizes(parts, counted, sizes):
    """Add to `sizes` (K,) the number of pixels of each part, of those that `counted` (H, W) has; parts: their numbers, int32 (H, W)."""
    for y in range(parts.shape[0]):
        for x in range(parts.shape[1]):
            if counted[y, x]:
                sizes[parts[y, x]] += 1


@compiled(nogil=True)
def some_parts(parts, chosen, out):
    """Set `out` (H, W), uint8, to 1 for pixels of the parts that `chosen` (K,) has, else to 0; parts: their numbers, int32 (H, W)."""
    for y in range(parts.shape[0]):
        for x in range(parts.shape[1]):
            out[y, x] = np.uint8(chosen[parts[y, x]])
