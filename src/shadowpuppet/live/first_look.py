"""The empty scene and the person from pictures of a session so far, though the person may be there in all of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.live.phases import unfit
from shadowpuppet.pipeline.footage import CameraFrame
from shadowpuppet.pipeline.silhouettes import Silhouettes, clean_settings
from shadowpuppet.silhouette import SilhouetteSettings, learn_background, recover_scene
from shadowpuppet.silhouette.recovery.scene import LEAST_FRAMES
from shadowpuppet.tracking.monocular.initialization import SizeFit
from shadowpuppet.tracking.monocular.pose_search import search_turned
from shadowpuppet.tracking.status import LOST_OVERLAP
from shadowpuppet.video import Image

MEASURED, FEWEST = 12, 4
"""Number of moments in which a person is measured, and the least number."""
SizesFrom = Callable[[list[Mask]], SizeFit]
"""Measures a person in masks (H, W). Raises `TrackingError` if none is found."""


class EmptyRoom(NamedTuple):
    """Pictures of an empty scene, or one that was recovered from pictures with a person."""

    pictures: list[Image]
    covered: Mask | None = None
    """Pixels (H, W) that the person always covered; None for a scene that was seen empty."""
    recovered: bool = False

    def silhouettes(self, task: LookTask, film: Sequence[Image]) -> tuple[Silhouettes, Silhouettes]:
        """Silhouettes before this scene, for tracking and for measuring; `film`: pictures with the person, for noise and the blur of
        outlines."""
        asked, clean = task.settings, clean_settings(task.settings)
        covered = None if self.covered is None or not self.covered.any() else self.covered

        def made(settings: SilhouetteSettings) -> Silhouettes:
            learnt = learn_background(self.pictures, settings, film=film or None, region=task.region, covered=covered)
            return Silhouettes("live", learnt, task.region)

        tracked = made(asked)
        return tracked, tracked if clean == asked else made(clean)


class FirstLook(NamedTuple):
    """Scene and person found in pictures."""

    scene: EmptyRoom
    tracked: Silhouettes
    clean: Silhouettes
    """For measuring."""
    fit: SizeFit | None
    """Sizes and place; None if no person could be measured."""
    overlap: float = np.nan
    """Median overlap of the fitted body with its masks."""
    before: float = 0.0
    """The same, at the same moments, of the body and the silhouettes before; none: 0."""
    tried: bool = False
    """Whether there were silhouettes to measure a person in."""


class LookTask(NamedTuple):
    """A camera's pictures and what is wanted of them."""

    settings: SilhouetteSettings
    region: tuple[slice, slice] | None
    """Rows and columns where the person may be; None for all."""
    fit: SizesFrom | None
    """None if no person is to be measured."""


def scene_of(pictures: Sequence[Image]) -> EmptyRoom | None:
    """The empty scene behind what moves in pictures (H, W, 3) or (H, W); None where nothing moves, or all of them."""
    recovered = recover_scene(pictures) if len(pictures) >= LEAST_FRAMES else None
    return None if recovered is None or recovered.doubt is not None else EmptyRoom([recovered.picture], recovered.covered, True)


def look(task: LookTask, pictures: Sequence[tuple[float, Image]], earlier: EmptyRoom | None = None, since: float = -np.inf,
         before: tuple[Picture, Silhouettes] | None = None) -> FirstLook:
    """The scene of pictures and their times (s), and the person in the moments from `since` on. `earlier`: the scene so far, kept if it
    was seen empty while a person is tracked, and if these pictures show none; `before`: the body and the silhouettes so far, to compare."""
    images = [image for _, image in pictures]
    known = earlier is not None and not earlier.recovered and before is not None
    scene = (None if known else scene_of(images)) or earlier or EmptyRoom(images)
    tracked, clean = scene.silhouettes(task, images)
    frames = [CameraFrame(time, image, None) for time, image in pictures if time >= since] if task.fit else []
    seen = [(frame, mask) for frame in frames if may_be_person(mask := clean(frame)) and not unfit(mask)]
    seen = [seen[k] for k in evenly_spread(len(seen), MEASURED)] if len(seen) >= FEWEST else []
    found = _measured(FirstLook(scene, tracked, clean, None), task, [mask for _, mask in seen])
    if before is None or found.fit is None:
        return found
    picture, so_far = before
    return found._replace(before=float(np.median([search_turned(picture, so_far(frame)).overlap for frame, _ in seen])))


def look_at(task: LookTask, masks: Sequence[Mask], scene: EmptyRoom, film: Sequence[Image]) -> FirstLook:
    """The person in masks (H, W) before a known scene; `film`: some pictures of them, for the noise and the blur of outlines."""
    return _measured(FirstLook(scene, *scene.silhouettes(task, film), None), task, masks)


def _measured(found: FirstLook, task: LookTask, masks: Sequence[Mask]) -> FirstLook:
    """The first look, with the person in masks (H, W), if one fits."""
    if task.fit is None or not masks:
        return found
    found = found._replace(tried=True)
    try:
        fit = task.fit(list(masks))
    except TrackingError:
        return found
    overlap = float(np.median(list(fit.overlaps.values())))
    return found if overlap < LOST_OVERLAP else found._replace(fit=fit, overlap=overlap)
