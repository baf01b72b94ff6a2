"""Kernels: points compared with a reduced picture, one by one and for many shifts; modes of log gains."""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import compiled


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


@compiled(nogil=True)
def modes(pixels, levels, informative, log, bounds, width, least, window, shifts, sums, out):
    """Fill `out` (C,) with the mode of each channel's log gain, in bins of a histogram, by mean shift from its fullest part; not a number
    where less than a share `least` of the pixels show a gain.

    pixels (n, C), uint8: of the frame; levels (n, C): log levels of the scene; informative (n, C): whether the scene's pixel may show a
    gain, which the frame's does if it lies between the two `bounds`; log (256,): logarithms of grey levels; width: of a bin; window: half
    width, in bins, of the mean shift, and its number of steps, `shifts`; sums (2, bins + 1): work space.
    """
    total, moment, bins = sums[0], sums[1], sums.shape[1] - 1
    for c in range(pixels.shape[1]):
        sums[:] = 0
        used = 0
        for n in range(pixels.shape[0]):
            level = pixels[n, c]
            if informative[n, c] and bounds[0] < level < bounds[1]:
                used += 1
                place = int(np.rint((log[level] - levels[n, c]) / width)) + bins // 2
                total[min(max(place, 0), bins - 1) + 1] += 1
        if used < least * pixels.shape[0]:
            out[c] = np.nan
            continue
        for k in range(bins):
            moment[k + 1] = moment[k] + k * total[k + 1]
            total[k + 1] += total[k]
        narrow = window // 3
        middle = float(np.argmax(total[2 * narrow + 1 :] - total[: -2 * narrow - 1]) + narrow)
        for _ in range(shifts):
            first, last = max(0, round(middle) - window), min(bins, round(middle) + window + 1)
            middle = (moment[last] - moment[first]) / (total[last] - total[first])
        out[c] = middle - bins // 2
