"""Rules switched off in a copy of the package: for `rules.py`.

An edit is `FILE:NAME=VALUE`, a constant with another value, or `FILE:NAME()=VALUE`, a function that only returns a value; FILE is in the
package. A copy gets fresh compiled kernels if a compiled function names what is edited: Numba freezes globals, and its cache notices
changes in a kernel's own file only.
"""

from __future__ import annotations

import ast
import hashlib
import os
import re
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from counted_lines import COMPILED, count_lines

ROOT = Path(__file__).resolve().parent.parent
PACKAGE = ROOT / "src" / "shadowpuppet"
EDIT = re.compile(r"(?P<file>[\w/]+\.py):(?P<name>\w+)(?P<call>\(\))?=(?P<value>.+)", re.DOTALL)
DECORATOR = re.compile(rf"\b({'|'.join(COMPILED)})\b")
SWITCHES: Mapping[str, Sequence[str]] = {
    "base": (),
}
"""Edits by the name of a switch; `base` is the package as it is."""


class Edit(NamedTuple):
    """One change of a module."""

    file: str
    name: str
    is_function: bool
    value: str


def parsed(text: str) -> Edit:
    """An edit from its text. Raises `SystemExit` for one that is none."""
    found = EDIT.fullmatch(text)
    if found is None:
        raise SystemExit(f"switch: found {text!r}, expected FILE:NAME=VALUE or FILE:NAME()=VALUE; switches: {', '.join(SWITCHES)}")
    return Edit(found["file"], found["name"], bool(found["call"]), found["value"])


def edited(source: str, edit: Edit) -> str:
    """The text of a module with an edit. Raises `SystemExit` if it has no such constant or function."""
    lines = source.splitlines(keepends=True)
    for node in ast.walk(ast.parse(source)):
        if edit.is_function and isinstance(node, ast.FunctionDef) and node.name == edit.name:
            first, last, indent = node.body[0], node.body[-1], " " * node.body[0].col_offset
            return "".join([*lines[: first.lineno - 1], f"{indent}return {edit.value}\n", *lines[last.end_lineno :]])
        if not edit.is_function and isinstance(node, (ast.Assign, ast.AnnAssign)) and edit.name in _targets(node):
            end = node.end_lineno or node.lineno
            return "".join([*lines[:end], f"{' ' * node.col_offset}{edit.name} = {edit.value}\n", *lines[end:]])
    raise SystemExit(f"switch: {edit.file} has no {'function' if edit.is_function else 'constant'} {edit.name!r}")


def _targets(node: ast.Assign | ast.AnnAssign) -> set[str]:
    targets = node.targets if isinstance(node, ast.Assign) else [node.target]
    return {name for target in targets for name in _names(target)}


def is_compiled(edits: Iterable[Edit], package: Path = PACKAGE) -> bool:
    """Whether a compiled function names what is edited, or a value that is made of it at import."""
    names, named = {edit.name for edit in edits}, set[str]()
    made_of: dict[str, set[str]] = {}
    for path in package.rglob("*.py"):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, (ast.Assign, ast.AnnAssign)) and node.value is not None:
                for name in _targets(node):
                    made_of.setdefault(name, set()).update(_names(node.value))
            elif isinstance(node, ast.FunctionDef) and any(DECORATOR.search(ast.unparse(each)) for each in node.decorator_list):
                named |= {node.name} | _names(node)
    while more := {name for name, parts in made_of.items() if parts & names} - names:
        names |= more
    return bool(names & named)


def _names(node: ast.AST) -> set[str]:
    return {each.id for each in ast.walk(node) if isinstance(each, ast.Name)}


def copied(edits: Sequence[Edit], folder: Path, package: Path = PACKAGE, counted: bool = False) -> dict[str, str]:
    """Make a copy of the package with the edits, in a folder of its own in `folder`, and return the environment in which programs import
    it. A copy of the same text is taken as it is. `counted`: its functions note the lines that run."""
    texts = {path.relative_to(package): path.read_text("utf-8") for path in sorted(package.rglob("*.py"))}
    for edit in edits:
        file = Path(edit.file)
        if file not in texts:
            raise SystemExit(f"switch: {edit.file} is not in {package.name}")
        texts[file] = edited(texts[file], edit)
    place = folder / (fingerprint(texts) + "_counted" * counted)
    fresh = is_compiled(edits, package)
    if not (place / "copied").exists():
        shutil.rmtree(place, ignore_errors=True)
        shutil.copytree(package, place / package.name, ignore=shutil.ignore_patterns("__pycache__") if fresh else None)
        for file in {Path(edit.file) for edit in edits}:
            (place / package.name / file).write_text(texts[file], encoding="utf-8")
        if counted:
            count_lines(place / package.name)
        (place / "copied").touch()
    paths = [str(place), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(paths)}
    return environment | ({"NUMBA_CACHE_DIR": str(place / "kernels")} if fresh else {})


def fingerprint(texts: Mapping[Path, str]) -> str:
    """A short name for the texts of a package."""
    return hashlib.sha256("\0".join(f"{path}\0{text}" for path, text in texts.items()).encode()).hexdigest()[:12]
