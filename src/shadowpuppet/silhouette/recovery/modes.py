"""Temporal modes: the colours that a pixel shows in the frames of a film, with their shares of the frames."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

COUNT = 5
"""Greatest number of modes of a pixel, the most frequent first."""
RADIUS = 4.0
"""Radius of a mode, standard deviations of the noise."""
MIN_RADIUS = np.array([6.0, 4.0, 4.0])
"""Least radius in Y, Cr, Cb, grey levels: compression and faint shadows."""

ROWS = 8
"""Number of rows of a picture that are ranked at a time."""

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
    from shadowpuppet.silhouette.recovery._kernels import find_modes

    scaled = np.ascontiguousarray((samples / radius).transpose(1, 0, 2), np.float32)
    colour, share = np.zeros((len(scaled), COUNT, 3), np.float32), np.zeros((len(scaled), COUNT), np.float32)
    find_modes(scaled, np.empty(len(samples), np.int32), colour, share)
    return Modes(colour * radius, share)


def ranked(images: Sequence[NDArray[np.uint8]] | NDArray[np.uint8], rank: int) -> NDArray[np.uint8]:
    """The value (H, W, ...) that comes at a `rank`, from 0, in each pixel of images (H, W, ...): bit by bit, some ten times as fast as
    sorting."""
    number = np.uint8 if len(images) < 256 else np.uint32
    out = np.zeros(images[0].shape, np.uint8)
    for y in range(0, len(out), ROWS):
        values, found = np.stack([image[y : y + ROWS] for image in images]), out[y : y + ROWS]
        for bit in (128, 64, 32, 16, 8, 4, 2, 1):
            less = np.add.reduce((values < (found | np.uint8(bit))).view(np.uint8), axis=0, dtype=number)
            found |= np.where(less <= rank, np.uint8(bit), np.uint8(0))
    return out
