"""A small synthetic recording for tests of whole runs, and functions to change copies of it."""

from __future__ import annotations

import shutil
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, Viewpoint, synthesize
from shadowpuppet.video import open_frames, write_frames

SIZE = (160, 120)
RATE, FRAMES = 8.0, 29
SPEC = Spec(name="tiny", motion=(Gesture(motion="wave_hands", seconds=2),), cameras=(Viewpoint(size=SIZE),), rate=RATE,
            scene=Scene(empty_seconds=1))

RING = Spec(name="tiny_ring", motion=(Gesture(motion="walk", seconds=2),), rate=RATE, scene=Scene(empty_seconds=1),
            ring=Ring(count=4, radius=3.6, fov_deg=42, size=SIZE))  # fmt: skip
"""A person walks in front of four cameras, 29 frames; with training motion."""


def make(folder: Path) -> Path:
    """Render a recording of `FRAMES` frames, with background, masks, references and ground truth."""
    return synthesize(SPEC, folder, np.random.default_rng(7))


def copied(recording: Path, to: Path, without: Iterable[str] = ()) -> Path:
    """A copy without some of its files or folders, to be changed."""
    shutil.copytree(recording, to)
    for name in without:
        path = to / name
        shutil.rmtree(path) if path.is_dir() else path.unlink()
    return to


def images(film: Path) -> list[np.ndarray]:
    return [frame.image for frame in open_frames(film)]


def write_film(path: Path, frames: Iterable[np.ndarray], rate: float = RATE, lossless: bool = False) -> None:
    path.unlink(missing_ok=True)
    with write_frames(path, rate, lossless=lossless) as film:
        for frame in frames:
            film.write(frame)


def replace_text(path: Path, old: str, new: str) -> None:
    text = path.read_text()
    assert old in text, f"{old!r} is not in {path}"
    path.write_text(text.replace(old, new))
