"""Every reader against damaged files: a few here, any number by `python benchmarks/fuzz_readers.py`."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import pytest

BENCHMARKS = Path(__file__).resolve().parents[2] / "benchmarks"
pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="memory and time are limited by means of Linux")


def fails(path):
    raise IndexError(f"{path.name} is damaged")


def test_damaged_files_of_every_reader_end_in_a_result_or_our_own_error(tmp_path):
    command = [sys.executable, BENCHMARKS / "fuzz_readers.py", "--inputs", "200", "--seed", "2", "--keep", tmp_path]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.endswith("readers, 0 findings\n")


def test_an_exception_of_a_reader_is_a_finding(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    assert importlib.import_module("fuzz_readers").cause_of(fails, tmp_path / "a.toml") == "IndexError: a.toml is damaged"
