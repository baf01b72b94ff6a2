"""What other programs get of a tracked person, and an outlet that gives nothing away."""

from __future__ import annotations

from collections.abc import Iterable
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
from shadowpuppet.motion.motion import BLANK, MotionFrame


class Told(NamedTuple):
    """A frame as outlets get it; None where there is no honest value."""

    time: float
    """Seconds of the run."""
    status: str
    """One of `motion.STATUSES`."""
    overlap: float
    """0..1; not a number where it is not known."""
    age: float
    """Seconds since the picture was captured; not a number where that is not known."""
    pose: Array | None
    """Degrees of freedom (D,), rad or m."""
    places: Array | None
    """Of the subject's joints in the world, of shape (N, 3), metres."""
    turns: Array | None
    """Their rotations from the axes of who stands at zero (X forward, Y left, Z up) to the world, of shape (N, 3, 3)."""


@dataclass(frozen=True, eq=False)
class Subject:
    """Who is tracked, and where their frame stands."""

    body: Body
    T_world_base: Array
    """The body's frame in the world, (4, 4): X forward of who stands at zero, Y to their left, Z up."""
    height: float | None = None
    """Metres, shoes on."""
    floor: float | None = None
    """Of the world: Z of the floor; None where that is not known, as with one camera that was not calibrated."""

    @cached_property
    def tree(self) -> BodyTree:
        """Joints and landmarks, parents before children, N of them."""
        return BodyTree(self.body)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Of the joints, N of them."""
        return tuple(node.name for node in self.tree.nodes)

    @cached_property
    def parents(self) -> tuple[int, ...]:
        """Index of the joint above each; -1: none."""
        return tuple(node.parent for node in self.tree.nodes)

    @cached_property
    def pelvis_height(self) -> float:
        """Metres from the floor to the pelvis of who stands upright: by proportions."""
        sizes = whole_sizes_from_bones(AnatomicalSizes, {}, (self.height or AVERAGE_HEIGHT) - SOLE)
        return sizes.hip_drop + sizes.thigh_length + sizes.shank_length + sizes.ankle_height

    def told(self, frame: MotionFrame, age: float = np.nan) -> Told:
        """A frame, with the places and rotations of all joints."""
        if frame.pose is None or frame.status in BLANK or not np.isfinite(frame.pose).all():
            return Told(frame.time, frame.status, frame.overlap, age, None, None, None)
        pose = np.asarray(frame.pose, float)
        joints = self.body.skeleton.forward(pose[None], self.T_world_base)[0][self._joints]
        turns = joints[:, :, :3]
        return Told(frame.time, frame.status, frame.overlap, age, pose, (turns @ self._offsets)[..., 0] + joints[:, :, 3], turns)

    @cached_property
    def _joints(self) -> list[int]:
        return [node.joint for node in self.tree.nodes]

    @cached_property
    def _offsets(self) -> Array:
        return np.array([node.place or (0.0, 0.0, 0.0) for node in self.tree.nodes])[:, :, None]


class Outlet:
    """Gives nothing away: derive from it. Used in a `with` block; nothing in it blocks or raises."""

    name = ""
    """What it is called where it is told of."""
    where = ""
    """Where it leads, in words; empty where nowhere."""

    def __enter__(self) -> Self:
        """Open it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""

    def begin(self, subject: Subject) -> None:
        """Whose frames follow: somebody was measured, perhaps anew."""

    def send(self, frame: Told) -> None:
        """A frame of the subject."""

    def trouble(self) -> str:
        """What is wrong, in a sentence, once; empty where nothing is, or nothing new."""
        return ""

    def counts(self) -> dict[str, Any]:
        """What was given away, as metrics.json has it."""
        return {}


class Outlets(Outlet):
    """Several at once. One that fails, by a mistake of its own, is given up; the session and the others go on."""

    def __init__(self, outlets: Iterable[Outlet] = ()) -> None:
        """Any number of them."""
        self._all = self._good = list(outlets)
        self._said = list[str]()
        self._open = ExitStack()
        self._subject: Subject | None = None

    @property
    def where(self) -> str:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Where they lead."""
        return "; ".join(outlet.where for outlet in self._all if outlet.where)

    def __enter__(self) -> Self:
        """Open all."""
        with ExitStack() as opened:
            for outlet in self._all:
                opened.enter_context(outlet)
            self._open = opened.pop_all()
        return self

    def __exit__(self, *error: Any) -> None:
        """Close all."""
        self._open.__exit__(*error)

    def begin(self, subject: Subject) -> None:
        """Tell all."""
        self._subject = subject
        self._each(lambda outlet: outlet.begin(subject))

    def follow(self, frame: MotionFrame, age: float = np.nan) -> None:
        """Give a frame of a run to all; nothing before it is known whose it is."""
        if self._good and self._subject is not None:
            told = self._subject.told(frame, age)
            self._each(lambda outlet: outlet.send(told))

    def send(self, frame: Told) -> None:
        """Give it to all."""
        self._each(lambda outlet: outlet.send(frame))

    def trouble(self) -> str:
        """The next thing that is wrong with any."""
        self._said += [said for outlet in self._good if (said := outlet.trouble())]
        return self._said.pop(0) if self._said else ""

    def counts(self) -> dict[str, Any]:
        """Of each, by its name."""
        return {outlet.name: counts for outlet in self._all if (counts := outlet.counts())}

    def _each(self, what: Any) -> None:
        for outlet in self._good:
            try:
                what(outlet)
            except Exception as error:  # whatever it is, tracking goes on
                self._said.append(f"{outlet.name}: {type(error).__name__}: {error}; nothing more is given to it")
                self._good = [other for other in self._good if other is not outlet]
