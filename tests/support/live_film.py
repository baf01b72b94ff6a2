"""Frames of a short film for live sessions: the empty scene, then a person standing and waving; and a fake clock."""

from __future__ import annotations

from pathlib import Path

import made
import numpy as np

from shadowpuppet.synthetic import Gesture, Scene, Spec, Viewpoint, synthesize

RATE, EMPTY, STAND, WAVE = 15.0, 2.0, 3.0, 2.0
"""Frame rate, and durations (s)."""
QUICK = {"tracker": {"cycles": 1, "explore": 20}, "initialization": {"hypotheses": 60, "rounds": 8, "patience": 4, "sweeps": 1}}
"""Fast settings, for tests that do not depend on the accuracy."""
FLAGS = ["--tracker.cycles", "1", "--tracker.explore", "20", "--initialization.hypotheses", "60", "--initialization.rounds", "8",
         "--initialization.patience", "4", "--initialization.sweeps", "1"]
HEIGHT, FOV = 1.75, 60.0


def frames(folder: Path, size: tuple[int, int]) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Images of the empty scene, and of the person."""
    spec = Spec(name="live", motion=(Gesture(motion="stand", seconds=STAND), Gesture(motion="wave_hands", seconds=WAVE)),
                cameras=(Viewpoint(size=size, fov_deg=FOV),), rate=RATE, scene=Scene(empty_seconds=EMPTY))
    recording = synthesize(spec, folder, np.random.default_rng(7))
    return made.images(recording / "background" / "cam.mp4"), made.images(recording / "video" / "cam.mp4")


class Clock:
    """A clock whose time advances by `wait` only."""

    def __init__(self, now: float = 100.0) -> None:
        self.now = now

    def __call__(self) -> float:
        return self.now

    def wait(self, seconds: float) -> None:
        self.now += seconds
