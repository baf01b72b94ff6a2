"""How much is measured: all of it, or the smallest form that a test runs."""

from __future__ import annotations

from dataclasses import dataclass, field

import smallest

from shadowpuppet.synthetic import Gesture, Scene, Spec

from .chain import walking
from .multi_cases import MultiCase

WAVING = Spec(name="bench", motion=tuple(Gesture(motion=name, seconds=2.0) for name in ("wave_hands", "reach")),
              scene=Scene(empty_seconds=1.0))  # fmt: skip
"""A person waves and reaches."""


@dataclass(frozen=True)
class Extent:
    """Numbers of rounds and frames, and what is filmed."""

    rounds: int = 41
    """Rounds with one camera."""
    frames: int = 3000
    """Frames of the film of one camera."""
    rounds_multi: int = 21
    frames_multi: int = 300
    waving: Spec = WAVING
    """Recording by one camera."""
    walking: Spec = field(default_factory=walking)
    """Recording by several cameras."""
    case: MultiCase = field(default_factory=MultiCase)
    """What is timed with several cameras."""
    starts: bool = True
    """Whether the start of a process is timed, and compilation."""


FULL = Extent()
SMALLEST = Extent(rounds=1, frames=12, rounds_multi=1, frames_multi=24, waving=smallest.ONE, walking=walking((160, 120), 5),
                  case=MultiCase(points=100, particles=3, size=(160, 120)), starts=False)  # fmt: skip
