"""The pictures of a session, kept as a recording, where that was asked for."""

from __future__ import annotations

import contextlib
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.video import FrameWriter, Image, write_frames

FALLBACK_RATE = 15.0
"""Frames/s that the film is said to have, where the camera tells none; its pictures have their own times."""


class Recorder:
    """Writes the recording layout: the empty scene, the pictures that were tracked, the camera, the height."""

    def __init__(self, folder: Path, camera: Camera, rate: float) -> None:
        """`camera`: for the pictures as they are kept. Nothing is written before the first of them."""
        self.folder, self.camera, self.rate = folder, camera, rate if np.isfinite(rate) else FALLBACK_RATE
        self._film: FrameWriter | None = None
        self._open = contextlib.ExitStack()

    def __enter__(self) -> Self:
        """Use it in a `with` block."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Finish the film; after an error what there is can be played from its partial name."""
        self._open.__exit__(kind, error, trace)

    def write(self, time: float, image: Image, scene: list[Image], height: float) -> None:
        """Add a picture (H, W, 3) at its time (s); with the first one come the empty scene and the person's height (m)."""
        if self._film is None:
            self._film = self._begin(scene, height)
            self._first = time
        self._film.write(image, time - self._first)

    def _begin(self, scene: list[Image], height: float) -> FrameWriter:
        for name in ("video", "background"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        write_calibration(self.folder / "calibration.toml", [self.camera])
        write_whole(self.folder / "recording.toml", f"[subject]\nheight = {height:.3f}     # metres, shoes on\n")
        with write_frames(self.folder / "background" / f"{self.camera.name}.mp4", self.rate) as film:
            for image in scene:
                film.write(image)
        return self._open.enter_context(write_frames(self.folder / "video" / f"{self.camera.name}.mp4", self.rate))
