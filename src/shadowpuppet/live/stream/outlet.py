"""Frames as other programs get them, and the base class of live motion streams (outlets)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT, SOLE
from shadowpuppet.body.models import whole_sizes_from_bones
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import AnatomicalSizes
from shadowpuppet.geometry import Array
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.limbs import limb_of, limbs_of
from shadowpuppet.motion.motion import BLANK, MotionFrame


class StreamFrame(NamedTuple):
    """A frame as outlets send it; None without a trustworthy pose."""

    time: float
    """Seconds of the run."""
    status: str
    """One of `motion.STATUSES`."""
    overlap: float
    """0..1; NaN if unknown."""
    age: float
    """Seconds since the picture was captured; NaN if unknown."""
    pose: Array | None
    """Degrees of freedom (D,), rad or m."""
    positions: Array | None
    """Joints in the world, (N, 3), metres."""
    rotations: Array | None
    """Joints' rotations from the axes of the zero pose (X forward, Y left, Z up) to the world, (N, 3, 3)."""
    statuses: tuple[str, ...] | None = None
    """Of each of the N joints' limbs: `tracked` if it is vouched for, else one of `motion.limbs.DOUBTFUL`."""


@dataclass(frozen=True, eq=False)
class StreamSubject:
    """The tracked person's body, and the body's frame in the world."""

    body: Body
    T_world_base: Array
    """From the body's frame (in the zero pose X forward, Y left, Z up) to the world, (4, 4)."""
    height: float | None = None
    """Height with shoes, metres; None if unknown."""
    floor: float | None = None
    """Z of the floor in the world, metres; None if unknown, as with one camera that was not calibrated."""

    @cached_property
    def tree(self) -> BodyTree:
        """The N joints and landmarks, parents before children."""
        return BodyTree(self.body)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the N joints."""
        return tuple(node.name for node in self.tree.nodes)

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Index of each joint's parent; -1 for none."""
        return tuple(node.parent for node in self.tree.nodes)

    @cached_property
    def pelvis_height(self) -> float:
        """Height of the pelvis over the floor when standing upright, metres, by proportions."""
        sizes = whole_sizes_from_bones(AnatomicalSizes, {}, (self.height or AVERAGE_HEIGHT) - SOLE)
        return sizes.hip_drop + sizes.thigh_length + sizes.shank_length + sizes.ankle_height

    def stream_frame(self, frame: MotionFrame, age: float = np.nan) -> StreamFrame:
        """A frame of a run with the positions and rotations of all joints."""
        if frame.pose is None or frame.status in BLANK or not np.isfinite(frame.pose).all():
            return StreamFrame(frame.time, frame.status, frame.overlap, age, None, None, None)
        pose = np.asarray(frame.pose, float)
        joints = self.body.skeleton.forward(pose[None], self.T_world_base)[0][self._joints]
        rotations = joints[:, :, :3]
        positions = (rotations @ self._offsets)[..., 0] + joints[:, :, 3]
        return StreamFrame(frame.time, frame.status, frame.overlap, age, pose, positions, rotations, self._statuses(frame))

    def _statuses(self, frame: MotionFrame) -> tuple[str, ...]:
        """Status of each joint: of its limb, or of the frame if that states none of limbs."""
        limbs = dict(zip(limbs_of(self.names), frame.limb_status or ()))
        return tuple(limbs.get(limb_of(name), frame.status) for name in self.names)

    @cached_property
    def _joints(self) -> list[int]:
        return [node.joint for node in self.tree.nodes]

    @cached_property
    def _offsets(self) -> Array:
        return np.array([node.place or (0.0, 0.0, 0.0) for node in self.tree.nodes])[:, :, None]


class Outlet:
    """Base class of live motion streams, used in a `with` block; sends nothing. No method may block or raise."""

    name = ""
    """Name in messages and metrics.json."""
    where = ""
    """Where it sends to, for messages; empty if nowhere."""

    def __enter__(self) -> Self:
        """Open it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""

    def begin(self, subject: StreamSubject) -> None:
        """Start with a newly measured person; the next frames are theirs."""

    def send(self, frame: StreamFrame) -> None:
        """Send a frame."""

    def trouble(self) -> str:
        """The latest problem as a sentence, reported once; empty if there is none."""
        return ""

    def counts(self) -> Mapping[str, object]:
        """Numbers for metrics.json."""
        return {}


class Outlets(Outlet):
    """Several outlets as one. An outlet that raises is dropped; the session and the other outlets continue."""

    def __init__(self, outlets: Iterable[Outlet] = ()) -> None:
        """`outlets`: any number of outlets."""
        self._all = self._working = list(outlets)
        self._problems = list[str]()
        self._open = ExitStack()
        self._subject: StreamSubject | None = None

    @property
    def where(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The destinations of all outlets."""
        return "; ".join(outlet.where for outlet in self._all if outlet.where)

    def __enter__(self) -> Self:
        """Open all outlets."""
        with ExitStack() as opened:
            for outlet in self._all:
                opened.enter_context(outlet)
            self._open = opened.pop_all()
        return self

    def __exit__(self, *error: Any) -> None:
        """Close all outlets."""
        self._open.__exit__(*error)

    def begin(self, subject: StreamSubject) -> None:
        """Start all outlets with a newly measured person."""
        self._subject = subject
        self._each(lambda outlet: outlet.begin(subject))

    def follow(self, frame: MotionFrame, age: float = np.nan) -> None:
        """Send a run's frame, `age` seconds after its picture was captured, to all; does nothing before `begin`."""
        if self._working and self._subject is not None:
            self.send(self._subject.stream_frame(frame, age))

    def send(self, frame: StreamFrame) -> None:
        """Send a frame to all outlets."""
        self._each(lambda outlet: outlet.send(frame))

    def trouble(self) -> str:
        """The next problem of any outlet; empty if there is none."""
        self._problems += [problem for outlet in self._working if (problem := outlet.trouble())]
        return self._problems.pop(0) if self._problems else ""

    def counts(self) -> Mapping[str, object]:
        """Numbers for metrics.json of each outlet, by its name."""
        return {outlet.name: counts for outlet in self._all if (counts := outlet.counts())}

    def _each(self, call: Callable[[Outlet], None]) -> None:
        for outlet in self._working:
            try:
                call(outlet)
            except Exception as error:  # any error of an outlet: tracking continues
                self._problems.append(f"{outlet.name}: {type(error).__name__}: {error}; nothing more is given to it")
                self._working = [other for other in self._working if other is not outlet]
