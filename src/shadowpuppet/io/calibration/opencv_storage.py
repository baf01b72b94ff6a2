"""Reads OpenCV's FileStorage, YAML and XML, as matrices, numbers, words and lists of these.

OpenCV's own parser is not used because damaged files crash it.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import Array
from shadowpuppet.io.calibration._xml import tree_of
from shadowpuppet.io.calibration.draft import numbers_of, text_of

MATRIX = ("rows", "cols", "data")
"""Keys of a matrix."""
KEY = re.compile(r"^(\s*)([\w.-]+)\s*:(?:\s+(.*))?$")
DEPTH = 2
"""Levels of tables with matrices in them; MC-Calib has one."""
MAX_ELEMENTS = 4096
"""Larger matrices are skipped: matrices of calibrations have 3 x 3 numbers, maps of rectification millions."""


def read_storage(path: Path) -> dict[str, Any]:
    """The entries of a file's top level. Raises `CalibrationError`."""
    text = text_of(path)
    return _of_xml(path) if text.lstrip().startswith("<") else _of_yaml(path, text)


def _of_xml(path: Path) -> dict[str, Any]:
    return {element.tag.lstrip("_"): _plain(path, element) for element in tree_of(path)}


def _plain(path: Path, element: Element) -> Any:
    if len(element) and all(element.find(key) is not None for key in MATRIX):
        return _matrix(path, element.tag, {key: (element.findtext(key) or "").strip() for key in MATRIX})
    if len(element):
        return [_plain(path, child) for child in element]
    words = re.findall(r'"[^"]*"|\S+', element.text or "")
    return _word(words[0]) if len(words) == 1 else [_word(word) for word in words]


def _of_yaml(path: Path, text: str) -> dict[str, Any]:
    """Parse the subset of YAML in files of OpenCV and ROS: keys, matrices as tables, lists in brackets or with dashes, tables of these."""
    return _entries(path, [line for line in _logical(path, text)
                           if line.strip() and not line.lstrip().startswith(("#", "%", "---", "..."))], DEPTH)


def _entries(path: Path, lines: list[str], depth: int) -> dict[str, Any]:
    """The entries of lines that begin without blanks; `depth`: levels of tables in tables."""
    found: dict[str, Any] = {}
    n = 0
    while n < len(lines):
        match = KEY.match(lines[n])
        if match is None or match[1]:
            raise CalibrationError(f"{path}: found {lines[n].strip()[:60]!r}, expected a key and a colon, as in OpenCV's YAML")
        key, value, below = match[2], (match[3] or "").strip(), []
        while n + 1 < len(lines) and (lines[n + 1][0] in " \t" or lines[n + 1].startswith("-")):
            below.append(lines[n + 1])
            n += 1
        n += 1
        if key in found:
            raise CalibrationError(f"{path}: found {key} twice")
        if depth and not value and any("!!opencv-matrix" in line for line in below):
            inner = len(below[0]) - len(below[0].lstrip())
            found[key] = _entries(path, [line[min(inner, len(line) - len(line.lstrip())) :] for line in below], depth - 1)
        else:
            found[key] = _below(path, key, value, [line.strip() for line in below])
    return found


def _logical(path: Path, text: str) -> list[str]:
    """Lines; those of a list in brackets are joined."""
    lines, open_since = [], None
    for line in text.splitlines():
        line = line.rstrip()
        if open_since is not None:
            open_since.append(line.strip())
        elif "[" in line and "]" not in line:
            open_since = [line]
        else:
            lines.append(line)
        if open_since is not None and "]" in line:
            lines.append(" ".join(open_since))
            open_since = None
    if open_since is not None:
        raise CalibrationError(f"{path}: found a list that does not end, {open_since[0].strip()[:40]!r}: is the file cut off?")
    return lines


def _below(path: Path, key: str, value: str, below: list[str]) -> Any:
    """The value of a key, on its own line or the lines below."""
    if value and not value.startswith("!!") and not below:
        return [_word(word) for word in value.strip("[]").split(",") if word.strip()] if value.startswith("[") else _word(value)
    if "!!opencv-matrix" not in value and all(line.startswith("-") for line in below):
        return [_word(line[1:]) for line in below]
    table = {match[2]: (match[3] or "").strip() for line in below if (match := KEY.match(line)) is not None}
    if all(part in table for part in MATRIX):
        return _matrix(path, key, table)
    if "!!opencv-matrix" in value:
        raise CalibrationError(f"{path}: {key}: found a matrix with {', '.join(table) or 'nothing'}, expected {', '.join(MATRIX)}: is the "
                               "file cut off?")
    return {name: _word(word) for name, word in table.items()}


def _matrix(path: Path, key: str, table: dict[str, str]) -> Array | None:
    shape = numbers_of(f"{table['rows']} {table['cols']}", (2,))
    if shape is None or (shape < 0).any() or (shape % 1).any():
        raise CalibrationError(f"{path}: {key}: found {table['rows'][:20]!r} rows and {table['cols'][:20]!r} columns, expected whole "
                               "numbers")
    if shape.max() > MAX_ELEMENTS or shape.prod() > MAX_ELEMENTS:
        return None
    rows, cols = int(shape[0]), int(shape[1])
    values = numbers_of(table["data"].strip("[] "), (rows * cols,)) if rows * cols else np.zeros(0)
    if values is None:
        raise CalibrationError(f"{path}: {key}: found {table['data'][:60]!r}, expected {rows} x {cols} finite numbers")
    return values.reshape(rows, cols)


def _word(text: str) -> Any:
    """A number, or a word without quotes."""
    text = text.strip()
    value = numbers_of(text, (1,)) if not text.startswith('"') else None
    return text.strip("\"'") if value is None else float(value[0])
