"""Reads ASF files (Acclaim): the skeleton of a motion capture."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.constants import inch

from shadowpuppet.errors import FormatError, choices
from shadowpuppet.geometry import Array, rotation_about
from shadowpuppet.io.files.table import shorten, with_point
from shadowpuppet.io.files.text import read_text

DOFS = ("rx", "ry", "rz")
"""Degrees of freedom of bones; stretching bones are not supported."""
ROOT = ("tx", "ty", "tz", "rx", "ry", "rz")
SECTIONS = ("version", "name", "units", "documentation", "root", "bonedata", "hierarchy")


@dataclass(frozen=True)
class Bone:
    """A rigid segment of the skeleton."""

    name: str
    direction: Array
    """Unit vector (3,) along the bone in the zero pose."""
    length: float
    """Metres."""
    axis: Array
    """The frame (3, 3) of its angles."""
    order: str
    """Order of its rotations: `XYZ` rotates about x first."""
    dofs: tuple[str, ...] = ()
    """Some of `DOFS`, in the order of the motion file."""
    limits: Array | None = None
    """Limits of each degree of freedom, (n, 2), rad."""
    parent: int = -1
    """Index of the parent bone; -1 for the root."""


@dataclass(frozen=True)
class AcclaimSkeleton:
    """Bones, parents before children; the root has six degrees of freedom."""

    path: Path
    bones: tuple[Bone, ...]
    root_dofs: tuple[str, ...]
    """`ROOT` in the order of the motion file."""
    root_order: str
    """Order of the root's rotations."""
    unit: float
    """Metres of one unit of length."""
    degrees: bool
    """Whether angles in the file are degrees."""

    def index(self, name: str) -> int:
        """Index of a bone. Raises `FormatError` with the names of all."""
        for place, bone in enumerate(self.bones):
            if bone.name == name:
                return place
        raise FormatError(f"{self.path}: no bone {name!r}; there are: {choices(bone.name for bone in self.bones)}")


def read_asf(path: str | Path) -> AcclaimSkeleton:
    """Read an ASF file. Lengths are in units of 1/length inches, as the CMU graphics lab's.

    Raises `FormatError`, naming line and key, if the file is malformed.
    """
    path = Path(path)
    sections = _sections(path)
    units = {words[0].lower(): (line, words[1:]) for line, words in sections["units"]}
    scale = _numbers(path, *units.get("length", (0, ["1"])), 1)[0]
    if scale <= 0:
        raise FormatError(f"{path}: line {units['length'][0]}, length: found {scale:g}, expected more than 0")
    degrees = units.get("angle", (0, ["deg"]))[1][:1] != ["rad"]
    unit = inch / scale
    bones = [_bone(path, rows, unit, degrees) for rows in _blocks(path, sections["bonedata"])]
    if not bones:
        raise FormatError(f"{path}: found no bones, expected blocks from begin to end under :bonedata")
    root = {words[0].lower(): (line, words[1:]) for line, words in sections["root"]}
    order = _root_dofs(path, *root.get("order", (0, list(ROOT))))
    axis = _order(path, *root.get("axis", (0, ["XYZ"])))
    return AcclaimSkeleton(path, _ordered(path, bones, sections["hierarchy"]), order, axis, unit, degrees)


def euler(order: str, angles: Array) -> Array:
    """Rotations (..., 3, 3) about x, y and z by `angles` (..., 3), rad, in the order of the letters in `order`."""
    R = np.broadcast_to(np.eye(3), (*angles.shape[:-1], 3, 3))
    for letter in order:
        n = "XYZ".index(letter)
        R = rotation_about(np.eye(3)[n], angles[..., n]) @ R
    return R


Rows = list[tuple[int, list[str]]]


def _sections(path: Path) -> dict[str, Rows]:
    """Numbered lines, as words, by section."""
    sections: dict[str, Rows] = {name: [] for name in SECTIONS}
    current = None
    for line, text in enumerate(read_text(path).splitlines(), 1):
        words = text.split("#")[0].split()
        if words and words[0].startswith(":"):
            current = words[0][1:].lower()
            if current not in SECTIONS and current != "skin":
                raise FormatError(f"{path}: line {line}: found {words[0]!r}, expected one of {choices(':' + s for s in SECTIONS)}")
        elif words and current is None:
            raise FormatError(f"{path}: line {line}: found {shorten([text.strip()])!r}, expected an ASF file, which begins with :version")
        elif words and current in sections:
            sections[current].append((line, words))
    return sections


def _blocks(path: Path, rows: Rows) -> Iterator[Rows]:
    """The lines between each begin and end."""
    block: Rows | None = None
    for line, words in rows:
        if words[0].lower() == "begin":
            block = []
        elif block is None:
            raise FormatError(f"{path}: line {line}: found {shorten(words)!r}, expected begin")
        elif words[0].lower() == "end":
            yield block
            block = None
        else:
            block.append((line, words))
    if block is not None:
        raise FormatError(f"{path}: line {rows[-1][0]}: the file ends within a block, expected end")


def _bone(path: Path, rows: Rows, unit: float, degrees: bool) -> Bone:
    keys = {words[0].lower(): (line, words[1:]) for line, words in rows}
    where = rows[0][0] if rows else 0
    for key in ("name", "direction", "length", "axis"):
        if key not in keys or not keys[key][1]:
            raise FormatError(f"{path}: line {where}: a bone without {key}, expected id, name, direction, length and axis")
    name = keys["name"][1][0]
    direction = np.array(_numbers(path, *keys["direction"], 3))
    size = np.linalg.norm(direction)
    if size == 0:
        raise FormatError(f"{path}: line {keys['direction'][0]}, direction of {name}: found 0 0 0, expected a direction")
    angle = np.pi / 180 if degrees else 1.0
    order = _order(path, keys["axis"][0], keys["axis"][1][3:])
    axis = euler(order, angle * np.array(_numbers(path, *keys["axis"], 3)))
    line, dofs = keys.get("dof", (0, []))
    dofs = tuple(word.lower() for word in dofs)
    bad = [dof for dof in dofs if dof not in DOFS]
    if bad or len(set(dofs)) < len(dofs):
        raise FormatError(f"{path}: line {line}, dof of {name}: found {shorten(dofs)!r}, expected each of {choices(DOFS)} once at most")
    return Bone(name, direction / size, _numbers(path, *keys["length"], 1)[0] * unit, axis, order, dofs, _limits(path, rows, dofs, angle))


def _limits(path: Path, rows: Rows, dofs: Sequence[str], angle: float) -> Array | None:
    """Limits (n, 2), rad: pairs in brackets after `limits` and on the following lines; None if there are none."""
    found = []
    for line, words in rows:
        text = " ".join(words)
        if words[0].lower() == "limits" or text.startswith("("):
            pair = text.lower().removeprefix("limits").replace("(", " ").replace(")", " ").split()
            found.append([angle * value for value in _numbers(path, line, pair, 2)])
    if not found:
        return None
    if len(found) != len(dofs):
        raise FormatError(f"{path}: line {rows[-1][0]}: found limits of {len(found)} degrees of freedom, expected {len(dofs)}")
    return np.array(found)


def _ordered(path: Path, bones: list[Bone], rows: Rows) -> tuple[Bone, ...]:
    """The bones with their parents, parents first. Raises `FormatError` if the hierarchy is not one tree."""
    from dataclasses import replace

    named = {bone.name: bone for bone in bones}
    if len(named) < len(bones):
        twice = next(bone.name for bone in bones if sum(other.name == bone.name for other in bones) > 1)
        raise FormatError(f"{path}: bone {twice!r} is there twice, expected different names")
    place, done = {"root": -1}, []
    for line, words in (row for block in _blocks(path, rows) for row in block):
        if words[0] not in place:
            raise FormatError(f"{path}: line {line}: found {words[0]!r}, expected a bone that hangs on the root already")
        for child in words[1:]:
            if child not in named or child in place:
                what = "there twice" if child in place else "no bone of :bonedata"
                raise FormatError(f"{path}: line {line}: {child!r} is {what}, expected bones of :bonedata, each once")
            place[child] = len(done)
            done.append(replace(named[child], parent=place[words[0]]))
    loose = [name for name in named if name not in place]
    if loose:
        raise FormatError(f"{path}: bone {loose[0]!r} hangs on nothing, expected it under :hierarchy")
    return tuple(done)


def _root_dofs(path: Path, line: int, words: Sequence[str]) -> tuple[str, ...]:
    dofs = tuple(word.lower() for word in words)
    if sorted(dofs) != sorted(ROOT):
        raise FormatError(f"{path}: line {line}, order of the root: found {shorten(words)!r}, expected TX TY TZ RX RY RZ in some order")
    return dofs


def _order(path: Path, line: int, words: Sequence[str]) -> str:
    order = (words[0] if words else "XYZ").upper()
    if sorted(order) != ["X", "Y", "Z"]:
        raise FormatError(f"{path}: line {line}, axis: found {order!r}, expected the letters XYZ in some order")
    return order


def _numbers(path: Path, line: int, words: Sequence[str], count: int) -> list[float]:
    try:
        values = [float(word) for word in words[:count]]
        if len(values) == count and np.isfinite(values).all():
            return values
    except ValueError:
        pass
    raise FormatError(f"{path}: line {line}: found {shorten(words)!r}, expected {count} number{'s' if count > 1 else ''}"
                      f"{next(filter(None, map(with_point, words[:count])), '')}")
