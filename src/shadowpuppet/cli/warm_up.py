"""Compiles all kernels of tracking, into Numba's cache: `doctor --warm`, for installers and containers."""

from __future__ import annotations

import tempfile
import warnings
from pathlib import Path

from shadowpuppet.synthetic import Gesture, Ring, Scene, Spec, Viewpoint

ONE_CAMERA = Spec(name="warm_one", motion=(Gesture(motion="wave_hands", seconds=2.0),), cameras=(Viewpoint(size=(160, 120)),), rate=8,
                  scene=Scene(empty_seconds=1))  # fmt: skip
FOUR_CAMERAS = Spec(name="warm_four", motion=(Gesture(motion="walk", seconds=2.0),), rate=10, scene=Scene(empty_seconds=1),
                    ring=Ring(count=4, radius=3.6, fov_deg=42, size=(160, 120)))  # fmt: skip


def warm_up() -> None:
    """Track two tiny made recordings, one of one camera and one of four, in a temporary folder; the compiled code is kept."""
    from shadowpuppet.pipeline.options import make_options
    from shadowpuppet.pipeline.track import track_recording
    from shadowpuppet.synthetic import synthesize

    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # such short films are warned of
        for spec in (ONE_CAMERA, FOUR_CAMERAS):
            recording = Path(folder, spec.name)
            synthesize(spec, recording)
            track_recording(recording, Path(folder, f"run-{spec.name}"), make_options({"anyway": True}))
