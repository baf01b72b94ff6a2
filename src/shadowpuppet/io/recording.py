"""Reads recording folders: calibrated cameras, films, empty scenes, masks, reference pictures, and facts about the person."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from difflib import get_close_matches
from itertools import count, takewhile
from pathlib import Path
from typing import Any

from shadowpuppet.body.sizes import DISTANCES, HEIGHTS
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import RecordingError, choices, reason, typed, warn
from shadowpuppet.io.calibration.calibration_files import UNITS, UPS, read_calibration
from shadowpuppet.io.calibration.formats import find_calibration
from shadowpuppet.io.keypoints.keypoint_files import KeypointSource, keypoints_in
from shadowpuppet.io.picture_sizes import fitting
from shadowpuppet.io.projects import RATES, Project, films_in, find_project, sources_in
from shadowpuppet.io.recording_toml import RecordingNotes
from shadowpuppet.io.shared_rate import shared_rate
from shadowpuppet.names import composed, spelled_as
from shadowpuppet.video import FILM_SUFFIXES, IMAGE_SUFFIXES, camera_number, open_frames

POSTURES = ("front_t_pose", "side_arms_hanging", "front_arms_t_pose")
"""Reference postures of Liu 2011's initialisation, for O1, O2 and O3 (IV-A)."""
BOARD_FOLDERS = ("intrinsics", "extrinsics", "floor")
"""Folders of films of a board, from which cameras are calibrated."""
STARTS, DURATIONS = (0.0, 100_000.0), (1e-3, 1e6)
"""Limits of `start` and `duration`, seconds."""


class UncalibratedError(RecordingError):
    """A recording some of whose cameras are not calibrated."""

    def __init__(self, message: str, cameras: Iterable[str] = (), known: Iterable[str] = ()) -> None:
        """The message, the names of the cameras without a calibration, and the names of those with one."""
        super().__init__(message)
        self.cameras, self.known = tuple(cameras), tuple(known)


@dataclass(frozen=True)
class Subject:
    """Known facts about the person; metres."""

    height: float | None = None
    """Height with shoes."""
    distance: float | None = None
    """Distance from the only camera to the middle of the body at the start."""


@dataclass(frozen=True)
class View:
    """A camera and its pictures; `video.open_frames` opens every source."""

    camera: Camera
    video: Path | int | str
    background: Path | None = None
    """Pictures or film of the empty scene."""
    masks: Path | None = None
    """Ready silhouettes, made by another program."""
    start: float = 0.0
    """The recording's time 0 on the film's clock, seconds; earlier frames are left out."""
    keypoints: KeypointSource | None = None
    """What a detector found in the film, not read yet."""


@dataclass(frozen=True)
class Reference:
    """The person in a known posture: a picture, film or folder of pictures."""

    name: str
    """One of `POSTURES`."""
    image: Path
    mask: Path | None = None


@dataclass(frozen=True)
class Recording:
    """A recording on disk; only the first frames of its films have been decoded."""

    path: Path
    name: str
    views: tuple[View, ...]
    subject: Subject = Subject()
    references: tuple[Reference, ...] = ()
    """Those that exist, in the order of `POSTURES`."""
    truth: Path | None = None
    training: Path | None = None
    rate: float | None = None
    """Frames/s that replace the films' times; None to keep the films' times."""
    duration: float | None = None
    """Duration used, seconds from time 0; None for all."""
    begin: float = 0.0
    """First moment used, seconds after time 0; the frames before are passed over, and times stay those after time 0."""
    truths: tuple[Path, ...] = ()
    """With several people: truth_1.csv, truth_2.csv, ..., one for each."""
    several: bool = False
    """Whether the project of another program states several people."""
    whole: Recording | None = None
    """The whole recording, where this is a part of it (`--start`, `--end`); None otherwise."""


def read_recording(path: str | Path | int, *, fov: float | None = None, calibration: Path | None = None,
                   asked: Sequence[str] | None = None) -> Recording:
    """Read a recording: a folder (video/ or films, calibration.toml, ...), another program's project (`io.projects`), or one film, folder
    of pictures or live camera.

    `calibration` replaces the folder's; `fov` (horizontal, radians) suffices for one camera; `asked`: cameras that will be used, all if
    left out: films of others may be unknown to the calibration. Raises `RecordingError`,
    `CalibrationError` or `VideoError`, naming file and field, if something is missing or does not fit.
    """
    folder = Path(str(path))
    try:
        exists = folder.exists()
    except OSError as error:  # for example, a name that is too long
        raise RecordingError(f"{folder}: cannot be read ({reason(error)})") from None
    project = find_project(folder) if camera_number(path) is None else None
    if camera_number(path) is None and not exists and project is None:
        raise RecordingError(f"{folder}: no such recording, expected a folder with video/ and calibration.toml, or a film"
                             f"{_like(folder)}")
    if is_run(folder):
        raise RecordingError(f"{folder}: found a run, as `shadowpuppet track` writes it, expected a recording; `shadowpuppet view`, "
                             f"`evaluate` and `export` read runs; `track` reads the recording that was tracked, named in {folder}/run.toml")
    if project is not None or (folder.is_dir() and (_is_own(folder) or films_in(folder))):
        return _read_folder(project.folder if project else folder, fov, calibration, project, asked)
    if folder.is_dir() and not any(p.suffix.lower() in IMAGE_SUFFIXES for p in folder.iterdir()):
        raise RecordingError(f"{folder}: found neither films nor video/ nor calibration.toml nor pictures in it, expected a "
                             "recording (<camera>.mp4 or video/<camera>.mp4, and calibration.toml) or a folder of pictures"
                             + _within(folder))
    source = folder if camera_number(path) is None else path
    if source is folder:
        if folder.is_file() and folder.suffix.lower() in IMAGE_SUFFIXES:
            raise RecordingError(f"{folder}: found a picture, expected a film, or the folder with a film's pictures")
        open_frames(folder)  # raises for a file that is no film, before the calibration is read
    cameras = _cameras(folder, {folder.stem: source}, fov, calibration)
    named = [c for c in cameras if composed(c.name) == composed(folder.stem) or len(cameras) == 1]
    if not named:
        raise RecordingError(f"{calibration}: found no camera {folder.stem!r}, after the film's name; cameras there: "
                             f"{choices(c.name for c in cameras)}")
    view = fitting(View(named[0], source))
    return Recording(folder, folder.stem, (view,))


def _like(path: Path) -> str:
    """The film or folder beside a missing one that has nearly its name, in words."""
    try:
        there = [each.name for each in path.parent.iterdir() if each.is_dir() or each.suffix.lower() in FILM_SUFFIXES]
    except OSError:
        return ""
    found = get_close_matches(path.name, there, 1)
    return f"; did you mean {path.parent / found[0]}?" if found else ""


def _within(folder: Path) -> str:
    """The recordings in a folder, in words; empty without one."""
    found = sorted(each.name for each in folder.iterdir() if each.is_dir() and is_recording(each))
    more = f" and {len(found) - 3} more" if len(found) > 3 else ""
    return f"; recordings in it: {', '.join(found[:3])}{more}" if found else ""


def _is_own(folder: Path) -> bool:
    """Whether a folder is laid out as a recording."""
    return _is_noted(folder) or (folder / "calibration.toml").exists()


def _is_noted(folder: Path) -> bool:
    """Whether a folder says itself that it is a recording, by its films' place or its notes."""
    return any((folder / name).exists() for name in ("video", "recording.toml"))


def is_run(folder: Path) -> bool:
    """Whether a folder holds a run, and no film but the run's overlay."""
    return (folder / "run.toml").is_file() and not _is_noted(folder) and set(films_in(folder)) <= {"overlay", "overlay.part"}


def is_recording(folder: Path) -> bool:
    """Whether a folder holds films with what is known about them, so that it is more than a calibration."""
    return _is_noted(folder) or find_project(folder) is not None or bool(films_in(folder))


def _read_folder(folder: Path, fov: float | None, calibration: Path | None, project: Project | None,
                 asked: Sequence[str] | None) -> Recording:
    """A recording folder; what it does not say is as the project of another program says."""
    notes = RecordingNotes(folder)
    height = notes.number("height", HEIGHTS, "metres", "subject")
    distance = notes.number("distance", DISTANCES, "metres", "subject")
    films, backgrounds, masks = (_sources(folder, kind, notes) for kind in ("video", "background", "masks"))
    if project is not None:
        films = films or project.films
    if not films:
        boards = [f"{name}/" for name in BOARD_FOLDERS if (folder / name).is_dir()]
        hint = f"; those in {choices(boards)} are of a board: put the person's into video/" if boards else ""
        raise RecordingError(f"{folder}: no films in it, expected <camera>.mp4 or video/<camera>.mp4, a folder of pictures "
                             f"video/<camera>/, or a [video] table in recording.toml{hint}")
    calibration = calibration or notes.file("calibration") or (project.calibration if project else find_calibration(folder))
    if project is not None and calibration is None and fov is None:
        raise RecordingError(f"{folder}: {project.no_calibration}")
    cameras = _cameras(folder, films, fov, calibration, notes)
    if project is not None:
        cameras = _in_order(cameras, films, project)
    names = [camera.name for camera in cameras]
    films, backgrounds, masks = (spelled_as(each, names) for each in (films, backgrounds, masks))
    keypoints = spelled_as(_keypoints(folder, notes, project), names)
    for kind, sources in (("video", films), ("background", backgrounds), ("masks", masks), ("keypoints", keypoints)):
        _check_names(folder / kind if (folder / kind).is_dir() else folder, sources, cameras, asked, kind)
    missing = [c.name for c in cameras if c.name not in films]
    if missing:
        pictures = [path.name for name in missing for path in sources_in(folder / "video", IMAGE_SUFFIXES).get(name, ())]
        instead = f" ({choices(pictures)} there: found a picture, expected a film)" if pictures else ""
        warn(f"{folder}: no film of {choices(missing)}{instead}; going on with {choices(films)}")
    starts = _starts(notes, cameras, asked)
    views = tuple(fitting(View(c, films[c.name], backgrounds.get(c.name), masks.get(c.name), starts.get(c.name, 0.0),
                               keypoints.get(c.name))) for c in cameras if c.name in films)
    truth = notes.file("truth") or _first(folder, "truth", ["csv", "trc"])
    training = notes.file("training") or _first(folder, "training", ["csv", "trc", "c3d", "bvh", "amc"])
    rate = notes.number("rate", RATES, "frames/s")
    duration = notes.number("duration", DURATIONS, "seconds")
    references = _references(folder / "references")
    recording = Recording(folder, folder.resolve().name, views, Subject(height, distance), references, truth, training, rate, duration,
                          truths=_truths(folder))
    recording = recording if project is None else _with_facts(recording, project)
    return recording if starts or recording.rate is not None else replace(recording, rate=shared_rate(folder, [v.video for v in views]))


def _in_order(cameras: tuple[Camera, ...], films: dict[str, Any], project: Project) -> tuple[Camera, ...]:
    """The cameras under the films' names: these programs pair the two by order where names differ."""
    if set(map(composed, films)) <= {composed(camera.name) for camera in cameras} or len(films) != len(cameras):
        return cameras
    named = tuple(replace(camera, name=name) for camera, name in zip(cameras, films))
    warn(f"{project.folder}: films and calibration have other names of cameras, and are paired by order, as {project.program} does: "
         f"{', '.join(f'{film} is {camera.name}' for camera, film in zip(cameras, films))}")
    return named


def _with_facts(recording: Recording, project: Project) -> Recording:
    """The recording with what the project says and recording.toml does not."""
    rate, begin, duration = recording.rate or project.rate, 0.0, recording.duration
    if project.frames is not None and duration is None:
        first, last = project.frames
        of_film = rate or open_frames(recording.views[0].video).rate
        begin, duration = max(first - 0.5, 0) / of_film, (last + 0.5) / of_film
    subject = replace(recording.subject, height=recording.subject.height or project.height)
    return replace(recording, name=project.name, subject=subject, rate=rate, begin=begin, duration=duration,
                   several=project.several)


def _truths(folder: Path) -> tuple[Path, ...]:
    """truth_1.csv, truth_2.csv, ..., up to the first that is missing."""
    found = takewhile(Path.exists, (folder / f"truth_{n}.csv" for n in count(1)))
    return tuple(found)


def _starts(notes: RecordingNotes, cameras: Iterable[Camera], asked: Sequence[str] | None) -> dict[str, float]:
    """`View.start` by camera, from recording.toml."""
    found = {name: notes.number(name, STARTS, "seconds", "start") for name in notes.table("start")}
    found = spelled_as(found, [camera.name for camera in cameras])
    _check_names(notes.path, found, cameras, asked)
    return {name: start for name, start in found.items() if start is not None}


def _first(folder: Path, stem: str, endings: list[str]) -> Path | None:
    return next((p for p in (folder / f"{stem}.{ending}" for ending in endings) if p.exists()), None)


def _sources(folder: Path, kind: str, notes: RecordingNotes) -> dict[str, Any]:
    """Film, picture or folder by camera: those named in recording.toml, else <kind>/<camera>.*."""
    sources: dict[str, Any] = {camera: notes.source(kind, camera) for camera in notes.table(kind)}
    found = sources_in(folder / kind, FILM_SUFFIXES if kind == "video" else FILM_SUFFIXES + IMAGE_SUFFIXES)
    if kind == "video" and not found and not sources:
        found = films_in(folder)  # films lie in a recording's folder itself in many laboratories
    return {name: _only(paths) for name, paths in spelled_as(found, sources).items() if name not in sources} | sources


def _keypoints(folder: Path, notes: RecordingNotes, project: Project | None) -> dict[str, KeypointSource]:
    """Keypoints by camera: those named in recording.toml, else keypoints/<camera>.*, else the project's."""
    table = notes.table("keypoints")
    stated = {camera: notes.source("keypoints", camera) for camera in table if camera != "model"}
    found = {name: _only(paths) for name, paths in keypoints_in(folder / "keypoints").items() if name not in stated} | stated
    model = table.get("model")
    if not found and project is not None:
        films = set(map(composed, project.films))
        found, model = {name: path for name, path in project.keypoints.items() if composed(name) in films}, model or project.pose_model
    return {name: KeypointSource(Path(str(path)), model) for name, path in found.items()}


def _only(paths: list[Path]) -> Path:
    if len(paths) > 1:
        raise RecordingError(f"{paths[0].parent}: found {' and '.join(p.name for p in paths)}, expected one of them")
    return paths[0]


def _cameras(folder: Path, films: dict[str, Any], fov: float | None, calibration: Path | None,
             notes: RecordingNotes | None = None) -> tuple[Camera, ...]:
    if calibration is not None and fov is not None:
        raise RecordingError(f"{folder}: found a field of view and a calibration ({calibration.name}), expected one of them")
    if calibration is not None:
        def size(name: str) -> tuple[int, int] | None:
            film = spelled_as(films, [name]).get(name)
            return open_frames(film).size if film is not None and camera_number(film) is None else None

        unit, up = (notes.choice(key, known) if notes else None for key, known in (("unit", UNITS), ("up", UPS)))
        return read_calibration(calibration, unit=unit, up=up, sizes=size)
    if len(films) > 1:
        by_board, by_person = (typed("calibrate", folder, *more) for more in ((), ("--from-person", "--height", "METRES")))
        raise UncalibratedError(f"{folder}: no calibration.toml for its {len(films)} cameras ({choices(films)}); several cameras must be "
                                "calibrated together: by films of a printed board, put into its intrinsics/ and extrinsics/ "
                                f"(`{by_board}`, docs/calibration.md), or by the person who walks there, from a rough.toml that says where "
                                f"they stand (`{by_person}`)", films)
    if fov is None:
        raise UncalibratedError(f"{folder}: no calibration: give the camera's horizontal field of view (--fov DEGREES, option fov; a "
                                "phone held across has about 65, held upright 40, a webcam 60) or a calibration.toml", films)
    name, film = next(iter(films.items()))
    source = open_frames(film)
    return (Camera.from_fov(source.size, fov, name, source.pixel),)


def _check_names(place: Path, sources: Iterable[str], cameras: Iterable[Camera], asked: Sequence[str] | None, kind: str = "") -> None:
    """Raise `RecordingError` if there is something of a camera that the calibration does not know, and that is `asked` for (None: all)."""
    known, used = [camera.name for camera in cameras], None if asked is None else set(map(composed, asked))
    unknown = sorted(name for name in set(sources) - set(known) if used is None or composed(name) in used)
    if unknown:
        found = f"{place}: found {choices(unknown)}, but the calibration knows no such camera; cameras known: {choices(known)}"
        if kind == "video":
            raise UncalibratedError(f"{found}; a film has the name of its camera; --camera leaves films out", unknown, known)
        raise RecordingError(found)


def _references(folder: Path) -> tuple[Reference, ...]:
    found = sources_in(folder, FILM_SUFFIXES + IMAGE_SUFFIXES)
    unknown = sorted(name for name in found if name.removesuffix("_mask") not in POSTURES)
    if unknown:
        raise RecordingError(f"{folder}: found {choices(unknown)}; postures known: {', '.join(POSTURES)}, and <posture>_mask")
    alone = sorted(name for name in found if name.endswith("_mask") and name.removesuffix("_mask") not in found)
    if alone:
        raise RecordingError(f"{folder}: found {alone[0]} alone, expected the picture {alone[0].removesuffix('_mask')} beside it")
    masks = {name: _only(found[f"{name}_mask"]) for name in POSTURES if f"{name}_mask" in found}
    return tuple(Reference(name, _only(found[name]), masks.get(name)) for name in POSTURES if name in found)
