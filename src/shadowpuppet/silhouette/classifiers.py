"""Segmentation methods: the test that a pixel must pass to be foreground.

A classifier is called with a frame and labels its pixels: 0 background, 1 perhaps a person, 2 surely a person. `METHODS` has a line for
each method; a new one is a classifier here and its line there (and a word in the help of the setting `method`).
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Window
from shadowpuppet.errors import SilhouetteError
from shadowpuppet.silhouette.background import (
    SMOOTHING,
    Background,
    Floats,
    Image,
    smoothed,
    to_brightness,
    to_planes,
)
from shadowpuppet.silhouette.boundary import Labels, disc
from shadowpuppet.silhouette.cleanup import MAX_PART_GAP, MIN_PART_SHARE

if TYPE_CHECKING:
    from shadowpuppet.silhouette.settings import SilhouetteSettings

KEY_CHANNELS = {"brightness": (1, 0, 0), "colour": (0, 1, 1), "both": (1, 1, 1)}
"""Channels of Y, Cr, Cb that each key compares."""
SHADOW_CHANNELS = {"brightness": (1, 1, 1), "colour": (0, 1, 1), "both": (1, 1, 1)}
"""Channels in which a pixel must match the darkened background to be a shadow. Colour is tested even if brightness is the key: without it,
dark clothes would look like shadow."""
CERTAIN_FACTOR = 2.0
"""Threshold of pixels that surely belong to a person, over that of pixels that may."""
ROUNDING_MARGIN = 1 - 1e-4
"""Factor on a threshold that keeps it on the safe side of single precision."""

CELL = 4
"""Side (pixels) of the cells whose means show where a frame differs."""
WHOLE: Window = slice(None), slice(None)
"""All rows and columns."""
EDGE_JITTER = 0.05
"""Standard deviation added at the background's edges, over the change of its value across a pixel: cameras shake."""

Classifier = Callable[[Image], Labels]
"""From a frame (H, W, 3) or (H, W) to its labels (H, W)."""


@dataclass(frozen=True, eq=False)
class ChannelClassifier:
    """Classifier by the difference from the background: foreground pixels differ by `factor` standard deviations over the key's channels
    together, and are no shadow."""

    key: str
    mean: Floats
    """Smoothed background, Y, Cr, Cb, of shape (H, W, 3)."""
    inverse_sigma: Floats
    """Inverse of the assumed standard deviation, of shape (H, W, 3)."""
    factor: float
    darkest: float
    """Least share of its brightness that the background keeps in shadow; 1: no pixel counts as shadow."""
    smoothing: float = SMOOTHING
    """Standard deviation of the smoothing of frames, pixels."""

    def __call__(self, image: Image) -> Labels:
        """Labels (H, W) of a picture (H, W, 3) or (H, W)."""
        return self.with_shadows(image)[0]

    def with_shadows(self, image: Image) -> tuple[Labels, NDArray[np.bool_] | None]:
        """Labels (H, W) of a picture (H, W, 3) or (H, W), and the background pixels (H, W) that a dark limb might look like; None if no
        pixel counts as shadow."""
        from shadowpuppet.silhouette.shadows import MAX_SHADE, MAYBE_SHADOW, resolve_shadows

        resolved, window = self.darkest < 1 and SHADOW_CHANNELS[self.key][0] > 0, self.different(image)
        out, shadow = np.zeros(image.shape[:2], np.uint8), np.zeros(image.shape[:2], bool) if resolved else None
        if not (inner := image[window]).size:
            return out, shadow
        smooth, part = smoothed(to_planes(inner), self.smoothing), self.within(window)
        label = part.labels(smooth, MAX_SHADE if resolved else 0.0)
        if shadow is not None:
            either = label == MAYBE_SHADOW
            label = resolve_shadows(label, smooth, part.mean, part.inverse_sigma)
            shadow[window] = either & (label == 0)
        out[window] = label
        return out, shadow

    def labels(self, planes: Image, asked: float = 0.0) -> Labels:
        """Labels (H, W) of smoothed Y, Cr, Cb (H, W, 3), pixel by pixel.

        Label 3 marks pixels that may be in shadow and have less than `asked` of the background's brightness: they may be a person's.
        """
        import cv2

        from shadowpuppet.silhouette._kernels import classify

        within, label = cv2.inRange(planes, *self.surely_background), np.empty(planes.shape[:2], np.uint8)
        keyed, shadowed = np.array(KEY_CHANNELS[self.key], np.float32), np.array(SHADOW_CHANNELS[self.key], np.float32)
        weak, strong = np.float32(self.factor), np.float32(CERTAIN_FACTOR * self.factor)
        classify(planes, within, self.mean, self.inverse_sigma, keyed, shadowed, np.float32(self.darkest), np.float32(asked), weak, strong,
                 label)
        return label

    def different(self, image: Image) -> Window:
        """Rows and columns of a picture (H, W, 3) or (H, W) beyond which it is background: the means of cells of pixels do not differ from
        it there but for parts too small and too far away to be kept (`cleanup.main_part`)."""
        import cv2

        if min(image.shape[:2]) < CELL:
            return WHOLE
        differ = ~np.asarray(cv2.inRange(to_planes(means_of_cells(image)), *self._background_of_cells), np.uint8)
        left, top, width, height, area = cv2.connectedComponentsWithStats(differ)[2][1:].T
        if not len(area):
            return slice(0), slice(0)
        large, gap = area >= MIN_PART_SHARE * area.max(), CELL + math.ceil(CELL * MAX_PART_GAP * area.sum() ** 0.5)
        window = _around(top[large], height[large], gap), _around(left[large], width[large], gap)
        return WHOLE if image[window].size > image.size / 2 else window  # little is saved

    def within(self, window: Window) -> ChannelClassifier:
        """The classifier of a window of rows and columns of pictures."""
        if window == WHOLE:
            return self
        part = replace(self, mean=np.ascontiguousarray(self.mean[window]), inverse_sigma=np.ascontiguousarray(self.inverse_sigma[window]))
        part.__dict__["surely_background"] = tuple(bound[window] for bound in self.surely_background)  # not computed anew
        return part

    @cached_property
    def _background_of_cells(self) -> tuple[Image, Image]:
        """Least and greatest means of Y, Cr, Cb of background in a picture's cells (H / CELL, W / CELL, 3)."""
        import cv2

        lowest, highest = self.surely_background
        low, high = np.asarray(cv2.erode(lowest, disc(CELL // 2))), np.asarray(cv2.dilate(highest, disc(CELL // 2)))  # edges are smoothed
        low, high = (means_of_cells(each.astype(np.float32)) for each in (low, high))
        return np.floor(low).astype(np.uint8), np.ceil(high).astype(np.uint8)

    @cached_property
    def surely_background(self) -> tuple[Image, Image]:
        """Least and greatest Y, Cr, Cb (H, W, 3) that are certainly background: a quick test that decides most pixels."""
        keyed = np.array(KEY_CHANNELS[self.key], np.float32)
        reach = np.where(keyed > 0, ROUNDING_MARGIN * self.factor / (self.inverse_sigma * np.sqrt(keyed.sum())), np.float32(256))
        lowest, highest = np.ceil(self.mean - reach), np.floor(self.mean + reach)
        return np.clip(lowest, 0, 255).astype(np.uint8), np.clip(highest, 0, 255).astype(np.uint8)


def _around(first: NDArray[np.int32], extent: NDArray[np.int32], margin: int) -> slice:
    """Pixels, along one axis, of cells from `first` (K,) on, each of an `extent` (K,), with a margin."""
    return slice(max(CELL * int(first.min()) - margin, 0), CELL * int((first + extent).max()) + margin)


def means_of_cells(image: np.ndarray) -> np.ndarray:
    """Means (H / CELL, W / CELL, ...) of a picture's square cells; a last row or column of less than a cell is left out."""
    import cv2

    height, width = image.shape[0] // CELL, image.shape[1] // CELL
    halved = cv2.resize(image[: height * CELL, : width * CELL], (2 * width, 2 * height), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.resize(halved, (width, height), interpolation=cv2.INTER_AREA))  # in two steps: three times as fast


def edge_jitter(mean: np.ndarray) -> np.ndarray:
    """Standard deviation that is assumed at the edges of a smoothed background (H, W, 3), beyond that elsewhere."""
    import cv2

    return EDGE_JITTER * np.asarray(cv2.dilate(mean, disc(1)) - cv2.erode(mean, disc(1)))


@dataclass(frozen=True, eq=False)
class AveragingClassifier:
    """Classifier by Liu 2011, eq. 1: |I_B - I_t| >= factor * sigma_B. Stored as the range of whole grey levels that are background, pixel
    by pixel."""

    lowest: Image
    highest: Image
    """Both of shape (H, W); `lowest` exceeds `highest` where every value is foreground."""

    @classmethod
    def of_background(cls, background: Background, factor: float) -> AveragingClassifier:
        """Eq. 1 with a background's mean and sigma. Raises `SilhouetteError` for a single picture."""
        if background.frames < 2:
            raise SilhouetteError("background: found a single picture, expected at least 2 frames for method averaging (eq. 1), "
                                  "which needs their standard deviation; give a film of the empty scene or choose method auto")
        return cls.of(background.brightness, background.sigma, factor)

    @classmethod
    def of(cls, mean: NDArray[np.float64], sigma: NDArray[np.float64], factor: float) -> AveragingClassifier:
        """Eq. 1 for a mean and a standard deviation of brightness (H, W)."""
        reach = factor * sigma
        steps = np.arange(3)[:, None, None]

        def beyond(values: np.ndarray) -> np.ndarray:
            # Eq. 1 itself decides between neighbours, so that rounding cannot make the range differ from it.
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
    """OpenCV's mixture of Gaussians (Stauffer & Grimson 1999, Zivkovic 2004), frozen after learning."""

    def __init__(self, shadow: bool) -> None:
        """shadow: whether OpenCV's own test takes darkened background for shadow, not for foreground."""
        import cv2

        self._subtractor = cv2.createBackgroundSubtractorMOG2(detectShadows=shadow)

    def add(self, image: Image) -> None:
        """Learn from the next picture of the empty scene."""
        self._subtractor.apply(image)

    def __call__(self, image: Image) -> Labels:
        """Labels (H, W), 0 or 2, of a picture (H, W, 3) or (H, W)."""
        return np.where(self._subtractor.apply(image, learningRate=0) == 255, 2, 0).astype(np.uint8)


class EmptyScene(NamedTuple):
    """What a method builds its classifier from."""

    background: Background
    channels: ChannelClassifier
    """A classifier that compares all channels, with the assumed noise."""
    settings: SilhouetteSettings
    observer: Any
    """The method's observer, after all pictures of the empty scene were added to it."""


class Method(NamedTuple):
    """A segmentation method."""

    build: Callable[[EmptyScene], Classifier]
    observer: Callable[[SilhouetteSettings], Any] = lambda settings: None
    """Returns an object with a method `add(image)`, called with every picture of the empty scene; None if the method needs only the
    background's statistics."""
    needs_colour: bool = False
    """Whether a grey film is refused."""
    contrast: tuple[int, int, int] = (1, 1, 1)
    """Channels of Y, Cr, Cb in which the outline's contrast is measured."""


def _by_channels(key: str) -> Method:
    return Method(lambda scene: replace(scene.channels, key=key), needs_colour=key != "brightness", contrast=KEY_CHANNELS[key])


def _averaging(scene: EmptyScene) -> Classifier:
    return AveragingClassifier.of_background(scene.background, scene.settings.factor)


METHODS: dict[str, Method] = {
    **{key: _by_channels(key) for key in KEY_CHANNELS},
    "averaging": Method(_averaging, contrast=KEY_CHANNELS["brightness"]),
    "mog2": Method(lambda scene: scene.observer, lambda settings: MixtureClassifier(settings.shadow)),
}
"""Segmentation methods by the name that the setting `method` gives them; `auto` chooses one of the first three."""
