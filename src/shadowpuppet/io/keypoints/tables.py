"""Reads tables of keypoints (CSV): DeepLabCut's, whose columns have a header of several lines, and SLEAP's analysis.

    DeepLabCut   scorer, (individuals), bodyparts, coords: four or three lines; then frame, x, y, likelihood, x, y, likelihood, ...
    SLEAP        track, frame_idx, instance.score, NODE.x, NODE.y, NODE.score, ...: one person a line
"""

from __future__ import annotations

import csv
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, warn
from shadowpuppet.io.files.table import lines_of, number, shorten
from shadowpuppet.io.files.text import errors_named, read_text
from shadowpuppet.io.keypoints.film_keypoints import FilmKeypoints
from shadowpuppet.io.keypoints.gathering import Gathered

HEADER = ("scorer", "individuals", "bodyparts", "coords")
"""First cells of the lines of DeepLabCut's header."""
SLEAP = ("track", "frame_idx", "instance.score")
"""SLEAP's columns beside those of landmarks; the score of all of a person is not used."""


class Row(NamedTuple):
    """A line of a table."""

    line: int
    cells: list[str]


def read_keypoint_table(path: Path, size: tuple[int, int]) -> FilmKeypoints:
    """Keypoints in a table of a film of a `size`. Raises `FormatError`, naming the line."""
    with errors_named(path):
        rows = _rows(path)
        first = next(rows, Row(1, [""]))
        if first.cells[0].strip() == HEADER[0]:
            return _deeplabcut(path, first, rows, size)
        if SLEAP[1] in first.cells:
            return _sleap(path, first, rows, size)
        raise ShadowPuppetError(f"found the columns {shorten(first.cells)!r}, expected DeepLabCut's lines scorer, bodyparts, coords, or "
                                "SLEAP's columns track, frame_idx, NODE.x, NODE.y, NODE.score")


def _rows(path: Path) -> Iterator[Row]:
    """The lines that are not empty, all of one length."""
    reader, length = csv.reader(lines_of(read_text(path))), 0
    try:
        for cells in reader:
            if len(cells) > 1 or any(map(str.strip, cells)):
                length = length or len(cells)
                if len(cells) != length:
                    raise FormatError(f"{path}: line {reader.line_num}: found {len(cells)} cells, expected {length} as in the first")
                yield Row(reader.line_num, cells)
    except csv.Error as error:
        raise FormatError(f"{path}: line {reader.line_num}: {error}, expected a table with commas (CSV)") from None


def _frame(path: Path, row: Row, cell: str) -> int:
    if not (cell.isascii() and cell.isdigit() and len(cell) < 20):
        raise FormatError(f"{path}: line {row.line}: found the frame {shorten([cell])!r}, expected a whole number from 0 on")
    return int(cell)


def _deeplabcut(path: Path, first: Row, rows: Iterator[Row], size: tuple[int, int]) -> FilmKeypoints:
    header, body = {HEADER[0]: first.cells}, None
    for body in rows:
        if body.cells[0].strip() not in HEADER:
            break
        header[body.cells[0].strip()] = body.cells
    if not set(header) >= {"bodyparts", "coords"}:
        raise ShadowPuppetError(f"found the lines {', '.join(header)}, expected scorer, (individuals), bodyparts, coords")
    people = header.get("individuals", header["scorer"])
    columns = {key: n for n, key in enumerate(zip(people, header["bodyparts"], header["coords"])) if n}
    persons, names = list(dict.fromkeys(key[0] for key in columns)), list(dict.fromkeys(key[1] for key in columns))
    unknown = {key[2] for key in columns} ^ {"x", "y", "likelihood"}
    if unknown or len(columns) != len(people) - 1:
        raise ShadowPuppetError(f"coords: found {shorten(sorted({key[2] for key in columns}))} in {len(people) - 1} columns, expected x, y "
                                "and likelihood of every landmark, once")
    gathered, several = Gathered(names, "DeepLabCut", size), "individuals" in header
    places = {person: [columns.get((person, name, part)) for name in names for part in ("x", "y", "likelihood")] for person in persons}
    for row in [] if body is None or body.cells[0].strip() in HEADER else [body, *rows]:
        frame = _frame(path, row, row.cells[0].strip())
        for n, person in enumerate(persons):
            values = [np.nan if place is None else number(path, row.line, names[k // 3], row.cells[place])
                      for k, place in enumerate(places[person])]
            gathered.add(frame, n if several else -1, np.reshape(values, (-1, 3)))
    return gathered.film()


def _sleap(path: Path, first: Row, rows: Iterator[Row], size: tuple[int, int]) -> FilmKeypoints:
    columns = {name.strip(): n for n, name in enumerate(first.cells)}
    names = list(dict.fromkeys(name.removesuffix(".x") for name in columns if name.endswith(".x")))
    wanted = [f"{name}.{part}" for name in names for part in ("x", "y", "score")]
    missing = [name for name in wanted if name not in columns]
    if missing or len(columns) != len(first.cells):
        raise ShadowPuppetError(f"found the columns {shorten(columns)!r}, expected every one once"
                                + (f", and {missing[0]} among them" if missing else ""))
    unknown = sorted(set(columns) - set(wanted) - set(SLEAP))
    if unknown:
        warn(f"{path}: columns that are not known are not used: {shorten(unknown)}")
    gathered, tracks = Gathered(names, "SLEAP", size, raw=True), dict[str, int]()
    for row in rows:
        track = row.cells[columns["track"]].strip() if "track" in columns else ""
        values = [number(path, row.line, name, row.cells[columns[name]]) for name in wanted]
        gathered.add(_frame(path, row, row.cells[columns[SLEAP[1]]].strip()), tracks.setdefault(track, len(tracks)) if track else -1,
                     np.reshape(values, (-1, 3)))
    return gathered.film()
