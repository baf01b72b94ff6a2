"""What a camera of a recording saw, frame by frame as it is asked for: pictures and silhouettes, of which one of each is held."""

from __future__ import annotations

import threading
import warnings
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import ShadowPuppetWarning, SilhouetteError, VideoError
from shadowpuppet.pipeline.footage import LOOKED_AT, CameraFrame, Footage, take_sample
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.silhouettes import Silhouettes, learn_silhouettes
from shadowpuppet.silhouette import ready_mask
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.video import Image
from shadowpuppet.video.seeking import Seeker
from shadowpuppet.viewer.scene.show import Eye, Surface

SAMPLED = 40
"""Frames that are looked at before silhouettes are made, where the empty scene is known by a film of its own."""


class FilmSeen:
    """A film's pictures and silhouettes at any time of the recording (s), of the size that is worked on.

    Ready silhouettes are taken where the recording has them and `options.masks` asks for them; others are made as `track` makes them: the
    background is learnt when the first is asked for.
    """

    def __init__(self, footage: Footage, options: Options) -> None:
        """The film is opened at once. Raises `VideoError` where it cannot be."""
        self.footage, self.options = footage, options
        view, rate = footage.view, footage.recording.rate
        assert not isinstance(view.video, (int, str))
        self._film = Seeker(view.video, footage.camera.size, rate)
        self._ready = Seeker(view.masks, footage.camera.size, rate) if view.masks is not None and options.masks else None
        self._lock, self.trouble = threading.RLock(), ""
        self._pictured: tuple[float, Image | None] = (np.nan, None)
        self._masked: tuple[float, Mask | None] = (np.nan, None)

    def picture(self, time: float) -> Image | None:
        """The picture (H, W, 3), blue green red."""
        with self._lock:
            if self._pictured[0] != time:
                self._pictured = time, self._film.at(time + self.footage.view.start) if self._counts(time) else None
            return self._pictured[1]

    def mask(self, time: float) -> Mask | None:
        """The silhouette (H, W); None where there is no picture."""
        with self._lock:
            if self._masked[0] != time:
                self._masked = time, None if self.trouble else self._tried(time)
            return self._masked[1]

    def _tried(self, time: float) -> Mask | None:
        """A silhouette; where none can be made that is said, once, and the film is shown without."""
        try:
            return self._mask(time)
        except (SilhouetteError, VideoError) as error:
            self.trouble = str(error)
            warnings.warn(f"camera {self.footage.camera.name!r}: no silhouettes are shown: {error}", ShadowPuppetWarning, stacklevel=2)
            return None

    def _mask(self, time: float) -> Mask | None:
        if self._ready is not None:
            image = self._ready.at(time + self.footage.view.start) if self._counts(time) else None
            return None if image is None else ready_mask(image)
        image = self.picture(time)
        return None if image is None else self._silhouettes(CameraFrame(time, image, None))

    def _counts(self, time: float) -> bool:
        """Whether a time is one of the recording's."""
        end = self.footage.recording.duration
        return time >= 0 and (end is None or time < end)

    @cached_property
    def _silhouettes(self) -> Silhouettes:
        longest = LOOKED_AT if self.footage.view.background is None else SAMPLED
        return learn_silhouettes(self.footage, take_sample(self.footage, longest=longest), self.options)


def hull_of(eyes: Sequence[Eye], settings: Options):
    """A function from a time (s) to points on the visual hull of what cameras see; None where fewer than two can make one."""
    able = [eye for eye in eyes if eye.seen is not None and eye.camera.oriented]
    if len(able) < 2:
        return None
    hull = VisualHull([eye.camera for eye in able], settings.multiview.hull)

    def points(time: float) -> Surface:
        found = hull.points([eye.seen.mask(time) if eye.seen else None for eye in able])
        return Surface(found.points, found.cameras)

    return points
