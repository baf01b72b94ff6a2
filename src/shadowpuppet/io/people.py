"""people.csv of a run of several people: time (s), person (1, 2, ...), status, x, y (m, world), a line for each person and frame; and the
folders person-1, person-2, ... beside it, each with the run of one of them."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path
from typing import BinaryIO

import numpy as np

from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import csv_line, read_table

PEOPLE = "people.csv"
HEADER = ("time", "person", "status", "x", "y")
FOLDER = re.compile(r"person-([1-9]\d{0,3})")


def person_folder(folder: Path, number: int) -> Path:
    """The folder of a person's run, counted from 1."""
    return folder / f"person-{number}"


def person_folders(folder: str | Path) -> dict[int, Path]:
    """The folders of the people's runs by number; empty for a run of one person."""
    folder = Path(folder)
    if not (folder / PEOPLE).exists():
        return {}
    found = {int(name[1]): path for path in folder.iterdir() if (name := FOLDER.fullmatch(path.name)) and (path / "run.toml").exists()}
    return dict(sorted(found.items()))


def open_places(folder: Path, size: int | None = None) -> BinaryIO:
    """people.csv of a run that begins, or that goes on after its first `size` bytes. Raises `FormatError` if it has fewer."""
    path = folder / PEOPLE
    if size is None:
        file = path.open("wb")
        file.write(csv_line(list(HEADER)).encode())
        return file
    if not path.exists() or path.stat().st_size < size:
        raise FormatError(f"{path}: found fewer lines than the checkpoint beside it, expected those of the run that it was written for")
    file = path.open("r+b")
    file.truncate(size)
    file.seek(size)
    return file


def write_place(file: BinaryIO, time: float, person: int, status: str, place: Array) -> None:
    """Add a line to people.csv; the place (2,), metres, is left empty where it is NaN."""
    x, y = (f"{value:.4f}" if np.isfinite(value) else "" for value in place)
    file.write(csv_line([f"{time:.5f}", str(person), status, x, y]).encode())


def read_places(folder: str | Path) -> dict[int, tuple[Array, list[str], Array]]:
    """Times (T,), seconds, statuses and places (T, 2), metres, of each person in people.csv. Raises `FormatError`."""
    table = read_table(Path(folder) / PEOPLE, cut=True)
    if tuple(table.columns) != HEADER:
        raise FormatError(f"{table.path}: found the columns {', '.join(table.columns)}, expected {', '.join(HEADER)}")
    values, status = table.numbers(["time", "person", "x", "y"]), np.array(table.texts("status"))
    if not np.isfinite(values[:, :2]).all():
        raise FormatError(f"{table.path}: found an empty time or person, expected a number in every line")
    times, people, places = values[:, 0], np.rint(values[:, 1]).astype(int), values[:, 2:]
    return {int(n): (times[people == n], status[people == n].tolist(), places[people == n]) for n in np.unique(people)}


def remove_people(folder: Path, names: tuple[str, ...]) -> None:
    """Remove the files `names` of earlier runs of people, and people.csv."""
    for own in person_folders(folder).values():
        for name in names:
            with contextlib.suppress(OSError):
                (own / name).unlink(missing_ok=True)
        with contextlib.suppress(OSError):
            own.rmdir()
    with contextlib.suppress(OSError):
        (folder / PEOPLE).unlink(missing_ok=True)
