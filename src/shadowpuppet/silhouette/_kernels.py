"""Per-pixel kernels. They release the GIL: several cameras are segmented in parallel."""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import compiled

NEUTRAL = 128.0
"""Cr and Cb of a grey pixel, 8 bit."""


@compiled(nogil=True, fastmath={"reassoc", "contract", "nsz", "arcp"})
def classify(planes, within, mean, inverse_sigma, keyed, shadowed, darkest, asked, weak, strong, label):
    """Label (H, W) pixels: 0 background, 1 differing by `weak` standard deviations, 2 by `strong`.

    `planes` uint8, `mean`, `inverse_sigma` float32, all of shape (H, W, 3): Y, Cr, Cb. The channels of `keyed` (3,), 0 or 1,
    are compared. A pixel is background if `within` (H, W) is not 0. It is also background, in shadow, if its channels of `shadowed` (3,)
    match the background darkened to a share of at least `darkest` (1: no darkening); such a pixel gets label 3 instead of 0 if it has
    less than `asked` of the background's brightness.
    """
    weak, strong, centre = weak * weak, strong * strong, np.float32(NEUTRAL)
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
def contrast(planes, mean, seen, out):
    """Euclidean difference (H, W), grey levels, of `planes` uint8 and `mean` float32 (H, W, 3) in the channels of `seen` (3,)."""
    for y in range(planes.shape[0]):
        for x in range(planes.shape[1]):
            d0 = np.float32(planes[y, x, 0]) - mean[y, x, 0]
            d1 = np.float32(planes[y, x, 1]) - mean[y, x, 1]
            d2 = np.float32(planes[y, x, 2]) - mean[y, x, 2]
            out[y, x] = np.sqrt(seen[0] * d0 * d0 + seen[1] * d1 * d1 + seen[2] * d2 * d2)


@compiled(nogil=True)
def far_from_samples(image, samples, squared_radius, needed, out):
    """Set `out` (H, W) to 1 for pixels of an image (H, W, C) that are near to fewer than `needed` of the samples (N, H, W, C), else to 0.

    All are uint8; near: within `squared_radius`, the square of a distance in grey levels.
    """
    for y in range(image.shape[0]):
        for x in range(image.shape[1]):
            near = 0
            for n in range(samples.shape[0]):
                squared = 0
                for c in range(image.shape[2]):
                    difference = np.int32(image[y, x, c]) - np.int32(samples[n, y, x, c])
                    squared += difference * difference
                near += squared <= squared_radius
                if near >= needed:
                    break
            out[y, x] = near < needed


@compiled(nogil=True)
def point_differences(xy, value, picture, movement, outside, out):
    """Differences (N,) of the picture (H, W) at the moved points and the points' values; `outside` for points outside the picture."""
    height, width = picture.shape
    half = np.float32(width / 2)
    for n in range(len(value)):
        u, v = xy[n, 0], xy[n, 1]
        w = movement[2, 0] * u + movement[2, 1] * v + movement[2, 2]
        x = ((movement[0, 0] * u + movement[0, 1] * v + movement[0, 2]) / w + 1) * half - np.float32(0.5)
        y = (movement[1, 0] * u + movement[1, 1] * v + movement[1, 2]) / w * half + np.float32(height / 2 - 0.5)
        if not (0 <= x < width - 1 and 0 <= y < height - 1):
            out[n] = outside
            continue
        i, j = int(y), int(x)
        q, p = y - np.float32(i), x - np.float32(j)
        above = picture[i, j] + p * (picture[i, j + 1] - picture[i, j])
        below = picture[i + 1, j] + p * (picture[i + 1, j + 1] - picture[i + 1, j])
        out[n] = above + q * (below - above) - value[n]


@compiled(nogil=True)
def shift_costs(xy, value, picture, reach, cap):
    """Mean difference, capped, of points and picture (H, W), for shifts by up to `reach` pixels down and across."""
    height, width = picture.shape
    out = np.empty((2 * reach + 1, 2 * reach + 1))
    for dy in range(-reach, reach + 1):
        for dx in range(-reach, reach + 1):
            total, number = 0.0, 0
            for n in range(len(value)):
                x = int((xy[n, 0] + 1) * width / 2) + dx
                y = int(xy[n, 1] * width / 2 + height / 2) + dy
                if 0 <= x < width and 0 <= y < height:
                    total += min(abs(picture[y, x] - value[n]), cap)
                    number += 1
            out[dy + reach, dx + reach] = total / max(number, 1)
    return out
