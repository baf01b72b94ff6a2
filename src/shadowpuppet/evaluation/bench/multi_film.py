"""A recording of several cameras for the whole chain: some pictures of somebody who walks, to and fro until the films are long enough."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import chain, cycle, islice
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.synthetic import Gesture, Mannequin, Ring, Scene, Spec
from shadowpuppet.video import write_frames

STEP = 72
"""The picture from which on it goes to and fro: in the middle of a stride."""


def ring_spec(size: tuple[int, int] = (640, 480), cameras: int = 7) -> Spec:
    """Who is seen by whom."""
    ring = Ring(count=cameras, radius=4.5, jitter=0.5, size=size, distortion=(-0.09, 0.05, 0.0, 0.0))
    walk = Gesture(motion="walk", seconds=2.5)
    return Spec(name="bench", body=Mannequin(), motion=(walk,), ring=ring, scene=Scene(clothing=8, room=3), rate=60)


def ring_recording(folder: Path, frames: int, spec: Spec | None = None, drawn: int = 12) -> Path:
    """A recording of so many frames in `folder`, of which `drawn` are different, with training motion; no masks, no truth."""
    from shadowpuppet.synthetic.recording import perform, write_truth
    from shadowpuppet.synthetic.scene_renderer import SceneRenderer

    spec = spec or ring_spec()
    for kind in ("video", "background"):
        (folder / kind).mkdir(parents=True, exist_ok=True)
    for_motion, for_training, *noises = np.random.default_rng(1).spawn(2 + len(spec.views()))
    _, figure = perform(spec, for_motion)
    shown = figure._replace(**{name: part[STEP : STEP + drawn] for name, part in figure._asdict().items()})
    for view, noise in zip(spec.views(), noises):
        studio = SceneRenderer(spec, view.camera(), noise)
        empty = [studio.empty(index, 6) for index in range(6)]
        _write(folder / "background" / f"{view.name}.mp4", empty, len(empty), spec.rate)
        _write(folder / "video" / f"{view.name}.mp4", [picture.image for picture in studio.film(shown)], frames, spec.rate)
    write_calibration(folder / "calibration.toml", [view.camera() for view in spec.views()])
    again, rehearsal = perform(spec, for_training)
    write_truth(folder / "training", again, rehearsal.joints, spec.rate)
    (folder / "recording.toml").write_text(f"[subject]\nheight = {spec.body.stature:.3f}\n", encoding="utf-8")
    return folder


def _write(path: Path, images: Sequence[NDArray[np.uint8]], count: int, rate: float) -> None:
    """A film of so many frames: the images, to and fro."""
    with write_frames(path, rate) as film:
        for image in islice(cycle(chain(images, images[::-1])), count):
            film.write(image)
