"""Changes of light: the gain of a frame's colour channels over the empty scene, and the frame as it would be without it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shadowpuppet.silhouette.background import Image

SAMPLED = 6000
"""Pixels, on a grid, that a gain is estimated from."""
DARK, BRIGHT = 40, 245
"""Grey levels between which a pixel tells a gain: below, it is noise; above, it may be clipped."""
ENOUGH = 300
"""Least number of such pixels."""
CLIPPED = 254
"""Grey level from which a pixel of the frame counts as clipped."""
WIDTH = 0.12
"""Half width of the window, in log gain, in which the mean is moved to the middle of the background's pixels (mean shift)."""
SHIFTS = 5
"""Steps of the mean shift."""
NEGLIGIBLE = 0.02
"""Log gain that is left as it is: a camera's exposure holds no better, and clean film stays untouched."""


@dataclass(frozen=True, eq=False)
class Light:
    """The empty scene that the light of a frame is compared with."""

    scene: Image
    """Mean picture of the empty scene, of shape (H, W, 3), blue green red, or (H, W)."""

    def gains(self, image: Image) -> np.ndarray:
        """Gain of each channel (C,) of a picture like the scene: the mode of the ratio picture to scene over pixels.

        The mode is that of the background even where the person covers half of the picture. 1 where too few pixels tell.
        """
        step = max(1, int(np.sqrt(self.scene.shape[0] * self.scene.shape[1] / SAMPLED)))
        before = self.scene[::step, ::step].reshape(-1, *self.scene.shape[2:] or (1,)).astype(np.float32)
        after = image[::step, ::step].reshape(before.shape).astype(np.float32)
        return np.array([_mode_of_ratio(before[:, c], after[:, c]) for c in range(before.shape[1])])

    def normalised(self, image: Image) -> Image:
        """The picture divided by its gains; itself where these are negligible. Clipped pixels become the scene's where it would clip."""
        import cv2

        gains = self.gains(image)
        if np.abs(np.log(gains)).max() < NEGLIGIBLE:
            return image
        levels = np.arange(256)[:, None] / gains
        table = np.clip(np.rint(levels), 0, 255).astype(np.uint8)
        out = np.asarray(cv2.LUT(image, table[None] if image.ndim == 3 else table[:, 0]), np.uint8)
        clipped = (image >= CLIPPED) & (self.scene * gains.astype(np.float32) >= CLIPPED - 4)
        np.copyto(out, self.scene, where=clipped)
        return out


def _mode_of_ratio(before: np.ndarray, after: np.ndarray) -> float:
    told = (before > DARK) & (before < BRIGHT) & (after > DARK / 2) & (after < BRIGHT)
    if np.count_nonzero(told) < ENOUGH:
        return 1.0
    ratio = np.sort(np.log(after[told] / before[told]))
    values = ratio
    while len(values) > 40:  # half-sample mode (Bickel and Fruehwirth 2006)
        half = len(values) // 2
        start = int(np.argmin(values[half:] - values[: len(values) - half]))
        values = values[start : start + half]
    middle = values.mean()
    for _ in range(SHIFTS):
        middle = ratio[np.abs(ratio - middle) < WIDTH].mean()
    return float(np.exp(middle))
