"""A recording's masks made by a segmentation script."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.io.masks.masked_recording import write_masked_recording
from shadowpuppet.io.recording import Recording, View
from shadowpuppet.silhouette.external.environment import command_for
from shadowpuppet.silhouette.external.masks import external_masks
from shadowpuppet.silhouette.external.script import Script
from shadowpuppet.video import open_frames


class Progress(Protocol):
    """Receives what is being done, as `pipeline.progress.Listener` does."""

    def begin(self, what: str, total: int | None = None) -> None:
        """A phase begins; `total`: its number of frames, if known."""
        ...

    def advance(self, frames: int) -> None:
        """`frames` frames of the phase are done."""
        ...


@dataclass
class MadeMasks:
    """What a script made of one camera's film."""

    camera: str
    frames: int = 0
    """Number of masks."""
    empty: int = 0
    """Number of those without a person."""
    seconds: float = 0.0
    """Time that they took, with starting the script."""


def make_masks(recording: Recording, script: Script, folder: Path, progress: Progress, say: Callable[[str], None] | None = None,
               *, calibrated: bool = True, replaced: bool = False) -> list[MadeMasks]:
    """Write the recording `folder` with a recording's films and the masks that a script makes of them; see `write_masked_recording`.

    say: called before the script's environment is made, which can take minutes; by default a phase of `progress`.
    Raises `SilhouetteError` if the script cannot run or its masks are wrong, and `RecordingError` if something cannot be written; then
    nothing is left.
    """
    command = command_for(script, say or progress.begin)
    made = list[MadeMasks]()

    def masks(view: View) -> Iterator[Mask]:
        source = open_frames(view.video, rate=recording.rate)
        one = MadeMasks(view.camera.name)
        made.append(one)
        progress.begin(f"masks of {one.camera}", source.count)
        begun = time.perf_counter()
        for mask in external_masks(command, script.name, Path(str(view.video)), source.size, (frame.image for frame in source)):
            yield mask
            one.frames, one.empty = one.frames + 1, one.empty + (not np.any(mask))
            one.seconds = time.perf_counter() - begun
            progress.advance(one.frames)

    made_by = {"script": script.name, "sha256": hashlib.sha256(script.path.read_bytes()).hexdigest(),
               "requirements": list(script.requirements), "requires_python": script.pythons, "film": str(recording.path)}
    write_masked_recording(recording, folder, masks, calibrated=calibrated, replaced=replaced, made_by=made_by)
    return made
