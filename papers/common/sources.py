"""Which source files a result depends on: a digest of all that a module imports of this repository, directly or through others."""

from __future__ import annotations

import ast
import hashlib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import shadowpuppet

PACKAGES = {"shadowpuppet": Path(shadowpuppet.__file__).parent, "papers": Path(__file__).parents[1]}
"""Folders of the packages whose files count; a library's version does not."""


@cache
def digest(*modules: str) -> str:
    """Of the text of all that `sources` finds."""
    text = hashlib.sha256()
    for name, content in sorted(sources(*modules).items()):
        text.update(name.encode() + b"\0" + content + b"\0")
    return text.hexdigest()


def sources(*modules: str) -> dict[str, bytes]:
    """The text, by name, of `modules`, such as `papers.ni2008.tracks`, and of all modules that they import, also inside functions."""
    found, waiting = dict[str, bytes](), list(modules)
    while waiting:
        name = waiting.pop()
        path = _file(name)
        if name not in found and path is not None:
            found[name] = path.read_bytes()
            waiting += _imported(path, ast.parse(found[name]))
    return found


def _imported(path: Path, tree: ast.AST) -> Iterator[str]:
    """Names of the modules and packages that a module's text imports, and of what may be modules in them."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            if node.level:
                raise ValueError(f"{path}: found a relative import, expected absolute ones")
            yield str(node.module)
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


def _file(name: str) -> Path | None:
    """The file of a module or package; None if it is none of ours, or a whole package of ours, which offers all that there is."""
    package, *parts = name.split(".")
    if package not in PACKAGES or not parts:
        return None
    place = PACKAGES[package].joinpath(*parts)
    return next((path for path in (place.with_suffix(".py"), place / "__init__.py") if path.is_file()), None)
