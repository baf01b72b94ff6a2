"""The summary of a batch: a table with a row for each run."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from shadowpuppet.errors import FormatError, ShadowPuppetError, extra_command
from shadowpuppet.io.files.table import csv_line
from shadowpuppet.io.files.text import read_text, write_whole
from shadowpuppet.io.motion.parquet import write_lists
from shadowpuppet.pipeline.batch.task import RUNS, read_mark
from shadowpuppet.pipeline.batch.tasks import Task

TABLES = ("csv", "parquet")
"""Formats of the summary."""


@dataclass(frozen=True, eq=False)
class BatchRun:
    """One run of a batch."""

    task: Task
    status: str
    """done, failed or missing."""
    folder: Path | None = None
    """The run folder; None if there is none."""
    seconds: float | None = None
    """Duration."""
    tries: int | None = None
    """Number of tries in this start of the batch; None for a run of an earlier start."""
    message: str = ""
    """Why the run failed; empty if it did not."""
    warnings: tuple[str, ...] = ()
    metrics: dict[str, Any] = field(default_factory=dict)
    """Its metrics.json."""

    def row(self) -> dict[str, Any]:
        """Values by column: recording, case, seed, settings that vary, status and outcome, and all metrics by dotted name."""
        task = self.task
        varied = {name: json.dumps(value) if isinstance(value, list) else value for name, value in task.varied.items()}
        end = {"status": self.status, "tries": self.tries, "seconds": self.seconds, "message": self.message,
               "folder": f"{RUNS}/{self.folder.name}" if self.folder else "", "warnings": "; ".join(self.warnings)}
        return {"recording": task.name, "case": task.case, "seed": task.seed, **varied, **end, **dict(_flat(self.metrics))}


def found_runs(out: Path) -> dict[str, tuple[Path, dict[str, Any]]]:
    """Folder and mark (`read_mark`) of the complete runs in a batch's folder, by task id."""
    folders = sorted(path for path in (out / RUNS).iterdir() if path.is_dir() and not path.name.startswith("."))
    marks = [(path, read_mark(path)) for path in folders]
    return {mark["id"]: (path, mark) for path, mark in marks if mark is not None}


def done_run(task: Task, folder: Path, mark: Mapping[str, Any], tries: int | None) -> BatchRun:
    """The finished run in a complete run folder."""
    seconds, said = mark.get("seconds"), mark.get("warnings")
    return BatchRun(task, "done", folder, seconds if isinstance(seconds, (int, float)) else None, tries,
                    warnings=tuple(map(str, said)) if isinstance(said, list) else (), metrics=_metrics(folder))


def write_summary(runs: Sequence[BatchRun], path: Path) -> None:
    """Write the rows as .csv or .parquet. Raises `ShadowPuppetError` if that fails."""
    rows = [run.row() for run in runs]
    columns = list(dict.fromkeys(name for row in rows for name in row))
    if path.suffix == ".parquet":
        return write_lists(path, {name: _column(rows, name) for name in columns})
    lines = [csv_line(columns), *(csv_line(_cell(row.get(name)) for name in columns) for row in rows)]
    write_whole(path, "".join(lines))


def check_table(table: str) -> None:
    """Raise `ShadowPuppetError` if a summary cannot have this format; called before hours of work."""
    if table not in TABLES:
        raise ShadowPuppetError(f"table: found {table!r}, expected one of {', '.join(TABLES)}")
    if table == "parquet" and find_spec("pyarrow") is None:
        raise ShadowPuppetError(f"table: parquet needs pyarrow, which is not installed; {extra_command('formats')}, or take csv")


def _column(rows: Sequence[Mapping[str, Any]], name: str) -> list[Any]:
    """A column of values of one type, as Parquet needs: floats for integers and floats, else text."""
    values = [row.get(name) for row in rows]
    kinds = {type(value) for value in values if value is not None}
    if len(kinds) < 2:
        return values
    return [None if value is None else float(value) if kinds <= {int, float} else _cell(value) for value in values]


def _cell(value: Any) -> str:
    return "" if value is None else str(value).lower() if isinstance(value, bool) else str(value)


def _flat(values: Mapping[str, Any], before: str = "") -> Iterator[tuple[str, Any]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{before}{name}.")
        elif not isinstance(value, list):
            yield before + name, value


def _metrics(folder: Path) -> dict[str, Any]:
    try:
        found = json.loads(read_text(folder / "metrics.json"))
    except (FormatError, ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}
