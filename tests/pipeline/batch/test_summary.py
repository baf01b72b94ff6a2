"""The table of a batch: text for people, columns of one type for Parquet."""

from __future__ import annotations

import csv
from importlib.util import find_spec

import pytest

from shadowpuppet.pipeline.batch.summary import BatchRun, _column, write_summary
from shadowpuppet.pipeline.batch.task import RUNS
from shadowpuppet.pipeline.batch.tasks import Task


def run_of(folder, seed: int = 0, **more) -> BatchRun:
    task = Task("id", "/films/Ann", "Ann", "Case", seed, {}, {"tracker.Part": "Arm", "stabilise": True, "sizes": [1, 2]}, "", "", "",
                f"folder{seed}", "")  # fmt: skip
    metrics = {"errors": {"mean_mm": 12.25}, "list": [3], "ok": False}
    return BatchRun(task, "done", folder / RUNS / f"folder{seed}", 1.5, None, metrics=metrics, **more)


def test_values_are_written_as_people_and_programs_read_them(tmp_path):
    write_summary([run_of(tmp_path), run_of(tmp_path, 1, warnings=("A, b", "C"))], tmp_path / "summary.csv")
    with (tmp_path / "summary.csv").open(newline="", encoding="utf-8") as file:
        first, second = csv.DictReader(file)
    assert first == {"recording": "Ann", "case": "Case", "seed": "0", "tracker.Part": "Arm", "stabilise": "true", "sizes": "[1, 2]",
                     "status": "done", "tries": "", "seconds": "1.5", "message": "", "folder": f"{RUNS}/folder0", "warnings": "",
                     "errors.mean_mm": "12.25", "ok": "false"}  # fmt: skip
    assert (second["seed"], second["warnings"]) == ("1", "A, b; C")


@pytest.mark.parametrize(("values", "column"), [
    ([1, 2.5, None], [1.0, 2.5, None]), ([1, 2], [1, 2]), ([True, "No", None], ["true", "No", None]), ([True, 2], ["true", "2"]),
    ([None, None], [None, None]),
])  # fmt: skip
def test_a_column_has_one_type(values, column):
    found = _column([{"a": value} if value is not None else {} for value in values], "a")
    assert found == column
    assert [type(value) for value in found] == [type(value) for value in column]


@pytest.mark.skipif(find_spec("pyarrow") is None, reason="needs pyarrow")
def test_parquet_has_the_same_columns(tmp_path):
    import pyarrow.parquet

    write_summary([run_of(tmp_path), BatchRun(run_of(tmp_path).task, "failed", message="no film")], tmp_path / "summary.parquet")
    first, second = pyarrow.parquet.read_table(tmp_path / "summary.parquet").to_pylist()
    assert (first["errors.mean_mm"], first["stabilise"], first["ok"], second["ok"]) == (12.25, True, False, None)
    assert (second["status"], second["message"], second["folder"]) == ("failed", "no film", "")
