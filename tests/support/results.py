"""Files that an experiment of `papers` wrote."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any


def read_rows(folder: Path, name: str) -> list[dict[str, str]]:
    """The rows of NAME.csv."""
    with (folder / f"{name}.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def read_summary(folder: Path, name: str) -> dict[str, Any]:
    """NAME.json."""
    return json.loads((folder / f"{name}.json").read_text("utf-8"))
