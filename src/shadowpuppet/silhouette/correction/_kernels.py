"""Kernels over points: comparison with a reduced picture, one by one and for many shifts."""

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
