"""Writes recordings whose masks or keypoints another program made: films linked, what was made written."""

from __future__ import annotations

import os
import shutil
import tempfile
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from shadowpuppet.errors import RecordingError, reason
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.keypoints.keypoint_files import SUFFIXES, KeypointSource
from shadowpuppet.io.recording import Recording, read_recording
from shadowpuppet.video import FILM_SUFFIXES, IMAGE_SUFFIXES, camera_number

MADE_BY = "made_by.toml"
"""File beside masks or keypoints that says what made them."""
OF_RECORDINGS = ("video", "recording.toml", "calibration.toml")
"""What is in a recording's folder, unlike in a folder of pictures."""
ENDINGS = {"video": FILM_SUFFIXES, "background": FILM_SUFFIXES + IMAGE_SUFFIXES, "masks": FILM_SUFFIXES + IMAGE_SUFFIXES,
           "keypoints": SUFFIXES}
"""Endings of the files that are found by their names, by folder."""


def readable_recording(source: str | Path, calibration: Path | None = None) -> tuple[Recording, bool]:
    """A recording or film for which something is to be made, and whether it is calibrated; a single film need not be.

    Raises `RecordingError`, `CalibrationError` or `VideoError`.
    """
    try:
        found = read_recording(source, calibration=calibration)
        calibrated = True
    except RecordingError as error:
        try:
            if calibration is not None:
                raise error
            found, calibrated = read_recording(source, fov=1.0), False  # the field of view has no effect on either
        except RecordingError:
            raise error from None
    for view in found.views:
        if camera_number(view.video) is not None:
            raise RecordingError(f"{source}: found a live camera, expected a film or a folder of pictures")
    return found, calibrated


def write_made_recording(kinds: Sequence[str], recording: Recording, folder: Path, write: Callable[[Path], None], *,
                         calibrated: bool = True, replaced: bool = False, made_by: dict[str, Any] | None = None) -> None:
    """Write a recording folder with a recording's films (linked) and what `write` makes of them, completely or not at all.

    Into the recording's own folder only the `kinds`' folders are written, some of masks/ and keypoints/. write: writes into these in a
    folder that it is given, where they are empty. calibrated: whether to write the cameras. replaced: whether what is there may be
    replaced. made_by: plain values for made_by.toml in each of them. Raises `RecordingError` if something is in the way or cannot be
    written, and the errors of `write`.
    """
    import tomli_w

    own = check_room(kinds, folder, recording, replaced)
    try:
        folder.absolute().parent.mkdir(parents=True, exist_ok=True)
        part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder if own else folder.absolute().parent))
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be made ({reason(error)})") from None
    try:
        for kind in kinds:
            (part / kind).mkdir()
        write(part)
        for kind in kinds:
            write_whole(part / kind / MADE_BY, tomli_w.dumps(made_by or {}))
        if not own:
            _write_rest(recording, part, calibrated, kinds)
        _put_in_place(part, folder, own, kinds)
    except OSError as error:
        raise RecordingError(f"{folder}: cannot be written ({reason(error)})") from None
    finally:
        shutil.rmtree(part, ignore_errors=True)


def check_room(kinds: Sequence[str], folder: Path, recording: Recording, replaced: bool) -> bool:
    """Whether `folder` is the recording's own. Raises `RecordingError` if something is in the way."""
    if folder.is_dir() and folder.resolve() == recording.path.resolve() and any((folder / name).exists() for name in OF_RECORDINGS):
        there = [kind for kind in kinds if (folder / kind).exists()]
        if there and not replaced:
            raise RecordingError(f"{folder / there[0]}: found {there[0]} there already; choose another folder with -o, or replace them "
                                 "with --force")
        return True
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise RecordingError(f"{folder}: found other files there, expected a new folder, or the recording's own")
    return False


def _write_rest(recording: Recording, folder: Path, calibrated: bool, made: Sequence[str]) -> None:
    """Link films, empty scenes, masks and keypoints but those made, truth, training, references; write calibration and recording.toml."""
    import tomli_w

    notes: dict[str, Any] = {key: value for key, value in (("rate", recording.rate), ("duration", recording.duration)) if value is not None}
    subject = {"height": recording.subject.height, "distance": recording.subject.distance}
    notes["subject"] = {key: value for key, value in subject.items() if value is not None}
    notes["start"] = {view.camera.name: view.start for view in recording.views if view.start}
    notes |= {kind: _link_views(recording, folder, kind) for kind in ENDINGS if kind not in made}
    for name, source in (("truth", recording.truth), ("training", recording.training)):
        if source is not None:
            link(source, folder / f"{name}{source.suffix}")
    if recording.references:
        link(recording.path / "references", folder / "references")
    if calibrated:
        write_calibration(folder / "calibration.toml", [view.camera for view in recording.views])
    if any(notes.values()):
        write_whole(folder / "recording.toml", tomli_w.dumps({key: value for key, value in notes.items() if value}))


def _link_views(recording: Recording, folder: Path, kind: str) -> dict[str, Any]:
    """Link every view's film, empty scene, masks or keypoints; what recording.toml has to say of them."""
    notes = dict[str, Any]()
    for view in recording.views:
        found = getattr(view, kind)
        if isinstance(found, KeypointSource):
            notes |= {} if found.model is None else {"model": found.model}
            found = found.path
        if found is not None:
            source, name = Path(str(found)), view.camera.name
            if source.is_dir() or source.suffix.lower() in ENDINGS[kind]:
                link(source, folder / kind / (name if source.is_dir() else name + source.suffix))
            else:  # a name that only recording.toml can give
                notes[name] = str(source.resolve())
    return notes


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


def _put_in_place(part: Path, folder: Path, own: bool, kinds: Sequence[str]) -> None:
    """Give what is complete its name; what it replaces is removed only then."""
    if not own:
        part.chmod(0o755)  # temporary folders are the user's alone
        if folder.exists():
            folder.rmdir()
        os.replace(part, folder)
        return
    for kind in kinds:
        if (folder / kind).exists():
            os.replace(folder / kind, part / f"old {kind}")
        os.replace(part / kind, folder / kind)
