"""Reads tables exported by Motive (OptiTrack): a line of facts, rows of types, names and properties of the columns, then frames."""

from __future__ import annotations

import csv
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import check_times, lines_of, number, shorten
from shadowpuppet.io.files.text import errors_named
from shadowpuppet.motion.motion import JointTable

BEGINNING = "Format Version"
"""First cell of every such table."""
LENGTHS = {"meters": 1.0, "centimeters": 0.01, "millimeters": 0.001}
"""Units in metres."""
TYPES = ("Bone", "Marker", "Bone Marker", "Rigid Body Marker")
"""Types of columns with places, in order of preference; markers would be doubled beside others."""
UNNAMED = "Unlabeled"
"""Beginning of the names of markers that the program did not recognise."""
MAX_HEADER = 12
"""Rows within which the frames must begin."""


def is_motive(text: str) -> bool:
    """Whether a table's text is an export of Motive."""
    return text[:100].lstrip('"').startswith(BEGINNING)


def joints_of_motive(path: Path, text: str) -> JointTable:
    """Bones' beginnings, or markers if there are no bones, in metres, in the file's axes (Y up); NaN where unknown. `text`: the file's.

    Raises `FormatError`, naming line and column, if it has neither, or bones relative to their parents.
    """
    reader = csv.reader(lines_of(text))
    try:
        facts, head = _facts(next(reader)), _head(path, reader)
        scale, places = _scale(path, facts), _places(path, head)
        columns = [column for three in places.values() for column in three]
        times, values, lines = array("d"), array("d"), array("q")
        for row in reader:
            if not any(map(str.strip, row)):
                continue
            cells = [row[n] if n < len(row) else "" for n in (1, *columns)]
            found = [number(path, reader.line_num, f"{n + 1}", cell) for n, cell in zip((1, *columns), cells)]
            times.append(found[0])
            values.extend(found[1:])
            lines.append(reader.line_num)
    except csv.Error as error:
        raise FormatError(f"{path}: line {reader.line_num}: {error}, expected a table with commas (CSV)") from None
    positions: Array = np.array(values).reshape(len(times), len(places), 3) * scale
    check_times(path, np.array(times), lines)
    with errors_named(path):
        return JointTable(np.array(times), tuple(places), positions)


def _facts(row: list[str]) -> dict[str, str]:
    """The first line's facts by name."""
    return dict(zip(row[::2], row[1::2]))


def _head(path: Path, reader: Iterator[list[str]]) -> list[list[str]]:
    """The rows between the facts and the frames, without empty ones; the last names the axes."""
    head = list[list[str]]()
    for row in reader:
        if any(map(str.strip, row)):
            head.append([cell.strip() for cell in row])
        if row and row[0].strip() == "Frame" and len(head) > 3:
            return head
        if len(head) > MAX_HEADER:
            break
    raise FormatError(f"{path}: found no row that begins with Frame after those of types, names and properties, expected a table of Motive")


def _scale(path: Path, facts: dict[str, str]) -> float:
    unit, space = (facts.get(name, "").strip() for name in ("Length Units", "Coordinate Space"))
    if unit.lower() not in LENGTHS:
        raise FormatError(f"{path}: line 1, Length Units: found {shorten([unit], 60)!r}, expected one of {choices(LENGTHS)}")
    if space.lower() not in ("", "global"):
        raise FormatError(f"{path}: line 1, Coordinate Space: found {shorten([space], 60)!r}, expected Global: export from Motive with it")
    return LENGTHS[unit.lower()]


def _places(path: Path, head: list[list[str]]) -> dict[str, list[int]]:
    """The columns of x, y and z of each bone or marker, by its name."""
    width = len(head[-1])
    kinds, names, what = (row + [""] * (width - len(row)) for row in (head[0], head[1], head[-2]))
    found: dict[str, dict[str, list[int]]] = {}
    for n in range(2, width):
        if what[n] == "Position" and head[-1][n] in ("X", "Y", "Z") and not names[n].startswith(UNNAMED):
            found.setdefault(kinds[n], {}).setdefault(names[n], []).append(n)
    used = next((found[kind] for kind in TYPES if kind in found), None)
    if used is None:
        there = dict.fromkeys(kind for kind in kinds[2:] if kind)
        raise FormatError(f"{path}: found columns of {shorten(there) or 'nothing'}, expected positions of bones or named markers: export "
                          "from Motive with Bones or Markers on")
    for name, columns in used.items():
        if [head[-1][n] for n in columns] != ["X", "Y", "Z"]:
            raise FormatError(f"{path}: {shorten([name], 60)!r}: found {len(columns)} columns of its position, expected X, Y and Z once")
    return used
