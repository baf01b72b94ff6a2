"""A live session with one camera: finds the empty scene, measures the person, tracks them, and refines both as it goes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, TypeVar

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.colour_codes import colour_codes
from shadowpuppet.camera.mask import Seen
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.io.person import Person
from shadowpuppet.live.base_session import LiveSession, Masks, Pictures, StepResult, scaled
from shadowpuppet.live.first_look import EmptyRoom, FirstLook, LookTask, look, look_at
from shadowpuppet.live.phases import BackgroundCollector, StandStillDetector, unfit
from shadowpuppet.live.watchdog import CameraWatchdog
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.footage import CameraFrame, region_of, worked_size
from shadowpuppet.pipeline.person import ColouredMask, MonocularSubject
from shadowpuppet.pipeline.rig import Segment
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.tracking.doubt.monocular import Before
from shadowpuppet.tracking.monocular.initialization import SizeFit, find_person
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.tracker import State
from shadowpuppet.video import Image
from shadowpuppet.video.live_source import Snapshot

COUNTDOWN = 5.0
"""Seconds to step out of a camera's picture."""
FIRST_REFINED, LAST_REFINED = 3.0, 60.0
"""Seconds of tracking after which scene and person are found again in all pictures so far; doubled each time, up to the last."""
GAIN = 0.01
"""Overlap that a person found again must gain."""
CameraValue = TypeVar("CameraValue")


@dataclass(eq=False, kw_only=True)
class CameraSession(LiveSession[Snapshot, State, ColouredMask, Before]):
    """A live session with one camera."""

    full: Camera
    """The camera for pictures of full size."""
    watchdog: CameraWatchdog
    person: Person | None = None
    """The person's known sizes; None to measure them."""
    scene: list[Image] = field(default_factory=list)
    """Pictures of the empty scene, of the working size; found if there are none."""
    fit: SizeFit | None = None
    """Fitted sizes and place; None before."""

    def __post_init__(self) -> None:
        """Raises `SettingsError` for a region outside the picture."""
        super().__post_init__()
        self.camera = self.full.resized(worked_size(self.full.size, self.options.max_size))
        self._region = region_of(self.options.region, self.full, self.camera)
        self._recent: list[Image] = []
        self._clean: Silhouettes | None = None
        self._segment: Segment | None = None
        self._scene: EmptyRoom | None = None
        self._refined: Callable[[], FirstLook | None] | None = None
        """Gives the result of a new look at the pictures so far; None while there is none."""
        self._due, self._between, self._since = np.inf, FIRST_REFINED, -np.inf
        self.begin_learning()
        self._wait_again()
        if self.scene:
            scene = EmptyRoom(self.scene)
            self._seen_before(scene, *scene.silhouettes(self._task(None), []))
            self.phase = "waiting"

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
        """Pictures of the empty scene; none of one that was never seen empty."""
        return ([] if self._scene is None or self._scene.recovered else self._scene.pictures,)

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

    def asks_again(self, now: float) -> Sequence[int]:
        """The camera's index, 0, if it is frozen and should be opened again."""
        return (0,) if self.watchdog.asks_again(now) else ()

    def placed(self) -> tuple[Array, float | None]:
        """The body's frame in the world (4, 4), and None: the floor is unknown with one camera."""
        assert isinstance(self.subject, MonocularSubject)
        picture = self.subject.picture
        return inverse(picture.camera.T_camera_world) @ picture.T_camera_base, None

    def begin_learning(self) -> None:
        """Discard the pictures collected so far. The person in a film cannot be asked to step out of the picture."""
        usual = COUNTDOWN if self.watchdog.live else 0.0
        self._collector = BackgroundCollector(usual if self.settings.countdown is None else self.settings.countdown, self.settings.learn)

    def begin_waiting(self) -> None:
        """Start waiting for a person to be measured, as they are from now on."""
        self._wait_again()
        self._since, self._refined = self.clock(), None

    def _wait_again(self, message: str = "") -> None:
        self._still, self._recent = StandStillDetector(self.settings.still), []
        self._still.message = message or self._still.message

    def _learn(self, shot: Snapshot, images: Pictures) -> StepResult:
        if self._collector.see(shot.captured, only(images)):
            task = self._task(self.person)
            task = task if self.fit is None else task._replace(fit=None)
            self.phase, self._measured = "measuring", self.work(partial(look, task, list(self._collector.pictures.kept)))
        return StepResult(self._view(images))

    def _wait(self, shot: Snapshot, images: Pictures) -> StepResult:
        if self._taken():
            return StepResult(self._view(images))
        masks = self._see(shot, images).masks
        self._recent = [*self._recent[-7:], only(images)]
        self._collector.pictures.add(shot.captured, only(images))
        ready = self._still.see(shot.captured, only(masks))
        if ready is not None:
            assert self._scene is not None
            self.phase, self._refined = "measuring", None
            task = self._task(self.fit.guess if self.fit else self.person)
            self._measured = self.work(partial(look_at, task, ready, self._scene, self._recent))
        elif not self.scene:
            self._look_again(shot.captured)
        return StepResult(self._view(images, masks))

    def _measure(self, shot: Snapshot, images: Pictures) -> StepResult:
        """Check whether the task is ready."""
        found: FirstLook | None = self._measured()
        if found is None:
            return StepResult(self._view(images, self._see(shot, images).masks))
        self._seen_before(found.scene, found.tracked, found.clean)
        self._due, self._between = shot.captured + FIRST_REFINED, FIRST_REFINED
        if found.fit is not None:
            self._begin(found.fit)
        elif self.fit is not None and not found.tried:
            self._track_again()
        else:
            self.phase = "waiting"
            self._wait_again("no person's shape: stand whole in the picture, facing the camera" if found.tried else "")
        return StepResult(self._view(images))

    def _track(self, shot: Snapshot, images: Pictures) -> StepResult:
        lagging = self._lagging
        given = () if not self._taken() or lagging is None else self._aged(lagging.rest())
        outcome = super()._track(shot, images)
        outcome = outcome._replace(given=(*given, *outcome.given))
        if outcome.frame is not None and outcome.frame.status == "tracked":
            self._collector.pictures.add(shot.captured, only(images))
        self._look_again(shot.captured)
        return outcome

    def _task(self, known: Person | PersonEstimate | None) -> LookTask:
        """Task for pictures: silhouettes, and the person's sizes and place, or the place alone if their sizes are `known`."""
        again = self._since > -np.inf
        sizes, height = (known.sizes, known.height) if known else (None, None)
        height = self.options.height or height if isinstance(known, Person | None) else height
        find = partial(find_person, self.rng.spawn(1)[0], self.camera, height=height, distance=None if again else self.options.distance,
                       sizes=sizes, body=self.options.tracker.body, settings=self.options.initialization)
        return LookTask(self.options.silhouette, self._region, find)

    def _look_again(self, now: float) -> None:
        """From time to time begin a new look at the pictures so far, for the person and for a scene that was not seen empty."""
        if now < self._due or self._refined is not None:
            return
        self._between *= 2
        self._due = now + self._between if self._between < LAST_REFINED else np.inf
        before = None
        if isinstance(self.subject, MonocularSubject) and self._clean is not None and self.phase == "tracking":
            before = self.subject.picture, self._clean
        pictures = list(self._collector.pictures.kept)
        self._refined = self.work(partial(look, self._task(self.person), pictures, self._scene, self._since, before))

    def _taken(self) -> bool:
        """Whether a new look is ready, and shows a person better than before: then scene and person are as they were found in it."""
        found = None if self._refined is None else self._refined()
        if found is None:
            return False
        self._refined = None
        if self.phase == "tracking" and (found.fit is None or found.overlap < found.before + GAIN):
            return False
        self._seen_before(found.scene, found.tracked, found.clean)
        if found.fit is None:
            return False
        self._begin(found.fit)
        return True

    def _begin(self, fit: SizeFit) -> None:
        """Track the person of a fit."""
        self.fit = fit
        source = str(self.options.person) if self.options.person else "proportions, refined on moments of the session"
        self._begin_tracking(MonocularSubject.of(fit, self.camera, self.options.tracker, source, 1 / self.timing.interval))

    def _seen_before(self, scene: EmptyRoom, tracked: Silhouettes, clean: Silhouettes) -> None:
        """Use new silhouettes before a scene."""
        self._scene, self._clean, self._segment = scene, clean, tracked.segmented

    def _scaled(self, shot: Snapshot) -> tuple[Image, ...]:
        return (scaled(shot.image, self.camera),)

    def _see(self, shot: Snapshot, images: Pictures) -> Seen:
        """The silhouette (H, W); before tracking a clean one, as measuring a person needs."""
        clean = None if self._clean is None else self._clean.segmented
        segment = self._segment if self.phase == "tracking" else clean
        if segment is None:
            return Seen(())
        found = segment(CameraFrame(shot.captured, only(images), None))
        assert found is not None
        return Seen((found.mask,), codes=(colour_codes(found.image),))

    def _forget_time(self) -> None:
        if self.phase == "learning":
            self._collector.wait()
        self._still.wait()

    def _shown(self, images: Pictures, masks: Masks, frame: MotionFrame | None) -> dict[str, Any]:
        picture = self.subject.picture if isinstance(self.subject, MonocularSubject) else None
        return {"image": only(images) if images else None, "mask": masks[0] if masks else None, "picture": picture,
                "pictures": () if picture is None else (picture,)}

    def _message(self, masks: Masks) -> tuple[str, float | None]:
        if self.phase == "tracking":
            hint = unfit(only(masks)) if masks else ""
            gone = "the body does not fit any more: measure again" if self._gone else ""
            return hint if hint.startswith("nearly all") else gone, None
        if self.phase == "learning":
            return self._collector.message, self._collector.left
        looking = "measuring: one moment" if self._scene is not None else "finding the empty scene, and measuring who is there"
        return self._still.message if self.phase == "waiting" else looking, None


def only(every: Sequence[CameraValue | None]) -> CameraValue:
    """The value of the only camera."""
    (value,) = every
    assert value is not None
    return value
