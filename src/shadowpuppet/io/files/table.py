"""Reads and writes tables with named columns (CSV), and checks their cells.

A spreadsheet takes a cell that begins with =, +, -, @, a tab or a line end for a formula, which may run a program. Such cells are
written with an apostrophe before them, which is taken away when the table is read: the same for every table, so that a name is read as it
was. Numbers stay as they are.
"""

from __future__ import annotations

import csv
import io
import re
from array import array
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.text import read_text

SEPARATORS = {";": "semicolons", "\t": "tabs"}
"""Signs with which other programs separate columns."""
FORMULA = re.compile(r"'*[=+\-@\t\r\n\uff0b\uff0d\uff1d\uff20]")
"""Beginning of a cell that a spreadsheet may take for a formula, with the apostrophes before it."""
COMMA = re.compile(r"[+-]?\d*,\d+(e[+-]?\d+)?", re.IGNORECASE | re.ASCII)
"""A number with a decimal comma, as programs of many countries write it."""
NUMBER = re.compile(r"-?(\d+\.?\d*|\.\d+)(e[+-]?\d+)?|-?(inf|nan)")


@dataclass(frozen=True, eq=False)
class Table:
    """A table as text. Columns are parsed on access; unused ones may contain anything. Cells are not kept apart: as texts of their own they
    would take forty times the file's size."""

    path: Path
    columns: tuple[str, ...]
    text: str
    begins: NDArray[np.int64]
    """Begin of each row in the text, of shape (T,)."""
    lines: NDArray[np.int64]
    """Line number in the file of each row, of shape (T,)."""

    def numbers(self, names: Sequence[str]) -> Array:
        """Columns as an array (T, len(names)), NaN in empty cells. Raises `FormatError` naming line and column."""
        places, out = [self._place(name) for name in names], np.empty((len(self.lines), len(names)))
        for i, row in enumerate(self._rows()):
            out[i] = [number(self.path, int(self.lines[i]), self.columns[place], row[place]) for place in places]
        return out

    def texts(self, name: str) -> list[str]:
        """A column's text. Raises `FormatError` if it is missing."""
        place, known = self._place(name), dict[str, str]()
        return [known.setdefault(cell, cell) for cell in (_read(row[place].strip()) for row in self._rows())]

    def times(self) -> Array:
        """The column `time` (T,), seconds. Raises `FormatError` if a time is missing or does not increase."""
        times = self.numbers(["time"])[:, 0]
        check_times(self.path, times, self.lines)
        return times

    def _rows(self) -> Iterator[list[str]]:
        """The cells of each row."""
        for begin in self.begins:
            yield next(csv.reader(_Lines(self.text, int(begin))))

    def _place(self, name: str) -> int:
        if name not in self._places:
            raise FormatError(f"{self.path}: no column {name!r}; columns there: {shorten(self.columns)}")
        return self._places[name]

    @cached_property
    def _places(self) -> dict[str, int]:
        return {name: n for n, name in reversed([*enumerate(self.columns)])}


class _Lines:
    """The lines of a text from some place on, with their ends; of a `StringIO` they would take four times the memory."""

    def __init__(self, text: str, at: int = 0) -> None:
        self.text, self.at = text, at

    def __iter__(self) -> Self:
        return self

    def __next__(self) -> str:
        begin, self.at = self.at, self.text.find("\n", self.at) + 1 or len(self.text)
        if begin == self.at:
            raise StopIteration
        return self.text[begin : self.at]


def lines_of(text: str) -> Iterator[str]:
    """The lines of a text, with their ends, for a reader of CSV."""
    return _Lines(text)


def number(path: Path, line: int, column: str, cell: str) -> float:
    """The number in a cell; NaN if it is empty. Raises `FormatError` naming line and column."""
    try:
        value = float(cell) if cell and not cell.isspace() else np.nan
    except ValueError:
        value = np.inf
    if value in (np.inf, -np.inf):
        raise FormatError(f"{path}: line {line}, column {column!r}: found {shorten([cell])!r}, expected a number or nothing"
                          f"{with_point(cell)}")
    return value


def with_point(cell: str) -> str:
    """The end of a message about a cell that is no number: the decimal sign that is expected, if the cell has a decimal comma."""
    return f", with a decimal point: {cell.strip().replace(',', '.')}" if COMMA.fullmatch(cell.strip()[:60]) else ""


def check_times(path: Path, times: Array, lines: Sequence[int] | NDArray[np.int64]) -> None:
    """Raise `FormatError`, naming the line, if times (T,) are missing or do not increase."""
    bad = np.flatnonzero(~np.isfinite(times) | (np.diff(times, prepend=-np.inf) <= 0))
    if len(bad):
        i = int(bad[0])
        before = f"more than the {times[i - 1]:g} of the row before" if i and np.isfinite(times[i]) else "seconds"
        found = f"{times[i]:g}" if np.isfinite(times[i]) else "no number"
        raise FormatError(f"{path}: line {lines[i]}, column 'time': found {found}, expected {before}")


def read_table(path: Path, cut: bool = False) -> Table:
    """Read a CSV table with a header line. Raises `FormatError`, naming file and line.

    `cut`: ignore a last line without a line end, as the writer may have been killed.
    """
    text = read_text(path)
    return table_of(path, text[: text.rfind("\n") + 1] if cut else text)


def table_of(path: Path, text: str) -> Table:
    """The table in the text of a file, as `read_table` returns it."""
    columns, begins, numbers, begin = None, array("q"), array("q"), 0
    reader = csv.reader(lines := _Lines(text))
    try:
        for row in reader:
            begin, here = lines.at, begin
            if len(row) <= 1 and not any(map(str.strip, row)):
                continue
            if columns is None:
                columns = tuple(_read(cell.strip()) for cell in row)
                _check_columns(path, columns)
            elif len(row) != len(columns):
                raise FormatError(f"{path}: line {reader.line_num}: found {len(row)} cells, expected {len(columns)} as in the header")
            else:
                begins.append(here)
                numbers.append(reader.line_num)
    except csv.Error as error:
        raise FormatError(f"{path}: line {reader.line_num}: {error}, expected a table with commas (CSV)") from None
    if columns is None:
        _check_columns(path, columns := ())
    return Table(path, columns, text, np.array(begins, np.int64), np.array(numbers, np.int64))


def csv_line(cells: Iterable[str]) -> str:
    """One line of a CSV table, without formulas."""
    out = io.StringIO()
    safe = [f"'{cell}" if FORMULA.match(cell) and not NUMBER.fullmatch(cell) else cell for cell in cells]
    csv.writer(out, lineterminator="\r\n").writerow(safe)  # with which both line ends in a cell are quoted
    return f"{out.getvalue()[:-2]}\n"


def _read(cell: str) -> str:
    """The text of a cell as `csv_line` was given it."""
    return cell[1:] if cell.startswith("'") and FORMULA.match(cell) else cell


def cells(values: Iterable[float], decimals: int = 6) -> list[str]:
    """Numbers as text; empty for NaN."""
    return ["" if value != value else f"{value:.{decimals}f}" for value in values]


def shorten(words: Iterable[str], limit: int = 120) -> str:
    """Words joined by commas, cut to at most `limit` characters, for messages."""
    text = ", ".join(words)
    return text if len(text) <= limit else text[: limit - 3] + "..."


def _check_columns(path: Path, columns: tuple[str, ...]) -> None:
    seen = set[str]()
    for name in columns:
        if name and name in seen:
            raise FormatError(f"{path}: column {name!r}: found it twice, expected every column once")
        seen.add(name)
    if "time" not in columns:
        other = next((name for sign, name in SEPARATORS.items() if any(sign in column for column in columns)), None)
        what = "" if other is None else f"; found {other} between columns, expected commas (and points in numbers)"
        raise FormatError(f"{path}: no column 'time', expected a header time,<name>,...; found {shorten(columns)!r}{what}")
