"""Cells of tables that a spreadsheet would take for formulas."""

from __future__ import annotations

import csv
import io

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from shadowpuppet.io.files.table import cells, csv_line, read_table
from shadowpuppet.io.motion.table import read_joints, write_joints
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.batch.summary import BatchRun, write_summary
from shadowpuppet.pipeline.batch.tasks import Task

BEGINNINGS = "=+-@\t\r\n\uff0b\uff0d\uff1d\uff20"
FORMULAS = ["=cmd|' /C calc'!A0", "+1+2", "-2+3", "@SUM(A1)", "\tx", "\rx", "\uff1dA1", "'=A1", "''@b", "-", "-1e", "--1"]


def written(cell: str) -> str:
    ((found,),) = csv.reader(io.StringIO(csv_line([cell]), newline=""))
    return found


@given(st.text(st.sampled_from([*BEGINNINGS, *"'a1 ,\""]), min_size=1) | st.text(min_size=1))
@example("=A1")
def test_no_cell_but_a_number_begins_as_a_formula_and_each_can_be_read_as_it_was(cell):
    found = written(cell)
    if found[0] in BEGINNINGS:
        float(found)
    assert found in (cell, f"'{cell}")
    assert (found[1:] if found != cell else found) == cell


@given(st.floats(), st.integers(0, 6))
def test_numbers_stay_numbers(value, decimals):
    (cell,) = cells([value], decimals)
    assert written(cell) == cell
    assert written(str(value)) == str(value)


@pytest.mark.parametrize("name", sorted({*FORMULAS} - {"\rx"}))  # line ends in files are read as \n
def test_names_are_read_as_they_were(name, tmp_path):
    path, joint = tmp_path / "joints.csv", name.strip()
    write_joints(path, JointTable(np.arange(2.0), (joint,), -np.ones((2, 1, 3))))
    assert read_joints(path).names == (joint,)
    assert path.read_text().splitlines()[-1] == "1.000000,-1.000000,-1.000000,-1.000000"
    path.write_text(csv_line(["time", "joint"]) + csv_line(["0", name]), newline="")
    assert read_table(path).texts("joint") == [name]


@pytest.mark.parametrize("name", FORMULAS[:7])
def test_a_folder_is_no_formula_in_the_summary_of_a_batch(name, tmp_path):
    task = Task("id", f"/films/{name}", name, "", 0, {}, {"tracker.angle": -1.5, "tracker.name": name}, "", "", "", "", "")
    write_summary([BatchRun(task, "failed", message=name, warnings=(name,), metrics={"off_mm": -2.5})], tmp_path / "summary.csv")
    with (tmp_path / "summary.csv").open(newline="", encoding="utf-8") as file:
        (row,) = csv.DictReader(file)
    assert row["recording"] == row["message"] == row["warnings"] == row["tracker.name"] == f"'{name}"
    assert (row["tracker.angle"], row["off_mm"]) == ("-1.5", "-2.5")
