"""A live session: learns the empty scene, waits for a person, measures and tracks them. Knows no threads, files or sockets."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.io.person import Person
from shadowpuppet.live.display.view import Angle, View
from shadowpuppet.live.learning_phase import BackgroundCollector
from shadowpuppet.live.phases import StandStillDetector, unfit
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.timing import Timing
from shadowpuppet.live.watchdog import CameraWatchdog
from shadowpuppet.motion.motion import BLANK, MotionFrame
from shadowpuppet.pipeline.footage import CameraFrame, region_of, worked_size
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.person import MonocularSubject
from shadowpuppet.pipeline.silhouettes import Silhouettes, clean_settings
from shadowpuppet.pipeline.subject import motion_frame
from shadowpuppet.silhouette import learn_background
from shadowpuppet.tracking.monocular.initialization import Fit, find_person
from shadowpuppet.tracking.monocular.tracker import State
from shadowpuppet.tracking.status import LOST
from shadowpuppet.video import Image
from shadowpuppet.video.live_source import Snapshot

GONE = 2.0
"""Seconds for which a person is lost, after which a new measurement is advised."""


class Outcome(NamedTuple):
    """What came of a picture, or of none."""

    view: View
    frame: MotionFrame | None = None
    """The person's, where somebody is tracked."""


@dataclass(eq=False)
class Session:
    """The session's state; `step` is called with every picture, `idle` where none came. The generator is the only chance."""

    full: Camera
    """The camera as it gives its pictures."""
    options: Options
    settings: LiveSettings
    rng: np.random.Generator
    clock: Callable[[], float]
    """Seconds that never go back: those that pictures are stamped with."""
    vigil: CameraWatchdog
    timing: Timing
    work: Callable[[Callable[[], Fit]], Callable[[], Fit | None]] = lambda task: partial(lambda fit: fit, task())
    """Does what takes seconds; the answer is asked for its result until that is not None. As it is here, done at once."""
    person: Person | None = None
    """Whose sizes are known."""
    scene: list[Image] = field(default_factory=list)
    """Pictures of the empty scene, of the worked size; where there are none they are learnt."""
    phase: str = "learning"
    fit: Fit | None = None
    """Sizes and place, once they are found."""
    trouble: str = ""
    """Why no pictures come; empty where they do."""

    def __post_init__(self) -> None:
        """Make what follows from the settings. Raises `SettingsError` for a region that is none."""
        self.camera = self.full.resized(worked_size(self.full.size, self.options.max_size))
        self._region = region_of(self.options.region, self.full, self.camera)
        self._began, self._lost_since, self._new = np.nan, np.nan, False
        self._learner = BackgroundCollector(self.settings.countdown, self.settings.learn)
        self._waiter, self._still = StandStillDetector(self.settings.still), list[tuple[Image, Mask]]()
        self._recent: list[Image] = []
        self._subject: MonocularSubject | None = None
        self._state: State | None = None
        self._silhouettes: Silhouettes | None = None
        self._clear: Silhouettes | None = None
        if self.scene:
            self._learnt(self.scene)

    # What comes

    def step(self, shot: Snapshot) -> Outcome:
        """A picture. Raises `SilhouetteError` where the scene cannot be learnt."""
        self._began = shot.captured if np.isnan(self._began) else self._began
        trouble = self.vigil.see(shot.captured, shot.image)
        if trouble:
            return self._pause(trouble)
        self.trouble = ""
        self.timing.came(shot.captured, shot.number)
        image = self._scaled(shot.image)
        phases = {"learning": self._learn, "waiting": self._wait, "measuring": self._measure, "tracking": self._track}
        return phases[self.phase](shot, image)

    def idle(self, problem: str = "") -> Outcome:
        """No picture came for a moment; `problem`: why, where that is known."""
        trouble = self.vigil.silence(self.clock(), problem, self.timing.interval)
        return self._pause(trouble) if trouble else Outcome(self._view())

    def ask(self, wish: str) -> None:
        """`learn` the background anew, or `measure` the person anew; nothing where it is not the time for it."""
        if wish == "learn" and self.phase in ("waiting", "tracking"):
            self._learner, self.phase = BackgroundCollector(self.settings.countdown, self.settings.learn), "learning"
        elif wish == "measure" and self.phase == "tracking":
            self._waiter, self.phase, self._recent = StandStillDetector(self.settings.still), "waiting", []

    @property
    def measured(self) -> Fit:
        """Sizes and place of the person, who was found."""
        assert self.fit is not None
        return self.fit

    def newly_measured(self) -> bool:
        """Whether the person was measured since this was last asked."""
        new, self._new = self._new, False
        return new

    # Phases

    def _learn(self, shot: Snapshot, image: Image) -> Outcome:
        scene = self._learner.see(shot.captured, image)
        if scene is not None:
            self._learnt(scene)
        return Outcome(self._view(image))

    def _wait(self, shot: Snapshot, image: Image) -> Outcome:
        mask = self._mask(shot, image)
        self._recent = [*self._recent[-7:], image]
        masks = self._waiter.see(shot.captured, mask)
        if masks is not None:
            self.phase, self._measured = "measuring", self.work(self._fitting(masks))
        return Outcome(self._view(image, mask))

    def _fitting(self, masks: list[Mask]) -> Callable[[], Fit]:
        """Finds sizes and place of who stood still; of whom they are known, the place alone."""
        known = self.fit.guess if self.fit else self.person
        sizes, height = (known.sizes, known.height) if known else (None, None)
        height = height if self.fit else self.options.height or height
        distance = None if self.fit else self.options.distance
        return partial(find_person, self.rng.spawn(1)[0], self.camera, masks, height=height, distance=distance, sizes=sizes,
                       body=self.options.tracker.body, settings=self.options.initialization)

    def _measure(self, shot: Snapshot, image: Image) -> Outcome:
        """Waits for the fit."""
        if (fit := self._measured()) is None:
            return Outcome(self._view(image, self._mask(shot, image)))
        if np.median(list(fit.overlaps.values())) < LOST:
            self._waiter, self.phase = StandStillDetector(self.settings.still), "waiting"
            self._waiter.message = "no person's shape: stand whole in the picture, facing the camera"
            return Outcome(self._view(image))
        self._learnt(self.scene, self._recent)
        self.fit, self.phase, self._state = fit, "tracking", None
        self._subject = MonocularSubject.of(fit, self.camera, self.options.tracker, "live")
        self._new = True
        self.timing.pause()
        return Outcome(self._view(image))

    def _track(self, shot: Snapshot, image: Image) -> Outcome:
        assert self._subject is not None
        mask = self._mask(shot, image)
        state = self._state = self._subject.next_state(self.rng, self._state, mask)
        now = self.clock()
        self.timing.done(shot.captured, now, shot.number)
        status = state.status if state else "absent"
        if status != "lost":
            self._lost_since = np.nan
        elif np.isnan(self._lost_since):
            self._lost_since = shot.captured
        frame = motion_frame(self._subject, self._seconds(shot), state)
        return Outcome(self._view(image, mask, state, now - shot.captured), frame)

    # Parts

    def _learnt(self, scene: list[Image], film: list[Image] | None = None) -> None:
        """The background; with pictures of the person also how blurred outlines are."""
        seen = Silhouettes("live", None, self._region, scene[0] if self._region else None)
        visible = [seen.visible(image) for image in film] if film else None
        asked, clear = self.options.silhouette, clean_settings(self.options.silhouette)
        self.scene = scene
        self._silhouettes = replace(seen, segmenter=learn_background(scene, asked, film=visible))
        self._clear = self._silhouettes if clear == asked else replace(seen, segmenter=learn_background(scene, clear, film=visible))
        self.phase, self._state = ("tracking" if self.fit else "waiting"), None

    def _pause(self, trouble: str) -> Outcome:
        """Nothing comes that can be used: the person is kept, what waits for time to pass begins anew."""
        self.trouble = trouble
        self._learner.wait()
        self._waiter.wait()
        self.timing.pause()
        return Outcome(self._view())

    def _seconds(self, shot: Snapshot) -> float:
        """A picture's time in the run: a film's own, else since the first picture."""
        return shot.captured - self._began if shot.shown is None else shot.shown

    def _scaled(self, image: Image) -> Image:
        import cv2

        if image.shape[1::-1] == self.camera.size:
            return image
        return np.asarray(cv2.resize(image, self.camera.size, interpolation=cv2.INTER_AREA), np.uint8)

    def _mask(self, shot: Snapshot, image: Image) -> Mask:
        """The silhouette (H, W): that which is tracked in, before that a clean one, in which a person can be measured."""
        silhouettes = self._silhouettes if self.phase == "tracking" else self._clear
        assert silhouettes is not None
        return silhouettes(CameraFrame(shot.captured, image, None))

    # What is shown

    def _view(self, image: Image | None = None, mask: Mask | None = None, state: State | None = None, latency: float = np.nan) -> View:
        tracking = self.phase == "tracking"
        status = (state.status if state else "absent") if tracking and mask is not None else ""
        pose = state.pose if state is not None and state.status not in BLANK else None
        picture = self._subject.picture if self._subject else None
        return View(
            phase=self.phase, message=self._message(mask), countdown=self._learner.left if self.phase == "learning" else None,
            trouble=self.trouble, status=status, overlap=state.overlap if state and pose is not None else np.nan,
            angles=_angles(picture, pose) if tracking else (), latency=latency, rate=self.timing.rate, interval=self.timing.interval,
            dropped=self.timing.dropped, image=image, mask=mask, picture=picture, pose=pose,
        )  # fmt: skip

    def _message(self, mask: Mask | None) -> str:
        if self.phase == "tracking":
            hint = unfit(mask) if mask is not None else ""
            gone = not np.isnan(self._lost_since) and self.clock() - self._lost_since > GONE
            return hint if hint.startswith("nearly all") else "the body does not fit any more: measure anew" if gone else ""
        return {"learning": self._learner.message, "waiting": self._waiter.message, "measuring": "measuring: one moment"}[self.phase]


def _angles(picture, pose: np.ndarray | None) -> tuple[Angle, ...]:
    """All rotations, degrees."""
    if picture is None:
        return ()
    values = np.full(len(picture.body.skeleton.dofs), np.nan) if pose is None else pose
    rotations = [(dof, value) for dof, value in zip(picture.body.skeleton.dofs, values.tolist()) if dof.kind == "rotation"]
    return tuple(Angle(dof.name.replace("_", " "), math.degrees(value), round(math.degrees(dof.low)), round(math.degrees(dof.high)))
                 for dof, value in rotations)
