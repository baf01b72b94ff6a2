"""A recording's masks or keypoints made by a script."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.external.environment import command_for
from shadowpuppet.external.pipes import FilmScript
from shadowpuppet.external.script import Script
from shadowpuppet.io.keypoints.film_keypoints import write_keypoints
from shadowpuppet.io.made.made_recording import mask_film, write_made_recording, write_mask, write_masked_recording
from shadowpuppet.io.made.script_keypoints import MASKS, ScriptKeypoints
from shadowpuppet.io.recording import Recording, View
from shadowpuppet.silhouette.external.masks import external_masks
from shadowpuppet.video import Image, open_frames

Output = TypeVar("Output")


class Progress(Protocol):
    """Receives what is being done, as `pipeline.progress.Listener` does."""

    def begin(self, what: str, total: int | None = None) -> None:
        """A phase begins; `total`: its number of frames, if known."""
        ...

    def advance(self, frames: int) -> None:
        """`frames` frames of the phase are done."""
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


def make_masks(recording: Recording, script: Script, folder: Path, progress: Progress, say: Callable[[str], None] | None = None,
               *, calibrated: bool = True, replaced: bool = False) -> list[Made]:
    """Write the recording `folder` with a recording's films and the masks that a script makes of them; see `write_masked_recording`.

    say: called before the script's environment is made, which can take minutes; by default a phase of `progress`.
    Raises `SilhouetteError` if the script cannot run or its masks are wrong, and `RecordingError` if something cannot be written; then
    nothing is left.
    """
    films = _Films(recording, script, progress, say)

    def masks(view: View) -> Iterator[Mask]:
        return films.counted("masks", view, partial(external_masks, films.script_on(view)), np.any)

    write_masked_recording(recording, folder, masks, calibrated=calibrated, replaced=replaced, made_by=films.made_by)
    return films.made


def make_keypoints(recording: Recording, script: Script, folder: Path, progress: Progress, say: Callable[[str], None] | None = None,
                   *, masks: bool = False, calibrated: bool = True, replaced: bool = False) -> list[Made]:
    """Write the recording `folder` with a recording's films and the keypoints that a script makes of them, keypoints/<camera>.npz, and the
    masks too if it is asked for both, as `make_masks` does. Raises `FormatError` for what are no keypoints."""
    films = _Films(recording, script, progress, say, (MASKS,) if masks else ())

    def write(part: Path) -> None:
        for view in recording.views:
            with ExitStack() as stack:
                film = stack.enter_context(mask_film(recording, view, part)) if masks else None
                found = ScriptKeypoints(films.script_on(view))
                for _, mask in films.counted("keypoints", view, found.made, lambda made: made[0]):
                    if film is not None and mask is not None:
                        write_mask(film, mask)
            write_keypoints(part / "keypoints" / f"{view.camera.name}.npz", found.film())

    write_made_recording(recording, folder, ("keypoints", *films.options), write, calibrated=calibrated, replaced=replaced,
                         made_by=films.made_by)
    return films.made


class _Films:
    """A script run on each film of a recording; `made`: what it made of them so far."""

    def __init__(self, recording: Recording, script: Script, progress: Progress, say: Callable[[str], None] | None,
                 options: tuple[str, ...] = ()) -> None:
        """The script's environment is made if there is none yet."""
        self.recording, self.script, self.progress, self.options = recording, script, progress, options
        self.command = command_for(script, say or progress.begin)
        self.made = list[Made]()

    def script_on(self, view: View) -> FilmScript:
        """The script, to be run on a view's film."""
        size = open_frames(view.video, rate=self.recording.rate).size
        return FilmScript(self.command, self.script.name, Path(str(view.video)), size, self.options)

    def counted(self, what: str, view: View, outputs: Callable[[Iterable[Image]], Iterator[Output]],
                is_found: Callable[[Output], object]) -> Iterator[Output]:
        """What the script makes of a view's frames, counted while it is made. is_found: whether a person is in one."""
        source = open_frames(view.video, rate=self.recording.rate)
        one = Made(view.camera.name)
        self.made.append(one)
        self.progress.begin(f"{what} of {one.camera}", source.count)
        begun = time.perf_counter()
        for output in outputs(frame.image for frame in source):
            yield output
            one.frames, one.empty = one.frames + 1, one.empty + (not is_found(output))
            one.seconds = time.perf_counter() - begun
            self.progress.advance(one.frames)

    @property
    def made_by(self) -> dict[str, Any]:
        """What makes it, for made_by.toml."""
        return {"script": self.script.name, "sha256": hashlib.sha256(self.script.path.read_bytes()).hexdigest(),
                "requirements": list(self.script.requirements), "requires_python": self.script.pythons, "film": str(self.recording.path)}
