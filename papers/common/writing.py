"""Files of an experiment: pictures, tables as CSV, and NAME.json with settings and results."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from typing import Any

from papers.common.claims import HEADER
from papers.common.experiment import Experiment, Outcome, Request, Table
from papers.common.plotting import save_picture
from shadowpuppet.cli.doctor import environment
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.pipeline.progress import json_text


def write_outcome(paper: str, experiment: Experiment, request: Request, outcome: Outcome, seconds: float, number: int = 0) -> None:
    """Write all files into the request's folder, the JSON last. `number`: of the experiment, in the paper's order. Raises
    `ShadowPuppetError`."""
    for name, picture in outcome.pictures.items():
        save_picture(picture, request.output / f"{name}.png")
    for name, table in outcome.tables.items():
        write_whole(request.output / f"{name}.csv", csv_text(table))
    told = summary(paper, experiment, request, outcome, seconds) | {"number": number}
    write_whole(request.output / f"{experiment.name}.json", json_text(told) + "\n")


def summary(paper: str, experiment: Experiment, request: Request, outcome: Outcome, seconds: float) -> dict[str, Any]:
    """Contents of NAME.json."""
    return {
        "paper": paper, "name": experiment.name, "title": experiment.title, "command": command(paper, experiment, request),
        "short": request.short, "recordings": [path.name for path in request.recordings] or ["made"], "seed": request.seed,
        "runs": request.runs, "fingerprint": dict(request.fingerprint), "settings": outcome.settings, "takes": experiment.takes,
        "seconds": round(seconds, 1),
        "environment": environment(), "said": outcome.said, "claims": [verdict.plain() for verdict in outcome.verdicts],
        "tables": {name: {"columns": list(table.columns), "rows": [list(row) for row in table.rows]}
                   for name, table in outcome.tables.items() if table.shown},
        "pictures": [f"{name}.png" for name in outcome.pictures], "data": [f"{name}.csv" for name in outcome.tables],
    }  # fmt: skip


def command(paper: str, experiment: Experiment, request: Request) -> str:
    """The command that repeats the experiment."""
    words = ["python -m", f"papers.{paper}", experiment.name]
    words += ["--recording", *(path.name for path in request.recordings)] if request.recordings else []
    words += ["--short"] if request.short else []
    default = experiment.short_runs if request.short else experiment.runs
    words += [f"--runs {request.runs}"] if request.runs != default else []
    return " ".join([*words, *([f"--seed {request.seed}"] if request.seed else []), *request.flags])


def csv_text(table: Table) -> str:
    """A table as CSV; empty cells where there is no value."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(table.columns)
    writer.writerows([["" if _nothing(value) else _short(value) for value in row] for row in table.rows])
    return out.getvalue()


def markdown(columns: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table in Markdown."""
    lines = ["| " + " | ".join(map(str, columns)) + " |", "|---" * len(columns) + "|"]
    cells = [["" if _nothing(value) else str(_short(value)).replace("|", "\\|") for value in row] for row in rows]
    return "\n".join(lines + ["| " + " | ".join(row) + " |" for row in cells])


def claims_table(verdicts: Sequence[Any]) -> str:
    """"Paper said, we got, same conclusion?" in Markdown."""
    return markdown(HEADER, [verdict.row for verdict in verdicts])


def _nothing(value: Any) -> bool:
    return value is None or (isinstance(value, float) and not math.isfinite(value))


def _short(value: Any) -> Any:
    return f"{value:.4g}" if isinstance(value, float) else value
