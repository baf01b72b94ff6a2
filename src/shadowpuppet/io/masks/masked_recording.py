"""Writes recordings whose silhouettes another program made: films linked, masks written."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import RecordingError, reason
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.recording import Recording, View, read_recording
from shadowpuppet.video import FILM_SUFFIXES, IMAGE_SUFFIXES, camera_number, open_frames, write_frames
from shadowpuppet.video.frames import ASSUMED_RATE

MADE_BY = "made_by.toml"
"""File beside masks that says what made them."""
OF_RECORDINGS = ("video", "recording.toml", "calibration.toml")
"""What is in a recording's folder, unlike in a folder of pictures."""


def readable_recording(source: str | Path, calibration: Path | None = None) -> tuple[Recording, bool]:
    """A recording or film for which masks are to be made, and whether it is calibrated; a single film need not be.

    Raises `RecordingError`, `CalibrationError` or `VideoError`.
    """
    try:
        found = read_recording(source, calibration=calibration)
        calibrated = True
    except RecordingError as error:
        try:
            if calibration is not None:
                raise error
            found, calibrated = read_recording(source, fov=1.0), False  # the field of view has no effect on masks
        except RecordingError:
            raise error from None
    for view in found.views:
        if camera_number(view.video) is not None:
            raise RecordingError(f"{source}: found a live camera, expected a film or a folder of pictures")
    return found, calibrated


def write_masked_recording(recording: Recording, folder: Path, masks: Callable[[View], Iterable[Mask]], *, calibrated: bool = True,
                           replaced: bool = False, made_by: dict[str, Any] | None = None) -> None:
    """Write a recording folder with a recording's films (linked) and the masks that `masks` makes of each view, completely or not at all.

    Into the recording's own folder only masks/ is written. masks: masks (H, W) of every frame of the view's film. calibrated: whether to
    write the cameras. replaced: whether masks that are there may be replaced. made_by: plain values for masks/made_by.toml. Raises
    `RecordingError` if something is in the way or cannot be written, and the errors of `masks`.
    """
    own = check_room(folder, recording, replaced)
    try:
        folder.absolute().parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder if own else folder.absolute().parent))
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be made ({reason(error)})") from None
    try:
        _write_masks(recording, part / "masks", masks, made_by or {})
        if not own:
            _write_rest(recording, part, calibrated)
        _put_in_place(part, folder, own)
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be written ({reason(error)})") from None
    finally:
        shutil.rmtree(part, ignore_errors=True)


def check_room(folder: Path, recording: Recording, replaced: bool) -> bool:
    """Whether `folder` is the recording's own. Raises `RecordingError` if something is in the way."""
    there = folder / "masks"
    if folder.is_dir() and folder.resolve() == recording.path.resolve() and any((folder / name).exists() for name in OF_RECORDINGS):
        if there.exists() and not replaced:
            raise RecordingError(f"{there}: found masks there already; choose another folder with -o, or replace them with --force")
        return True
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise RecordingError(f"{folder}: found other files there, expected a new folder, or the recording's own")
    return False


def _write_masks(recording: Recording, folder: Path, masks: Callable[[View], Iterable[Mask]], made_by: dict[str, Any]) -> None:
    import tomli_w

    folder.mkdir()
    for view in recording.views:
        rate = open_frames(view.video, rate=recording.rate).rate
        with write_frames(folder / f"{view.camera.name}.mkv", rate if np.isfinite(rate) else ASSUMED_RATE, lossless=True) as film:
            for mask in masks(view):
                film.write(np.multiply(mask, 255, dtype=np.uint8))
    write_whole(folder / MADE_BY, tomli_w.dumps(made_by))


def _write_rest(recording: Recording, folder: Path, calibrated: bool) -> None:
    """Link films, empty scenes, truth, training and references; write calibration and recording.toml."""
    import tomli_w

    notes: dict[str, Any] = {key: value for key, value in (("rate", recording.rate), ("duration", recording.duration)) if value is not None}
    subject = {"height": recording.subject.height, "distance": recording.subject.distance}
    notes["subject"] = {key: value for key, value in subject.items() if value is not None}
    notes["start"] = {view.camera.name: view.start for view in recording.views if view.start}
    for kind, known in (("video", FILM_SUFFIXES), ("background", FILM_SUFFIXES + IMAGE_SUFFIXES)):
        sources = {view.camera.name: Path(str(getattr(view, kind))) for view in recording.views if getattr(view, kind) is not None}
        notes[kind] = {}
        for name, source in sources.items():
            if source.is_dir() or source.suffix.lower() in known:
                link(source, folder / kind / (name if source.is_dir() else name + source.suffix))
            else:  # a name that only recording.toml can give
                notes[kind][name] = str(source.resolve())
    for name, source in (("truth", recording.truth), ("training", recording.training)):
        if source is not None:
            link(source, folder / f"{name}{source.suffix}")
    if recording.references:
        link(recording.path / "references", folder / "references")
    if calibrated:
        write_calibration(folder / "calibration.toml", [view.camera for view in recording.views])
    if any(notes.values()):
        write_whole(folder / "recording.toml", tomli_w.dumps({key: value for key, value in notes.items() if value}))


def link(source: Path, place: Path) -> None:
    """Link a file or folder to a new place; copy it where links are not possible."""
    place.parent.mkdir(parents=True, exist_ok=True)
    try:
        os.symlink(source.resolve(), place, target_is_directory=source.is_dir())
    except (OSError, NotImplementedError):
        if source.is_dir():
            shutil.copytree(source, place)
        else:
            shutil.copy2(source, place)


def _put_in_place(part: Path, folder: Path, own: bool) -> None:
    """Give what is complete its name; masks that it replaces are removed only then."""
    if not own:
        part.chmod(0o755)  # temporary folders are the user's alone
        if folder.exists():
            folder.rmdir()
        os.replace(part, folder)
        return
    if (folder / "masks").exists():
        os.replace(folder / "masks", part / "old")
    os.replace(part / "masks", folder / "masks")
