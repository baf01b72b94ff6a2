"""Reads trials of HumanEva-I and II as recordings, with calibration, synchronisation and motion capture.

L. Sigal, A. O. Balan, M. J. Black: HumanEva, International Journal of Computer Vision 87, 2010. The data needs a licence.

Frames of a trial are counted from 1, as in the owners' programs; frame 1 is the first that all cameras and the motion capture have.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from papers.humaneva.cal import read_cal
from shadowpuppet.errors import RecordingError, choices, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.files.text import read_text, write_whole
from shadowpuppet.io.motion.c3d import read_c3d
from shadowpuppet.io.motion.joint_names import renamed
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.io.recording import Recording, View
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.video import open_frames

RATE = 60.0
"""Frames/s of all films."""
FIRST_VALID = 6
"""First valid frame of the films."""
PARTS = {
    "S1": {"Walking": (590, 1203), "Jog": (367, 740), "ThrowCatch": (473, 945), "Gestures": (395, 801), "Box": (385, 789)},
    "S2": {"Walking": (438, 876), "Jog": (398, 795), "ThrowCatch": (550, 1128), "Gestures": (500, 901), "Box": (382, 734)},
    "S3": {"Walking": (448, 939), "Jog": (401, 842), "ThrowCatch": (493, 1027), "Gestures": (533, 1102), "Box": (512, 1021)},
}
"""First trials of HumanEva-I: last frames of the validation part, which begins at `FIRST_VALID`, and of the training part, which follows it
(the owners' partition, as in VideoPose3D). Ni 2008 tracks S2's validation frames: 433 of walking, 393 of jogging, 377 of boxing."""
HEAD = "# A trial of HumanEva; made by `python -m papers.humaneva`. The films stay where they are.\n"
"""First line of recording.toml; marks folders that may be overwritten."""
WRITTEN = ("recording.toml", "calibration.toml", "truth.csv", "training.csv")

Part = Literal["validation", "training", "all"]


class Sync(NamedTuple):
    """An .ofs file: image `image` of a film matches frame `mocap` of the motion capture (from 1); `scale`: mocap frames per image."""

    image: float
    mocap: float
    scale: float


@dataclass(frozen=True, eq=False)
class Timing:
    """Position of frame 1 of a trial in the films and the motion capture."""

    images: dict[str, int]
    """Image number in each camera's film, from 1."""
    mocap: float
    """Frame number in the motion capture, from 1."""
    scale: float
    """Frames of the motion capture per frame of the trial."""


class HumanEva(NamedTuple):
    """A trial of HumanEva: recording, truth and training motion."""

    recording: Recording
    """Its `path` is the data's folder; its truth and training are in the fields below."""
    truth: JointTable | None
    """Joints at the recording's frames; None if they are not published (test trials, HumanEva-II)."""
    training: JointTable | None
    """Joints in training frames of the same person and action, at `RATE`; None if there are none."""


def read_humaneva(folder: str | Path, subject: str, action: str, trial: int = 1, part: Part = "validation",
                  training_frames: int = 100) -> HumanEva:
    """Read a trial of HumanEva; only the first frame of each film is decoded.

    Raises `RecordingError`, `CalibrationError` or `FormatError`, naming the file.

    Args:
        folder: the data, with S1, S2, ...
        subject: S1, ...
        action: Walking, ...
        trial: its number.
        part: of a first trial of HumanEva-I; other trials have one part, `all`.
        training_frames: number of consecutive training frames, those with the fewest gaps (Ni 2008: 100); 0 for all.
    """
    folder = Path(folder)
    films = _films(folder, subject, action, trial)
    timing = _timing(folder / subject, f"{action}_{trial}", list(films))
    first, last = _frames(folder, subject, action, trial, part)
    length = min(_length(film) - timing.images[name] + 1 for name, film in films.items())
    last = min(last, length)
    if last <= first:
        raise RecordingError(f"{folder}: {subject} {action}_{trial}: found {length} frames that all films have, expected more than {first}")
    views = tuple(
        View(read_cal(folder / subject / "Calibration_Data" / f"{name}.cal", name, open_frames(film, rate=RATE).size), film,
             _background(folder, subject, name), None, (timing.images[name] - 1 + first - 1) / RATE)
        for name, film in films.items()
    )
    recording = Recording(folder, f"{subject}_{action}_{trial}", views, rate=RATE, duration=(last - first + 1) / RATE)
    truth = _joints(folder, subject, action, trial, timing, first, last)
    return HumanEva(recording, truth, _training(folder, subject, action, training_frames))


def write_humaneva(found: HumanEva, folder: str | Path) -> None:
    """Write a recording folder that refers to the films. Raises `RecordingError` if the folder holds something else."""
    import tomli_w

    folder, recording = Path(folder), found.recording
    notes = folder / WRITTEN[0]
    if folder.exists() and (not folder.is_dir() or (any(folder.iterdir()) and not _is_ours(notes))):
        raise RecordingError(f"{folder}: found something there that is no recording of HumanEva's, expected a new folder")
    folder.mkdir(parents=True, exist_ok=True)
    for name in WRITTEN:
        (folder / name).unlink(missing_ok=True)
    write_calibration(folder / "calibration.toml", [view.camera for view in recording.views])
    for name, table in (("truth.csv", found.truth), ("training.csv", found.training)):
        if table is not None:
            write_joints(folder / name, table)
    named = {view.camera.name: view for view in recording.views}
    values = {"rate": recording.rate, "duration": recording.duration,
              "start": {name: view.start for name, view in named.items()},
              "video": {name: str(Path(str(view.video)).resolve()) for name, view in named.items()},
              "background": {name: str(view.background.resolve()) for name, view in named.items() if view.background is not None}}
    write_whole(notes, HEAD + tomli_w.dumps({key: value for key, value in values.items() if value}))


def read_sync(path: Path) -> Sync:
    """Read an .ofs file: three numbers. Raises `RecordingError`."""
    try:
        values = np.array(read_text(path).split(), float)
    except ValueError:
        values = np.zeros(0)
    if len(values) < 3 or not np.isfinite(values[:3]).all() or values[2] <= 0:
        raise RecordingError(f"{path}: expected three numbers (image, frame of motion capture, scale more than 0), found something else")
    return Sync(*values[:3].tolist())


def timing_of(syncs: dict[str, Sync]) -> Timing:
    """Frame 1 of a trial: the first for which every film has an image, and the motion capture a frame."""
    reference = next(iter(syncs.values()))
    scale = float(np.mean([sync.scale for sync in syncs.values()]))
    images = {name: sync.image + (reference.mocap - sync.mocap) / sync.scale for name, sync in syncs.items()}
    back = min(min(images.values()) - 1, (reference.mocap - 1) / scale)  # frames from the common beginning to the reference's image
    return Timing({name: round(image - back) for name, image in images.items()}, reference.mocap - scale * back, scale)


def _films(folder: Path, subject: str, action: str, trial: int) -> dict[str, Path]:
    """Films or folders of pictures by camera, for calibrated cameras."""
    person = folder / subject
    if not person.is_dir():
        there = [path.name for path in sorted(folder.glob("S[0-9]*"))] if folder.is_dir() else []
        raise RecordingError(f"{folder}: found no {subject}, expected one of {choices(there)}, with Image_Data, Calibration_Data and so on")
    cameras = _in_order(path.stem for path in person.glob("Calibration_Data/*.cal"))
    if not cameras:
        raise RecordingError(f"{person / 'Calibration_Data'}: found no camera, expected C1.cal, C2.cal, ...")
    stems = {name: person / "Image_Data" / f"{action}_{trial}_({name})" for name in cameras}
    films = {name: stem if stem.is_dir() else stem.with_name(f"{stem.name}.avi") for name, stem in stems.items()}
    films = {name: film for name, film in films.items() if film.exists()}
    if not films:
        there = sorted({path.name.rpartition("_(")[0] for path in person.glob("Image_Data/*_(*")})
        raise RecordingError(f"{person / 'Image_Data'}: found no film of {action}_{trial}, expected one of {choices(there)}")
    if len(films) < len(cameras):
        warn(f"{person / 'Image_Data'}: no film of {choices(set(cameras) - set(films))} for {action}_{trial}; going on with "
             f"{choices(films)}")
    return films


def _in_order(cameras: Iterable[str]) -> list[str]:
    """C1, C2, C3, BW1, ...; the first is the reference, as in the owners' programs."""
    return sorted(cameras, key=lambda name: (len(name), name))


def _length(film: Path) -> int:
    """Number of images of a film. Raises `RecordingError` if it is unknown."""
    source = open_frames(film, rate=RATE)
    count = source.count or source.duration * source.rate
    if not np.isfinite(count):
        raise RecordingError(f"{film}: found a film that does not tell how long it is, expected an .avi or a folder of pictures")
    return int(count)


def _timing(person: Path, take: str, cameras: list[str]) -> Timing:
    return timing_of({name: read_sync(person / "Sync_Data" / f"{take}_({name}).ofs") for name in cameras})


def _frames(folder: Path, subject: str, action: str, trial: int, part: Part) -> tuple[int, int]:
    """First and last frame of a part of a trial."""
    known = PARTS.get(subject, {}).get(action) if trial == 1 else None
    if part == "all":
        return FIRST_VALID, 10**9
    if known is None:
        raise RecordingError(f"{folder}: {subject} {action}_{trial} is not divided, expected part all; divided are the first trials of "
                             f"{', '.join(PARTS)}: {choices(PARTS['S1'])}")
    return (FIRST_VALID, known[0]) if part == "validation" else (known[0] + 1, known[1])


def _joints(folder: Path, subject: str, action: str, trial: int, timing: Timing, first: int, last: int) -> JointTable | None:
    """Joints at frames `first` to `last` of a trial, times from 0; None if there is no motion capture of these frames."""
    path = folder / subject / "Mocap_Data" / f"{action}_{trial}.c3d"
    if not path.exists():
        return None
    table = renamed(read_c3d(path))
    places = _between(table.positions, timing.mocap - 1 + np.arange(first - 1, last, dtype=float) * timing.scale)
    return JointTable(np.arange(last - first + 1) / RATE, table.names, places) if np.isfinite(places).any() else None


def _between(places: Array, at: Array) -> Array:
    """`places` (T, J, 3) interpolated at fractional rows `at` (K,): (K, J, 3); NaN outside, or next to a gap."""
    low = np.floor(at).astype(int)
    share = (at - low)[:, None, None]
    padded = np.concatenate([places, np.full((1, *places.shape[1:]), np.nan)])

    def rows(n: Array) -> Array:
        return padded[np.where((n >= 0) & (n < len(places)), n, len(places))]

    return np.where(share > 0, rows(low) * (1 - share) + rows(low + 1) * share, rows(low))


def _training(folder: Path, subject: str, action: str, count: int) -> JointTable | None:
    """Joints in the training frames of the first trial; None if there are none."""
    person, known = folder / subject, PARTS.get(subject, {}).get(action)
    cameras = _in_order(path.stem.rpartition("(")[2].rstrip(")") for path in person.glob(f"Sync_Data/{action}_1_(*.ofs"))
    if known is None or not cameras:
        return None
    table = _joints(folder, subject, action, 1, _timing(person, f"{action}_1", cameras), known[0] + 1, known[1])
    if table is None or not 0 < count < len(table.times):
        return table
    gaps = np.concatenate([[0], np.cumsum(~np.isfinite(table.positions).all((1, 2)))])
    start = int((gaps[count:] - gaps[:-count]).argmin())
    return replace(table, times=table.times[:count], positions=table.positions[start : start + count])


def _background(folder: Path, subject: str, camera: str) -> Path | None:
    """The camera's film of the empty scene; None if there is none."""
    found = [path for pattern in (f"{subject}/Image_Data/Background*_({camera})*", f"Background/Image_Data/*_({camera})*")
             for path in sorted(folder.glob(pattern))]
    return next(iter(found), None)


def _is_ours(notes: Path) -> bool:
    try:
        return notes.read_text("utf-8").startswith(HEAD)
    except (OSError, UnicodeDecodeError):
        return False
