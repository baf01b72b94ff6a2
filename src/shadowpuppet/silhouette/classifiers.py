"""Tests that a pixel must pass to be foreground.

Each is called with a picture and labels its pixels: 0 background, 1 perhaps a person, 2 a person.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats, Image, smoothed, to_brightness, to_planes
from shadowpuppet.silhouette.boundary import Labels

KEY_CHANNELS = {"brightness": (1, 0, 0), "colour": (0, 1, 1), "both": (1, 1, 1)}
"""Channels of Y, Cr, Cb that each key compares."""
SHADOW_CHANNELS = {"brightness": (1, 1, 1), "colour": (0, 1, 1), "both": (1, 1, 1)}
"""Channels that a shadow must explain: colour tells it from dark clothes even where brightness alone is the key."""
CERTAIN_FACTOR = 2.0
"""How many times more than a pixel that may belong to a person one must differ that surely does."""
SAMPLE_RADIUS = 20
"""Grey levels within which a pixel is near to a sample of the background (OpenCV's dist2Threshold is its square)..."""
MIN_NEAR_SAMPLES = 2
"""... and how many samples it must be near to."""
ROUNDING_MARGIN = 1 - 1e-4
"""Of a threshold, what is on its safe side whatever single precision does."""
MIN_SAMPLES = 7
"""Samples kept, to twice as many."""


@dataclass(frozen=True, eq=False)
class ChannelClassifier:
    """Pixels that differ by `factor` standard deviations in the key's channels, taken together, and are no shadow."""

    key: str
    mean: Floats
    """The smoothed background's Y, Cr, Cb, of shape (H, W, 3)."""
    inverse_sigma: Floats
    """One over the standard deviation assumed, of shape (H, W, 3)."""
    factor: float
    darkest: float
    """Least share of its light that a background keeps in a shadow; 1 where nothing is taken for shadow."""

    def __call__(self, image: Image) -> Labels:
        """Labels (H, W) of a picture (H, W, 3) or (H, W)."""
        from shadowpuppet.silhouette.shadows import MAX_SHADE, resolve_shadows

        planes = smoothed(to_planes(image))
        if self.darkest < 1 and SHADOW_CHANNELS[self.key][0]:
            return resolve_shadows(self.labels(planes, MAX_SHADE), planes, self.mean, self.inverse_sigma)
        return self.labels(planes)

    def labels(self, planes: Image, asked: float = 0.0) -> Labels:
        """Labels (H, W) of smoothed Y, Cr, Cb (H, W, 3), pixel by pixel.

        3 is that of pixels that may be in shadow and have less than `asked` of the background's brightness: a person's, too, have.
        """
        import cv2

        from shadowpuppet.silhouette._kernels import classify

        within, label = cv2.inRange(planes, *self.surely_background), np.empty(planes.shape[:2], np.uint8)
        keyed, shadowed = np.array(KEY_CHANNELS[self.key], np.float32), np.array(SHADOW_CHANNELS[self.key], np.float32)
        weak, strong = np.float32(self.factor), np.float32(CERTAIN_FACTOR * self.factor)
        classify(planes, within, self.mean, self.inverse_sigma, keyed, shadowed, np.float32(self.darkest), np.float32(asked), weak, strong,
                 label)
        return label

    @cached_property
    def surely_background(self) -> tuple[Image, Image]:
        """Least and greatest Y, Cr, Cb (H, W, 3) of a box within which no pixel can be labelled: most are told at once."""
        keyed = np.array(KEY_CHANNELS[self.key], np.float32)
        reach = np.where(keyed > 0, ROUNDING_MARGIN * self.factor / (self.inverse_sigma * np.sqrt(keyed.sum())), np.float32(256))
        lowest, highest = np.ceil(self.mean - reach), np.floor(self.mean + reach)
        return np.clip(lowest, 0, 255).astype(np.uint8), np.clip(highest, 0, 255).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class AveragingClassifier:
    """Liu 2011, eq. 1: |I_B - I_t| >= factor * sigma_B, as the range of whole numbers that are background, pixel by pixel."""

    lowest: Image
    highest: Image
    """Both of shape (H, W); `lowest` exceeds `highest` where every value is foreground."""

    @classmethod
    def of(cls, mean: NDArray[np.float64], sigma: NDArray[np.float64], factor: float) -> AveragingClassifier:
        """The rule for a mean and a standard deviation of brightness (H, W)."""
        reach = factor * sigma
        steps = np.arange(3)[:, None, None]

        def beyond(values: np.ndarray) -> np.ndarray:
            # The rule itself decides between neighbours, so that rounding cannot make the range differ from it.
            return np.cumprod(np.abs(mean - values) >= reach, axis=0).sum(axis=0)

        lowest, highest = np.floor(mean - reach), np.ceil(mean + reach)
        lowest, highest = lowest + beyond(lowest + steps), highest - beyond(highest - steps)
        return cls(np.clip(lowest, 0, 255).astype(np.uint8), np.clip(highest, 0, 255).astype(np.uint8))

    def __call__(self, image: Image) -> Labels:
        """Labels (H, W), 0 or 2, of a picture (H, W, 3) or (H, W)."""
        import cv2

        within = np.asarray(cv2.inRange(to_brightness(image), self.lowest, self.highest), np.uint8)
        return np.bitwise_and(~within, np.uint8(2))


class MixtureClassifier:
    """OpenCV's mixture of Gaussians (Stauffer & Grimson 1999, Zivkovic 2004), which no longer learns when it is called."""

    def __init__(self, shadow: bool) -> None:
        """`shadow`: its own test takes darkened background for shadow, not for foreground."""
        import cv2

        self._subtractor = cv2.createBackgroundSubtractorMOG2(detectShadows=shadow)

    def learn(self, image: Image) -> None:
        """The next picture of the empty scene."""
        self._subtractor.apply(image)

    def __call__(self, image: Image) -> Labels:
        """Labels (H, W), 0 or 2, of a picture (H, W, 3) or (H, W)."""
        return np.where(self._subtractor.apply(image, learningRate=0) == 255, 2, 0).astype(np.uint8)


@dataclass(frozen=True, eq=False)
class NeighbourClassifier:
    """Pixels that hardly any picture of the empty scene is near to (Zivkovic & van der Heijden 2006).

    With the numbers of OpenCV's KNN subtractor, which itself cannot be used: it goes on learning at a learning rate of 0, so that
    a mask would depend on the frames before.
    """

    samples: NDArray[np.uint8]
    """Pictures of the empty scene, of shape (N, H, W, C)."""
    shadows: ChannelClassifier | None
    """Whose shadows are background; None for none."""

    def __call__(self, image: Image) -> Labels:
        """Labels (H, W), 0 or 2, of a picture (H, W, 3) or (H, W)."""
        from shadowpuppet.silhouette._kernels import far_from_samples

        far = np.empty(image.shape[:2], np.uint8)
        deep = np.ascontiguousarray(image).reshape(*image.shape[:2], -1)
        far_from_samples(deep, self.samples, SAMPLE_RADIUS * SAMPLE_RADIUS, min(MIN_NEAR_SAMPLES, len(self.samples)), far)
        return 2 * far if self.shadows is None else 2 * (far & (self.shadows(image) > 0))
