"""Reads AMC files (Acclaim): motion of an ASF skeleton (`asf.py`), as joints in metres.

This is the format of the CMU graphics lab's motion capture database; our joint names need that database's bone names.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import NoReturn

import numpy as np

from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import shorten, with_point
from shadowpuppet.io.files.text import read_text
from shadowpuppet.io.motion.asf import AcclaimSkeleton, euler, read_asf
from shadowpuppet.motion.motion import JointTable

Z_UP = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
"""From the file's world (y up, a person at rest faces z) to ours (z up, facing -y)."""

ENDS = {
    "neck": "thorax", "head": "upperneck", "crown": "head", "lumbar": "lowerback",
    **{
        f"{side}_{joint}": f"{side[0]}{bone}"
        for side in ("left", "right")
        for joint, bone in (("shoulder", "clavicle"), ("elbow", "humerus"), ("wrist", "wrist"), ("hand", "hand"), ("thumb", "thumb"),
                            ("hip", "hipjoint"), ("knee", "femur"), ("ankle", "tibia"), ("ball", "foot"), ("toes", "toes"))
    },
}  # fmt: skip
"""For each joint, the bone whose far end it is; joints that are not ours show the rotation of segments. In addition, `pelvis` lies between
the hips, `face` in front of the crown."""


@dataclass(frozen=True, eq=False)
class Capture:
    """Motion of a skeleton."""

    skeleton: AcclaimSkeleton
    root: Array
    """Position of the root (T, 3), metres, in the file's world."""
    root_rotation: Array
    """Rotation of the root (T, 3, 3), in the file's world."""
    angles: Array
    """Angles of the bones about x, y and z of their axes (T, B, 3), rad; 0 for axes without a degree of freedom."""

    @cached_property
    def rotations(self) -> Array:
        """Rotations of the bones from the zero pose, (T, B, 3, 3), in the file's world."""
        found = np.empty((len(self.root), len(self.skeleton.bones), 3, 3))
        for n, bone in enumerate(self.skeleton.bones):
            above = self.root_rotation if bone.parent < 0 else found[:, bone.parent]
            own = bone.axis @ euler(bone.order, self.angles[:, n]) @ bone.axis.T if bone.dofs else np.eye(3)
            found[:, n] = above @ own
        return found

    @cached_property
    def ends(self) -> Array:
        """Far ends of the bones (T, B, 3), metres, in the file's world."""
        found = np.empty((len(self.root), len(self.skeleton.bones), 3))
        for n, bone in enumerate(self.skeleton.bones):
            start = self.root if bone.parent < 0 else found[:, bone.parent]
            found[:, n] = start + self.rotations[:, n] @ (bone.direction * bone.length)
        return found

    def joints(self, rate: float = 120.0) -> JointTable:
        """Joints of `ENDS`, `pelvis` and `face` at `rate` frames/s from 0 s, metres, z up.

        Raises `FormatError` if the skeleton lacks a bone.
        """
        places = {name: self.ends[:, self.skeleton.index(bone)] for name, bone in ENDS.items()}
        places["pelvis"] = (places["left_hip"] + places["right_hip"]) / 2
        places["face"] = places["crown"] + self.rotations[:, self.skeleton.index("head")] @ np.array([0, 0, 0.15])
        positions = np.stack(list(places.values()), 1) @ Z_UP.T
        return JointTable(np.arange(len(positions)) / rate, tuple(places), positions)

    @property
    def at_rest(self) -> Capture:
        """The zero pose, one frame."""
        zero = np.zeros((1, len(self.skeleton.bones), 3))
        return Capture(self.skeleton, np.zeros((1, 3)), np.eye(3)[None], zero)


def read_amc(path: str | Path, skeleton: AcclaimSkeleton) -> Capture:
    """Read an AMC file. Raises `FormatError`, naming the line, if it is malformed or of another skeleton."""
    path = Path(path)
    lines = read_text(path).splitlines()
    first, degrees = _header(path, lines, skeleton)
    names, counts = _layout(path, lines, first, skeleton)
    values = _parsed(lines[first:], names, counts)
    if values is None:
        _raise_malformed(path, lines, first, names, counts)
    angle = np.pi / 180 if degrees else 1.0
    frames, angles = values[:, 1:], np.zeros((len(values), len(skeleton.bones), 3))
    if (np.diff(values[:, 0]) <= 0).any():
        bad = values[int((np.diff(values[:, 0]) <= 0).argmax()) + 1, 0]
        raise FormatError(f"{path}: frame {bad:g} comes after one with a number that is not smaller, expected increasing numbers")
    at, root = 0, np.zeros((len(values), 6))
    for name, count in zip(names, counts):
        part = frames[:, at : at + count]
        at += count
        if name == "root":
            root[:, ["txtytzrxryrz".index(dof) // 2 for dof in skeleton.root_dofs]] = part
        elif count:
            place = skeleton.index(name)
            angles[:, place, ["xyz".index(dof[1]) for dof in skeleton.bones[place].dofs]] = angle * part
    return Capture(skeleton, root[:, :3] * skeleton.unit, euler(skeleton.root_order, angle * root[:, 3:]), angles)


@np.errstate(all="ignore")  # impossible numbers are refused where they are checked
def read_mocap(path: str | Path, skeleton: str | Path | None = None) -> Capture:
    """Read an AMC file with its skeleton: an ASF file, by default the one in the same folder.

    For `02_10.amc` that is `02_10.asf`, `02.asf`, or the only .asf file in the folder. Raises `FormatError`.
    """
    path = Path(path)
    if path.suffix.lower() != ".amc":
        raise FormatError(f"{path}: found the ending {path.suffix!r}, expected .amc")
    return read_amc(path, read_asf(skeleton or _beside(path)))


def _beside(path: Path) -> Path:
    if not path.is_file():
        raise FormatError(f"{path}: cannot be read (no such file)")
    there = sorted(p for p in path.parent.glob("*") if p.suffix.lower() == ".asf")
    stems = list(dict.fromkeys([path.stem, path.stem.split("_")[0]]))
    for stem in stems:
        for other in there:
            if other.stem == stem:
                return other
    if len(there) == 1:
        return there[0]
    raise FormatError(f"{path}: found {len(there)} .asf files beside it, expected {' or '.join(f'{s}.asf' for s in stems)}")


def _header(path: Path, lines: list[str], skeleton: AcclaimSkeleton) -> tuple[int, bool]:
    """Index of the first frame's line, and whether angles are degrees."""
    degrees = skeleton.degrees
    for n, line in enumerate(lines):
        word = line.split("#")[0].strip()
        if word.isdigit():
            return n, degrees
        if word.upper() in (":DEGREES", ":RADIANS"):
            degrees = word.upper() == ":DEGREES"
        elif word and not word.startswith(":"):
            raise FormatError(f"{path}: line {n + 1}: found {shorten([word])!r}, expected a frame's number")
    raise FormatError(f"{path}: found no frames, expected lines with a number before each")


def _layout(path: Path, lines: list[str], first: int, skeleton: AcclaimSkeleton) -> tuple[list[str], list[int]]:
    """Names in the first frame's lines, and the number of values of each."""
    wanted = {"root": 6} | {bone.name: len(bone.dofs) for bone in skeleton.bones}
    names: list[str] = []
    for n, line in enumerate(lines[first + 1 :], first + 2):
        words = line.split()
        if not words:
            continue
        if words[0].isdigit():
            break
        if words[0] not in wanted or words[0] in names:
            what = "is there twice in the frame" if words[0] in names else f"is no bone of {skeleton.path.name}"
            raise FormatError(f"{path}: line {n}: {shorten(words[:1])!r} {what}, expected each bone that moves once")
        names.append(words[0])
    missing = [name for name, count in wanted.items() if count and name not in names]
    if missing:
        raise FormatError(f"{path}: line {first + 1}: the frame has no {missing[0]!r}, expected every bone that moves")
    return names, [wanted[name] for name in names]


def _parsed(lines: list[str], names: list[str], counts: list[int]) -> Array | None:
    """Frame numbers and values (T, 1 + n) of a well-formed file; None for any other."""
    words = " ".join(lines).split()
    width = 1 + len(names) + sum(counts)
    if len(words) % width:
        return None
    table = np.array(words, object).reshape(-1, width)  # as texts of one width, a single long word would be the size of all
    at = 1 + np.cumsum([0, *(count + 1 for count in counts[:-1])])
    if not (table[:, at] == names).all():
        return None
    try:
        values = np.delete(table, at, 1).astype(float)
    except ValueError:
        return None
    return values if np.isfinite(values).all() else None


def _is_number(word: str) -> bool:
    try:
        return bool(np.isfinite(float(word)))
    except ValueError:
        return False


def _raise_malformed(path: Path, lines: list[str], first: int, names: list[str], counts: list[int]) -> NoReturn:
    """Raise `FormatError` with the line that is malformed."""
    due = [("", 0), *zip(names, counts)]
    place = 0
    for n, line in enumerate(lines[first:], first + 1):
        words = line.split()
        if not words:
            continue
        name, count = due[place]
        expected = f"{name} and {count} number{'s' if count != 1 else ''}" if name else "a frame's number"
        right = words[0] == name if name else words[0].isdigit()
        if not right or len(words) != count + 1 or not all(_is_number(word) for word in words[1:]):
            point = next(((at, word) for at, word in enumerate(words[1:], 1) if with_point(word)), None)
            where, what = (f", number {point[0]}", point[1]) if point and right else ("", shorten(words))
            raise FormatError(f"{path}: line {n}{where}: found {what!r}, expected {expected}{with_point(what)}")
        place = (place + 1) % len(due)
    raise FormatError(f"{path}: line {len(lines)}: the file ends within a frame, expected {due[place][0]}")
