"""A made recording, where it may be made: nothing that is not a made recording is touched unasked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import RecordingError, SettingsError
from shadowpuppet.io.recording import POSTURES, Recording, read_recording
from shadowpuppet.pipeline.track import Listener
from shadowpuppet.synthetic import Spec, synthesize
from shadowpuppet.synthetic.recording import perform
from shadowpuppet.synthetic.spec_file import HEAD, SPEC_FILE, read_spec


def make_recording(spec: Spec, folder: str | Path, listener: Listener | None = None, force: bool = False) -> Recording:
    """Make the recording of `spec`, with its seed, in `folder`, and read it back.

    A folder that holds a made recording is made anew; another one that is not empty only with `force`, and then only files of
    the same names are replaced. Raises `RecordingError` otherwise, or where something cannot be written, and a `ShadowPuppetError`
    where a file of motion cannot be used.
    """
    folder, listener = Path(folder), listener or Listener()
    for gesture in (*spec.motion, *(spec.training or ()), *(other.motion for other in spec.scene.bystanders)):
        if gesture.file is not None:  # one that cannot be used is told before anything is removed
            perform(replace(spec, motion=(gesture,)), np.random.default_rng(0))
    clear(folder, force)
    listener.begin("drawing")
    synthesize(spec, folder, tell=Drawing(listener))
    return read_recording(folder)


def clear(folder: Path, force: bool = False) -> None:
    """Remove what an earlier made recording wrote into `folder`, and nothing else."""
    if not folder.exists() or (folder.is_dir() and not any(folder.iterdir())):
        return
    if not folder.is_dir():
        raise RecordingError(f"{folder}: found a file, expected a folder to be made")
    old = _made(folder / SPEC_FILE)
    if old is None and not force:
        raise RecordingError(
            f"{folder}: found files in it that are no made recording; choose another folder, or write among them with --force"
        )
    for path in files_of(old, folder) if old is not None else ():
        try:
            path.unlink(missing_ok=True)
        except OSError as error:
            raise RecordingError(f"{path}: cannot be replaced ({(error.strerror or str(error)).lower()})") from None


def files_of(spec: Spec, folder: Path) -> list[Path]:
    """All files that a recording of `spec` can have in `folder`, its films also as they are while they grow."""
    ends = {"video": "mp4", "background": "mp4", "masks": "mkv", "people": "mkv"}
    films = [folder / kind / f"{view.name}{part}.{end}" for kind, end in ends.items() for view in spec.views() for part in ("", ".part")]
    postures = [folder / "references" / f"{name}{end}" for name in POSTURES for end in (".png", "_mask.png", ".csv", ".trc")]
    tables = [folder / f"{name}.{end}" for name in ("truth", "training") for end in ("csv", "trc")]
    return [*films, *postures, *tables, *(folder / name for name in ("calibration.toml", "recording.toml", SPEC_FILE))]


def _made(path: Path) -> Spec | None:
    """The spec that a recording was made of; None where it is no made one: a spec that a person wrote has another first line."""
    try:
        with path.open(encoding="utf-8") as file:
            return read_spec(path) if file.readline() == HEAD else None
    except (OSError, UnicodeDecodeError, SettingsError):
        return None


class Drawing:
    """Tells a listener of pictures that are made."""

    def __init__(self, listener: Listener) -> None:
        """`listener`: is told what begins, and how far it is."""
        self.listener, self.total = listener, 0

    def __call__(self, done: int, total: int) -> None:
        """`done` of `total` pictures are made."""
        if total != self.total:
            self.total = total
            self.listener.begin("drawing", total)
        self.listener.advance(done)
