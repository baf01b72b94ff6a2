"""Scenes by path: of a run, a recording, a film, a calibration, a prior, a file of motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, choices
from shadowpuppet.io.calibration.formats import find_calibration, is_calibration
from shadowpuppet.io.motion import READABLE
from shadowpuppet.io.people import person_folders
from shadowpuppet.io.prior import FORMAT
from shadowpuppet.io.recording import is_recording
from shadowpuppet.pipeline.options import Options
from shadowpuppet.viewer.scene.of_file import calibration_scene, motion_scene
from shadowpuppet.viewer.scene.of_people import people_scene
from shadowpuppet.viewer.scene.of_prior import prior_scene
from shadowpuppet.viewer.scene.of_recording import recording_scene
from shadowpuppet.viewer.scene.of_run import run_scene
from shadowpuppet.viewer.scene.scene import Stage


def open_scene(path: str | Path, options: Options | None = None, truth: Path | None = None, recording: Path | None = None) -> Stage:
    """The scene of a path. `options`: of recordings and films; `truth` and `recording`: replace the ones that a run names.

    Raises a `ShadowPuppetError` if it cannot be shown or read.
    """
    path = Path(path)
    if not path.exists():
        raise FormatError(f"{path}: no such file or folder; a run, a recording, a film with --fov, a calibration, a prior (.npz) or a "
                          f"file of motion ({choices(READABLE)}) can be shown")
    if people := person_folders(path):
        if truth is not None:
            raise ShadowPuppetError(f"{path}: truth: found {truth}, expected none: it is a run of several people; view "
                                    f"{next(iter(people.values()))} for one of them")
        return people_scene(path, people, recording)
    if (path / "run.toml").exists():
        return run_scene(path, truth, recording)
    for name, value in (("truth", truth), ("recording", recording)):
        if value is not None:
            raise ShadowPuppetError(f"{path}: {name}: found {value}, expected none: it belongs to a run, and this is none")
    if path.is_dir():
        return _of_folder(path, options or Options())
    if path.suffix.lower() == ".npz" and is_prior(path):
        return prior_scene(path)
    if path.suffix.lower() in READABLE:
        return motion_scene(path)
    return calibration_scene(path) if is_calibration(path) else recording_scene(path, options or Options())


def is_prior(path: Path) -> bool:
    """Whether an .npz file is a motion prior."""
    from shadowpuppet.io.files.npz import read_arrays

    try:
        return str(read_arrays(path, ["format"]).get("format")) == FORMAT
    except ShadowPuppetError:
        return False


def cut_scene(scene: Stage, start: float | None, end: float | None) -> Stage:
    """The part of a scene from `start` to `end`, seconds. Raises `ShadowPuppetError` if it is empty."""
    low, high = (-np.inf if start is None else start), (np.inf if end is None else end)
    kept = scene.times[(scene.times >= low - 1e-6) & (scene.times <= high + 1e-6)]
    if not len(kept):
        raise ShadowPuppetError(f"{scene.title}: start and end: found {start} and {end} s, expected a part of "
                                f"{scene.times[0]:.2f} to {scene.times[-1]:.2f} s")
    return replace(scene, times=kept)


def _of_folder(path: Path, options: Options) -> Stage:
    made = is_recording(path)
    if not made and is_calibration(path):
        return calibration_scene(path)
    if not made and (found := find_calibration(path)) is not None:
        return calibration_scene(found)
    return recording_scene(path, options)
