"""Base class of live sessions with one camera and with several: phases, timing, views. Uses no threads, files or sockets."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from array import array
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Generic, NamedTuple, Protocol, TypeVar

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.geometry import Array
from shadowpuppet.live.display.view import DofAngle, SessionState
from shadowpuppet.live.settings import LiveSettings
from shadowpuppet.live.timing import Timing
from shadowpuppet.motion.motion import MotionFrame
from shadowpuppet.pipeline.options import Options
from shadowpuppet.pipeline.subject import Before, Observation, State, TrackedSubject, motion_frame
from shadowpuppet.tracking.doubt.limbs import doubtful_names
from shadowpuppet.tracking.multiview.watch.rig_watch import RigWatch
from shadowpuppet.tracking.smoothing.fixed_lag import FixedLag
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother
from shadowpuppet.video import Image

GONE = 2.0
"""Seconds of being lost after which a new measurement is advised."""


LAG = 0.1
"""Lag (s) of smoothed motion: more takes hardly more of the shaking away (docs/live.md)."""


Pictures = tuple[Image | None, ...]
"""Each camera's picture; None of one that has none at that moment."""
Masks = tuple[Mask | None, ...]
"""Each camera's silhouette (H, W), likewise."""


class CapturedShot(Protocol):
    """A picture, or a set of pictures, as a session sees it."""

    @property
    def captured(self) -> float:
        """Time of capture, seconds of the monotonic clock."""
        ...

    @property
    def shown(self) -> float | None:
        """Time in the film, seconds; None for cameras."""
        ...

    @property
    def number(self) -> int:
        """Number of pictures, or of sets, before it."""
        ...


Shot = TypeVar("Shot", bound=CapturedShot)
"""A picture of one camera, or a set of pictures of several."""
Result = TypeVar("Result")


class StepResult(NamedTuple):
    """Result of processing a picture, or of waiting for one."""

    view: SessionState
    frame: MotionFrame | None = None
    """Motion of the frame, as tracked; None unless a person is tracked."""
    images: Pictures = ()
    """Each camera's picture, of the working size."""
    given: tuple[Given, ...] = ()
    """Frames for other programs, of this picture or of some before, when there is a lag."""


class Given(NamedTuple):
    """A frame for other programs."""

    frame: MotionFrame
    """Smoothed, if there is a lag."""
    age: float
    """Seconds since its picture was captured."""


class _Waiting(NamedTuple):
    """Pictures and masks of a frame that waits for the next ones."""

    captured: float
    images: Pictures
    masks: Masks


def at_once(task: Callable[[], Result]) -> Callable[[], Result | None]:
    """Do a task now; returns a function that returns its result."""
    return partial(lambda result: result, task())


@dataclass(eq=False)
class LiveSession(ABC, Generic[Shot, State, Observation, Before]):
    """State of a session. Call `step` with every picture (or set of pictures), and `idle` if none came."""

    options: Options
    settings: LiveSettings
    rng: np.random.Generator
    """The only source of randomness."""
    clock: Callable[[], float]
    """Returns seconds of a monotonic clock, the one of the pictures' times of capture."""
    timing: Timing
    work: Callable[[Callable[[], Any]], Callable[[], Any]] = at_once
    """Starts a long task; returns a function that returns the result, or None while it is not ready."""
    phase: str = "learning"
    """One of `PHASES`."""
    subject: TrackedSubject[State, Observation, Before] | None = None
    """The measured person; None before."""
    trouble: str = ""
    """Why no pictures come; empty while they do."""

    def __post_init__(self) -> None:
        """Set the state before the first picture."""
        self._began, self._lost_since, self._new = np.nan, np.nan, False
        self._state: State | None = None
        self._before: Before | None = None
        self._lagging: FixedLag | None = None
        """Smooths the frames; None without a lag, and before there is a person."""
        self._waiting = dict[float, _Waiting]()
        """Waiting frames' pictures and masks, by time."""
        self.leans = array("d")
        """`TrackedSubject.lean` of each frame."""
        self._watch: RigWatch | None = None
        """Which of several cameras are set aside."""
        self._measured: Callable[[], Any] = lambda: None

    @property
    def lag(self) -> float:
        """Seconds by which frames wait for the next ones; 0: not at all."""
        usual = 0.0 if self.options.smoothing[0] == "off" else LAG
        return usual if self.settings.lag is None else self.settings.lag

    # Input

    def step(self, shot: Shot) -> StepResult:
        """Process a picture, or a set of pictures. Raises `SilhouetteError` if the background cannot be learnt."""
        self._began = shot.captured if np.isnan(self._began) else self._began
        if trouble := self.check(shot):
            return self._pause(trouble)
        self.trouble = ""
        self.timing.came(shot.captured, shot.number)
        phases = {"learning": self._learn, "waiting": self._wait, "measuring": self._measure, "tracking": self._track}
        outcome = phases[self.phase](shot, self._scaled(shot))
        return outcome if outcome.frame is not None else outcome._replace(given=self.rest())

    def rest(self) -> tuple[Given, ...]:
        """The frames that wait yet, when no more follow at once."""
        if self._lagging is None:
            return ()
        return self._aged(self._lagging.rest())

    def idle(self, problem: str = "") -> StepResult:
        """Handle that no picture came for a moment; `problem`: the reason, if known."""
        trouble = self.silence(self.clock(), problem)
        return self._pause(trouble) if trouble else StepResult(self._view())

    def ask(self, wish: str) -> None:
        """Carry out a command: `learn` the background again, or `measure` the person again. Ignored in phases that do not allow it."""
        if wish == "learn" and self.phase in ("waiting", "tracking"):
            self.begin_learning()
            self.phase = "learning"
        elif wish == "measure" and self.phase == "tracking":
            self.begin_waiting()
            self.phase = "waiting"

    def newly_measured(self) -> bool:
        """Whether the person was measured since the last call."""
        new, self._new = self._new, False
        return new

    # Depends on the number of cameras

    @property
    @abstractmethod
    def cameras(self) -> tuple[Camera, ...]:
        """The cameras for pictures of full size."""

    @property
    @abstractmethod
    def worked_cameras(self) -> tuple[Camera, ...]:
        """The cameras for pictures of the working size."""

    @property
    @abstractmethod
    def scenes(self) -> Sequence[list[Image]]:
        """Pictures of each camera's empty scene, of the working size."""

    @abstractmethod
    def check(self, shot: Shot) -> str:
        """The problem of a picture, in a sentence; empty if there is none."""

    @abstractmethod
    def silence(self, now: float, problem: str) -> str:
        """The problem, in a sentence, if no picture has come by time `now` (s); empty if it is too early to tell."""

    @abstractmethod
    def asks_again(self, now: float) -> Sequence[int]:
        """Indices of frozen cameras that should be opened again."""

    @abstractmethod
    def placed(self) -> tuple[Array, float | None]:
        """The body's frame in the world (4, 4), and Z of the floor (m), None if unknown."""

    @abstractmethod
    def begin_learning(self) -> None:
        """Discard the collected pictures of the empty scene."""

    @abstractmethod
    def begin_waiting(self) -> None:
        """Start waiting for a person."""

    @abstractmethod
    def _scaled(self, shot: Shot) -> Pictures: ...

    @abstractmethod
    def _see(self, shot: Shot, images: Pictures) -> Seen: ...

    @abstractmethod
    def _learn(self, shot: Shot, images: Pictures) -> StepResult: ...

    @abstractmethod
    def _wait(self, shot: Shot, images: Pictures) -> StepResult: ...

    @abstractmethod
    def _measure(self, shot: Shot, images: Pictures) -> StepResult: ...

    @abstractmethod
    def _shown(self, images: Pictures, masks: Masks, frame: MotionFrame | None) -> dict[str, Any]:
        """The fields image, mask and picture of a `SessionState`."""

    @abstractmethod
    def _message(self, masks: Masks) -> tuple[str, float | None]:
        """Instruction to the person, and the seconds of a countdown or None."""

    @abstractmethod
    def _forget_time(self) -> None:
        """Restart countdowns and collections, after a gap in the pictures."""

    # Shared by all sessions

    def _track(self, shot: Shot, images: Pictures) -> StepResult:
        assert self.subject is not None
        seen = self._see(shot, images)
        masks, observation = seen.masks, self.subject.observe(seen if self._watch is None else self._watch(shot.captured, seen))
        self._state = self.subject.next_state(self.rng, self._state, observation)
        if self._watch is not None:
            self._watch.tracked(self.subject.drawn(self._state))
        seconds = shot.captured - self._began if shot.shown is None else shot.shown
        frame, self._before = motion_frame(self.subject, seconds, self._state, observation, self._before)
        self.leans.append(self.subject.lean(frame, masks))
        now = self.clock()
        self.timing.done(shot.captured, now, shot.number)
        if frame.status != "lost":
            self._lost_since = np.nan
        elif np.isnan(self._lost_since):
            self._lost_since = shot.captured
        if self._lagging is None:
            late = now - shot.captured
            return StepResult(self._view(images, masks, frame, late), frame, images, (Given(frame, late),))
        return self._later(_Waiting(shot.captured, images, masks), frame)

    def _later(self, waiting: _Waiting, frame: MotionFrame) -> StepResult:
        """The outcome of a frame that waits for the next ones: it shows the newest of those that are due, if any is."""
        assert self._lagging is not None
        self._waiting[frame.time] = waiting
        before = dict(self._waiting)
        given = self._aged(self._lagging(frame))
        if not given:
            return StepResult(self._view(), frame, waiting.images)
        shown = before[given[-1].frame.time]
        self.timing.given(given[-1].age)
        return StepResult(self._view(shown.images, shown.masks, *given[-1]), frame, waiting.images, given)

    def _aged(self, frames: Sequence[MotionFrame]) -> tuple[Given, ...]:
        """Frames that wait no more."""
        now = self.clock()
        return tuple(Given(frame, now - self._waiting.pop(frame.time).captured) for frame in frames)

    def _begin_tracking(self, subject: TrackedSubject[State, Observation, Before]) -> None:
        if self.phase != "tracking":  # a person measured again while tracked leaves no gap in the pictures
            self.timing.pause()
        self.subject, self.phase, self._state, self._before, self._new = subject, "tracking", None, None, True
        self._lagging = FixedLag(MotionSmoother(subject.body.skeleton, subject.joints), self.lag) if self.lag else None

    def _track_again(self) -> None:
        """Track the same person after pictures that were not tracked."""
        self.phase, self._state, self._before = "tracking", None, None
        self.timing.pause()

    def _pause(self, trouble: str) -> StepResult:
        """Handle a missing or unusable picture: keep the person, restart countdowns and collections."""
        self.trouble = trouble
        self._forget_time()
        self.timing.pause()
        return StepResult(self._view(), given=self.rest())

    def _view(self, images: Pictures = (), masks: Masks = (), frame: MotionFrame | None = None,
              latency: float = np.nan) -> SessionState:
        pose = None if frame is None or frame.pose is None else np.asarray(frame.pose)
        message, countdown = self._message(masks)
        doubtful = doubtful_names(self.subject.body, frame.limb_status) if frame and self.subject else frozenset[str]()
        angles = _angles(self.subject.body, pose) if self.phase == "tracking" and self.subject else ()
        return SessionState(
            phase=self.phase, message=message, countdown=countdown, trouble=self.trouble, status=frame.status if frame else "",
            overlap=frame.overlap if frame and pose is not None else np.nan, angles=angles, latency=latency, rate=self.timing.rate,
            interval=self.timing.interval, dropped=self.timing.dropped, pose=pose, doubtful=doubtful,
            lag=0.0 if self._lagging is None else self.lag,
            **self._shown(images, masks, frame),
        )  # fmt: skip

    @property
    def _gone(self) -> bool:
        """Whether the person has been lost for longer than `GONE`."""
        return not np.isnan(self._lost_since) and self.clock() - self._lost_since > GONE


def scaled(image: Image, camera: Camera) -> Image:
    """A picture scaled to the camera's size."""
    import cv2

    if image.shape[1::-1] == camera.size:
        return image
    return np.asarray(cv2.resize(image, camera.size, interpolation=cv2.INTER_AREA), np.uint8)


def _angles(body: Body, pose: Array | None) -> tuple[DofAngle, ...]:
    """All rotational DOF, degrees; limits are -180 and 180 for a DOF without limits."""
    values: Sequence[float] = np.full(len(body.skeleton.dofs), np.nan).tolist() if pose is None else pose.tolist()
    rotations = [(dof, value) for dof, value in zip(body.skeleton.dofs, values) if dof.kind == "rotation"]
    return tuple(DofAngle(dof.name.replace("_", " "), math.degrees(value), round(math.degrees(dof.low)) if math.isfinite(dof.low) else -180,
                       round(math.degrees(dof.high)) if math.isfinite(dof.high) else 180) for dof, value in rotations)
