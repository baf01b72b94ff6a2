"""Changes of light: the gain of a frame's colour channels over the empty scene, and the frame as it would be without it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Image

SAMPLED = 5000
"""Number of pixels, on a grid, from which a gain is estimated."""
DARK, BRIGHT = 40, 245
"""Grey levels between which a pixel shows the gain: below, it is noise; above, it may be clipped."""
MIN_SHARE = 0.25
"""Least share of such pixels in a channel whose own gain is estimated."""
CLIPPED = 254
"""Grey level from which a pixel of the frame counts as clipped."""
BINS, BIN = 512, 0.008
"""Histogram of log gains: number and width of bins, the middle one at a gain of 1."""
WINDOW = 15
"""Half width, in bins, of the window that the mean shift moves onto the background's pixels."""
SHIFTS = 5
"""Steps of the mean shift."""
NEGLIGIBLE = 0.02
"""Log gain up to which a frame is left unchanged: rounding and codecs alone cause as much."""


@dataclass(frozen=True, eq=False)
class Light:
    """Estimates, and removes from a frame, changes of light since the empty scene."""

    scene: Image
    """Mean picture of the empty scene, of shape (H, W, 3), blue green red, or (H, W)."""

    def gains(self, image: Image) -> NDArray[np.float64]:
        """Gain of each channel (C,) of a picture like the scene: the mode of the ratio picture to scene over pixels.

        The mode is the background's even if the person covers nearly half of the picture. A channel in which too few pixels
        show a gain, such as red in a blue room, has the mean of the others; all have 1 if no channel shows one.
        """
        levels, informative = self._sampled
        step = self._step
        after = image[::step, ::step].reshape(levels.shape)
        informative = informative & (after > DARK // 2) & (after < BRIGHT)
        bins = np.rint((LOG[after] - levels) / BIN).astype(np.intp) + BINS // 2
        logs = np.array([_mode(bins[use, c]) if use.mean() >= MIN_SHARE else np.nan for c, use in enumerate(informative.T)])
        known = np.isfinite(logs)
        return np.exp(np.where(known, logs, logs[known].mean() if known.any() else 0.0))

    def normalised(self, image: Image) -> Image:
        """The picture divided by its gains; the picture itself if they are negligible.

        Clipped pixels of the picture are replaced by the scene's where the scene under this light would be clipped too.
        """
        import cv2

        gains = self.gains(image)
        if np.abs(np.log(gains)).max() < NEGLIGIBLE:
            return image
        table = np.clip(np.rint(np.arange(256)[:, None] / gains), 0, 255).astype(np.uint8)
        out = np.asarray(cv2.LUT(image, table[None] if image.ndim == 3 else table[:, 0]), np.uint8)
        if gains.max() > 1 and (image >= CLIPPED).any():
            reached = np.clip(np.ceil((CLIPPED - 4) / gains), 0, 255).astype(np.uint8)
            np.copyto(out, self.scene, where=(image >= CLIPPED) & (self.scene >= (reached if image.ndim == 3 else reached[0])))
        return out

    @property
    def _step(self) -> int:
        return max(1, int(np.sqrt(self.scene.shape[0] * self.scene.shape[1] / SAMPLED)))

    @cached_property
    def _sampled(self) -> tuple[NDArray[np.float32], NDArray[np.bool_]]:
        """Log levels of the scene's sampled pixels (n, C), and whether each can show a gain (n, C)."""
        pixels = self.scene[:: self._step, :: self._step].reshape(-1, self.scene.shape[2] if self.scene.ndim == 3 else 1)
        return LOG[pixels], (pixels > DARK) & (pixels < BRIGHT)


LOG = np.log(np.maximum(np.arange(256), 1)).astype(np.float32)
"""Logarithm of each grey level."""


def _mode(bins: NDArray[np.intp]) -> float:
    """The mode of log gains, given as histogram bins; by mean shift from the fullest part of the histogram."""
    counts = np.bincount(np.clip(bins, 0, BINS - 1), minlength=BINS).astype(float)
    total, moment = (np.concatenate([[0], np.cumsum(values)]) for values in (counts, counts * np.arange(BINS)))
    narrow = WINDOW // 3
    middle = float(np.argmax(total[2 * narrow + 1 :] - total[: -2 * narrow - 1]) + narrow)
    for _ in range(SHIFTS):
        first, last = max(0, round(middle) - WINDOW), min(BINS, round(middle) + WINDOW + 1)
        middle = (moment[last] - moment[first]) / (total[last] - total[first])
    return (middle - BINS // 2) * BIN
