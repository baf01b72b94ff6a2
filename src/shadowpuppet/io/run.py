"""Reads and writes run folders: a tracked motion, written frame by frame, with its settings and metrics.

    joints.csv     time, <joint>_x, _y, _z (m, world), <joint>_sd_x, _sd_y, _sd_z (m), status, cost (px), overlap (0..1), <limb>_status
    angles.csv     time, every degree of freedom (rad or m), then <dof>_sd
    intervals.csv  time, joint, mode, weight, x, y, z, x_low, x_high, y_low, ... (m, world): 90 % bounds, and other places (`io.intervals`)
    motion.npz     the fields of `Motion`, arrays only
    run.toml       complete, frames, body, versions, and what the tracker adds: recording, method, seed, settings, sizes, ...
    metrics.json   complete, frames, status (number of frames of each), limb_status (likewise, by limb), timings, errors, ...

The tables grow with every frame; the other files are written at the end, also after an error. `complete` in run.toml says whether all
frames were tracked. A killed run is read from its tables.
"""

from __future__ import annotations

import contextlib
import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any, Self, TextIO

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, reason
from shadowpuppet.io.files.plain import for_json, for_toml, plain
from shadowpuppet.io.files.table import Table, csv_line, read_table, shorten
from shadowpuppet.io.files.text import errors_named, read_toml, write_whole
from shadowpuppet.io.intervals import IntervalWriter
from shadowpuppet.io.motion.npz import read_motion_npz, write_motion_npz
from shadowpuppet.io.motion.table import read_run_tables, run_headers, run_rows
from shadowpuppet.motion.motion import Motion, MotionBuilder, MotionFrame

TABLES = ("joints.csv", "angles.csv", "intervals.csv")
FILES = (*TABLES, "motion.npz", "metrics.json", "overlay.mp4")
"""Files of an earlier run that a new one in its folder replaces or removes. run.toml, which marks a run's folder, always stays."""
OWN_KEYS = ("complete", "frames", "body", "versions")
"""Keys of run.toml that the writer sets."""


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


class RunWriter:
    """Writes a run: `with RunWriter(...) as run: run.write(frame)`; `run.metrics` may be filled until the end.

    The folder must be new, empty or that of an earlier run, which is replaced when the first frame is written. Raises
    `ShadowPuppetError` for any other folder, and if it cannot be written; frames written before stay readable.
    """

    def __init__(self, folder: str | Path, body_name: str, dof_names: Sequence[str], joint_names: Sequence[str],
                 info: Mapping[str, Any]) -> None:
        """`info`: entries of run.toml; dataclasses, arrays and paths are converted, values of None are left out."""
        taken = set(info) & set(OWN_KEYS)
        if taken:
            raise ShadowPuppetError(f"info: found {min(taken)!r}, which the run's writer fills in itself")
        self.folder, self.metrics = Path(folder), dict[str, Any]()
        self.info = for_toml(plain(info, "info")) | {"body": body_name, "versions": versions()}
        self._motion = MotionBuilder(body_name, dof_names, joint_names)
        self._intervals = IntervalWriter(joint_names)
        self._tables: list[TextIO] = []
        self._earlier = False

    def __enter__(self) -> Self:
        """Make the folder. Raises `ShadowPuppetError` if it cannot be used."""
        with self._system_errors():
            self.folder.mkdir(parents=True, exist_ok=True)
            self._earlier = _check_folder(self.folder)
            probe = self.folder / "run.toml.part"  # fail now rather than after hours of tracking
            probe.touch()
            probe.unlink()
        if not self._earlier:
            self._write_info(complete=False)  # marks the folder as a run's before callers add files to it
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Write the remaining files, after an error as far as possible."""
        if kind is None:
            self._start()
            self._finish(complete=True)
        elif not self._tables:
            self._leave()
        else:
            with contextlib.suppress(ShadowPuppetError):
                self._finish(complete=False)

    def _leave(self) -> None:
        """Remove the folder of a run without frames, unless callers put files into it."""
        with contextlib.suppress(OSError):
            if not self._earlier and [path.name for path in self.folder.iterdir()] == ["run.toml"]:
                (self.folder / "run.toml").unlink()
                self.folder.rmdir()

    def write(self, frame: MotionFrame) -> None:
        """Add a frame. Raises `ShadowPuppetError` if it does not fit the run, or cannot be written."""
        self._start()
        kept = self._motion.append(frame)
        self._append(run_rows(kept), self._intervals.lines(kept))

    def _start(self) -> None:
        """Replace an earlier run and write the headers, once."""
        if self._tables:
            return
        with self._system_errors():
            for name in FILES:
                (self.folder / name).unlink(missing_ok=True)
        self._write_info(complete=False)
        with self._system_errors():
            self._tables = [(self.folder / name).open("w", encoding="utf-8", newline="") for name in TABLES]
        self._append(run_headers(self._motion.joint_names, self._motion.dof_names), self._intervals.header())

    def _append(self, rows: tuple[list[str], list[str]], intervals: str) -> None:
        """Append a row to joints.csv and angles.csv, and lines to intervals.csv."""
        with self._system_errors():
            for table, text in zip(self._tables, (*map(csv_line, rows), intervals), strict=True):
                table.write(text)
                table.flush()  # so that a killed run keeps it

    def _finish(self, complete: bool) -> None:
        for table in self._tables:
            with contextlib.suppress(OSError):
                table.close()
        motion = self._motion.build()
        # The most important file first, in case the disk is full.
        write_motion_npz(self.folder / "motion.npz", motion)
        counts = {"complete": complete, "frames": len(motion), "status": motion.status_counts,
                  "limb_status": motion.limb_status_counts}
        write_metrics(self.folder, counts | self.metrics)
        self._write_info(complete)

    def _write_info(self, complete: bool) -> None:
        import tomli_w

        head = {"complete": complete, "frames": len(self._motion)}
        write_whole(self.folder / "run.toml", tomli_w.dumps(head | self.info))

    @contextlib.contextmanager
    def _system_errors(self) -> Iterator[None]:
        """Convert `OSError` to `ShadowPuppetError`, which states what was saved."""
        try:
            yield
        except OSError as error:
            frames = len(self._motion)
            kept = f"; the {frames} frames so far are in joints.csv and angles.csv" if frames else ""
            raise ShadowPuppetError(f"{self.folder}: the run cannot be written ({reason(error)}){kept}") from None


def read_run(folder: str | Path) -> Run:
    """Read a run folder, also a killed run's. Raises `FormatError`, naming file, line and column, if something is malformed."""
    folder = Path(folder)
    if not (folder / "run.toml").exists():
        raise FormatError(f"{folder}: found no run.toml in it, expected the folder of a run, as `shadowpuppet track` writes it")
    info = read_toml(folder / "run.toml", FormatError)
    _check_info(folder / "run.toml", info)
    whole = (folder / "motion.npz").exists()
    motion = read_motion_npz(folder / "motion.npz") if whole else _read_tables(folder, info["body"], cut=not info["complete"])
    return Run(folder, motion, info, _read_metrics(folder / "metrics.json"))


def write_metrics(folder: str | Path, metrics: Mapping[str, Any]) -> None:
    """Write metrics.json; NaN becomes null. Raises `ShadowPuppetError` if that fails."""
    text = json.dumps(for_json(plain(metrics, "metrics")), indent=1, ensure_ascii=False, allow_nan=False)
    write_whole(Path(folder) / "metrics.json", text + "\n")


def versions() -> dict[str, str]:
    """Versions of Python and the libraries on which results depend."""
    found = {"python": platform.python_version()}
    for name in ("shadowpuppet", "numpy", "scipy", "numba", "opencv-python-headless", "av"):
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def _check_folder(folder: Path) -> bool:
    """Whether a folder holds an earlier run. Raises `ShadowPuppetError` if it holds other files."""
    names = sorted(path.name for path in folder.iterdir())
    if not names:
        return False
    info = folder / "run.toml"
    if not info.exists() or not {"complete", "versions"} <= set(read_toml(info, FormatError)):
        raise ShadowPuppetError(f"{folder}: found {shorten(names, 60)} in it but no run.toml of a run, expected a new or empty "
                                "folder, or that of an earlier run, which is replaced")
    return True


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


def _read_metrics(path: Path) -> dict[str, Any]:
    if not path.exists():
        return {}
    try:
        data = json.loads(path.read_text("utf-8"))
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({reason(error)})") from None
    except (ValueError, RecursionError) as error:
        raise FormatError(f"{path}: not valid JSON: {error}") from None
    if not isinstance(data, dict):
        raise FormatError(f"{path}: found {type(data).__name__}, expected an object {{...}}")
    return data
