"""Reads and writes TRC files (Motion Analysis; OpenSim, Pose2Sim): markers over time, separated by tabs, usually in millimetres."""

from __future__ import annotations

import re
from pathlib import Path
from warnings import warn

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning, choices
from shadowpuppet.io.files.table import cells, check_times, number, shorten
from shadowpuppet.io.files.text import errors_named, read_text, write_whole
from shadowpuppet.motion.motion import JointTable

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Units of length in metres."""
KEYS = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames")


def read_trc(path: str | Path) -> JointTable:
    """Read a TRC file: markers in metres, in the file's axes; an empty cell is unknown.

    Raises `FormatError`, naming line and column, if the file is malformed; warns of a wrong number of frames.
    """
    path = Path(path)
    lines = [re.split("\t", line) for line in read_text(path).splitlines()]
    if len(lines) < 4 or lines[0][0].split()[:1] != ["PathFileType"] or lines[3][0].strip() != "Frame#":
        raise FormatError(f"{path}: found no TRC header, expected lines that begin with PathFileType, DataRate, a number, Frame#")
    keys, said = ([cell.strip() for cell in line if cell.strip()] for line in lines[1:3])  # some files have doubled tabs there
    header = dict(zip(keys, said))
    names, scale = _markers(path, header, lines[3]), _scale(path, header)
    columns = ["Frame#", "Time", *(f"{name} {axis}" for name in names for axis in "XYZ")]
    start = 5 if len(lines) > 4 and not lines[4][0].strip() else 4  # X1 Y1 Z1 ..., which some files lack
    numbered = [(i, row) for i, row in enumerate(lines[start:], start + 1) if any(map(str.strip, row))]
    values = np.array([_row(path, i, columns, row) for i, row in numbered]).reshape(len(numbered), len(columns) - 1)
    check_times(path, values[:, 0], [i for i, _ in numbered])
    _check_count(path, header, len(numbered))
    with errors_named(path):
        return JointTable(values[:, 0], names, values[:, 1:].reshape(-1, len(names), 3) * scale)


def write_trc(path: str | Path, table: JointTable, unit: str = "mm") -> None:
    """Write joints as markers without changing axes; cells are empty if unknown. Raises `ShadowPuppetError` if that fails."""
    path = Path(path)
    if unit not in METRES:
        raise ShadowPuppetError(f"unit: found {unit!r}, expected one of {choices(METRES)}")
    bad = [name for name in table.names if "\t" in name or name.splitlines() != [name]]
    if bad:
        raise ShadowPuppetError(f"{path}: marker name: found {bad[0]!r}, expected one without tabs and line ends")
    count, rate = len(table.times), _rate(table)
    values = (rate, rate, count, len(table.names), unit, rate, 1, count)
    axes = [f"{axis}{n}" for n in range(1, len(table.names) + 1) for axis in "XYZ"]
    names = [cell for name in table.names for cell in (name, "", "")]
    head = [["PathFileType", "4", "(X/Y/Z)", path.name], KEYS, map(str, values), ["Frame#", "Time", *names], ["", "", *axes],
            [""]]
    scaled = table.positions.reshape(count, 3 * len(table.names)) / METRES[unit]
    decimals = {"mm": 3, "cm": 4, "m": 6}[unit]
    frames = enumerate(zip(table.times.tolist(), scaled.tolist()), 1)
    rows = [[str(n), *cells([time]), *cells(row, decimals)] for n, (time, row) in frames]
    rows = [row if row[-1] else [*row, ""] for row in rows]  # OpenSim ignores an empty last cell without a tab after it
    write_whole(path, "".join("\t".join(line) + "\n" for line in [*head, *rows]))


def _markers(path: Path, header: dict[str, str], line: list[str]) -> tuple[str, ...]:
    names = [name.strip() for name in line[2::3]]
    while names and not names[-1]:
        names.pop()
    stray = [cell.strip() for i, cell in enumerate(line[2:]) if i % 3 and cell.strip()]
    if not names or not all(names) or stray:
        raise FormatError(f"{path}: line 4: found {shorten(line[2:])!r}, expected a marker's name in every third column")
    said = header.get("NumMarkers", "")
    if said != str(len(names)):
        raise FormatError(f"{path}: line 3, NumMarkers: found {said!r}, expected {len(names)}, as many as line 4 has names")
    return tuple(names)


def _scale(path: Path, header: dict[str, str]) -> float:
    unit = header.get("Units", "")
    if unit.lower() not in METRES:
        raise FormatError(f"{path}: line 3, Units: found {unit!r}, expected one of {choices(METRES)}")
    return METRES[unit.lower()]


def _row(path: Path, line: int, columns: list[str], row: list[str]) -> list[float]:
    while len(row) > len(columns) and not row[-1].strip():
        row = row[:-1]  # tabs at the end of a line are common
    if len(row) != len(columns):
        raise FormatError(f"{path}: line {line}: found {len(row)} cells, expected {len(columns)} for {len(columns) // 3} markers")
    return [number(path, line, column, cell) for column, cell in zip(columns[1:], row[1:])]


def _check_count(path: Path, header: dict[str, str], count: int) -> None:
    said = header.get("NumFrames", "")
    if said != str(count):
        warn(f"{path}: line 3, NumFrames: found {said!r}, but the file has {count} frames; those are used", ShadowPuppetWarning,
             stacklevel=3)


def _rate(table: JointTable) -> str:
    step = float(np.median(np.diff(table.times))) if len(table.times) > 1 else 1.0
    return f"{1 / step:.6g}"
