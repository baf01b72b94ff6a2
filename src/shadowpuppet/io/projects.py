"""Finds films, calibration and facts in the project folders of other programs, as they lie: Pose2Sim, FreeMoCap, OpenCap.

    Pose2Sim     <trial>/videos/<camera>.mp4; calibration/ and Config.toml there, or in a folder above
    FreeMoCap    <session>/synchronized_videos/<camera>.mp4; *_camera_calibration.toml
    OpenCap      <session>/Videos/Cam0/InputMedia/<trial>/<any name>.mov; sessionMetadata.yaml; a session with several trials is named
                 <session>/<trial>; its calibration is a pickle, which is never opened

Nothing of these programs is run or imported, and nothing is written into their folders.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from shadowpuppet.body.sizes import HEIGHTS, is_within
from shadowpuppet.errors import RecordingError, choices, shown
from shadowpuppet.io.calibration.formats import find_calibration
from shadowpuppet.io.files.text import read_limited, read_toml
from shadowpuppet.names import composed
from shadowpuppet.video import FILM_SUFFIXES

LEVELS = 2
"""Pose2Sim's folders above a trial, participant and session, whose settings and calibration hold for it."""
CONFIG_BYTES, MOST_FRAMES = 1_000_000, 10**9
RATES = (0.1, 10_000.0)
"""Limits of frames/s."""


@dataclass(frozen=True)
class Project:
    """One trial of another program's project."""

    program: str
    folder: Path
    name: str
    """The trial's name, or the folder's."""
    films: dict[str, Path]
    """By camera, sorted; the calibration's cameras have these names or this order."""
    calibration: Path | None
    results: tuple[str, Path]
    """Formats of `export`, with commas between, and the folder in which the program looks for them."""
    height: float | None = None
    """Of the person, metres."""
    rate: float | None = None
    """Frames/s, where the project replaces the films' own."""
    frames: tuple[int, int] | None = None
    """First and last frame used."""
    several: bool = False
    """Whether it states several people."""
    keypoints: dict[str, Path] = field(default_factory=dict)
    """Folders of OpenPose's files that the program wrote, by film."""
    pose_model: Any = None
    """The model of their detector, as its settings name it; or a tree of landmarks."""
    no_calibration: str = ""
    """Why there is no calibration, and what to do."""


def find_project(path: Path) -> Project | None:
    """The trial of a project in a folder; None if it is no project's.

    Raises `RecordingError` if a project's settings are malformed, or one of several trials must be named.
    """
    if path.is_dir():
        return _pose2sim(path) or _freemocap(path) or _opencap(path, None)
    return _opencap(path.parent, path.name) if path.parent.is_dir() else None


def sources_in(folder: Path, suffixes: tuple[str, ...]) -> dict[str, list[Path]]:
    """Files with some endings, and folders, in a folder, by name without ending, sorted."""
    found, spelling = dict[str, list[Path]](), dict[str, str]()
    for path in sorted(folder.iterdir()) if folder.is_dir() else []:
        if path.name[0] != "." and (path.is_dir() or path.suffix.lower() in suffixes):
            name = path.name if path.is_dir() else path.stem
            found.setdefault(spelling.setdefault(composed(name), name), []).append(path)
    return found


def films_in(folder: Path) -> dict[str, list[Path]]:
    """Films in a folder, by name without ending, sorted."""
    found = {name: [path for path in paths if path.is_file()] for name, paths in sources_in(folder, FILM_SUFFIXES).items()}
    return {name: films for name, films in found.items() if films}


def _films(folder: Path) -> dict[str, Path]:
    return {name: paths[0] for name, paths in films_in(folder).items()}


def _pose2sim(folder: Path) -> Project | None:
    films = _films(folder / "videos")
    levels = list(_levels(folder))
    configs = [read_toml(level / "Config.toml", RecordingError) for level in levels if (level / "Config.toml").is_file()]
    if not films or not (configs or any(_calibration_folders(level) for level in levels)):
        return None
    places = [place for level in levels for place in _calibration_folders(level)]
    calibration = next((found for place in places if (found := find_calibration(place)) is not None), None)
    known = _Config(folder / "Config.toml", [config.get("project", {}) for config in configs])
    return Project("Pose2Sim", folder, folder.resolve().name, films, calibration, ("trc", folder / "pose-3d"), known.height(),
                   known.rate(), known.frames(),
                   known.several(), _poses(folder / "pose"), _pose_model([config.get("pose") for config in configs]),
                   "Pose2Sim's calibration, a file in calibration/ beside or above the trial, is missing")


def _poses(folder: Path) -> dict[str, Path]:
    """Folders <film>_json of keypoints; those in pose-sync/ and pose-associated/ have other frames."""
    return {path.name.removesuffix("_json"): path for path in sorted(folder.glob("*_json")) if path.is_dir()}


def _pose_model(tables: list[Any]) -> Any:
    """`pose_model` of the first `[pose]` table that has it: a model's name, or the tree of landmarks that a table of that name holds."""
    tables = [table for table in tables if isinstance(table, dict)]
    name = next((table["pose_model"] for table in tables if "pose_model" in table), None)
    return next((table[name] for table in tables if isinstance(name, str) and isinstance(table.get(name), dict | list)), name)


def _levels(folder: Path) -> Iterator[Path]:
    """The trial's folder, and those above it up to the session's: as far as there are settings."""
    yield folder
    for level in list(folder.resolve().parents)[:LEVELS]:
        if not (level / "Config.toml").is_file():
            return
        yield level


def _calibration_folders(folder: Path) -> list[Path]:
    """Pose2Sim's rule: folders whose name holds `calib`."""
    try:
        return sorted(path for path in folder.iterdir() if "calib" in path.name.lower() and path.is_dir())
    except OSError:
        return []


class _Config:
    """Pose2Sim's `[project]` tables of a trial and the folders above it; the trial's come first."""

    def __init__(self, path: Path, tables: list[Any]) -> None:
        self.path, self.tables = path, [table for table in tables if isinstance(table, dict)]

    def _value(self, key: str) -> Any:
        return next((table[key] for table in self.tables if key in table), "auto")

    def several(self) -> bool:
        """`multi_person`."""
        return self._value("multi_person") is True

    def rate(self) -> float | None:
        """`frame_rate`, unless it is a word or zero."""
        value = self._value("frame_rate")
        if isinstance(value, str) or not value:
            return None
        if not is_within(value, RATES):
            raise RecordingError(f"{self.path}: project.frame_rate: found {shown(value)}, expected {RATES[0]:g} to {RATES[1]:g} frames/s")
        return float(value)

    def height(self) -> float | None:
        """The height, if it is one person's."""
        value = self._value("participant_height")
        value = value[0] if isinstance(value, list) and len(value) == 1 else value
        if isinstance(value, str | list):
            return None
        if not is_within(value, HEIGHTS):
            raise RecordingError(f"{self.path}: project.participant_height: found {shown(value)}, expected {HEIGHTS[0]:g} to "
                                 f"{HEIGHTS[1]:g} metres")
        return float(value)

    def frames(self) -> tuple[int, int] | None:
        value = self._value("frame_range")
        if isinstance(value, str) or value == []:
            return None
        whole = isinstance(value, list) and len(value) == 2 and all(isinstance(n, int) and not isinstance(n, bool) for n in value)
        if not whole or not 0 <= value[0] < value[1] < MOST_FRAMES:
            raise RecordingError(f"{self.path}: project.frame_range: found {shown(value)}, expected 'auto', 'all', or the first and last "
                                 "frame")
        return value[0], value[1]


def _freemocap(folder: Path) -> Project | None:
    films = _films(folder / "synchronized_videos")
    if not films:
        return None
    return Project("FreeMoCap", folder, folder.resolve().name, films, find_calibration(folder), ("trc", folder / "output_data"),
                   no_calibration="FreeMoCap's calibration, a file *_camera_calibration.toml, is missing in the session's folder")


def _opencap(session: Path, trial: str | None) -> Project | None:
    """One trial of a session; `trial` may be None if there is only one with a moving person."""
    cameras = sorted(path for path in (session / "Videos").glob("Cam*") if (path / "InputMedia").is_dir())
    trials = sorted({path.name for camera in cameras for path in (camera / "InputMedia").iterdir() if path.is_dir()})
    if not trials or (trial is not None and trial not in trials):
        return None
    moving = [name for name in trials if name not in ("calibration", "neutral")]
    if trial is None and len(moving) != 1:
        raise RecordingError(f"{session}: found the trials {choices(trials)} of an OpenCap session, expected one of them: "
                             f"{session / (moving or trials)[0]}")
    name = trial or moving[0]
    films = {}
    for camera in cameras:
        found = sorted(_films(camera / "InputMedia" / name).values(), key=lambda film: ("sync" not in film.stem.lower(), film.name))
        films |= {camera.name: found[0]} if found else {}
    return Project("OpenCap", session, name, films, find_calibration(session), ("trc", session / "MarkerData"), _opencap_height(session),
                   no_calibration="OpenCap keeps its calibration in Python pickles, which are never opened, as reading one can run any "
                                  "code: convert it (docs, Calibration) and give the file with --calibration")


def _opencap_height(session: Path) -> float | None:
    """`height_m` of sessionMetadata.yaml."""
    path = session / "sessionMetadata.yaml"
    found = re.search(r"^\s*height_m:\s*['\"]?([0-9.]+)", read_limited(path, CONFIG_BYTES, RecordingError, "OpenCap's settings"),
                      re.MULTILINE) if path.is_file() else None
    try:
        height = float(found[1]) if found else None
    except ValueError:
        height = None
    if height is not None and not is_within(height, HEIGHTS):
        raise RecordingError(f"{path}: height_m: found {height:g}, expected {HEIGHTS[0]:g} to {HEIGHTS[1]:g} metres")
    return height
