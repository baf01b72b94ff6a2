"""Coarse colours of a picture's pixels, as numbers that can be counted: 16 levels a channel."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

LEVELS = 16
"""Number of levels of each channel."""
NUMBER = LEVELS**3
"""Number of colours."""
ENOUGH = 320 * 240
"""Number of pixels that say enough about colours; in larger pictures some are left out."""

ColourCode = NDArray[np.uint16]
"""Colours, 0 to `NUMBER` - 1, of the pixels that `thinned` leaves."""


def step_of(size: tuple[int, int]) -> int:
    """Distance (pixels) of those that are looked at in a picture of a width and height."""
    return max(1, round((size[0] * size[1] / ENOUGH) ** 0.5))


def thinned(pixels: NDArray) -> NDArray:
    """The pixels that are looked at in a picture or mask (H, W, ...)."""
    step = step_of((pixels.shape[1], pixels.shape[0]))
    return np.ascontiguousarray(pixels[::step, ::step])


def colour_codes(image: NDArray[np.uint8] | None) -> ColourCode | None:
    """The colours of an image (H, W, 3) or (H, W); None for None."""
    if image is None:
        return None
    step = step_of((image.shape[1], image.shape[0]))
    seen = image[::step, ::step]
    codes = np.zeros(seen.shape[:2], np.uint16)
    for channel in np.moveaxis(seen, 2, 0) if seen.ndim > 2 else (seen,) * 3:  # a channel at a time: ten times as fast as all at once
        codes *= LEVELS
        codes += channel // (256 // LEVELS)
    return codes
