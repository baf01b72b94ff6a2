"""The number of constants and settings does not grow past a budget: a commit raises it only with a row of what the new rule is worth."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import get_type_hints

import pytest

from shadowpuppet.pipeline.options import Options

PACKAGE = Path(__file__).resolve().parent.parent / "src" / "shadowpuppet"
CONSTANTS, SETTINGS = 1114, 139
"""The budget: number constants in upper case at the top of modules, and settings that a run has, those of inner tables for each table."""


def number_constants(source: str) -> Iterator[str]:
    """Names in upper case to which a module's text assigns a number, or something computed of numbers alone."""
    for node in ast.parse(source).body:
        if isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None:
            for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
                together = isinstance(target, ast.Tuple) and isinstance(node.value, ast.Tuple)
                pairs = zip(target.elts, node.value.elts) if together else [(target, node.value)]
                yield from (name.id for name, value in pairs if isinstance(name, ast.Name) and name.id.isupper() and is_number(value))


def is_number(node: ast.expr) -> bool:
    if isinstance(node, ast.BinOp):
        return is_number(node.left) and is_number(node.right)
    if isinstance(node, ast.UnaryOp):
        return is_number(node.operand)
    return isinstance(node, ast.Constant) and isinstance(node.value, (int, float)) and not isinstance(node.value, bool)


def number_of_settings(kind: type) -> int:
    kinds = get_type_hints(kind)
    return sum(number_of_settings(kinds[each.name]) if is_dataclass(kinds[each.name]) else 1 for each in fields(kind))


def test_the_number_of_constants_stays_within_its_budget():
    found = sum(len(list(number_constants(path.read_text("utf-8")))) for path in PACKAGE.rglob("*.py"))
    assert found <= CONSTANTS, "measure what the new rule is worth (benchmarks/rules.py) and add its row, or remove another"


def test_the_number_of_settings_stays_within_its_budget():
    assert number_of_settings(Options) <= SETTINGS


@pytest.mark.parametrize(("source", "names"), [
    ("ONE = 1\nTWO: float = -2.5\n", ["ONE", "TWO"]),
    ("LOW, HIGH = 0.1, 1 / 3\n", ["LOW", "HIGH"]), ("SHARE, NAME = 0.5, 'a'\n", ["SHARE"]),
    ("_HIDDEN = 2**8\n", ["_HIDDEN"]), ("NAME = 'a'\nIS = True\nlower = 3\nMADE = float(3)\nBOTH = 1, 2\n", []),
    ("def made():\n    INNER = 1\n", []),
])  # fmt: skip
def test_a_number_constant_is_an_upper_case_name_that_a_module_assigns_a_number(source, names):
    assert list(number_constants(source)) == names
