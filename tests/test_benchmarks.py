"""Every script of benchmarks/ runs in its smallest form, and every script of docs/ that makes pictures can be imported."""

from __future__ import annotations

import importlib.util
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
TEXTS = {path: path.read_text("utf-8") for path in sorted((ROOT / "benchmarks").rglob("*.py"))}
SCRIPTS = [path for path, text in TEXTS.items() if "def main(" in text and "# /// script" not in text]
"""Without those that run in an environment of their own."""
PICTURES = sorted({*(ROOT / "docs").glob("make_*.py"), *(ROOT / "docs").glob("*picture*.py")})


def changed(folder: Path) -> dict[Path, int]:
    return {path: path.stat().st_mtime_ns for path in folder.rglob("*") if path.is_file() and "__pycache__" not in path.parts}


@pytest.fixture
def kept(once, monkeypatch) -> Path:
    """What scripts make alike: tiny recordings and runs of them."""
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    return once("smallest", importlib.import_module("smallest").keep)


@pytest.mark.whole
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda path: path.stem)
def test_a_benchmark_runs_in_its_smallest_form(script, kept, tmp_path):
    before = changed(ROOT / "docs"), changed(ROOT / "benchmarks")
    path = os.pathsep.join([str(ROOT / "src"), *filter(None, [os.environ.get("PYTHONPATH")])])
    done = subprocess.run([sys.executable, script, "--smallest", tmp_path / "out"], cwd=tmp_path,
                          env=os.environ | {"PYTHONPATH": path, "SMALLEST_KEPT": str(kept)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr[-3000:]
    if done.stdout.startswith("skipped: "):
        pytest.skip(done.stdout.strip())
    assert done.stdout.strip()
    assert (changed(ROOT / "docs"), changed(ROOT / "benchmarks")) == before
    assert {path.name for path in tmp_path.iterdir()} <= {"out"}


@pytest.mark.parametrize("script", PICTURES, ids=lambda path: path.stem)
def test_a_script_of_the_documentation_can_be_imported(script):
    spec = importlib.util.spec_from_file_location(f"docs_{script.stem}", script)
    assert spec is not None
    assert spec.loader is not None
    try:
        spec.loader.exec_module(importlib.util.module_from_spec(spec))
    except ModuleNotFoundError as error:
        if error.name is None or error.name.startswith("shadowpuppet"):
            raise
        pytest.skip(f"{error.name} is not here")


def test_a_table_goes_to_its_place_in_a_page_or_to_the_end_of_a_file_without_places(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "benchmarks")
    into_page = importlib.import_module("faults").into_page
    page, file = tmp_path / "page.md", tmp_path / "file.md"
    page.write_text("<!-- table: kept -->\nold\n<!-- end of table -->\n", "utf-8")
    for name in ("kept", "left out"):
        into_page(page, name, "new")
        into_page(file, name, "new")
    assert page.read_text("utf-8") == "<!-- table: kept -->\nnew\n<!-- end of table -->\n"
    assert file.read_text("utf-8") == "kept\n\nnew\n\nleft out\n\nnew\n\n"


def test_the_page_on_speed_has_a_row_for_each_time_and_each_figure(monkeypatch):
    monkeypatch.syspath_prepend(ROOT / "docs")
    page, bench = importlib.import_module("make_speed"), importlib.import_module("benchmarks.bench")
    rows = (*bench.MONO_ROWS, *bench.MULTI_ROWS)
    known = dict.fromkeys(("cpu", "llvm_cpu", "cores", "vectors", "python", "numpy", "numba", "opencv-python-headless"), "")
    raw = {row[0]: {"median": 1.5, "least": 1.0} for row in rows}
    made = page.tables({"environment": known, "raw": raw} | dict.fromkeys(page.KEYS, 2.0))
    written = (ROOT / "docs" / "speed.md").read_text("utf-8")
    for line in made.splitlines():
        name = line.split("|")[1:2]
        assert not name or f"|{name[0]}|" in written
