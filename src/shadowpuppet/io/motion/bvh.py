"""Reads BVH files (Biovision): a skeleton and its motion, as joints by forward kinematics."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NoReturn

import numpy as np

from shadowpuppet.errors import FormatError, warn
from shadowpuppet.geometry import Array, rotation_about
from shadowpuppet.io.files.table import shorten, with_point
from shadowpuppet.io.files.text import errors_named, read_text
from shadowpuppet.motion.motion import JointTable

CHANNELS = ("Xposition", "Yposition", "Zposition", "Xrotation", "Yrotation", "Zrotation")
"""Kinds of channels; a joint has any of them in any order."""
NAMED = re.compile(r"(?<!\S)(ROOT|JOINT)(?!\S)\s*([^{}]*)", re.IGNORECASE)
"""Keyword and name of a joint: the name is the rest of the line, as it may have blanks (`Bip01 L Thigh`)."""
END = "_end"
"""Suffix of the names of end sites."""
BLOCK = 100_000
"""Joints of frames computed at once, to limit memory."""
MOST_PLACES = 4_000_000
"""Greatest number of joints of all frames, unless the file has as many numbers: joints without channels cost the file nothing."""
MAX_JOINTS = 10_000


@dataclass(frozen=True, eq=False)
class Node:
    """A joint of the hierarchy, or an end site."""

    name: str
    parent: int
    """Index of the parent; -1 for none."""
    offset: Array
    """Position relative to the parent (3,), in the file's unit."""
    channels: tuple[int, ...] = ()
    """Indices into `CHANNELS`, in the file's order, in which rotations are multiplied."""


@dataclass(frozen=True, eq=False)
class Bvh:
    """The content of a file, in its own unit of length and axes."""

    path: Path
    nodes: tuple[Node, ...]
    """Parents before children."""
    step: float
    """Seconds from frame to frame."""
    values: Array
    """Channels of all nodes (T, C); the file's unit, and degrees."""

    def joints(self) -> JointTable:
        """All joints and end sites in the file's unit and axes, times from 0. Raises `FormatError` for an impossible name."""
        places = np.empty((len(self.values), len(self.nodes), 3))
        block = max(BLOCK // len(self.nodes), 1)
        for start in range(0, len(self.values), block):
            places[start : start + block] = self._placed(*self._local(self.values[start : start + block]))
        with errors_named(self.path):
            return JointTable(np.arange(len(places), dtype=float) * self.step, unique_names([node.name for node in self.nodes]), places)

    def local_transforms(self) -> tuple[Array, Array]:
        """Rotations (T, J, 3, 3) and positions (T, J, 3) of the nodes relative to their parents, in the file's unit and axes."""
        return self._local(self.values)

    def _local(self, values: Array) -> tuple[Array, Array]:
        """As `local_transforms`, for channel values (T, C)."""
        turns, shifts = np.empty((len(values), len(self.nodes), 3, 3)), np.empty((len(values), len(self.nodes), 3))
        for n, (node, columns) in enumerate(zip(self.nodes, self._columns)):
            own, shifts[:, n] = np.eye(3), node.offset
            for channel, column in zip(node.channels, columns):
                if channel < 3:
                    shifts[:, n, channel] = values[:, column] + (node.offset[channel] if n == 0 or self._added else 0.0)
                else:
                    own = own @ rotation_about(np.eye(3)[channel - 3], np.radians(values[:, column]))
            turns[:, n] = own
        return turns, shifts

    def _placed(self, turns: Array, shifts: Array) -> Array:
        """World positions (T, J, 3) of nodes with rotations (T, J, 3, 3) and positions (T, J, 3) relative to their parents."""
        for n, node in enumerate(self.nodes):
            if node.parent >= 0:
                shifts[:, n] = shifts[:, node.parent] + (turns[:, node.parent] @ shifts[:, n, :, None])[:, :, 0]
                turns[:, n] = turns[:, node.parent] @ turns[:, n]
        return shifts

    @cached_property
    def _columns(self) -> list[list[int]]:
        """Columns of `values` of each node."""
        ends = np.cumsum([len(node.channels) for node in self.nodes]).tolist()
        return [list(range(end - len(node.channels), end)) for node, end in zip(self.nodes, ends)]

    @cached_property
    def _added(self) -> bool:
        """Whether position channels are added to the offsets, rather than replace them, in all joints but the root.

        They are for the root, by the format's first description. For other joints programs differ: most write the whole position, which is
        recognised by values that are near the offsets in all joints together. One joint does not show it: its offset may be small, or its
        movement large.
        """
        whole, zero = 0.0, 0.0
        for node, columns in zip(self.nodes[1:], self._columns[1:]):
            for channel, column in zip(node.channels, columns):
                if channel < 3:
                    median = float(np.median(self.values[:, column]))
                    whole, zero = whole + abs(median - node.offset[channel]), zero + abs(median)
        return zero < whole


def read_bvh(path: str | Path) -> Bvh:
    """Read a BVH file. Raises `FormatError`, naming the line, if it is malformed; warns if it breaks off."""
    path = Path(path)
    lines = read_text(path).splitlines()
    motion = next((n for n, line in enumerate(lines) if line.strip().upper() == "MOTION"), None)
    if motion is None:
        raise FormatError(f"{path}: found no line MOTION, expected a BVH file: HIERARCHY, joints, MOTION, frames")
    nodes = _hierarchy(_Words(path, lines[:motion]))
    step, first = _header(path, lines, motion)
    values = _values(path, lines, first, sum(len(node.channels) for node in nodes))
    if len(nodes) * len(values) > max(MOST_PLACES, 2 * values.size):
        raise FormatError(f"{path}: found {len(nodes)} joints in {len(values)} frames of {values.shape[1]} channels, expected those of a "
                          "person")
    return Bvh(path, nodes, step, values)


class _Words:
    """Tokens of the hierarchy, with errors that name the line."""

    def __init__(self, path: Path, lines: list[str]) -> None:
        self.path, self.last = path, len(lines)
        self._words = iter([(n, word) for n, line in enumerate(lines, 1) for word in _words(line.replace("{", " { ").replace("}", " } "))])
        self.line = 1

    def next(self, *expected: str) -> str:
        """The next word; if `expected` is given, one of these, in any case, returned in capitals."""
        self.line, word = next(self._words, (self.last, ""))
        if not word or (expected and word.upper() not in expected):
            self.fail(word, " or ".join(expected))
        return word.upper() if expected else word

    def rest(self) -> str:
        """The next word; empty at the end."""
        self.line, word = next(self._words, (self.last, ""))
        return word

    def numbers(self, count: int) -> Array:
        """The next words as finite numbers (count,)."""
        words = [self.next() for _ in range(count)]
        values = _numbers(words)
        if values is None:
            self.fail(" ".join(words), f"{count} numbers{next(filter(None, map(with_point, words)), '')}")
        return values

    def fail(self, found: str, expected: str) -> NoReturn:
        """Raise `FormatError` at the line of the last word."""
        what = f"found {shorten([found])!r}" if found else "the hierarchy ends"
        raise FormatError(f"{self.path}: line {self.line}: {what}{f', expected {expected}' if expected else ''}")


def _words(line: str) -> Iterator[str]:
    """The words of a line of the hierarchy, in which braces are words; a joint's name is one word."""
    at = 0
    for found in NAMED.finditer(line):
        yield from line[at : found.start()].split()
        yield found[1]
        if name := found[2].strip():
            yield name
        at = found.end()
    yield from line[at:].split()


def _hierarchy(words: _Words) -> tuple[Node, ...]:
    """Joints and end sites in the file's order, parents first."""
    words.next("HIERARCHY")
    words.next("ROOT")
    nodes, above = list[Node](), [-1]
    nodes.append(_node(words, words.next(), -1))
    above.append(0)
    while len(above) > 1:
        kind = words.next("JOINT", "END", "}")
        if kind == "}":
            above.pop()
            continue
        if len(nodes) >= MAX_JOINTS:
            words.fail(f"more than {MAX_JOINTS} joints", "those of a person")
        if kind == "JOINT":
            nodes.append(_node(words, words.next(), above[-1]))
            above.append(len(nodes) - 1)
        else:
            words.next("SITE")
            nodes.append(_node(words, nodes[above[-1]].name + END, above[-1], end=True))
            words.next("}")
    if more := words.rest():
        words.fail(more, "MOTION")
    return tuple(nodes)


def _node(words: _Words, name: str, parent: int, end: bool = False) -> Node:
    """The node after its name: offset, and channels unless it is an `end` site."""
    words.next("{")
    words.next("OFFSET")
    offset = words.numbers(3)
    if end:
        return Node(name, parent, offset)
    words.next("CHANNELS")
    word = words.next()
    if word not in map(str, range(len(CHANNELS) + 1)):
        words.fail(word, "a number of channels from 0 to 6")
    known = [channel.upper() for channel in CHANNELS]
    channels = tuple(known.index(words.next(*known)) for _ in range(int(word)))
    if len(set(channels)) < len(channels):
        words.fail(f"a channel of {name} twice", "each once at most")
    return Node(name, parent, offset, channels)


def _header(path: Path, lines: list[str], motion: int) -> tuple[float, int]:
    """Seconds per frame, and the index of the first frame's line."""
    header: dict[str, float] = {}
    n = motion
    for key in ("Frames:", "Frame Time:"):
        n += 1
        while n < len(lines) and not lines[n].strip():
            n += 1
        line = lines[n].strip() if n < len(lines) else ""
        value = _numbers([line[len(key) :].strip()]) if line.lower().startswith(key.lower()) else None
        if value is None or value[0] <= 0:
            raise FormatError(f"{path}: line {n + 1}: found {shorten([line])!r}, expected {key} and a number more than zero"
                              f"{with_point(line[len(key) :])}")
        header[key] = _step(line[len(key) :].strip(), float(value[0])) if key == "Frame Time:" else float(value[0])
    frames = sum(bool(line.strip()) for line in lines[n + 1 :])
    if frames and frames != header["Frames:"]:
        warn(f"{path}: line {n}, Frames: found {header['Frames:']:g}, but the file has {frames}; those are used")
    return header["Frame Time:"], n + 1


def _step(word: str, step: float) -> float:
    """Seconds per frame stated as `word`: of the only rate in whole frames/s, or NTSC's, that is rounded to it, else as it stands."""
    digits = len(word.partition(".")[2])
    if not 0 < digits < 12 or not word.replace(".", "", 1).isdecimal():
        return step
    rate = round(1 / step)
    for factor in (1.0, 1.001):
        fit = [factor / n for n in (rate - 1, rate, rate + 1) if n > 0 and abs(factor / n - step) <= 0.5001 * 10.0**-digits]
        if fit:
            return fit[0] if len(fit) == 1 else step
    return step


def _values(path: Path, lines: list[str], first: int, width: int) -> Array:
    """Channel values (T, width) of the lines from index `first` on, one frame per line; an incomplete last line is left out."""
    rows = [(n, line.split()) for n, line in enumerate(lines[first:], first + 1) if line.strip()]
    if len(rows) > 1 and len(rows[-1][1]) < width:
        warn(f"{path}: line {rows[-1][0]}: the file breaks off within a frame; the {len(rows) - 1} before it are used")
        rows.pop()
    if not rows or not width:
        raise FormatError(f"{path}: found {len(rows)} frames of {width} channels, expected a motion")
    for n, words in rows:
        if len(words) != width:
            raise FormatError(f"{path}: line {n}: found {len(words)} numbers, expected {width}, as many as there are channels")
    values = _numbers([word for _, words in rows for word in words])
    if values is None:
        line, words = next(row for row in rows if _numbers(row[1]) is None)
        wrong = [(at, word) for at, word in enumerate(words, 1) if _numbers([word]) is None]
        point = with_point(wrong[0][1])
        what, place = (wrong[0][1], f", number {wrong[0][0]}") if point else (shorten(word for _, word in wrong), "")
        raise FormatError(f"{path}: line {line}{place}: found {what!r}, expected numbers{point}")
    return values.reshape(len(rows), width)


def _numbers(words: list[str]) -> Array | None:
    """Words as finite numbers; None if one is not."""
    try:
        values = np.array(words, float)
    except ValueError:
        return None
    return values if np.isfinite(values).all() and len(values) else None


def unique_names(names: list[str]) -> tuple[str, ...]:
    """Names, made unique by numbers."""
    counts: dict[str, int] = {}
    out = []
    for name in names:
        counts[name] = counts.get(name, 0) + 1
        out.append(name if counts[name] == 1 else f"{name}#{counts[name]}")
    return tuple(out)
