"""Motion blur of a film: how many pixels of fast limbs are half limb, half background.

Where a limb arrives or leaves within two frames, a short exposure shows the pixel in the frame between either as background or as limb. An
exposure that lasts from frame to frame shows half of it as a mixture.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import bounding_window
from shadowpuppet.silhouette.background import Image, smoothed, to_planes
from shadowpuppet.silhouette.boundary import disc

FAST = 4
"""Radius (pixels) of discs that fit into what is covered or uncovered within two frames; outlines of slower limbs are mixed anyway."""
LEAST_CONTRAST = 30.0
"""Least difference of limb and background, grey levels over Y, Cr, Cb together."""
MIXED = (0.3, 0.7)
"""Shares of the limb in a mixture."""
FEWEST = 3
"""Least number of consecutive frames that tell anything."""
LEAST_PIXELS = 25
"""Least number of pixels that tell anything."""


def blurred_share(runs: Sequence[Sequence[Image]], masks: Sequence[Sequence[NDArray[np.bool_]]]) -> float | None:
    """Share of mixtures among the pixels that fast limbs reach or leave within two frames; None if there are too few.

    runs: runs of consecutive pictures (H, W, 3) or (H, W); masks: the person's masks (H, W) in them.
    """
    shares = [np.zeros(0)]
    for images, found in zip(runs, masks, strict=True):
        if len(images) < FEWEST:
            continue
        window = bounding_window(np.logical_or.reduce(found).view(np.uint8), FAST + 1)
        planes = [smoothed(to_planes(np.ascontiguousarray(image[window]))).astype(np.float32) for image in images]
        found = [mask[window] for mask in found]
        for n in range(1, len(images) - 1):
            shares += [_limb_shares(planes[n + a], planes[n], planes[n + b], found[n + b] & ~found[n + a]) for a, b in ((-1, 1), (1, -1))]
    shares = np.concatenate(shares)
    return float(((shares > MIXED[0]) & (shares < MIXED[1])).mean()) if len(shares) >= LEAST_PIXELS else None


def _limb_shares(without: np.ndarray, between: np.ndarray, limb: np.ndarray, changed: NDArray[np.bool_]) -> np.ndarray:
    """Share (K,) of the limb in pixels of a frame (H, W, 3), between one without and one with the limb in the `changed` pixels (H, W)."""
    import cv2

    wide = cv2.morphologyEx(changed.astype(np.uint8), cv2.MORPH_OPEN, disc(FAST)) > 0
    contrast = limb[wide] - without[wide]
    squared = (contrast**2).sum(1)
    clear = squared > LEAST_CONTRAST**2
    return ((between[wide] - without[wide]) * contrast).sum(1)[clear] / squared[clear]
