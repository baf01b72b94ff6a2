"""Reads and writes TRC files (Motion Analysis; OpenSim, Pose2Sim): markers over time, separated by tabs, usually in millimetres."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FormatError, ShadowPuppetError, choices, warn
from shadowpuppet.io.files.table import cells, check_times, number, shorten
from shadowpuppet.io.files.text import errors_named, read_text, write_whole
from shadowpuppet.motion.interpolation import filled, rate_of
from shadowpuppet.motion.motion import JointTable

METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Units of length in metres."""
MISSING = ("nan", "drop", "fill")
"""Ways to write unknown positions: the text NaN; no frame that has one; interpolated positions."""
KEYS = ("DataRate", "CameraRate", "NumFrames", "NumMarkers", "Units", "OrigDataRate", "OrigDataStartFrame", "OrigNumFrames")


def read_trc(path: str | Path) -> JointTable:
    """Read a TRC file: markers in metres, in the file's axes; an empty cell or NaN is unknown.

    The column of times counts: DataRate is often rounded.
    Blanks in the first three lines and doubled tabs are allowed where they leave no doubt: samples of OpenSim have them.
    Raises `FormatError`, naming line and column, if the file is malformed; warns of a wrong number of frames.
    """
    path = Path(path)
    lines = [line.split("\t") for line in read_text(path).splitlines()]
    if len(lines) < 4 or lines[0][0].split()[:1] != ["PathFileType"] or lines[3][0].split()[:1] != ["Frame#"]:
        raise FormatError(f"{path}: found no TRC header, expected lines that begin with PathFileType, DataRate, a number, Frame#")
    keys, said = (" ".join(line).split() for line in lines[1:3])
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


def write_trc(path: str | Path, table: JointTable, unit: str = "mm", missing: str = "nan") -> None:
    """Write joints as markers without changing axes. Raises `ShadowPuppetError` if that fails.

    Unknown positions are never empty cells: pandas and Pose2Sim lose an empty last cell and its tab, and OpenSim stops at a row without
    numbers; all of them read NaN.

    Args:
        path: the file.
        table: the joints.
        unit: m, cm or mm.
        missing: what is written for unknown positions (of `MISSING`): `nan`, the text NaN; `drop`, no frame that has one; `fill`, positions
            interpolated between known frames, held before the first and after the last. `drop` and `fill` leave out joints without any
            known position.
    """
    path = Path(path)
    if unit not in METRES:
        raise ShadowPuppetError(f"unit: found {unit!r}, expected one of {choices(METRES)}")
    bad = [name for name in table.names if "\t" in name or name.splitlines() != [name]]
    if bad:
        raise ShadowPuppetError(f"{path}: marker name: found {bad[0]!r}, expected one without tabs and line ends")
    rate = f"{rate_of(table.times) if len(table.times) > 1 else 1.0:.6g}"
    table = _without_gaps(path, table, missing)
    count = len(table.times)
    values = (rate, rate, count, len(table.names), unit, rate, 1, count)
    axes = [f"{axis}{n}" for n in range(1, len(table.names) + 1) for axis in "XYZ"]
    names = [cell for name in table.names for cell in (name, "", "")]
    head = [["PathFileType", "4", "(X/Y/Z)", path.name], KEYS, map(str, values), ["Frame#", "Time", *names], ["", "", *axes],
            [""]]
    scaled = table.positions.reshape(count, 3 * len(table.names)) / METRES[unit]
    decimals = {"mm": 3, "cm": 4, "m": 6}[unit]
    frames = enumerate(zip(table.times.tolist(), scaled.tolist()), 1)
    rows = [[str(n), f"{time:.6f}", *(cell or "NaN" for cell in cells(row, decimals))] for n, (time, row) in frames]
    write_whole(path, "".join("\t".join(line) + "\n" for line in [*head, *rows]))


def _without_gaps(path: Path, table: JointTable, missing: str) -> JointTable:
    """The table as `write_trc` writes it for `missing`. Raises `ShadowPuppetError` if no frame or joint is left."""
    if missing not in MISSING:
        raise ShadowPuppetError(f"missing: found {missing!r}, expected one of {choices(MISSING)}")
    known: NDArray[np.bool_] = np.asarray(np.isfinite(table.positions).all(2))
    if missing == "nan" or known.all():
        return table
    seen = np.flatnonzero(known.any(0))
    kept, known = table.select([table.names[n] for n in seen]), known[:, seen]
    whole = np.flatnonzero(known.all(1))
    if not len(seen) or (missing == "drop" and not len(whole)):
        raise ShadowPuppetError(f"{path}: found no frame in which all of {len(seen)} joints are known, expected one at least; "
                                "nan and fill write other frames")
    if missing == "drop":
        return JointTable(kept.times[whole], kept.names, kept.positions[whole])
    return JointTable(kept.times, kept.names, filled(kept.times, np.where(known[:, :, None], kept.positions, np.nan)))


def _markers(path: Path, header: dict[str, str], line: list[str]) -> tuple[str, ...]:
    names = [name.strip() for name in line[2::3]]
    while names and not names[-1]:
        names.pop()
    stray = [cell.strip() for i, cell in enumerate(line[2:]) if i % 3 and cell.strip()]
    count, there = header.get("NumMarkers", ""), [i for i, cell in enumerate(line[2:]) if cell.strip()]
    if (stray or not all(names)) and count == str(len(there)) and all(i >= 3 * n for n, i in enumerate(there)):  # doubled tabs
        names, stray = [line[2 + i].strip() for i in there], []
    if not names or not all(names) or stray:
        raise FormatError(f"{path}: line 4: found {shorten(line[2:])!r}, expected a marker's name in every third column")
    if count != str(len(names)):
        raise FormatError(f"{path}: line 3, NumMarkers: found {count!r}, expected {len(names)}, as many as line 4 has names")
    return tuple(names)


def _scale(path: Path, header: dict[str, str]) -> float:
    unit = header.get("Units", "")
    if unit.lower() not in METRES:
        raise FormatError(f"{path}: line 3, Units: found {unit!r}, expected one of {choices(METRES)}")
    return METRES[unit.lower()]


def _row(path: Path, line: int, columns: list[str], row: list[str]) -> list[float]:
    while len(row) > len(columns) and not row[-1].strip():
        row = row[:-1]  # tabs at the end of a line are common
    if len(row) > len(columns) and sum(bool(cell.strip()) for cell in row) == len(columns):
        row = [cell for cell in row if cell.strip()]  # doubled tabs
    if len(row) != len(columns):
        raise FormatError(f"{path}: line {line}: found {len(row)} cells, expected {len(columns)} for {len(columns) // 3} markers")
    return [number(path, line, column, cell) for column, cell in zip(columns[1:], row[1:])]


def _check_count(path: Path, header: dict[str, str], count: int) -> None:
    said = header.get("NumFrames", "")
    if said != str(count):
        warn(f"{path}: line 3, NumFrames: found {said!r}, but the file has {count} frames; those are used")
