"""Pictures and silhouettes of a camera of a recording, read on demand; and the visual hull made of them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from pathlib import Path

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import SilhouetteError, VideoError, warn
from shadowpuppet.io.masks.ready_masks import are_pictures, read_mask
from shadowpuppet.pipeline.footage import LOOKED_AT, CameraFrame, Footage, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.silhouettes import Silhouettes, learn_silhouettes
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.video import Image
from shadowpuppet.video.seeking import Seeker
from shadowpuppet.viewer.scene.scene import HullPoints, SceneCamera

SAMPLE = 40
"""Frames sampled before segmentation if the empty scene has a film of its own."""


class FilmImages:
    """Pictures and silhouettes of a film at any time of the recording (s), at the working size; keeps the last of each.

    Uses the recording's silhouettes if it has them and `options.masks` is set; else segments the film as `track` does, and learns the
    background at the first request. For one thread at a time.
    """

    def __init__(self, footage: Footage, options: Options) -> None:
        """Opens the film. Raises `VideoError`."""
        self.footage, self.options = footage, options
        view, rate = footage.view, footage.recording.rate
        assert not isinstance(view.video, (int, str))
        self._film = Seeker(view.video, footage.camera.size, rate)
        self._ready = self._masks(view.masks, rate) if view.masks is not None and options.masks else None
        self.trouble = ""
        self._pictured: tuple[float, Image | None] = (np.nan, None)
        self._masked: tuple[float, Mask | None] = (np.nan, None)

    @property
    def _film_inverted(self) -> bool:
        """Whether the ready silhouettes are a film, black on white."""
        return self.footage.mask_kind.inverted and self._ready is not None and not are_pictures(self._ready.source)

    def _masks(self, masks: Path, rate: float | None) -> Seeker:
        """The recording's silhouettes; those of a folder are numbered as the film's frames, whose rate is theirs."""
        kind, size, film = self.footage.mask_kind, self.footage.camera.size, self.footage.film
        if rate is None and masks.is_dir() and np.isfinite(film.rate):
            rate = film.rate
        return Seeker(masks, size, rate, lambda path: read_mask(path, kind))

    def picture(self, time: float) -> Image | None:
        """Picture (H, W, 3), BGR."""
        if self._pictured[0] != time:
            self._pictured = time, self._film.at(time + self.footage.view.start) if self._is_within(time) else None
        return self._pictured[1]

    def mask(self, time: float) -> Mask | None:
        """Silhouette (H, W); None if there is no picture."""
        if self._masked[0] != time:
            self._masked = time, None if self.trouble else self._tried(time)
        return self._masked[1]

    def _tried(self, time: float) -> Mask | None:
        """Silhouette (H, W), or None if there is none. A failure is a warning and sets `trouble`: no more silhouettes are made."""
        try:
            return self._mask(time)
        except (SilhouetteError, VideoError) as error:
            self.trouble = str(error)
            warn(f"camera {self.footage.camera.name!r}: no silhouettes are shown: {error}")
            return None

    def _mask(self, time: float) -> Mask | None:
        if self._ready is not None:
            image = self._ready.at(time + self.footage.view.start) if self._is_within(time) else None
            return None if image is None else ready_mask(np.invert(image) if self._film_inverted else image)
        image = self.picture(time)
        return None if image is None else self._silhouettes(CameraFrame(time, image, None))

    def _is_within(self, time: float) -> bool:
        """Whether a time is within the recording."""
        begin, end = self.footage.recording.begin, self.footage.recording.duration
        return time >= begin and (end is None or time < end)

    @cached_property
    def _silhouettes(self) -> Silhouettes:
        longest = LOOKED_AT if self.footage.view.background is None else SAMPLE
        return learn_silhouettes(self.footage, take_sample(self.footage, longest=longest), self.options)


def hull_function(cameras: Sequence[SceneCamera], settings: Options):
    """A function from a time (s) to points on the visual hull of the silhouettes; None with fewer than two cameras."""
    useful = [(each.camera, each.images) for each in cameras if each.images is not None and each.camera.oriented]
    if len(useful) < 2:
        return None
    hull = VisualHull([camera for camera, _ in useful], settings.multiview.hull)

    def points(time: float) -> HullPoints:
        found = hull.points([images.mask(time) for _, images in useful])
        return HullPoints(found.points, found.cameras)

    return points
