"""Reads run folders: a tracked motion, with its settings and metrics.

    joints.csv     time, <joint>_x, _y, _z (m, world), <joint>_sd_x, _sd_y, _sd_z (m), status, cost (px), overlap (0..1), <limb>_status
    angles.csv     time, every degree of freedom (rad or m), then <dof>_sd
    intervals.csv  time, joint, mode, weight, x, y, z, x_low, x_high, y_low, ... (m, world): 90 % bounds, and other places (`io.intervals`)
    contacts.csv   time, height of the floor (m), <point>_contact and <point>_probability of heels and toes (`io.contacts`)
    angles.toml    what each degree of freedom means: zero, positive sense, order, limits (`io.angle_conventions`)
    motion.npz     the fields of `Motion`, arrays only
    raw.csv        joints.csv and angles.csv as they were tracked, if they were smoothed afterwards; then run.toml has [smoothing]
    run.toml       complete, frames, body, versions, and what the tracker adds: recording, method, seed, settings, sizes, ...; [floor] with
                   its height in the world (m) where that is not 0, as before a camera that is known by its field of view alone
    metrics.json   complete, frames, status (number of frames of each), limb_status (likewise, by limb), timings, errors, ...

The tables grow with every frame; the other files are written at the end, also after an error. `complete` in run.toml says whether all
frames were tracked. A killed run is read from its tables, and can go on (`io.checkpoint`). `io.run_writer` writes them.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import FormatError, shown, typed
from shadowpuppet.io.files.table import Table, read_table
from shadowpuppet.io.files.text import JSON_LIMIT, errors_named, read_limited, read_toml
from shadowpuppet.io.motion.npz import read_motion_npz
from shadowpuppet.io.motion.table import read_raw, read_run_tables
from shadowpuppet.io.people import person_folders
from shadowpuppet.motion.motion import Motion

TABLES = ("joints.csv", "angles.csv", "intervals.csv")
RAW = "raw.csv"
CONTACTS = "contacts.csv"
ANGLES = "angles.toml"


@dataclass(frozen=True, eq=False)
class Run:
    """The content of a run folder."""

    folder: Path
    motion: Motion
    info: dict[str, Any]
    """Contents of run.toml."""
    metrics: dict[str, Any]
    """Contents of metrics.json; empty if there is none."""

    @property
    def complete(self) -> bool:
        """Whether all frames were tracked."""
        return self.info["complete"]

    @property
    def settings(self) -> dict[str, Any]:
        """The settings of the run."""
        return self.info.get("settings", {})

    @property
    def floor(self) -> float:
        """Height of the floor in the world, metres: 0 unless run.toml says otherwise."""
        return float(self.info.get("floor", {}).get("height_m", 0.0))


def resuming(run: Run) -> str:
    """How to go on with a run that was broken off, in words."""
    recording = run.info.get("recording", "RECORDING")
    return f"`{typed('track', recording, '-o', run.folder, '--resume')}`, with the flags it had, goes on with it"


def read_run(folder: str | Path) -> Run:
    """Read a run folder, also a killed run's. Raises `FormatError`, naming file, line and column, if something is malformed."""
    folder = Path(folder)
    if not folder.exists():
        raise FormatError(f"{folder}: no such folder, expected a run's, as `shadowpuppet track` writes it")
    if not (folder / "run.toml").exists():
        film = any((folder / name).exists() for name in ("video", "recording.toml", "calibration.toml"))
        hint = f"; it is a recording: track it first (`{typed('track', folder)}`)" if film else ""
        raise FormatError(f"{folder}: found no run.toml in it, expected the folder of a run, as `shadowpuppet track` writes it{hint}")
    info = read_toml(folder / "run.toml", FormatError)
    _check_info(folder / "run.toml", info)
    if people := person_folders(folder):
        raise FormatError(f"{folder}: found the runs of {len(people)} people, expected one of them: "
                          f"{', '.join(path.name for path in people.values())} in it")
    if (folder / "motion.npz").exists():
        motion = read_motion_npz(folder / "motion.npz")
    elif not info["complete"] and (folder / RAW).exists():  # killed while its tables were revised
        motion = read_raw(folder / RAW, info["body"])
    else:
        motion = _read_tables(folder, info["body"], cut=not info["complete"])
    return Run(folder, motion, info, _read_metrics(folder / "metrics.json"))


def _read_tables(folder: Path, body_name: str, cut: bool) -> Motion:
    if cut and not (folder / "joints.csv").exists():
        raise FormatError(f"{folder}: the run ended before its first frame, so that there is nothing to read")
    joints, angles = (read_table(folder / name, cut) for name in TABLES[:2])
    with errors_named(f"{folder}: joints.csv and angles.csv"):
        return read_run_tables(joints, angles, _common_frames(joints, angles, cut), body_name)


def _common_frames(joints: Table, angles: Table, cut: bool) -> int:
    """Number of frames in both tables; in a killed run (`cut`), one table may have a frame more."""
    times, others = joints.times(), angles.times()
    frames = min(len(times), len(others)) if cut else max(len(times), len(others))
    if not np.array_equal(times[:frames], others[:frames]):
        raise FormatError(f"{angles.path}: column 'time': found other times than in joints.csv, expected the same")
    return frames


def _check_info(path: Path, info: dict[str, Any]) -> None:
    kinds = {"complete": (bool, "true or false"), "body": (str, "the name of a body"), "versions": (dict, "a table")}
    kinds |= {"settings": (dict, "a table")} if "settings" in info else {}
    for key, (kind, expected) in kinds.items():
        if not isinstance(info.get(key), kind):
            raise FormatError(f"{path}: {key}: found {info.get(key)!r}, expected {expected}")
    floor = info.get("floor", {"height_m": 0.0})
    height = floor.get("height_m") if isinstance(floor, dict) else None
    if isinstance(height, bool) or not isinstance(height, int | float) or not np.isfinite(height):
        raise FormatError(f"{path}: floor: found {shown(floor)}, expected a table with height_m, metres")


def _read_metrics(path: Path) -> dict[str, Any]:
    if not path.exists():
        return {}
    try:
        data = json.loads(read_limited(path, JSON_LIMIT, FormatError, "a JSON file"))
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: not valid JSON: {error}") from None
    if not isinstance(data, dict):
        raise FormatError(f"{path}: found {type(data).__name__}, expected an object {{...}}")
    return data
