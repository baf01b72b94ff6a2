"""The person in a recording: a fitted body and the tracker that follows it, behind one interface for one camera and for several."""

from __future__ import annotations

import time
from abc import ABC, abstractmethod
from collections.abc import Generator, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Generic, NamedTuple, Protocol, Self, TypeVar

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.camera.bits import Bits
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, Seen
from shadowpuppet.errors import Finding
from shadowpuppet.geometry import Array
from shadowpuppet.io.person import Person
from shadowpuppet.motion.contact.contact import under_feet
from shadowpuppet.motion.motion import BLANK, SCALARS, Motion, MotionFrame
from shadowpuppet.pipeline.rig import FrameSet
from shadowpuppet.silhouette.added import BesideBody
from shadowpuppet.tracking.doubt.doubt import Doubt
from shadowpuppet.video import Image


class TrackerState(Protocol):
    """Interface that a run needs of a tracker's state."""

    @property
    def pose(self) -> Array:
        """The estimated pose (D,)."""
        ...

    @property
    def status(self) -> str:
        """One of `motion.STATUSES`."""
        ...

    @property
    def cost(self) -> float:
        """The tracker's own measure of misfit."""
        ...

    @property
    def overlap(self) -> float:
        """Mean intersection over union of the projected estimate and the silhouettes; NaN if it was not computed."""
        ...


State = TypeVar("State", bound=TrackerState)
"""All that a tracker's next frame needs of those before."""
Observation = TypeVar("Observation")
"""What a tracker makes of one frame set's evidence (`Seen`)."""
Before = TypeVar("Before")
"""What the doubt about a frame needs of the frame before."""


class Observed(NamedTuple, Generic[Observation]):
    """A frame set and the tracker's observation of it."""

    frames: FrameSet
    observation: Observation
    seconds: float = 0.0
    """Time taken to make the observation."""


@dataclass(frozen=True, eq=False, kw_only=True)
class FittedPerson:
    """A person whose sizes are known."""

    body: Body
    person: Person
    """Sizes that other runs can use, written to person.toml."""
    summary: dict[str, object]
    """How the person was fitted, as plain values: the entry `person` of look.json."""
    doubts: tuple[Finding, ...] = ()
    """Doubts about the fit, a sentence each."""
    beside: tuple[BesideBody | None, ...] = ()
    """What the body leaves unexplained in each camera's silhouettes; empty, or None, for nothing."""

    @property
    def limits(self) -> Mapping[str, float] | None:
        """Of each kind of limb, metres, for what a smoothed motion says of its limbs (`MotionSmoother.limits`)."""
        return None

    def landmarks(self, poses: Array) -> Array:
        """Landmarks (N, L, 3) of poses (N, D) in the world, metres."""
        return self.body.points(poses)

    def joints(self, poses: Array) -> Array:
        """The landmarks (N, J, 3) of poses (N, D) that a run writes as joints, in the world, metres."""
        return self.landmarks(poses)[:, self.joint_columns]

    def points(self, pose: Array) -> Array:
        """Landmarks (L, 3) of a pose (D,) in the world, metres."""
        return self.landmarks(pose[None])[0]

    @cached_property
    def joint_columns(self) -> list[int]:
        """Indices of the landmarks that a run writes as joints."""
        return [self.body.landmark_names.index(name) for name in joint_names(self.body)]


@dataclass(frozen=True, eq=False, kw_only=True)
class TrackedSubject(FittedPerson, ABC, Generic[State, Observation, Before]):
    """A fitted person and the tracker that follows them: observe, next_state and doubt make a frame."""

    state_types: ClassVar[tuple[type, ...]]
    """The named tuples in the tracker's state and in what the doubt about the next frame needs."""

    @abstractmethod
    def observe(self, seen: Seen) -> Observation:
        """The tracker's observation of what one frame set shows."""

    @abstractmethod
    def next_state(self, rng: np.random.Generator, state: State | None, observation: Observation) -> State | None:
        """The tracker's state after an observation; None while there is no person."""

    @abstractmethod
    def doubt(self, state: State, observation: Observation, seconds: float, before: Before | None) -> tuple[Doubt, Before]:
        """Doubt about the estimate of an observation at a time (s), and what the next frame's needs: its `before`, at first None."""

    @abstractmethod
    def draw(self, frames: FrameSet, found: MotionFrame, last: MotionFrame | None = None) -> Image:
        """A frame of overlay.mp4, (H, W, 3), blue green red. `last`: the last frame with a pose, dashed where this one has none."""

    def observations(self, frames: Iterable[FrameSet]) -> Generator[Observed[Observation]]:
        """Observations of frame sets, one after another."""
        for each in frames:
            start = time.perf_counter()
            observation = self.observe(each.seen)
            yield Observed(each, observation, time.perf_counter() - start)

    @property
    def both_ways(self) -> bool:
        """Whether a film is tracked backward, too."""
        return False

    def turned_back(self, state: State | None) -> Self:
        """The subject for tracking a film backward, with what the last state of the forward pass has learnt."""
        return self

    def blended(self, forward: Motion, backward: Motion) -> tuple[Motion, Array]:
        """Motions of the same frames that were tracked forward and backward as one, and the weight (T,) of the backward one: 0 for subjects
        that are not tracked `both_ways`."""
        return forward, np.zeros(len(forward))

    def left_out(self, state: State | None) -> tuple[Mask | None, ...]:
        """For each camera the pixels (H, W) that a tracker's state leaves out of the silhouettes, in masks of any size; None for none."""
        return ()

    def lean(self, found: MotionFrame, masks: Sequence[Mask | None]) -> float:
        """How far the head lies before the neck in a frame in which the person is seen in profile (`head_lean`); NaN in others, and with
        several cameras."""
        return np.nan

    def kept(self, state: State | None) -> State | None:
        """A tracker's state without what the next frame does not need."""
        return state

    def drawn(self, state: TrackerState | MotionFrame | None) -> tuple[Bits, ...]:
        """The body of a tracker's state in each camera's picture of half the size; empty if there is none, or with one camera."""
        return ()

    def unfound(self, observation: Observation) -> str:
        """Status of a frame without a state: `lost` or `absent`."""
        return "absent"


def motion_frame(subject: TrackedSubject[State, Observation, Before], seconds: float, state: State | None, observation: Observation,
                 before: Before | None = None) -> tuple[MotionFrame, Before | None]:
    """The motion of one frame from a tracker's state, without a pose if the person is lost or absent; and the next frame's `before`."""
    if state is None:
        return MotionFrame(seconds, subject.unfound(observation)), None
    scalars = {name: getattr(state, name) for name in SCALARS}
    if state.status in BLANK:
        return MotionFrame(seconds, state.status, **scalars), None
    joints, (doubt, before) = subject.points(state.pose)[subject.joint_columns], subject.doubt(state, observation, seconds, before)
    modes = [mode._replace(joints=mode.joints[subject.joint_columns]) for mode in doubt.modes]
    found = MotionFrame(seconds, state.status, state.pose, joints, doubt.pose_sd, doubt.joint_sd[subject.joint_columns],
                        limb_status=doubt.limb_status, modes=modes, **scalars)
    return found, before


def joint_names(body: Body) -> list[str]:
    """Names of the landmarks that a run writes as joints."""
    return [landmark for landmark in body.landmark_names if not landmark.endswith("_fist")]


def floor_entry(motion: Motion, cameras: Sequence[Camera], person: Person) -> dict[str, dict[str, float | str]]:
    """The entry `floor` of run.toml of a run whose only camera is known by its field of view alone, so that the world does not have its
    floor at 0: exports put it there. Empty for others."""
    if len(cameras) > 1 or cameras[0].oriented:
        return {}
    sizes, height = person.sizes, person.height or AVERAGE_HEIGHT
    above = sizes.head_height + sizes.neck_gap + sizes.torso_height if isinstance(sizes, CardboxSizes) else 0.0
    level = under_feet(motion.joint_names, motion.joints, height - above)
    return {"floor": {"height_m": round(level, 4), "from": "the lowest foot over the film"}} if np.isfinite(level) else {}
