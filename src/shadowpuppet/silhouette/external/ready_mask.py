"""Silhouettes made by other programs."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import SilhouetteError

THRESHOLD = 128
"""Least value of the person's pixels."""
MAX_GREY_SHARE = 0.1
"""Greatest share of pixels neither dark nor bright: smooth outlines and compression."""


def ready_mask(image: NDArray[np.uint8] | NDArray[np.bool_]) -> NDArray[np.bool_]:
    """A mask (H, W) from a picture (H, W), or (H, W, 3) of equal channels, dark outside and bright (128 or more) inside the person.

    Raises `SilhouetteError` for a picture that is no silhouette.
    """
    shape = getattr(image, "shape", ())
    if len(shape) not in (2, 3) or shape[2:] not in ((), (3,)) or not image.size:
        found = f"an array of shape {shape}" if shape else type(image).__name__
        raise SilhouetteError(f"mask: found {found}, expected a picture of shape (H, W) or (H, W, 3)")
    if image.dtype == bool and image.ndim == 2:
        return image.astype(bool)
    if image.dtype != np.uint8:
        raise SilhouetteError(f"mask: found values of type {image.dtype}, expected 8 bits, 0 to 255 (uint8)")
    grey = image if image.ndim == 2 else np.ascontiguousarray(image[..., 1])
    if image.ndim == 3 and np.ptp(image[::4, ::4].astype(np.int16), axis=2).mean() > 8:
        raise SilhouetteError("mask: found a picture in colour, expected black outside and white inside the person; "
                              "pictures of the person belong under video, not masks")
    between = float(np.mean((grey >= 64) & (grey < 192)))
    if between > MAX_GREY_SHARE:
        raise SilhouetteError(f"mask: found {100 * between:.0f} % of the pixels neither dark nor bright, expected black outside "
                              "and white inside the person; pictures of the person belong under video, not masks")
    if grey.max() == 1 and np.mean(grey) > 0.002:
        raise SilhouetteError("mask: found the values 0 and 1, expected 0 outside and 255 inside the person")
    return grey >= THRESHOLD
