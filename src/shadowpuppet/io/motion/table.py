"""Our own tables: joints over time (CSV), a run's joints.csv and angles.csv, and a whole motion as columns.

The names of all columns are made here. `MotionFrame` and `Motion` (motion.motion) hold what stands in them.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FormatError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import Table, cells, csv_line, read_table, shorten, table_of
from shadowpuppet.io.files.text import errors_named, read_text, write_whole
from shadowpuppet.io.motion.motive import is_motive, joints_of_motive
from shadowpuppet.io.motion.trc import read_trc, write_trc
from shadowpuppet.motion.limbs import limbs_of
from shadowpuppet.motion.motion import OF_LATER_RUNS, SCALARS, STATUSES, JointTable, Motion, MotionFrame

AXES = ("_x", "_y", "_z")
SD = "_sd"
"""Suffix of columns of standard deviations; no name of a joint or degree of freedom may end in it."""
LIMB_STATUS = "_status"
"""Suffix of the columns of limbs' statuses."""
TRANSLATIONS = ("torso_y", "root_x", "root_y", "root_z")
"""Degrees of freedom in metres; all others are angles."""
Columns = dict[str, Array | NDArray[np.str_]]
"""Numbers or words (T,) by the column's name."""


def joint_columns(names: Sequence[str], suffix: str = "") -> list[str]:
    """Names of the columns of joints, three each; `suffix`: `SD` for standard deviations."""
    return [f"{name}{suffix}{axis}" for name in names for axis in AXES]


def column_joints(path: Path, columns: Sequence[str]) -> tuple[str, ...]:
    """The joints to which columns belong, in order. Raises `FormatError` if there is none, or one lacks a column."""
    stems = list(dict.fromkeys(column[:-2] for column in columns if column.endswith(AXES)))
    names = tuple(stem for stem in stems if not stem.endswith(SD))
    known = set(columns)
    missing = [column for column in joint_columns(names) if column not in known]
    if missing:
        raise FormatError(f"{path}: no column {missing[0]!r}, expected _x, _y and _z of every joint")
    if not names:
        raise FormatError(f"{path}: no joints, expected columns time,<joint>_x,<joint>_y,<joint>_z,...; found {shorten(columns)!r}")
    return names


# Joints


def read_joints(path: str | Path) -> JointTable:
    """Joints from a file: .csv with the header `time,<joint>_x,<joint>_y,<joint>_z,...` (seconds, metres) or of Motive, or .trc.

    Other columns are ignored; an empty cell is an unknown coordinate. Raises `FormatError` naming file, line and column.
    """
    path = Path(path)
    return _functions(path)[0](path)


def write_joints(path: str | Path, table: JointTable) -> None:
    """Write joints so that `read_joints` gives them back: .csv to the micrometre, or .trc. Raises `ShadowPuppetError`."""
    path = Path(path)
    _functions(path)[1](path, table)


def _read_csv(path: Path) -> JointTable:
    if is_motive(text := read_text(path)):
        return joints_of_motive(path, text)
    table = table_of(path, text)
    names, times = column_joints(path, table.columns), table.times()
    with errors_named(path):
        return JointTable(times, names, _joints(table, names))


def _joints(table: Table, names: tuple[str, ...], suffix: str = "") -> Array:
    return table.numbers(joint_columns(names, suffix)).reshape(-1, len(names), 3)


def _write_csv(path: Path, table: JointTable) -> None:
    write_columns(path, table_columns(table))


READERS_AND_WRITERS = {".csv": (_read_csv, _write_csv), ".trc": (read_trc, write_trc)}


def _functions(path: Path) -> tuple:
    if path.suffix.lower() not in READERS_AND_WRITERS:
        raise FormatError(f"{path}: found the ending {path.suffix!r}, expected one of {choices(READERS_AND_WRITERS)}")
    return READERS_AND_WRITERS[path.suffix.lower()]


# A run: joints.csv and angles.csv


def run_headers(joints: Sequence[str], dofs: Sequence[str]) -> tuple[list[str], list[str]]:
    """Columns of joints.csv and angles.csv."""
    positions = [column for name in joints for suffix in ("", SD) for column in joint_columns([name], suffix)]
    limbs = [limb + LIMB_STATUS for limb in limbs_of(joints)]
    return ["time", *positions, "status", *SCALARS, *limbs], ["time", *dofs, *(f"{name}{SD}" for name in dofs)]


def run_rows(frame: MotionFrame) -> tuple[list[str], list[str]]:
    """A complete frame's cells in joints.csv and angles.csv."""
    joints, joint_sd = (np.asarray(values).reshape(-1, 3) for values in (frame.joints, frame.joint_sd))
    positions = np.concatenate([joints, joint_sd], 1).ravel().tolist()
    angles = np.concatenate([np.asarray(frame.pose), np.asarray(frame.pose_sd)]).tolist()
    time = cells([frame.time])
    scalars = [cell for name, decimals in SCALARS.items() for cell in cells([getattr(frame, name)], decimals)]
    row = [*time, *cells(positions), frame.status, *scalars, *(frame.limb_status or ())]
    return row, [*time, *cells(angles)]


def write_raw(path: Path, joints: Path, angles: Path) -> None:
    """Write the rows of joints.csv and angles.csv side by side. Degrees of freedom are named with their unit, `chest_x [rad]`, so that none
    is taken for a joint's. A line at a time; raises `OSError`."""
    with (path.open("w", encoding="utf-8", newline="") as out, joints.open(encoding="utf-8", newline="") as left,
          angles.open(encoding="utf-8", newline="") as right):  # fmt: skip
        names = next(right).rstrip("\n").split(",")[1:]
        out.write(csv_line([*next(left).rstrip("\n").split(","), *(f"{name} [{dof_unit(name.removesuffix(SD))}]" for name in names)]))
        for one, two in zip(left, right):
            out.write(one.rstrip("\n") + two[two.index(",") :])


def read_raw(path: str | Path, body_name: str) -> Motion:
    """The motion in a run's raw.csv, as it was tracked. Raises `FormatError`, naming file, line and column."""
    table = read_table(Path(path))
    joints, dofs = column_joints(table.path, table.columns), [name for name in table.columns if name.endswith(("[rad]", "[m]"))]
    own = [name for name in dofs if not name.rpartition(" ")[0].endswith(SD)]
    others = [name for name in dofs if name not in own]
    if len(own) != len(others):
        raise FormatError(f"{table.path}: found {len(own)} degrees of freedom and {len(others)} standard deviations, expected as many")
    series: dict[str, Any] = _of_joints(table, joints) | {"poses": table.numbers(own), "pose_sd": table.numbers(others)}
    with errors_named(table.path):
        return Motion(body_name=body_name, dof_names=tuple(name.rpartition(" ")[0] for name in own), joint_names=joints, **series)


def read_run_tables(joints: Table, angles: Table, frames: int, body_name: str) -> Motion:
    """The first `frames` frames of joints.csv and angles.csv. Raises `ShadowPuppetError`, `FormatError` naming line and column."""
    names = column_joints(joints.path, joints.columns)
    dofs = tuple(name for name in angles.columns if name != "time" and not name.endswith(SD))
    deviations = angles.numbers([f"{name}{SD}" for name in dofs])
    series: dict[str, Any] = _of_joints(joints, names) | {"poses": angles.numbers(dofs), "pose_sd": deviations}
    series = {name: values[:frames] for name, values in series.items()}
    return Motion(body_name=body_name, dof_names=dofs, joint_names=names, **series)


def _of_joints(table: Table, names: Sequence[str]) -> dict[str, Any]:
    """The fields of a `Motion` that joints.csv has."""
    joints = tuple(names)
    return {"times": table.times(), "status": _statuses(table, "status"), "limb_status": _limb_statuses(table, joints),
            "joints": _joints(table, joints), "joint_sd": _joints(table, joints, SD),
            **{name: table.numbers([name])[:, 0] for name in SCALARS if name in table.columns or name not in OF_LATER_RUNS}}


def _limb_statuses(table: Table, joints: Sequence[str]) -> np.ndarray:
    """Statuses (T, K) of the limbs; (0, 0) of runs made before limbs had one."""
    columns = [limb + LIMB_STATUS for limb in limbs_of(joints)]
    if not set(columns) & set(table.columns):
        return np.empty((0, 0), str)
    return np.stack([_statuses(table, column) for column in columns], 1)


def _statuses(table: Table, column: str) -> np.ndarray:
    status = table.texts(column)
    wrong = [i for i, word in enumerate(status) if word not in STATUSES]
    if wrong:
        raise FormatError(f"{table.path}: line {table.lines[wrong[0]]}, column {column!r}: found {shorten([status[wrong[0]]])!r}, "
                          f"expected one of {', '.join(STATUSES)}")
    return np.array(status, str)


# Columns, for exports


def motion_columns(motion: Motion) -> Columns:
    """A whole motion: `time`, joints (world, metres), their deviations, `status`, `SCALARS`, then degrees of freedom.

    Names of degrees of freedom end in their unit, `chest_x [rad]`, so that none is taken for a joint's. Columns without a known value are
    left out.
    """
    found: Columns = table_columns(motion.table)
    deviations = motion.joint_sd.reshape(len(motion), 3 * len(motion.joint_names)).T
    found |= dict(zip(joint_columns(motion.joint_names, SD), deviations))
    found |= {"status": motion.status, **{name: getattr(motion, name) for name in SCALARS}}
    found |= {limb + LIMB_STATUS: column for limb, column in zip(motion.limbs, motion.limb_status.T)}
    for values, suffix in ((motion.poses, ""), (motion.pose_sd, SD)):
        found |= {f"{name}{suffix} [{dof_unit(name)}]": column for name, column in zip(motion.dof_names, values.T)}
    always = {"time", "status", *joint_columns(motion.joint_names), *(limb + LIMB_STATUS for limb in motion.limbs)}
    return {name: column for name, column in found.items() if name in always or np.isfinite(column.astype(float)).any()}


def table_columns(table: JointTable) -> Columns:
    """`time`, and each joint's `_x`, `_y`, `_z`."""
    found: Columns = {"time": table.times}
    return found | dict(zip(joint_columns(table.names), table.positions.reshape(len(table.times), 3 * len(table.names)).T))


def dof_unit(name: str) -> str:
    """The unit of a degree of freedom by its name: m or rad."""
    return "m" if name in TRANSLATIONS else "rad"


def write_columns(path: Path, columns: Columns) -> None:
    """Write columns as CSV, to the micrometre; empty cells for NaN. Raises `ShadowPuppetError` if that fails."""
    texts = [column.tolist() if column.dtype.kind == "U" else cells(column.tolist()) for column in columns.values()]
    write_whole(path, "".join([csv_line(columns), *map(csv_line, zip(*texts))]))
