"""Pictures with unknown pixels, filled smoothly from around."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats

SMALLEST = 2
"""Least side, pixels, of a level of the pyramid."""


def filled(picture: Floats, known: NDArray[np.bool_]) -> Floats:
    """The picture (H, W, C) or (H, W) with its unknown pixels filled by ever wider means of the known ones (push and pull in a pyramid).

    known: of shape (H, W); the known pixels stay as they are.
    """
    import cv2

    weight = known.astype(np.float32)
    if known.all() or not known.any():
        return picture
    levels = [(_weighted(picture, weight), weight)]
    while min(weight.shape) > SMALLEST and (weight < 1e-3).any():
        levels.append((np.asarray(cv2.pyrDown(levels[-1][0]), np.float32), np.asarray(cv2.pyrDown(weight), np.float32)))
        weight = levels[-1][1]
    values = _divided(*levels[-1])
    for sums, weight in reversed(levels[:-1]):
        coarse = np.asarray(cv2.pyrUp(values, dstsize=weight.shape[::-1]), np.float32)
        share = np.minimum(weight, 1)
        values = _weighted(_divided(sums, weight), share) + _weighted(coarse, 1 - share)
    return np.where(known if picture.ndim == 2 else known[..., None], picture, values)


def _weighted(picture: Floats, weight: Floats) -> Floats:
    return picture * (weight if picture.ndim == 2 else weight[..., None])


def _divided(sums: Floats, weight: Floats) -> Floats:
    weight = np.maximum(weight, 1e-6)
    return sums / (weight if sums.ndim == 2 else weight[..., None])
