"""Motions of a spec, as data."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from shadowpuppet.settings import STRICT
from shadowpuppet.synthetic.movement.paths import PathName

MotionName = Literal[
    "stand", "wave_hands", "bend_aside", "bow_forward", "twist", "reach", "forearms_up", "overhead", "random",
    "walk", "jog", "box", "lift", "squat", "sit", "march", "jump", "turn_around", "random_body", "mocap", "sit_down", "kneel",
    "shake_hands",
]  # fmt: skip
SHORTEST = 2.0
"""Least length of a gesture, seconds: it begins and ends at rest."""


@dataclass(frozen=True, config=STRICT, kw_only=True)
class Gesture:
    """A motion and its length."""

    motion: MotionName
    """Name: a gesture of arms and trunk, a whole-body action, `walk`, `jog`, or `mocap` from a file."""
    seconds: Annotated[float, Field(ge=SHORTEST, le=3600)] = 4.0
    """Length, seconds; at most the file's."""
    speed: Annotated[float, Field(ge=0.4, le=5)] | None = None
    """Speed of walk (0.4 to 2.0) and jog (1.6 to 5), m/s; by default a comfortable one."""
    path: PathName = "circle"
    """Path of walk and jog: a circle or ellipse to the left, a line there and back, or on the spot as on a treadmill."""
    size: Annotated[float, Field(ge=0.5, le=20)] = 1.2
    """Radius of the circle, half the longer axis of the ellipse, length of the line, metres."""
    file: str | None = None
    """Motion capture to play (`mocap`): a .amc file; its skeleton, a .asf file, is in the same folder."""
    start: Annotated[float, Field(ge=0)] = 0.0
    """Seconds of the file to skip."""
    file_rate: Annotated[float, Field(gt=0, le=1000)] = 120.0
    """Frames per second of the file."""

    def __post_init__(self) -> None:
        """Check that the speed fits the gait, and that motion capture, and only that, has a file."""
        low, high = {"walk": (0.4, 2.0), "jog": (1.6, 5.0)}.get(self.motion, (0.0, 5.0))
        if self.speed is not None and not low <= self.speed <= high:
            raise ValueError(f"speed: found {self.speed:g}, expected {low:g} to {high:g} for {self.motion}")
        if (self.motion == "mocap") != (self.file is not None):
            raise ValueError("file: needed by the motion mocap, and only by it")
