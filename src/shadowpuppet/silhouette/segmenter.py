"""Pictures into silhouettes of a person before a fixed camera."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import SilhouetteError
from shadowpuppet.silhouette.background import Background, Image, check_alike, check_image, to_planes
from shadowpuppet.silhouette.boundary import Contrast, Mask, Outline
from shadowpuppet.silhouette.classifiers import KEYED, PlainRule
from shadowpuppet.silhouette.cleanup import Window, clean
from shadowpuppet.silhouette.light import Light
from shadowpuppet.silhouette.settings import SilhouetteSettings

EVERYTHING: Window = (slice(None), slice(None))


@dataclass(frozen=True, eq=False)
class Segmenter:
    """A learnt background: `segmenter(image)` is the mask of the person. Nothing is kept from one picture to the next."""

    background: Background
    """Statistics of the empty scene."""
    settings: SilhouetteSettings
    key: str
    """What is compared: brightness, colour, both; or the method where it is averaging, mog2 or knn."""
    reason: str
    """Why, in one sentence."""
    outline: Outline
    """How blurred outlines are in the film."""
    rule: Callable[[Image], Mask]
    """The test of pixels: picture to labels (H, W), 0 background, 1 perhaps a person, 2 a person."""
    light: Light | None = None
    """Follows changes of light; None: the light is taken to be constant."""

    def __call__(self, image: Image) -> NDArray[np.bool_]:
        """The person's mask (H, W) in a picture (H, W, 3), blue green red, or (H, W), grey; empty where nobody is.

        Raises `SilhouetteError` for a picture that does not fit the background.
        """
        self._check(image)
        image = image if self.light is None else self.light.normalised(image)
        label = self.rule(image)
        if self.settings.cleaned:
            label = clean(label, lambda window: self.contrast(image, window), self.outline)
        return label > 0

    def raw(self, image: Image) -> NDArray[np.bool_]:
        """Liu 2011, eq. 1, and nothing else: |I_B - I_t| >= factor * sigma_B, of shape (H, W).

        Raises `SilhouetteError` where the background is a single picture, which has no sigma.
        """
        self._check(image)
        return self.plain(image) > 0

    @cached_property
    def plain(self) -> PlainRule:
        """Eq. 1 for this background, as a range of whole numbers a pixel."""
        return plain_rule(self.background, self.settings.factor)

    def contrast(self, image: Image, window: Window = EVERYTHING) -> Contrast:
        """Difference to the background (H, W) in the key's channels, grey levels, in a window of rows and columns."""
        from shadowpuppet.silhouette._kernels import contrast

        planes = to_planes(np.ascontiguousarray(image[window]))
        out = np.empty(planes.shape[:2], np.float32)
        seen = KEYED.get("brightness" if self.key == "averaging" else self.key, KEYED["both"])
        contrast(planes, self.background.mean[window], np.array(seen, np.float32), out)
        return out

    def _check(self, image: Image) -> None:
        check_image(image, "frame")
        check_alike(image, self.background.image_shape, "frame")


def plain_rule(background: Background, factor: float) -> PlainRule:
    """Eq. 1 with a background's sigma. Raises `SilhouetteError` for a single picture."""
    if background.frames < 2:
        raise SilhouetteError("background: found a single picture, expected at least 2 frames for method averaging (eq. 1), "
                              "which needs their standard deviation; give a film of the empty scene or choose method auto")
    return PlainRule.of(background.brightness, background.sigma, factor)
