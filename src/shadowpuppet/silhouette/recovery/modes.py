"""Temporal modes: the colours that a pixel shows in the frames of a film, with their shares of the frames."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.jit import compiled

COUNT = 5
"""Greatest number of modes of a pixel, the most frequent first."""
RADIUS = 4.0
"""Radius of a mode, standard deviations of the noise."""
MIN_RADIUS = np.array([6.0, 4.0, 4.0])
"""Least radius in Y, Cr, Cb, grey levels: compression and faint shadows."""

Floats = NDArray[np.float32]


class Modes(NamedTuple):
    """Temporal modes of P pixels."""

    colour: Floats
    """Mean Y, Cr, Cb of each mode, of shape (P, COUNT, 3), grey levels."""
    share: Floats
    """Share of the frames that show each mode, of shape (P, COUNT), decreasing; 0 for modes that there are not."""


def radius_of(noise: NDArray[np.float64]) -> Floats:
    """Radius (3,) of a mode in Y, Cr, Cb, grey levels, for a `noise` (3,)."""
    return np.maximum(RADIUS * noise, MIN_RADIUS).astype(np.float32)


def temporal_modes(samples: Floats, radius: Floats) -> Modes:
    """The modes of pixels with samples (N, P, 3), Y, Cr, Cb; `radius` (3,) is the largest distance of a sample from its mode.

    A mode is the mean of the samples around the one with the most others near it; the next mode is that of the remaining samples.
    """
    scaled = np.ascontiguousarray((samples / radius).transpose(1, 0, 2), np.float32)
    colour, share = np.zeros((len(scaled), COUNT, 3), np.float32), np.zeros((len(scaled), COUNT), np.float32)
    _modes(scaled, np.empty(len(samples), np.int32), colour, share)
    return Modes(colour * radius, share)


@compiled(nogil=True)
def _modes(samples, counts, colour, share):
    """Modes of samples (P, N, 3) in units of the radius; `counts` (N,) is work space: neighbours among the remaining, or -1 if taken."""
    n = samples.shape[1]
    for p in range(samples.shape[0]):
        own = samples[p]
        for i in range(n):
            counts[i] = 0
        for i in range(n):
            for j in range(i + 1):
                if _near(own, i, own[j, 0], own[j, 1], own[j, 2]):
                    counts[i] += 1
                    if i != j:
                        counts[j] += 1
        for k in range(share.shape[1]):
            best = counts.argmax()
            if counts[best] < 0:
                break
            a, b, c, size = own[best, 0], own[best, 1], own[best, 2], 1
            for _ in range(2):
                a, b, c, size = _mean_near(own, counts, a, b, c)
            colour[p, k, 0], colour[p, k, 1], colour[p, k, 2], share[p, k] = a, b, c, max(size, 1) / n
            _take(own, counts, best, a, b, c)


@compiled(nogil=True)
def _near(own, i, a, b, c):
    """Whether sample i lies within the radius of a colour."""
    return (own[i, 0] - a) ** 2 + (own[i, 1] - b) ** 2 + (own[i, 2] - c) ** 2 < 1


@compiled(nogil=True)
def _mean_near(own, counts, a, b, c):
    """Mean and number of the remaining samples near a colour; the colour itself if there is none."""
    x, y, z, size = np.float32(0), np.float32(0), np.float32(0), 0
    for j in range(len(counts)):
        if counts[j] >= 0 and _near(own, j, a, b, c):
            x, y, z, size = x + own[j, 0], y + own[j, 1], z + own[j, 2], size + 1
    if size == 0:
        return a, b, c, size
    return x / np.float32(size), y / np.float32(size), z / np.float32(size), size


@compiled(nogil=True)
def _take(own, counts, best, a, b, c):
    """Take the samples near a colour, and sample `best`, out of the remaining ones, and count their neighbours off."""
    n = len(counts)
    for j in range(n):
        if counts[j] >= 0 and (j == best or _near(own, j, a, b, c)):
            counts[j] = -1
            for i in range(n):
                if counts[i] >= 0 and _near(own, i, own[j, 0], own[j, 1], own[j, 2]):
                    counts[i] -= 1
