"""Whatever can be looked at, by its path: a run, a recording, a film, a calibration, a prior, a file of motion."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, choices
from shadowpuppet.io.calibration.calibration_files import find_calibration, is_calibration
from shadowpuppet.io.motion import READABLE
from shadowpuppet.io.prior import FORMAT
from shadowpuppet.pipeline.options import Options
from shadowpuppet.viewer.scene.of_file import show_calibration, show_motion
from shadowpuppet.viewer.scene.of_prior import show_prior
from shadowpuppet.viewer.scene.of_recording import show_recording
from shadowpuppet.viewer.scene.of_run import show_run
from shadowpuppet.viewer.scene.show import Show


def show_of(path: str | Path, options: Options | None = None, truth: Path | None = None, recording: Path | None = None) -> Show:
    """What there is to be seen of a path. `options`: of recordings and films; `truth` and `recording`: in place of those that a run names.

    Raises a `ShadowPuppetError` where it is nothing that can be shown, or cannot be read.
    """
    path = Path(path)
    if not path.exists():
        raise FormatError(f"{path}: no such file or folder; a run, a recording, a film with --fov, a calibration, a prior (.npz) or a "
                          f"file of motion ({choices(READABLE)}) can be shown")
    if (path / "run.toml").exists():
        return show_run(path, truth, recording)
    for name, value in (("truth", truth), ("recording", recording)):
        if value is not None:
            raise ShadowPuppetError(f"{path}: {name}: found {value}, expected none: it belongs to a run, and this is none")
    if path.is_dir():
        return _of_folder(path, options or Options())
    if path.suffix.lower() == ".npz" and is_prior(path):
        return show_prior(path)
    if path.suffix.lower() in READABLE:
        return show_motion(path)
    return show_calibration(path) if is_calibration(path) else show_recording(path, options or Options())


def is_prior(path: Path) -> bool:
    """Whether an archive of arrays says that it is a motion prior."""
    from shadowpuppet.io.files.npz import read_arrays

    try:
        return str(read_arrays(path, ["format"]).get("format")) == FORMAT
    except ShadowPuppetError:
        return False


def between(show: Show, start: float | None, end: float | None) -> Show:
    """The part of a show from `start` to `end`, seconds of its own time. Raises `ShadowPuppetError` where there is nothing."""
    low, high = (-np.inf if start is None else start), (np.inf if end is None else end)
    kept = show.times[(show.times >= low - 1e-6) & (show.times <= high + 1e-6)]
    if not len(kept):
        raise ShadowPuppetError(f"{show.title}: start and end: found {start} and {end} s, expected a part of "
                                f"{show.times[0]:.2f} to {show.times[-1]:.2f} s")
    return replace(show, times=kept)


def _of_folder(path: Path, options: Options) -> Show:
    made = any((path / name).exists() for name in ("video", "recording.toml"))
    if not made and is_calibration(path):
        return show_calibration(path)
    if not made and (found := find_calibration(path)) is not None:
        return show_calibration(found)
    return show_recording(path, options)
