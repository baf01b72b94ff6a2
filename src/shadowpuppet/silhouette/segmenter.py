"""Frames of a fixed camera to silhouettes of a person."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Window
from shadowpuppet.silhouette.background import Background, Image, check_alike, check_image, to_planes
from shadowpuppet.silhouette.boundary import Contrast, EdgeProfile, Labels
from shadowpuppet.silhouette.classifiers import METHODS, AveragingClassifier, ChannelClassifier, Classifier
from shadowpuppet.silhouette.cleanup import clean
from shadowpuppet.silhouette.correction.frame_correction import Correction
from shadowpuppet.silhouette.correction.registration import Gap
from shadowpuppet.silhouette.settings import SilhouetteSettings


class Labelled(NamedTuple):
    """A frame with its pixels classified."""

    image: Image
    """The corrected frame (H, W, 3) or (H, W)."""
    label: Labels
    """0 background, 1 perhaps a person, 2 surely a person (H, W)."""
    gap: Gap | None
    """Pixels that a moved camera does not show; None if it stands still."""
    shadow: NDArray[np.bool_] | None = None
    """Background pixels (H, W) that are taken for shadow, and that a dark limb might look like; None if the method knows no shadow."""


class Segmented(NamedTuple):
    """A frame's silhouette, and what was taken for shadow."""

    mask: NDArray[np.bool_]
    """The person (H, W)."""
    shadow: NDArray[np.bool_] | None = None
    """As in `Labelled`."""
    image: Image | None = None
    """The frame (H, W, 3) or (H, W) as it would be where, and in the light in which, the camera saw the empty scene; None: not known."""


@dataclass(frozen=True, eq=False)
class Segmenter:
    """A learnt background: `segmenter(image)` is the mask of the person. It has no state: a mask depends on its frame alone.

    The steps of a call, in order:

    1. Check that the frame has the background's size and channels.
    2. Undo what has changed since the empty scene (`correction.frame_correction.Correction`): the camera's movement
       (`correction.registration.Registration`), the gain of exposure, white balance and lamps (`correction.light.Light`), and
       the detail that compression has taken (`correction.detail.LostDetail`).
    3. Classify every pixel of the rows and columns that differ (`classifier`): convert to Y, Cr, Cb, smooth (`background.smoothed`),
       compare with the background in units of its standard deviation (`_kernels.classify`), and decide between dark limbs and shadows
       (`shadows.resolve_shadows`). `averaging` and `mog2` have comparisons of their own.
    4. Clean up (`cleanup.clean`, if the setting `clean` asks for it): remove specks, keep the largest part and what nearly touches it,
       move the outline to half the contrast of the unsmoothed frame (`boundary.at_half_contrast`), fill small holes.

    The noise that step 3 assumes is set once, by `learning.assumed_sigma`: the greatest of the empty scene's, the film's own
    (`background.film_noise`, after step 2) and the setting `noise_floor`, plus a share of the background's edges.
    """

    background: Background
    """Statistics of the empty scene."""
    settings: SilhouetteSettings
    key: str
    """The channels compared (brightness, colour or both), or the name of another method."""
    reason: str
    """Why that key is used, in one sentence."""
    edge: EdgeProfile
    """Blur of outlines in the film."""
    classifier: Classifier
    """From a frame to labels (H, W): 0 background, 1 perhaps a person, 2 a person."""
    correction: Correction | None = None
    """Undoes what has changed since the empty scene; None: nothing."""
    covered: NDArray[np.bool_] | None = None
    """Pixels (H, W) that the person covers in every frame, so that the scene there is unknown (`recovery.recover_scene`); None for none."""
    noise: float = 0.0
    """Standard deviation of the film's frames that it was learnt with about the empty scene, after correction and the least smoothing, grey
    levels of brightness; 0 without them."""
    several: bool = False
    """Whether masks keep all parts of a person's size, for several people, or the largest part, one person's."""

    def __call__(self, image: Image) -> NDArray[np.bool_]:
        """The person's mask (H, W) in a frame (H, W, 3), blue green red, or (H, W), grey; empty if it shows no person.

        Raises `SilhouetteError` for a frame that does not fit the background.
        """
        return self.finished(self.labelled(image))

    def segmented(self, labelled: Labelled) -> Segmented:
        """The silhouette that step 4 makes of a frame after step 3."""
        return Segmented(self.finished(labelled), labelled.shadow, labelled.image)

    def labelled(self, image: Image) -> Labelled:
        """A frame's pixels after step 3. Raises `SilhouetteError` for a frame that does not fit the background."""
        self._check(image)
        gap = None
        if self.correction is not None:
            image, gap, *_ = self.correction(image)
        if isinstance(self.classifier, ChannelClassifier):
            label, shadow = self.classifier.with_shadows(image)
        else:
            label, shadow = self.classifier(image), None
        if self.covered is not None:
            label[self.covered] = 2
        return Labelled(image, label, gap, shadow)

    def finished(self, labelled: Labelled) -> NDArray[np.bool_]:
        """The mask (H, W) that step 4 makes of it."""
        return self._filled(self._cleaned(labelled), labelled.gap)

    def _cleaned(self, labelled: Labelled) -> Labels:
        """The person (H, W) in the cleaned-up frame; as labelled if it is not to be cleaned up."""
        if not self.settings.cleaned:
            return labelled.label
        return clean(labelled.label, partial(self.contrast, labelled.image), self.edge, self.several)

    def _filled(self, person: Labels, gap: Gap | None) -> NDArray[np.bool_]:
        """The mask (H, W) of a person (H, W), with pixels that the person always covers, or that a moved camera does not show."""
        mask = person > 0 if self.covered is None else (person > 0) | self.covered
        return mask if gap is None else gap.filled(mask)

    def raw(self, image: Image) -> NDArray[np.bool_]:
        """Liu 2011, eq. 1, and nothing else: |I_B - I_t| >= factor * sigma_B, of shape (H, W).

        Raises `SilhouetteError` if the background is a single picture, which has no sigma.
        """
        self._check(image)
        return self._averaging(image) > 0

    @cached_property
    def _averaging(self) -> AveragingClassifier:
        return AveragingClassifier.of_background(self.background, self.settings.factor)

    def contrast(self, image: Image, window: Window, where: Labels) -> Contrast:
        """Difference to the background (h, w) in the method's channels, grey levels, in a window of rows and columns, of pixels in which
        `where` (h, w) is not 0; 0 elsewhere."""
        from shadowpuppet.silhouette._kernels import contrast

        planes = to_planes(np.ascontiguousarray(image[window]))
        out = np.empty(planes.shape[:2], np.float32)
        contrast(planes, self.background.mean[window], np.array(METHODS[self.key].contrast, np.float32), where, out)
        return out

    def _check(self, image: Image) -> None:
        check_image(image, "frame")
        check_alike(image, self.background.image_shape, "frame")
