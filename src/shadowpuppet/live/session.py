"""A live session with one camera: learns the empty scene, waits for a person who stands still, measures and tracks them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.io.person import Person
from shadowpuppet.live.base_session import LiveSession, Outcome, scaled
from shadowpuppet.live.phases import BackgroundCollector, StandStillDetector, unfit
from shadowpuppet.live.watchdog import CameraWatchdog
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.footage import CameraFrame, region_of, worked_size
from shadowpuppet.pipeline.person import MonocularSubject
from shadowpuppet.pipeline.rig import Segment
from shadowpuppet.pipeline.silhouettes import Silhouettes, clean_settings
from shadowpuppet.silhouette import SilhouetteSettings, learn_background
from shadowpuppet.tracking.monocular.initialization import SizeFit, find_person
from shadowpuppet.tracking.status import LOST_OVERLAP
from shadowpuppet.video import Image
from shadowpuppet.video.live_source import Snapshot


@dataclass(eq=False, kw_only=True)
class Session(LiveSession):
    """A live session with one camera."""

    full: Camera
    """The camera for pictures of full size."""
    watchdog: CameraWatchdog
    person: Person | None = None
    """The person's known sizes; None to measure them."""
    scene: list[Image] = field(default_factory=list)
    """Pictures of the empty scene, of the working size; learnt if there are none."""
    fit: SizeFit | None = None
    """Fitted sizes and place; None before."""

    def __post_init__(self) -> None:
        """Raises `SettingsError` for a region outside the picture."""
        super().__post_init__()
        self.camera = self.full.resized(worked_size(self.full.size, self.options.max_size))
        self._region = region_of(self.options.region, self.full, self.camera)
        self._recent: list[Image] = []
        self._silhouettes: Silhouettes | None = None
        self._clean: Silhouettes | None = None
        self._segment: Segment | None = None
        self.begin_learning()
        self.begin_waiting()
        if self.scene:
            self._learnt(self.scene)

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The camera for pictures of full size."""
        return (self.full,)

    @property
    def worked_cameras(self) -> tuple[Camera, ...]:
        """The camera for pictures of the working size."""
        return (self.camera,)

    @property
    def scenes(self) -> Sequence[list[Image]]:
        """Pictures of the empty scene."""
        return (self.scene,)

    @property
    def measured(self) -> SizeFit:
        """Fitted sizes and place; valid only after the person was measured."""
        assert self.fit is not None
        return self.fit

    def check(self, shot: Snapshot) -> str:
        """The problem of a picture; empty if there is none."""
        return self.watchdog.see(shot.captured, shot.image)

    def silence(self, now: float, problem: str) -> str:
        """The problem if no picture came; empty if there is none."""
        return self.watchdog.silence(now, problem, self.timing.interval)

    def asks_again(self, now: float) -> bool:
        """Whether the frozen camera should be opened again."""
        return self.watchdog.asks_again(now)

    def placed(self) -> tuple[Array, float | None]:
        """The body's frame in the world (4, 4), and None: the floor is unknown with one camera."""
        assert isinstance(self.subject, MonocularSubject)
        picture = self.subject.picture
        return inverse(picture.camera.T_camera_world) @ picture.T_camera_base, None

    def begin_learning(self) -> None:
        """Discard the collected pictures of the empty scene."""
        self._collector = BackgroundCollector(self.settings.countdown, self.settings.learn)

    def begin_waiting(self) -> None:
        """Start waiting until a person stands still."""
        self._still, self._recent = StandStillDetector(self.settings.still), []

    def _learn(self, shot: Snapshot, images: tuple[Image, ...]) -> Outcome:
        scene = self._collector.see(shot.captured, images[0])
        if scene is not None:
            self._learnt(scene)
        return Outcome(self._view(images))

    def _wait(self, shot: Snapshot, images: tuple[Image, ...]) -> Outcome:
        (mask,) = masks = self._masks(shot, images)
        self._recent = [*self._recent[-7:], images[0]]
        still = self._still.see(shot.captured, mask)
        if still is not None:
            self.phase, self._measured = "measuring", self.work(self._fitting(still))
        return Outcome(self._view(images, masks))

    def _fitting(self, masks: list[Mask]) -> Callable[[], SizeFit]:
        """A task that fits sizes and place to the `masks` of a person standing still; only the place if the sizes are known."""
        known = self.fit.guess if self.fit else self.person
        sizes, height = (known.sizes, known.height) if known else (None, None)
        height = height if self.fit else self.options.height or height
        distance = None if self.fit else self.options.distance
        return partial(find_person, self.rng.spawn(1)[0], self.camera, masks, height=height, distance=distance, sizes=sizes,
                       body=self.options.tracker.body, settings=self.options.initialization)

    def _measure(self, shot: Snapshot, images: tuple[Image, ...]) -> Outcome:
        """Check whether the fit is ready."""
        fit: SizeFit | None = self._measured()
        if fit is None:
            return Outcome(self._view(images, self._masks(shot, images)))
        if np.median(list(fit.overlaps.values())) < LOST_OVERLAP:
            self._still, self.phase = StandStillDetector(self.settings.still), "waiting"
            self._still.message = "no person's shape: stand whole in the picture, facing the camera"
            return Outcome(self._view(images))
        self._learnt(self.scene, self._recent)
        self.fit = fit
        source = str(self.options.person) if self.options.person else "proportions, refined on who stood still"
        self._begin_tracking(MonocularSubject.of(fit, self.camera, self.options.tracker, source, 1 / self.timing.interval))
        return Outcome(self._view(images))

    def _learnt(self, scene: list[Image], film: list[Image] | None = None) -> None:
        """Learn the background from `scene`, and, from `film`, pictures with the person, also the blur of outlines."""
        asked, clean = self.options.silhouette, clean_settings(self.options.silhouette)

        def silhouettes(settings: SilhouetteSettings) -> Silhouettes:
            return Silhouettes("live", learn_background(scene, settings, film=film or None, region=self._region), self._region)

        self.scene, self._silhouettes = scene, silhouettes(asked)
        self._clean = self._silhouettes if clean == asked else silhouettes(clean)
        self._segment = self._silhouettes.following()
        self.phase, self._state, self._before = ("tracking" if self.fit else "waiting"), None, None

    def _scaled(self, shot: Snapshot) -> tuple[Image, ...]:
        return (scaled(shot.image, self.camera),)

    def _masks(self, shot: Snapshot, images: tuple[Image, ...]) -> tuple[Mask, ...]:
        """The silhouette (H, W); before tracking a clean one, as measuring a person needs."""
        segment = self._segment if self.phase == "tracking" else self._clean
        assert segment is not None
        return (segment(CameraFrame(shot.captured, images[0], None)),)

    def _forget_time(self) -> None:
        self._collector.wait()
        self._still.wait()

    def _shown(self, images: tuple[Image, ...], masks: tuple[Mask, ...], frame: MotionFrame | None) -> dict[str, Any]:
        picture = self.subject.picture if isinstance(self.subject, MonocularSubject) else None
        return {"image": images[0] if images else None, "mask": masks[0] if masks else None, "picture": picture}

    def _message(self, masks: tuple[Mask, ...]) -> tuple[str, float | None]:
        if self.phase == "tracking":
            hint = unfit(masks[0]) if masks else ""
            gone = "the body does not fit any more: measure anew" if self._gone else ""
            return hint if hint.startswith("nearly all") else gone, None
        if self.phase == "learning":
            return self._collector.message, self._collector.left
        return self._still.message if self.phase == "waiting" else "measuring: one moment", None
