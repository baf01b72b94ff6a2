"""Run folders: what a tracker found, frame by frame as it finds it, with the settings and measures that belong to it.

    joints.csv    time, <joint>_x, _y, _z (m, world), <joint>_sd_x, _sd_y, _sd_z (m), status, cost (px), overlap (0..1)
    angles.csv    time, every degree of freedom (rad or m), then <dof>_sd
    motion.npz    the fields of `Motion`, arrays only
    run.toml      complete, frames, body, versions, and whatever the tracker says: recording, method, seed, settings, sizes, ...
    metrics.json  complete, frames, status (number of frames of each), timings, errors, ...

The tables grow with every frame; the other files are written at the end, however it comes, so that `complete` in run.toml tells
whether the run came to it. A run that was killed is read from its tables.
"""

from __future__ import annotations

import contextlib
import io
import json
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from importlib import metadata
from pathlib import Path
from typing import Any, Self, TextIO

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, reason
from shadowpuppet.io.calibration.calibration_files import read_toml
from shadowpuppet.io.files.npz import BROKEN
from shadowpuppet.io.files.plain import for_json, for_toml, plain
from shadowpuppet.io.files.table import Table, cells, csv_line, read_table, shorten
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.table import joint_columns, joint_names
from shadowpuppet.motion.motion import STATUSES, Motion, MotionBuilder, MotionFrame

FILES = ("joints.csv", "angles.csv", "motion.npz", "metrics.json", "overlay.mp4")
"""What a new run in an earlier one's folder replaces or removes; run.toml, which makes a folder a run's, always stays."""
OWN_KEYS = ("complete", "frames", "body", "versions")
"""Keys of run.toml that the writer fills in itself."""


@dataclass(frozen=True, eq=False)
class Run:
    """A run as it was read."""

    folder: Path
    motion: Motion
    info: dict[str, Any]
    """run.toml."""
    metrics: dict[str, Any]
    """metrics.json; empty where there is none."""

    @property
    def complete(self) -> bool:
        """Whether the run came to its end."""
        return self.info["complete"]

    @property
    def settings(self) -> dict[str, Any]:
        """The settings it was made with."""
        return self.info.get("settings", {})


class RunWriter:
    """A run being written: `with RunWriter(...) as run: run.write(frame)`; `run.metrics` may be filled until the end.

    The folder must be new, empty or an earlier run's, which the first frame replaces. Raises `ShadowPuppetError` for any other
    folder and where it cannot be written; what was written before stays readable.
    """

    def __init__(self, folder: str | Path, body_name: str, dof_names: Sequence[str], joint_names: Sequence[str],
                 info: Mapping[str, Any]) -> None:
        """`info`: what run.toml is to say; dataclasses, arrays, paths and None (left out) are made plain."""
        taken = set(info) & set(OWN_KEYS)
        if taken:
            raise ShadowPuppetError(f"info: found {min(taken)!r}, which the run's writer fills in itself")
        self.folder, self.metrics = Path(folder), dict[str, Any]()
        self.info = for_toml(plain(info, "info")) | {"body": body_name, "versions": versions()}
        self._motion = MotionBuilder(body_name, dof_names, joint_names)
        self._tables: list[TextIO] = []
        self._earlier = False

    def __enter__(self) -> Self:
        """Make the folder, or refuse it."""
        with self._told():
            self.folder.mkdir(parents=True, exist_ok=True)
            self._earlier = _check_folder(self.folder)
            probe = self.folder / "run.toml.part"  # a folder that cannot be written is better known before hours of work
            probe.touch()
            probe.unlink()
        if not self._earlier:
            self._write_info(complete=False)  # what others add before the first frame then lies in a run's folder
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Complete the files; after an error as far as possible, and the error goes on."""
        if kind is None:
            self._start()
            self._finish(complete=True)
        elif not self._tables:
            self._leave()
        else:
            with contextlib.suppress(ShadowPuppetError):
                self._finish(complete=False)

    def _leave(self) -> None:
        """Leave no folder of a run that had no frame, but what others put into it."""
        with contextlib.suppress(OSError):
            if not self._earlier and [path.name for path in self.folder.iterdir()] == ["run.toml"]:
                (self.folder / "run.toml").unlink()
                self.folder.rmdir()

    def write(self, frame: MotionFrame) -> None:
        """Add a frame. Raises `ShadowPuppetError` where it does not fit the run or the disk."""
        self._start()
        kept = self._motion.append(frame)
        joints, joint_sd = (np.asarray(values).reshape(-1, 3) for values in (kept.joints, kept.joint_sd))
        places = np.concatenate([joints, joint_sd], 1).ravel().tolist()
        angles = np.concatenate([np.asarray(kept.pose), np.asarray(kept.pose_sd)]).tolist()
        time, fit = cells([kept.time]), [*cells([kept.cost], 2), *cells([kept.overlap])]
        self._append([[*time, *cells(places), kept.status, *fit], [*time, *cells(angles)]])

    def _start(self) -> None:
        """Replace an earlier run, once."""
        if self._tables:
            return
        with self._told():
            for name in FILES:
                (self.folder / name).unlink(missing_ok=True)
        self._write_info(complete=False)
        with self._told():
            self._tables = [(self.folder / name).open("w", encoding="utf-8", newline="") for name in FILES[:2]]
        joints, dofs = self._motion.joint_names, self._motion.dof_names
        places = [column for name in joints for suffix in ("", "_sd") for column in joint_columns((name,), suffix)]
        self._append([["time", *places, "status", "cost", "overlap"], ["time", *dofs, *(f"{name}_sd" for name in dofs)]])

    def _append(self, rows: list[list[str]]) -> None:
        with self._told():
            for table, row in zip(self._tables, rows):
                table.write(csv_line(row))
                table.flush()  # so that a killed run keeps it

    def _finish(self, complete: bool) -> None:
        for table in self._tables:
            with contextlib.suppress(OSError):
                table.close()
        motion = self._motion.build()
        # What matters most is written first: where the disk is full, it is the rest that is missing.
        write_whole(self.folder / "motion.npz", motion_bytes(motion))
        counts = {"complete": complete, "frames": len(motion), "status": motion.status_counts}
        write_metrics(self.folder, counts | self.metrics)
        self._write_info(complete)

    def _write_info(self, complete: bool) -> None:
        import tomli_w

        head = {"complete": complete, "frames": len(self._motion)}
        write_whole(self.folder / "run.toml", tomli_w.dumps(head | self.info))

    @contextlib.contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except OSError as error:
            frames = len(self._motion)
            kept = f"; the {frames} frames so far are in joints.csv and angles.csv" if frames else ""
            raise ShadowPuppetError(f"{self.folder}: the run cannot be written ({reason(error)}){kept}") from None


def read_run(folder: str | Path) -> Run:
    """Read a run folder, a killed run's too. Raises `FormatError`, naming file, line and column, where something is malformed."""
    folder = Path(folder)
    if not (folder / "run.toml").exists():
        raise FormatError(f"{folder}: found no run.toml in it, expected the folder of a run, as `shadowpuppet track` writes it")
    info = read_toml(folder / "run.toml", FormatError)
    _check_info(folder / "run.toml", info)
    whole = (folder / "motion.npz").exists()
    motion = _read_npz(folder / "motion.npz") if whole else _read_tables(folder, info["body"], cut=not info["complete"])
    return Run(folder, motion, info, _read_metrics(folder / "metrics.json"))


def write_metrics(folder: str | Path, metrics: Mapping[str, Any]) -> None:
    """Write metrics.json; values that are not numbers become null. Raises `ShadowPuppetError` where that fails."""
    text = json.dumps(for_json(plain(metrics, "metrics")), indent=1, ensure_ascii=False, allow_nan=False)
    write_whole(Path(folder) / "metrics.json", text + "\n")


def versions() -> dict[str, str]:
    """Versions of what a run depends on."""
    found = {"python": platform.python_version()}
    for name in ("shadowpuppet", "numpy", "scipy", "numba", "opencv-python-headless", "av"):
        with contextlib.suppress(metadata.PackageNotFoundError):
            found[name] = metadata.version(name)
    return found


def _check_folder(folder: Path) -> bool:
    """Whether there is an earlier run in a folder. Raises `ShadowPuppetError` where there are files, but not a run's."""
    names = sorted(path.name for path in folder.iterdir())
    if not names:
        return False
    info = folder / "run.toml"
    if not info.exists() or not {"complete", "versions"} <= set(read_toml(info, FormatError)):
        raise ShadowPuppetError(f"{folder}: found {shorten(names, 60)} in it but no run.toml of a run, expected a new or empty "
                                "folder, or that of an earlier run, which is replaced")
    return True


def motion_bytes(motion: Motion) -> bytes:
    """The motion's fields as an archive of arrays."""
    out = io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, **{f.name: np.asarray(getattr(motion, f.name)) for f in fields(motion)})
    return out.getvalue()


def _read_npz(path: Path) -> Motion:
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            missing = [f.name for f in fields(Motion) if f.name not in data]
            arrays: dict[str, Any] = {f.name: data[f.name] for f in fields(Motion) if not missing}
        if not missing:
            arrays["body_name"] = str(arrays["body_name"])
            return Motion(**arrays)
        problem = f"no array {missing[0]!r}"
    except (OSError, *BROKEN, ShadowPuppetError) as error:
        problem = str(error)
    raise FormatError(f"{path}: not a motion ({problem}); without this file the run is read from joints.csv and angles.csv")


def _read_tables(folder: Path, body_name: str, cut: bool) -> Motion:
    if cut and not (folder / "joints.csv").exists():
        raise FormatError(f"{folder}: the run ended before its first frame, so that there is nothing to read")
    joints, angles = (read_table(folder / name, cut) for name in FILES[:2])
    frames, names = _common_frames(joints, angles, cut), joint_names(joints)
    dofs = tuple(name for name in angles.columns if name != "time" and not name.endswith("_sd"))
    series: dict[str, Any] = {
        "times": joints.times(), "status": _statuses(joints), "cost": joints.numbers(["cost"])[:, 0],
        "overlap": joints.numbers(["overlap"])[:, 0], "joints": joints.numbers(joint_columns(names)).reshape(-1, len(names), 3),
        "joint_sd": joints.numbers(joint_columns(names, "_sd")).reshape(-1, len(names), 3), "poses": angles.numbers(dofs),
        "pose_sd": angles.numbers([f"{name}_sd" for name in dofs]),
    }
    series = {name: values[:frames] for name, values in series.items()}
    try:
        return Motion(body_name=body_name, dof_names=dofs, joint_names=names, **series)
    except ShadowPuppetError as error:
        raise FormatError(f"{folder}: joints.csv and angles.csv: {error}") from None


def _common_frames(joints: Table, angles: Table, cut: bool) -> int:
    """Number of frames in both tables; in a killed run one of them may be a frame ahead."""
    times, others = joints.times(), angles.times()
    frames = min(len(times), len(others)) if cut else max(len(times), len(others))
    if not np.array_equal(times[:frames], others[:frames]):
        raise FormatError(f"{angles.path}: column 'time': found other times than in joints.csv, expected the same")
    return frames


def _statuses(table: Table) -> np.ndarray:
    status = table.texts("status")
    wrong = [i for i, word in enumerate(status) if word not in STATUSES]
    if wrong:
        raise FormatError(f"{table.path}: line {table.lines[wrong[0]]}, column 'status': found {shorten([status[wrong[0]]])!r}, "
                          f"expected one of {', '.join(STATUSES)}")
    return np.array(status, str)


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
