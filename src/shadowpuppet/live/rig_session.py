"""A live session with several calibrated cameras: measures the person in the first seconds, then tracks in all cameras at once."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from shadowpuppet.body.models import average_body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.colour_codes import colour_codes
from shadowpuppet.camera.mask import Seen, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.live.base_session import LiveSession, Masks, Pictures, StepResult, scaled
from shadowpuppet.live.first_look import EmptyRoom, LookTask, scene_of
from shadowpuppet.live.phases import NOBODY, BackgroundCollector
from shadowpuppet.live.rig_capture import SnapshotSet
from shadowpuppet.live.session import COUNTDOWN, FIRST_REFINED, LAST_REFINED
from shadowpuppet.live.watchdog import CameraWatchdog
from shadowpuppet.motion.motion import BLANK, MotionFrame
from shadowpuppet.pipeline.findings.opening import OPENED, OPENING
from shadowpuppet.pipeline.footage import CameraFrame, worked_size
from shadowpuppet.pipeline.overlay_video import overlay_grid
from shadowpuppet.pipeline.person_rig import HullObservation, MultiviewSubject, check_body, fit_in_views
from shadowpuppet.pipeline.rig import FrameSet, Segment, shown_in
from shadowpuppet.pipeline.silhouettes import Silhouettes
from shadowpuppet.pipeline.subject import TrackedSubject
from shadowpuppet.tracking.doubt.multiview import Before
from shadowpuppet.tracking.frozen import LEAST
from shadowpuppet.tracking.multiview.tracker import MultiviewState
from shadowpuppet.tracking.multiview.watch.rig_watch import RigWatch
from shadowpuppet.video import Image

STEP_IN = "step in between the cameras and move a little"
LearntRoom = tuple[EmptyRoom, Silhouettes]
"""A camera's empty scene, and the silhouettes before it."""


def _found_scenes(films: Sequence[list[Image]], task: LookTask) -> list[LearntRoom]:
    """The scenes of each camera's pictures."""
    return _before([scene_of(film) or EmptyRoom(film) for film in films], task, films)


def _before(scenes: Iterable[EmptyRoom], task: LookTask, films: Sequence[list[Image]]) -> list[LearntRoom]:
    """Scenes, and silhouettes before them; pictures of a scene that was recovered show the person, too."""
    return [(scene, scene.silhouettes(task, film if scene.recovered else [])[0]) for scene, film in zip(scenes, films)]


@dataclass(eq=False, kw_only=True)
class RigSession(LiveSession[SnapshotSet, MultiviewState, HullObservation, Before]):
    """A live session with several cameras."""

    full: tuple[Camera, ...]
    """The cameras for pictures of full size."""
    watchdogs: tuple[CameraWatchdog, ...]
    scene: list[list[Image]] = field(default_factory=list)
    """Pictures of each camera's empty scene, of the working size; found if there are none."""
    height: float | None = None
    """Height of the person, metres; None if unknown."""

    def __post_init__(self) -> None:
        """Raises `SettingsError` for a body that several cameras cannot track."""
        super().__post_init__()
        check_body(self.options)
        self._worked = tuple(camera.resized(worked_size(camera.size, self.options.max_size)) for camera in self.full)
        body = average_body(self.options.multiview.body)
        self._pictures = [Picture(body, camera, camera.T_camera_world) for camera in self._worked]
        self._segment: list[Segment] = []
        self._without = dict[int, str]()
        """Cameras whose pictures cannot be used now, by index, and why."""
        self._found_again: Callable[[], list[LearntRoom] | None] | None = None
        self._due, self._between = np.inf, FIRST_REFINED
        given = self.scene if self.scene and all(self.scene) else None
        self.begin_learning()
        self.begin_waiting()
        if given is not None:
            self._learnt(_before(map(EmptyRoom, given), self._task, [[]] * len(given)))

    @property
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras for pictures of full size."""
        return self.full

    @property
    def worked_cameras(self) -> tuple[Camera, ...]:
        """The cameras for pictures of the working size."""
        return self._worked

    @property
    def scenes(self) -> list[list[Image]]:
        """Pictures of each camera's empty scene; none of one that was never seen empty."""
        return self.scene

    def check(self, shot: SnapshotSet) -> str:
        """The first problem of the pictures. Once the person is tracked, two cameras without one suffice: the others are left out."""
        troubles = [self._trouble(n, shot.captured, image) for n, image in enumerate(shot.images)]
        self._without = {n: "frozen" if self.watchdogs[n].frozen(shot.captured) else "no pictures"
                         for n, trouble in enumerate(troubles) if trouble}
        there = [image for n, image in enumerate(shot.images) if image is not None and n not in self._without]
        return "" if self.phase == "tracking" and len(there) >= LEAST else next(filter(None, troubles), "")

    def _trouble(self, camera: int, now: float, image: Image | None) -> str:
        """The problem of a camera at time `now` (s); empty if there is none."""
        dog = self.watchdogs[camera]
        return dog.silence(now, "", self.timing.interval) if image is None else dog.see(now, image)

    def silence(self, now: float, problem: str) -> str:
        """The first camera's problem if no set of pictures came; empty if there is none, or if enough cameras go on."""
        interval = self.timing.interval
        going_on = sum(not dog.silence(now, "", interval) for dog in self.watchdogs)
        if self.phase == "tracking" and going_on >= LEAST:
            return ""
        return next(filter(None, (dog.silence(now, problem, interval) for dog in self.watchdogs)), "")

    def asks_again(self, now: float) -> Sequence[int]:
        """Indices of frozen cameras that should be opened again."""
        return [n for n, dog in enumerate(self.watchdogs) if dog.asks_again(now)]

    def placed(self) -> tuple[Array, float | None]:
        """The body's frame is the world's; the floor is at Z = 0."""
        return np.eye(4), 0.0

    def begin_learning(self) -> None:
        """Discard the collected pictures of the empty scenes."""
        usual = COUNTDOWN if self.watchdogs[0].live else 0.0
        countdown = usual if self.settings.countdown is None else self.settings.countdown
        self._collectors = [BackgroundCollector(countdown, self.settings.learn) for _ in self.full]

    def begin_waiting(self) -> None:
        """Start waiting until two cameras see a person."""
        self._first: list[tuple[float, Masks]] = []
        self._hint = STEP_IN

    def _learn(self, shot: SnapshotSet, images: Pictures) -> StepResult:
        ready = [image is not None and collector.see(shot.captured, image) for collector, image in zip(self._collectors, images)]
        if all(ready):
            films = [[image for _, image in collector.pictures.kept] for collector in self._collectors]
            self.phase, self._measured = "measuring", self.work(partial(_found_scenes, films, self._task))
        return StepResult(self._view(images))

    def _learnt(self, found: Sequence[LearntRoom]) -> None:
        self._seen_before(found)
        self._due, self._between, self._found_again = self.clock() + FIRST_REFINED, FIRST_REFINED, None
        if self.subject:
            self._track_again()
        else:
            self.phase = "waiting"

    def _seen_before(self, found: Sequence[LearntRoom]) -> None:
        """Use new silhouettes before the scenes."""
        self.scene = [[] if scene.recovered else scene.pictures for scene, _ in found]
        self._segment = [silhouettes.segmented for _, silhouettes in found]

    def _look_again(self, now: float, images: Pictures, fits: bool) -> bool:
        """From time to time find the scenes that were not seen empty again in all pictures so far. Whether they were, while the body does
        not fit: a person who left the place where they stood at first leaves a hole in the scene."""
        for collector, image in zip(self._collectors, images):
            if image is not None:
                collector.pictures.add(now, image)
        if self._found_again is None and now >= self._due and not all(self.scene):
            self._between *= 2
            self._due = now + self._between if self._between < LAST_REFINED else np.inf
            films = [[image for _, image in collector.pictures.kept] for collector in self._collectors]
            self._found_again = self.work(partial(_found_scenes, films, self._task))
        found = None if self._found_again is None else self._found_again()
        if found is None:
            return False
        self._found_again = None
        if not fits:
            self._seen_before(found)
        return not fits

    def _track(self, shot: SnapshotSet, images: Pictures) -> StepResult:
        outcome = super()._track(shot, images)
        status = outcome.frame.status if outcome.frame is not None else "lost"
        if self._look_again(shot.captured, images, status == "tracked") and status in BLANK:
            self.begin_waiting()
            self.phase = "waiting"
        return outcome

    @property
    def _task(self) -> LookTask:
        """Task for the first pictures: silhouettes."""
        return LookTask(self.options.silhouette, None, None)

    def _wait(self, shot: SnapshotSet, images: Pictures) -> StepResult:
        if self._look_again(shot.captured, images, False):
            self.begin_waiting()
        masks = self._see(shot, images).masks
        if sum(mask is not None and may_be_person(mask) and float(mask.mean()) > NOBODY / 3 for mask in masks) > 1:
            self._first.append((shot.captured, masks))
        else:
            self.begin_waiting()
        if self._first and shot.captured - self._first[0][0] >= max(OPENING, self.settings.still):
            self.phase, self._measured = "measuring", self.work(self._fitting())
        return StepResult(self._view(images, masks))

    def _fitting(self) -> Callable[[], MultiviewSubject | TrackingError]:
        """A task that measures the person in the first seconds; it returns, rather than raises, the error if there is no person."""
        chosen, settings = evenly_spread(len(self._first), OPENED).tolist(), self.options.multiview
        in_time = replace(self.options, multiview=replace(settings, cycles=settings.cycles or 1))  # more would take longer than a frame
        fit = partial(fit_in_views, self.rng.spawn(1)[0], self._worked, [self._first[n][1] for n in chosen], in_time,
                      1 / self.timing.interval, self.height)

        def tried() -> MultiviewSubject | TrackingError:
            try:
                return fit()
            except TrackingError as error:
                return error

        return tried

    def _measure(self, shot: SnapshotSet, images: Pictures) -> StepResult:
        """Check whether the fit is ready."""
        found: MultiviewSubject | TrackingError | list[LearntRoom] | None = self._measured()
        if found is None:
            return StepResult(self._view(images, self._see(shot, images).masks if self._segment else ()))
        if isinstance(found, list):
            self._learnt(found)
        elif isinstance(found, TrackingError):
            self.begin_waiting()
            self.phase, self._hint = "waiting", f"no person's shape: {STEP_IN}"
        else:
            self._begin_tracking(found)
        return StepResult(self._view(images))

    def _begin_tracking(self, subject: TrackedSubject[MultiviewState, HullObservation, Before]) -> None:
        super()._begin_tracking(subject)
        self._watch = RigWatch(len(self.full))

    def _scaled(self, shot: SnapshotSet) -> Pictures:
        return tuple(None if image is None or n in self._without else scaled(image, camera)
                     for n, (image, camera) in enumerate(zip(shot.images, self._worked)))

    def _see(self, shot: SnapshotSet, images: Pictures) -> Seen:
        found = [None if image is None else segment(CameraFrame(shot.captured, image, None))
                 for segment, image in zip(self._segment, images)]
        codes = tuple(None if each is None else colour_codes(each.image) for each in found)
        return shown_in(found)._replace(codes=codes)

    def _forget_time(self) -> None:
        self._watch = None if self._watch is None else RigWatch(len(self.full))
        for collector in self._collectors:
            collector.wait()
        self._first.clear()

    def _shown(self, images: Pictures, masks: Masks, frame: MotionFrame | None) -> dict[str, Any]:
        """The fields image and pictures of a `SessionState`. The image is a grid of all cameras: a display shows a single picture."""
        if not images:
            return {}
        measured = self.subject.pictures if isinstance(self.subject, MultiviewSubject) else ()
        found = frame or MotionFrame(0.0, self.phase)
        seen = Seen(masks or (None,) * len(images))
        grid = overlay_grid(FrameSet(found.time, images, seen), found, measured or self._pictures)
        return {"image": grid, "pictures": tuple(measured)}

    def _aside(self) -> str:
        """Which cameras are left out or set aside, and why; empty if none is."""
        present = {} if self._watch is None else self._watch.present
        present = present | self._without
        names = ", ".join(f"{self.watchdogs[n].name} ({why})" for n, why in sorted(present.items()))
        return f"set aside: {names}" if names else ""

    def _message(self, masks: Masks) -> tuple[str, float | None]:
        if self.phase == "learning":
            slowest = max(self._collectors, key=lambda collector: collector.left)
            return slowest.message, slowest.left
        if self.phase == "tracking":
            return "the body does not fit any more: measure again" if self._gone else self._aside(), None
        return self._hint if self.phase == "waiting" else "measuring: one moment", None
