"""benchmarks/rules.py: a rule switched off arrives in compiled code, and lines that never ran are named with their constants."""

from __future__ import annotations

import ast
import importlib
import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

BENCHMARKS = Path(__file__).resolve().parent.parent / "benchmarks"
RULE = "LIMIT = 3.0\nHALF = LIMIT / 2\nTEXT = 1\n"
KERNEL = "from numba import njit\nfrom planted.limits import HALF\n\n\n@njit(cache=True)\ndef above(x):\n    return x > HALF\n"


@pytest.fixture
def switches(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("rule_switches")


@pytest.fixture
def rules(monkeypatch):
    monkeypatch.syspath_prepend(BENCHMARKS)
    return importlib.import_module("rules")


@pytest.fixture
def planted(tmp_path):
    """A package with a rule and a kernel that was compiled with it."""
    package = tmp_path / "planted"
    package.mkdir()
    for name, text in (("__init__", ""), ("limits", RULE), ("kernels", KERNEL)):
        (package / f"{name}.py").write_text(text, encoding="utf-8")
    return package


def answer(environment: dict[str, str], folder: Path) -> str:
    """Whether 2 is above the rule's half, by the compiled kernel."""
    program = "import planted.kernels as kernels; print(kernels.above(2.0))"
    done = subprocess.run([sys.executable, "-c", program], env=environment, cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.strip()


@pytest.mark.kernels
def test_a_planted_rule_switched_off_arrives_in_compiled_code(switches, planted, tmp_path):
    out, work = tmp_path / "out", tmp_path / "work"
    work.mkdir()
    assert answer(os.environ | {"PYTHONPATH": str(tmp_path)}, work) == "True"
    base = switches.copied([], out, planted)
    assert answer(base, work) == "True"
    switched = switches.copied([switches.parsed("limits.py:LIMIT=8.0")], out, planted)
    assert answer(switched, work) == "False"
    assert answer(base, work) == "True"


def test_kernels_are_fresh_only_where_the_rule_is_in_compiled_code(switches, planted, tmp_path):
    edits = ("limits.py:LIMIT=8.0", "limits.py:TEXT=2")
    compiled, plain = (switches.copied([switches.parsed(edit)], tmp_path / "out", planted) for edit in edits)
    assert "NUMBA_CACHE_DIR" in compiled
    assert "NUMBA_CACHE_DIR" not in plain or plain["NUMBA_CACHE_DIR"] != compiled["NUMBA_CACHE_DIR"]


@pytest.mark.parametrize(("edit", "after"), [
    ("a.py:LOW=0.5", "LOW, HIGH = 1, 2\nLOW = 0.5\n"), ("a.py:HIGH=9", "LOW, HIGH = 1, 2\nHIGH = 9\n"),
])  # fmt: skip
def test_a_constant_gets_another_value(switches, edit, after):
    assert switches.edited("LOW, HIGH = 1, 2\n", switches.parsed(edit)) == after


def test_a_function_only_returns_a_value(switches):
    source = "def rule(mask, more):\n    '''Say.'''\n    if more:\n        return 1\n    return 2\n\n\nrest = 1\n"
    assert switches.edited(source, switches.parsed("a.py:rule()=mask")) == "def rule(mask, more):\n    return mask\n\n\nrest = 1\n"


@pytest.mark.parametrize("text", ["nothing", "a.py:NAME", "a.py:OTHER=1", "a.py:other()=1"])
def test_a_switch_that_is_none_ends_in_a_sentence(switches, text):
    with pytest.raises(SystemExit, match="switch: "):
        switches.edited("NAME = 1\n", switches.parsed(text))


def test_statements_are_listed_with_the_constants_around_them_and_without_kernels(rules):
    source = ("LIMIT = 3\n\n\ndef rule(x):\n    '''Say.'''\n    if x > LIMIT:\n        y = x\n        return y\n    return NEVER * x\n\n\n"
              "@kernel\ndef fast(x):\n    return x\n")  # fmt: skip
    assert rules.statements(ast.parse(source)) == [(6, 6, ("LIMIT",)), (7, 7, ("LIMIT",)), (8, 8, ("LIMIT",)), (9, 9, ("NEVER",))]


def test_pieces_that_never_ran_are_joined(rules, tmp_path):
    (tmp_path / "tracking").mkdir()
    source = "def rule(x):\n    if x > LIMIT:\n        y = x\n        return y\n    return 2\n"
    (tmp_path / "tracking" / "a.py").write_text(source, encoding="utf-8")
    ran = [{"film": name, "lines": {"tracking/a.py": [1, 2, 5]}} for name in ("a", "b")]
    assert list(rules.pieces(ran, tmp_path)) == [rules.Piece("tracking/a.py", 3, 4, 0, (), ("LIMIT",))]


def test_noise_is_the_seeds_share_of_the_mean(rules):
    values = {("a", 0): 1.0, ("a", 1): 3.0, ("b", 0): 10.0, ("b", 1): 10.0}
    assert rules.noise(values) == pytest.approx(np.sqrt(2 / 2) / 2)


def test_a_refused_film_counts_as_lost(rules):
    base, other = [{"film": "a", "seed": 0, "error": 20.0}], [{"film": "a", "seed": 0, "refused": "too dark"}]
    assert rules.compared(base, other)[0] == "20.0 -> 500.0"


def test_a_counted_package_notes_the_lines_that_run_but_not_those_of_kernels(switches, planted, tmp_path):
    source = '"""Doc."""\nfrom __future__ import annotations\n\n\ndef rule(x):\n    """Say."""\n    if x:\n        return 1\n    return 2\n'
    (planted / "rules.py").write_text(source, encoding="utf-8")
    program = "import json, planted.rules, planted.kernels; from counted_lines import lines_that_ran as ran; planted.rules.rule(0)"
    program += "; planted.kernels.above(2.0); print(json.dumps([ran('planted'), ran('planted')]))"
    environment = switches.copied([], tmp_path / "out", planted, counted=True)
    environment["PYTHONPATH"] += os.pathsep + str(BENCHMARKS)
    done = subprocess.run([sys.executable, "-c", program], env=environment, check=True, capture_output=True, text=True)
    assert json.loads(done.stdout) == [{"rules.py": [7, 9]}, {}]
