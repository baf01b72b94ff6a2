"""Detail of the background that a film has lost to compression or focus: restored where a frame shows the scene without it.

A codec that saves bits repaints what a limb has passed without its texture, in blocks, and keeps their mean colours. Such a pixel lies
between the empty scene and the same scene smoothed; it is moved back along that line. Other pixels, a person's, hardly lie on it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from shadowpuppet.silhouette.background import Floats, Image, smoothed, to_brightness

LOSS = 0.035
"""Median share of its detail that a film has lost from which on it is restored. Films of good quality have lost up to 0.03, at crf 32 0.05
to 0.2."""
FINE, COARSE = 2.0, 4.0
"""Standard deviation (pixels) of the smoothing beyond which detail counts as such: to measure the loss, and to restore it."""
TEXTURED = 6.0
"""Least detail of a pixel that shows a loss, grey levels of brightness."""
MIN_TEXTURED = 0.005
"""Least share of such pixels."""
NEAR = 3.0
"""Distance from the line up to which detail is restored, over the film's noise."""
QUIET = 1.0
"""Difference from the empty scene up to which a pixel is left as it is, grey levels."""
LEAST = 1.0
"""Detail of a pixel below which none is restored, grey levels."""


@dataclass(frozen=True, eq=False)
class LostDetail:
    """Restores detail of the empty scene in frames (H, W, 3), blue green red, or (H, W), grey."""

    scene: Floats
    """Smoothed picture of the empty scene, of shape (H, W, C)."""
    detail: Floats
    """What it loses when its detail is lost, of shape (H, W, C)."""
    inverse: Floats
    """Inverse of its squared length, of shape (H, W); 0 where there is little."""
    near: float
    """Distance from the line up to which a pixel shows the scene without detail, root mean square of the channels, grey levels."""

    @classmethod
    def of(cls, scene: Image, near: float) -> LostDetail:
        """Of the mean picture (H, W, 3) or (H, W) of an empty scene."""
        sharp = smoothed(scene.astype(np.float32))
        detail = _deep(smoothed(sharp, COARSE) - sharp)
        size = (detail**2).sum(2)
        return cls(_deep(sharp), detail, np.where(size >= LEAST**2, 1 / np.maximum(size, LEAST**2), 0).astype(np.float32), near)

    def __call__(self, image: Image) -> Image:
        """The picture (H, W, 3) or (H, W) with the detail that it has lost."""
        from shadowpuppet.silhouette.correction._kernels import restore_detail

        out = np.empty_like(image)
        restore_detail(_deep(image), _deep(smoothed(image)), self.scene, self.detail, self.inverse, np.float32(QUIET),
                       np.float32(self.near), _deep(out))
        return out


def lost_detail(scene: Image, frames: Sequence[Image]) -> LostDetail | None:
    """What restores the detail that frames (H, W, 3) or (H, W) have lost of the empty scene (H, W, 3) or (H, W); None if it is little, or
    the scene has none."""
    sharp = _brightness(scene)
    detail = smoothed(sharp, FINE) - sharp
    textured = np.abs(detail) >= TEXTURED
    if not frames or np.count_nonzero(textured) < MIN_TEXTURED * textured.size:
        return None
    differences = [_brightness(frame) - sharp for frame in frames]
    if np.median([each[textured] / detail[textured] for each in differences]) < LOSS:
        return None
    return LostDetail.of(scene, NEAR * float(np.percentile(np.abs([each[::2, ::2] for each in differences]), 68)))


def _brightness(image: Image) -> Floats:
    """Smoothed brightness (H, W) of a picture (H, W, 3) or (H, W)."""
    return smoothed(to_brightness(image).astype(np.float32))


def _deep(image: np.ndarray) -> np.ndarray:
    """A view of shape (H, W, C) of a picture (H, W, C) or (H, W)."""
    return image.reshape(*image.shape[:2], -1)
