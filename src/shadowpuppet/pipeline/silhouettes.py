"""Silhouettes of one camera's frames: made by segmentation, or taken from the recording."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.pipeline.footage import CameraFrame, Footage, Sample, spread_frames, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.rig import Rig, Segment, unsegmented
from shadowpuppet.silhouette import RecoveredScene, Segmenter, SilhouetteSettings, learn_background, ready_mask, recover_scene
from shadowpuppet.silhouette.added import AddedParts, StillParts, find_still
from shadowpuppet.silhouette.segmenter import Labelled, Segmented
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
    recovered: RecoveredScene | None = None
    """The empty scene if it was recovered from the film."""
    added: AddedParts | None = None
    """What was added to the empty scene, and belongs to the background since."""
    before: Segmenter | None = None
    """The segmenter without what was added."""
    classified: dict[int, tuple[Image, Labelled]] = field(default_factory=dict, repr=False)
    """Pictures of the film's sample by `id`, with their classified pixels: each is classified once, however often it is looked at."""

    @property
    def smeared(self) -> bool:
        """Whether the film has lost detail to compression or focus, so that thin limbs are missing in its silhouettes."""
        correction = None if self.segmenter is None else self.segmenter.correction
        return correction is not None and correction.detail is not None

    def __call__(self, frame: CameraFrame) -> Mask:
        """The person's mask (H, W)."""
        return self.segmented(frame).mask

    def segmented(self, frame: CameraFrame) -> Segmented:
        """The person's silhouette, and what is taken for shadow."""
        if self.segmenter is None:
            ready = frame.image if frame.ready is None else frame.ready
            return self._kept(Segmented(ready_mask(ready), image=None if frame.ready is None else frame.image))
        _, labelled = self.classified.get(id(frame.image)) or (None, self.segmenter.labelled(frame.image))
        return self._kept(self.segmenter.segmented(labelled))

    def of_several(self) -> Silhouettes:
        """A copy whose masks keep everybody in the picture, not only the largest part."""
        wide = [None if one is None else replace(one, several=True) for one in (self.segmenter, self.before)]
        return replace(self, segmenter=wide[0], before=wide[1])

    def elsewhere(self, frame: CameraFrame) -> Mask:
        """The mask (H, W) in a picture that is none of the film's, so that what the person always covers there need not be covered."""
        segmenter = self.before or self.segmenter
        if segmenter is None or (segmenter.covered is None and self.before is None):
            return self(frame)
        return replace(self, segmenter=replace(segmenter, covered=None), before=None)(frame)

    def still_parts(self, frames: Sequence[CameraFrame], masks: Sequence[Mask]) -> StillParts | None:
        """What never changes in frames and their masks (H, W), in the light of the empty scene; None where there is no empty scene, or the
        frames are few."""
        if self.segmenter is None or self.recovered is not None:
            return None
        correction = self.segmenter.correction
        return find_still([frame.image if correction is None else correction(frame.image).image for frame in frames], masks)

    def plain(self, frame: CameraFrame) -> Mask | None:
        """The mask (H, W) by eq. 1 alone; None if the background has no standard deviation."""
        if self.segmenter is None or self.segmenter.background.frames < 2:
            return None
        return self._within(self.segmenter.raw(frame.image))

    def steadied(self, image: Image) -> Image:
        """An image as the camera would see it without its movement since the empty scene: it fits the mask."""
        correction = None if self.segmenter is None else self.segmenter.correction
        if correction is None or correction.registration is None:
            return image
        movement = correction.registration.movement(image)
        return image if movement is None else correction.registration.undone(image, movement)[0]

    def _kept(self, found: Segmented) -> Segmented:
        """A silhouette within the region."""
        return found._replace(mask=self._within(found.mask))

    def _within(self, mask: Mask) -> Mask:
        if self.region is None:
            return mask
        out = np.zeros_like(mask)
        out[self.region] = mask[self.region]
        return out


def segments_of(rig: Rig, silhouettes: Sequence[Silhouettes]) -> list[Segment]:
    """Makes the silhouettes of each of a rig's films; none if keypoints alone are evidence."""
    return [each.segmented for each in silhouettes] or [unsegmented] * len(rig.footage)


def learn_silhouettes(footage: Footage, sample: Sample, options: Options, recovered: RecoveredScene | None = None,
                      added: AddedParts | None = None, before: Segmenter | None = None) -> Silhouettes:
    """Silhouettes with a learnt background, or the ready ones. Raises `SilhouetteError` or `SettingsError`.

    recovered: the empty scene as it was recovered from the same film before; None to do so where the recording has none. added: what is
    to be put into the pictures of the empty scene. before: what was learnt without `added`; None to learn it.
    """
    if options.masks:
        return Silhouettes(f"{_short(footage.view.masks)}, ready silhouettes{footage.mask_kind.words}", None, footage.region)
    images = [frame.image for frame in sample.frames]
    if footage.view.background is not None:
        scene, source, recovered = footage.empty_scene(), _short(footage.view.background), None
    else:
        recovered = recovered or _recovered(footage, images)
        scene, source = iter([recovered.picture]), f"the film itself (recovered from {recovered.frames} frames)"
    if added is not None:
        scene = added.into(scene)
    covered = recovered.covered if recovered is not None and recovered.covered.any() else None
    segmenter = learn_background(scene, options.silhouette, film=images, region=footage.region, covered=covered)
    before = None if added is None else before or learn_silhouettes(footage, sample, options).segmenter
    return Silhouettes(source, segmenter, footage.region, recovered=recovered, added=added, before=before)


def _recovered(footage: Footage, sampled: list[Image]) -> RecoveredScene:
    """The empty scene recovered from the whole film, or from the images `sampled` of it if it cannot be sought through."""
    images = max(spread_frames(footage), sampled, key=len)
    if footage.region is None or not images:
        return recover_scene(images)
    alike = [images[0].copy() for _ in images]  # nothing moves outside the region
    for out, image in zip(alike, images):
        out[footage.region] = image[footage.region]
    return recover_scene(alike)


def read_masks(footage: Footage, options: Options) -> Iterator[Mask]:
    """Masks (H, W) of the film's frames, one after another, as `track_recording` makes them. Raises `SilhouetteError` or
    `SettingsError`."""
    segment = learn_silhouettes(footage, take_sample(footage, options.masks), options).segmented
    return (segment(frame).mask for frame in footage.frames(ready=options.masks))


def clean_silhouettes(footage: Footage, sample: Sample, tracked: Silhouettes, options: Options) -> Silhouettes:
    """Silhouettes for measuring a person: the `tracked` ones if these are clean, otherwise clean ones.

    Once sizes are known, the particle filter tolerates specks and holes; estimating sizes and first poses needs clean masks.
    """
    clean = clean_settings(options.silhouette)
    if tracked.segmenter is None or clean == options.silhouette:
        return tracked
    return learn_silhouettes(footage, sample, replace(options, silhouette=clean), tracked.recovered, tracked.added)


def clean_settings(asked: SilhouetteSettings) -> SilhouetteSettings:
    """Silhouette settings for measuring a person: `asked` if these give clean silhouettes, otherwise changed so that they do."""
    if asked.method == "averaging":
        return SilhouetteSettings()
    return asked if asked.cleaned else replace(asked, clean=None)


def _short(path: Path | None) -> str:
    return Path(*path.parts[-2:]).as_posix() if path is not None else ""
