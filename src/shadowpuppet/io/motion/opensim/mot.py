"""MOT files: a table of coordinates after a short header, with angles in degrees and lengths in metres."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import check_times, number, shorten
from shadowpuppet.io.files.text import read_text, write_whole

TRANSLATIONS = ("_tx", "_ty", "_tz")
"""Endings of coordinates in metres; all others are angles."""
MAX_HEADER = 100
"""Lines within which the header must end."""


class Coordinates(NamedTuple):
    """Coordinates over time."""

    times: Array
    """Seconds (T,)."""
    values: dict[str, Array]
    """Each coordinate's values (T,), rad or metres."""


def write_mot(path: str | Path, times: Array, values: Mapping[str, Array], smoothing: str = "") -> None:
    """Write coordinates (T,), rad or metres, as a MOT file. Frames with an unknown coordinate are left out: OpenSim has no gaps.
    `smoothing`: how the motion was smoothed, a line of the header.

    Raises `ShadowPuppetError` if no frame is known or the file cannot be written.
    """
    path = Path(path)
    table = np.stack([times, *(values[name] if name.endswith(TRANSLATIONS) else np.degrees(values[name]) for name in values)], 1)
    table = table[np.isfinite(table).all(1)]
    if not len(table) or not values:
        raise ShadowPuppetError(f"{path}: found no frame in which all of {len(values)} coordinates are known, expected one at least")
    sizes = [f"nRows={len(table)}", f"nColumns={table.shape[1]}"]
    note = [f"smoothing={smoothing}"] if smoothing else []
    head = [path.stem, "version=1", *sizes, "inDegrees=yes", *note, "endheader", "\t".join(["time", *values])]
    rows = ("\t".join(f"{value + 0.0:.6f}" for value in row) for row in table.round(6).tolist())
    write_whole(path, "\n".join([*head, *rows, ""]))


def read_mot(path: str | Path) -> Coordinates:
    """Read a MOT file. Raises `FormatError`, naming line and column, if it is malformed; warns of a wrong number of rows."""
    path = Path(path)
    lines = read_text(path).splitlines()
    end = next((n for n, line in enumerate(lines[:MAX_HEADER]) if line.strip().lower() == "endheader"), None)
    if end is None or len(lines) < end + 2:
        raise FormatError(f"{path}: found no line endheader with columns behind it, expected a MOT file of OpenSim")
    header = dict(line.strip().split("=", 1) for line in lines[:end] if "=" in line)
    columns = lines[end + 1].split()
    if columns[:1] != ["time"] or len(set(columns)) < len(columns) or len(columns) < 2:
        raise FormatError(f"{path}: line {end + 2}: found {shorten(columns)!r}, expected time and the names of coordinates, each once")
    numbered = [(n, line.split()) for n, line in enumerate(lines[end + 2 :], end + 3) if line.strip()]
    for n, row in numbered:
        if len(row) != len(columns):
            raise FormatError(f"{path}: line {n}: found {len(row)} numbers, expected {len(columns)}, as many as there are columns")
    table = np.array([[number(path, n, column, cell) for column, cell in zip(columns, row)] for n, row in numbered])
    table = table.reshape(-1, len(columns))
    check_times(path, table[:, 0], [n for n, _ in numbered])
    if header.get("nRows", str(len(table))).strip() != str(len(table)):
        warn(f"{path}: nRows: found {header['nRows']}, but the file has {len(table)} rows; those are used")
    angle = np.pi / 180 if header.get("inDegrees", "no").strip().lower() == "yes" else 1.0
    values = zip(columns[1:], table.T[1:])
    return Coordinates(table[:, 0], {name: column * (1.0 if name.endswith(TRANSLATIONS) else angle) for name, column in values})
