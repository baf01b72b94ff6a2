"""Silhouettes of one camera's frames: made by segmentation, or taken from the recording."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.pipeline.footage import CameraFrame, Footage, Sample, spread_frames, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.silhouette import RecoveredScene, Segmenter, SilhouetteSettings, learn_background, ready_mask, recover_scene
from shadowpuppet.video import Image


@dataclass(frozen=True, eq=False)
class Silhouettes:
    """Turns a camera's frames into masks, by segmentation or by reading ready ones."""

    source: str
    """Where the silhouettes come from, in words."""
    segmenter: Segmenter | None
    """Segments the person from the background; None for ready silhouettes."""
    region: tuple[slice, slice] | None = None
    """Rows and columns outside which masks are empty; None for all."""
    blank: Image | None = None
    """Image of the empty scene, which replaces the image outside the region."""
    recovered: RecoveredScene | None = None
    """The empty scene if it was recovered from the film."""

    def __call__(self, frame: CameraFrame) -> Mask:
        """The person's mask (H, W)."""
        if self.segmenter is None:
            return self._within(ready_mask(frame.ready if frame.ready is not None else frame.image))
        return self._within(self.segmenter(self.visible(frame.image)))

    def plain(self, frame: CameraFrame) -> Mask | None:
        """The mask (H, W) by eq. 1 alone; None if the background has no standard deviation."""
        if self.segmenter is None or self.segmenter.background.frames < 2:
            return None
        return self._within(self.segmenter.raw(frame.image))

    def visible(self, image: Image) -> Image:
        """A copy of an image with the empty scene outside the region, so that nothing there is taken for the person."""
        if self.region is None or self.blank is None:
            return image
        out = self.blank.copy()
        out[self.region] = image[self.region]
        return out

    def _within(self, mask: Mask) -> Mask:
        if self.region is None:
            return mask
        out = np.zeros_like(mask)
        out[self.region] = mask[self.region]
        return out


def learn_silhouettes(footage: Footage, sample: Sample, options: Options, recovered: RecoveredScene | None = None) -> Silhouettes:
    """Silhouettes with a learnt background, or the ready ones. Raises `SilhouetteError` or `SettingsError`.

    recovered: the empty scene as it was recovered from the same film before; None to do so where the recording has none.
    """
    if options.masks:
        return Silhouettes(f"{_short(footage.view.masks)}, ready silhouettes", None, footage.region)
    images = [frame.image for frame in sample.frames]
    if footage.view.background is not None:
        scene, source, recovered = footage.pictures(footage.view.background, "the empty scene"), _short(footage.view.background), None
    else:
        recovered = recovered or _recovered(footage, images)
        scene, source = iter([recovered.picture]), f"the film itself (recovered from {recovered.frames} frames)"
    first, scene = _peeked(scene)
    silhouettes = Silhouettes(source, None, footage.region, None if footage.region is None else first, recovered)
    covered = recovered.covered if recovered is not None and recovered.covered.any() else None
    segmenter = learn_background(scene, options.silhouette, film=[silhouettes.visible(image) for image in images], covered=covered)
    return replace(silhouettes, segmenter=segmenter)


def _recovered(footage: Footage, sampled: list[Image]) -> RecoveredScene:
    """The empty scene recovered from the whole film, or from the images `sampled` of it if it cannot be sought through."""
    images = max(spread_frames(footage), sampled, key=len)
    if footage.region is None:
        return recover_scene(images)
    still = Silhouettes("", None, footage.region, images[0]) if images else None  # nothing moves outside the region
    return recover_scene([still.visible(image) for image in images] if still else [])


def read_masks(footage: Footage, options: Options) -> Iterator[Mask]:
    """Masks (H, W) of the film's frames, one after another, as `track_recording` makes them. Raises `SilhouetteError` or
    `SettingsError`."""
    return map(learn_silhouettes(footage, take_sample(footage, options.masks), options), footage.frames(ready=options.masks))


def clean_silhouettes(footage: Footage, sample: Sample, tracked: Silhouettes, options: Options) -> Silhouettes:
    """Silhouettes for measuring a person: the `tracked` ones if these are clean, otherwise clean ones.

    Once sizes are known, the particle filter tolerates specks and holes; estimating sizes and first poses needs clean masks.
    """
    clean = clean_settings(options.silhouette)
    if tracked.segmenter is None or clean == options.silhouette:
        return tracked
    return learn_silhouettes(footage, sample, replace(options, silhouette=clean), tracked.recovered)


def clean_settings(asked: SilhouetteSettings) -> SilhouetteSettings:
    """Silhouette settings for measuring a person: `asked` if these give clean silhouettes, otherwise changed so that they do."""
    if asked.method == "averaging":
        return SilhouetteSettings()
    return asked if asked.cleaned else replace(asked, clean=None)


def _peeked(images: Iterator[Image]) -> tuple[Image | None, Iterator[Image]]:
    """The first of some images, and an iterator over all of them."""
    first = next(images, None)
    return first, chain([] if first is None else [first], images)


def _short(path: Path | None) -> str:
    return f"{path.parent.name}/{path.name}" if path is not None else ""
