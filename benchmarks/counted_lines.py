"""A package whose functions note which of their statements run: for `rules.py`. A tracer of lines takes five times a run's time; a note a
statement takes a few per cent."""

from __future__ import annotations

import ast
from collections.abc import Mapping
from pathlib import Path

COMPILED = ("njit", "kernel", "inline_kernel", "reduction_kernel", "device", "compiled")
"""Decorators of functions that stay as they are."""
MODULE = "ran_lines"
"""Name of the module beside the package that holds the notes."""
NOTES = '''"""The lines whose statements ran, by module."""

RAN: dict[str, set[int]] = {}


def of(module: str) -> set[int]:
    """The set of a module's lines."""
    return RAN.setdefault(module, set())
'''


def count_lines(package: Path) -> None:
    """Make each function of a package note the lines whose statements run, except compiled ones."""
    (package.parent / f"{MODULE}.py").write_text(NOTES, encoding="utf-8")
    for path in sorted(package.rglob("*.py")):
        text = path.read_text("utf-8")
        if (noting := noted(text)) != text:
            path.write_text(noting, encoding="utf-8")


def noted(source: str) -> str:
    """The text of a module whose functions note the lines whose statements run; the same text if it has no such function."""
    tree = ast.parse(source)
    if not _note(tree.body, False):
        return source
    start = next((n for n, node in enumerate(tree.body) if not is_text(node) and not isinstance(node, ast.ImportFrom)), len(tree.body))
    tree.body[start:start] = ast.parse(f"import {MODULE}\n_ran_ = {MODULE}.of(__name__)").body
    return ast.unparse(ast.fix_missing_locations(tree))


def lines_that_ran(package: str) -> dict[str, list[int]]:
    """The lines that ran since the last call, by the module's file in the package; nothing without such a package."""
    try:
        ran: Mapping[str, set[int]] = __import__(MODULE).RAN
    except ModuleNotFoundError:
        return {}
    found = dict[str, list[int]]()
    for name, lines in ran.items():
        if lines:
            found[name.removeprefix(package + ".").replace(".", "/") + ".py"] = sorted(lines)
            lines.clear()
    return found


def _note(body: list[ast.stmt], within: bool) -> bool:
    """Put notes into the functions of statements, in their own lists, and tell whether there are any. `within`: they are a function's."""
    some, out = False, list[ast.stmt]()
    for node in body:
        if within and not is_text(node):
            out += ast.parse(f"_ran_.add({node.lineno})").body
            some = True
        out.append(node)
        if isinstance(node, ast.FunctionDef) and any(called(each) in COMPILED for each in node.decorator_list):
            continue
        inside = within or isinstance(node, ast.FunctionDef)
        parts = [node, *getattr(node, "handlers", ()), *getattr(node, "cases", ())]
        for part in parts:
            for name in ("body", "orelse", "finalbody"):
                some |= _note(getattr(part, name, None) or [], inside)
    body[:] = out
    return some


def called(node: ast.expr) -> str:
    """The name of a decorator, without what it is called with."""
    return node.func.id if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) else getattr(node, "id", "")


def is_text(node: ast.stmt) -> bool:
    """Whether a statement is a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)
