"""Colours averaged over areas, for noisy films: a single pixel's colour is within the noise, that of an area of clothes is not.

A guided filter (He, Sun, Tang 2010, "Guided image filtering") averages colours among pixels of like brightness, so that edges of brightness
stop it. Where an edge has none, colours run over it by `RADIUS`: alone they decide only inside areas.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.silhouette.background import Floats, smoothed
from shadowpuppet.silhouette.boundary import Labels, disc

RADIUS = 4
"""Half side of the square that colours are averaged over, pixels."""
EDGE_FACTOR = 2.0
"""Variance of brightness in that square, over the noise's, at which half of an edge remains."""
RIM = 2
"""Pixels of an area's rim in which its colour does not make a person of what is like the background pixel by pixel."""


class AreaFilter(NamedTuple):
    """Averages colours over areas of like brightness."""

    smoothing: float
    """Standard deviation of the smoothing of brightness, pixels."""
    noise: float
    """Standard deviation of the film's noise after that smoothing, grey levels of brightness."""

    def __call__(self, planes: np.ndarray) -> np.ndarray:
        """Y, Cr, Cb (H, W, 3): brightness smoothed, colours averaged over areas; of the type of `planes`."""
        import cv2

        exact = planes.astype(np.float32)
        guide = np.ascontiguousarray(smoothed(exact[..., :1], self.smoothing)).reshape(planes.shape[:2])
        averaged = [_guided(guide, np.ascontiguousarray(exact[..., c]), EDGE_FACTOR * self.noise**2) for c in (1, 2)]
        out = np.asarray(cv2.merge([guide, *averaged]))
        return out if planes.dtype != np.uint8 else np.rint(out).astype(np.uint8)


def _guided(guide: Floats, values: Floats, variance: float) -> Floats:
    """Values (H, W) averaged, except across edges of the guide (H, W) that have more than `variance`."""
    mean_guide, mean_values = _mean(guide), _mean(values)
    spread = np.maximum(_mean(guide * guide) - mean_guide**2, np.float32(0)) + np.float32(variance)
    slope = ((_mean(guide * values) - mean_guide * mean_values) / spread).astype(np.float32)
    return _mean(slope) * guide + _mean((mean_values - slope * mean_guide).astype(np.float32))


def _mean(values: Floats) -> Floats:
    import cv2

    side = 2 * RADIUS + 1
    return np.asarray(cv2.boxFilter(values, cv2.CV_32F, (side, side)), np.float32)


def with_areas(label: Labels, area: Labels) -> Labels:
    """Labels (H, W) of single pixels, improved by those (H, W) of colours averaged over areas, where these know more.

    Areas tell dark clothes from shadows, and add what pixel by pixel is within the noise, but for a rim of `RIM` pixels.
    """
    import cv2

    from shadowpuppet.silhouette.shadows import MAYBE_SHADOW

    out = np.where((label == MAYBE_SHADOW) & (area > 0), area, label)
    inner = np.asarray(cv2.erode(np.where(area == MAYBE_SHADOW, 0, area).astype(np.uint8), disc(RIM)), np.uint8)
    return np.where((inner > 0) & ((out == 0) | (out == MAYBE_SHADOW)), inner, out).astype(np.uint8)
