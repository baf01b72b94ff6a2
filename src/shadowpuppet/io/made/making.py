"""A recording's masks or keypoints made by a script."""

from __future__ import annotations

import hashlib
import time
from contextlib import closing, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from shadowpuppet.external.environment import command_for
from shadowpuppet.external.pipes import FilmScript
from shadowpuppet.external.script import Script
from shadowpuppet.io.keypoints.film_keypoints import write_keypoints
from shadowpuppet.io.made.made_recording import write_made_recording
from shadowpuppet.io.made.script_keypoints import ScriptKeypoints
from shadowpuppet.io.recording import Recording
from shadowpuppet.silhouette.external.masks import external_masks
from shadowpuppet.video import FrameSource, open_frames, write_frames
from shadowpuppet.video.frames import ASSUMED_RATE


class Progress(Protocol):
    """Receives what is being done, as `pipeline.progress.Listener` does."""

    def begin(self, what: str, total: int | None = None) -> None:
        """A phase begins; `total`: its number of frames, if known."""
        ...

    def advance(self, frames: int) -> None:
        """`frames` frames of the phase are done."""
        ...

    def note(self, message: str) -> None:
        """Something that takes minutes begins."""
        ...


@dataclass
class Made:
    """What a script made of one camera's film."""

    camera: str
    frames: int = 0
    empty: int = 0
    """Number of those without a person."""
    seconds: float = 0.0
    """Time that they took, with starting the script."""


def make(kinds: tuple[str, ...], recording: Recording, script: Script, folder: Path, progress: Progress, *, calibrated: bool = True,
         replaced: bool = False) -> list[Made]:
    """Write the recording `folder` with a recording's films and what a script makes of them; see `write_made_recording`.

    kinds: masks; keypoints; or keypoints and masks, which the script makes in one pass. Raises `SilhouetteError` if the script cannot run
    or its masks are wrong, `FormatError` if its keypoints are, and `RecordingError` if something cannot be written; then nothing is left.
    """
    command, made = command_for(script, progress.note), list[Made]()

    def write(part: Path) -> None:
        for view in recording.views:
            source = open_frames(view.video, rate=recording.rate)
            made.append(Made(view.camera.name))
            progress.begin(f"{kinds[0]} of {view.camera.name}", source.count)
            run = FilmScript(command, script.name, Path(str(view.video)), source.size, kinds[1:])
            _make_of_film(kinds, run, source, part, made[-1], progress)

    made_by = {"script": script.name, "sha256": hashlib.sha256(script.path.read_bytes()).hexdigest(),
               "requirements": list(script.requirements), "requires_python": script.pythons, "film": str(recording.path)}
    write_made_recording(kinds, recording, folder, write, calibrated=calibrated, replaced=replaced, made_by=made_by)
    return made


def _make_of_film(kinds: tuple[str, ...], script: FilmScript, source: FrameSource, folder: Path, made: Made, progress: Progress) -> None:
    """Write what a script makes of one film into the kinds' folders, and count it."""
    begun, images = time.perf_counter(), (frame.image for frame in source)
    keypoints = ScriptKeypoints(script) if "keypoints" in kinds else None
    outputs = keypoints.made(images) if keypoints else ((bool(mask.any()), mask) for mask in external_masks(script, images))
    rate = source.rate if np.isfinite(source.rate) else ASSUMED_RATE
    film = write_frames(folder / "masks" / f"{made.camera}.mkv", rate, lossless=True) if "masks" in kinds else None
    with closing(outputs), film or nullcontext():
        for is_person, mask in outputs:
            if film is not None and mask is not None:
                film.write(np.multiply(mask, 255, dtype=np.uint8))
            made.frames, made.empty = made.frames + 1, made.empty + (not is_person)
            made.seconds = time.perf_counter() - begun
            progress.advance(made.frames)
    if keypoints:
        write_keypoints(folder / "keypoints" / f"{made.camera}.npz", keypoints.film())
