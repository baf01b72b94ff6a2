"""Joints over time: tables of ours (CSV) and marker files (TRC)."""

from __future__ import annotations

from pathlib import Path

from shadowpuppet.errors import FormatError, ShadowPuppetError, choices
from shadowpuppet.io.files.table import Table, cells, csv_line, read_table, shorten
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.trc import read_trc, write_trc
from shadowpuppet.motion.motion import JointTable

__all__ = ["JointTable", "joint_columns", "joint_names", "read_joints", "write_joints"]


def read_joints(path: str | Path) -> JointTable:
    """Joints from a file: .csv with the header `time,<joint>_x,<joint>_y,<joint>_z,...` (seconds, metres), or .trc.

    Other columns of a table are skipped; an empty cell is an unknown place. Raises `FormatError` naming file, line and column.
    """
    path = Path(path)
    return _kind(path)[0](path)


def write_joints(path: str | Path, table: JointTable) -> None:
    """Write joints so that `read_joints` gives them back: .csv to the micrometre, or .trc. Raises `ShadowPuppetError`."""
    path = Path(path)
    _kind(path)[1](path, table)


def joint_names(table: Table) -> tuple[str, ...]:
    """Joints that a table has columns of, in order. Raises `FormatError` where there is none, or a column of one is missing."""
    stems = list(dict.fromkeys(column[:-2] for column in table.columns if column[-2:] in ("_x", "_y", "_z")))
    names = tuple(stem for stem in stems if not stem.endswith("_sd"))
    missing = [column for column in joint_columns(names) if column not in table.columns]
    if missing:
        raise FormatError(f"{table.path}: no column {missing[0]!r}, expected _x, _y and _z of every joint")
    if not names:
        raise FormatError(f"{table.path}: no joints, expected columns time,<joint>_x,<joint>_y,<joint>_z,...; "
                          f"found {shorten(table.columns)!r}")
    return names


def joint_columns(names: tuple[str, ...], suffix: str = "") -> list[str]:
    """Columns of joints: three each; `suffix` _sd for standard deviations."""
    return [f"{name}{suffix}_{axis}" for name in names for axis in "xyz"]


def _read_csv(path: Path) -> JointTable:
    table = read_table(path)
    names, times = joint_names(table), table.times()
    try:
        return JointTable(times, names, table.numbers(joint_columns(names)).reshape(len(times), len(names), 3))
    except FormatError:
        raise
    except ShadowPuppetError as error:
        raise FormatError(f"{path}: {error}") from None


def _write_csv(path: Path, table: JointTable) -> None:
    rows = table.positions.reshape(len(table.times), 3 * len(table.names)).tolist()
    lines = [csv_line(["time", *joint_columns(table.names)])]
    lines += [csv_line(cells([time, *row])) for time, row in zip(table.times.tolist(), rows)]
    write_whole(path, "".join(lines))


KINDS = {".csv": (_read_csv, _write_csv), ".trc": (read_trc, write_trc)}
"""How each kind of file is read and written."""


def _kind(path: Path) -> tuple:
    if path.suffix.lower() not in KINDS:
        raise FormatError(f"{path}: found the ending {path.suffix!r}, expected one of {choices(KINDS)}")
    return KINDS[path.suffix.lower()]
