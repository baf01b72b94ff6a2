"""A script in cells (`# %%`), run cell by cell, and the page of the documentation made from its text, code, output and pictures."""

from __future__ import annotations

import contextlib
import io
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

LECTURES = Path(__file__).parent
CELL = re.compile(r"^# %%( \[markdown\])?\n", re.MULTILINE)


class Cell(NamedTuple):
    """A cell of a script."""

    text: str
    """Markdown or Python."""
    code: bool


class Result(NamedTuple):
    """What a cell of code printed, and the names of the pictures that it wrote."""

    printed: str = ""
    pictures: tuple[str, ...] = ()


def cells(script: str) -> list[Cell]:
    """The cells of a script's text, which begins with one."""
    _, *parts = CELL.split(script)
    found = []
    for marker, text in zip(parts[::2], parts[1::2], strict=True):
        found.append(Cell(re.sub(r"^# ?", "", text, flags=re.MULTILINE).strip() if marker else text.strip(), not marker))
    return found


def run(script: str, name: str) -> list[Result]:
    """Run the cells one after another, in one namespace; pictures land in the current folder."""
    names: dict[str, object] = {"__name__": "__main__"}
    found, here = [], Path()
    for number, cell in enumerate(cells(script)):
        if not cell.code:
            found.append(Result())
            continue
        before = {path: path.stat().st_mtime_ns for path in here.glob("*.png")}
        printed = io.StringIO()
        with contextlib.redirect_stdout(printed):
            exec(compile(cell.text, f"{name}, cell {number}", "exec"), names)
        written = sorted(path for path in here.glob("*.png") if before.get(path) != path.stat().st_mtime_ns)
        found.append(Result(printed.getvalue().strip(), tuple(path.name for path in written)))
    return found


def page(script: str, results: Sequence[Result]) -> str:
    """The page in Markdown: text, code, and after each cell of code what it printed and drew."""
    parts = []
    for cell, result in zip(cells(script), results, strict=True):
        parts.append(f"```python\n{cell.text}\n```" if cell.code else cell.text)
        if result.printed:
            parts.append(f"```text\n{result.printed}\n```")
        parts += [f"![{picture.removesuffix('.png').replace('_', ' ')}](assets/{picture})" for picture in result.pictures]
    return "\n\n".join(parts) + "\n"
