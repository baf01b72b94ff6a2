"""Saves the pictures of a live session as a recording."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.video import FrameWriter, Image, write_frames

FALLBACK_RATE = 15.0
"""Nominal frames/s of the film if the camera does not state its rate; each picture has its own time anyway."""


class Recorder:
    """Writes a recording folder: the empty scenes, the tracked pictures, the cameras, the height."""

    def __init__(self, folder: Path, cameras: Sequence[Camera], rate: float) -> None:
        """`cameras`: for the saved pictures; `rate`: their frames/s. Nothing is written before the first picture."""
        self.folder, self.cameras, self.rate = folder, cameras, rate if np.isfinite(rate) else FALLBACK_RATE
        self._films: list[FrameWriter] = []
        self._open = contextlib.ExitStack()

    def __enter__(self) -> Self:
        """Return itself; nothing is open yet."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """Finish the films; after an error they keep their partial names, and can be played."""
        self._open.__exit__(kind, error, trace)

    def write(self, time: float, images: Sequence[Image | None], scenes: Sequence[list[Image]], height: float | None) -> None:
        """Add a picture (H, W, 3) of each camera at a time (s); None of one without. The first one also writes the empty scenes and the
        person's height (m), and waits until all cameras have a picture: films that begin together are in step."""
        if not self._films and any(image is None for image in images):
            return
        if not self._films:
            self._films = self._begin(scenes, height)
            self._first = time
        for film, image in zip(self._films, images):
            if image is not None:
                film.write(image, time - self._first)

    def _begin(self, scenes: Sequence[list[Image]], height: float | None) -> list[FrameWriter]:
        for name in ("video", "background") if any(scenes) else ("video",):
            (self.folder / name).mkdir(parents=True, exist_ok=True)
        write_calibration(self.folder / "calibration.toml", self.cameras)
        if height is not None:
            write_whole(self.folder / "recording.toml", f"[subject]\nheight = {height:.3f}     # metres, shoes on\n")
        for camera, scene in zip(self.cameras, scenes):
            if not scene:
                continue
            with write_frames(self.folder / "background" / f"{camera.name}.mp4", self.rate) as film:
                for image in scene:
                    film.write(image)
        return [self._open.enter_context(write_frames(self.folder / "video" / f"{camera.name}.mp4", self.rate)) for camera in self.cameras]
