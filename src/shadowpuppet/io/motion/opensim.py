"""OpenSim formats: marker names, a skeleton's motion as coordinates of a full-body model, and MOT files, which contain coordinates.

Markers are named as in Pose2Sim's marker sets; coordinates are those of the full-body model of Rajagopal et al. (2016). Its world and
bodies have X forward, Y up, Z to the right, and ball joints rotate about Z, then X, then Y. A MOT file is a table after a short header,
with angles in degrees and lengths in metres.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple
from warnings import warn

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.geometry import Array, continuous_angles
from shadowpuppet.io.files.table import check_times, number, shorten
from shadowpuppet.io.files.text import read_text, write_whole
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.motion import JointTable

MARKERS = {
    "pelvis": "CHip", "neck": "Neck", "head": "HeadBase",
    **{f"{side}_{joint}": f"{side[0].upper()}{name}" for side in ("left", "right") for joint, name in (
        ("shoulder", "Shoulder"), ("elbow", "Elbow"), ("wrist", "Wrist"), ("hand", "Middle1"), ("hip", "Hip"), ("knee", "Knee"),
        ("ankle", "Ankle"))},
}  # fmt: skip
"""Marker names of our joints. `Head` is the crown there, so the base of the skull has another name."""
TRANSLATIONS = ("_tx", "_ty", "_tz")
"""Endings of coordinates in metres; all others are angles."""
MAX_HEADER = 100
"""Lines within which the header must end."""

Pair = tuple[float, float]


class Ball(NamedTuple):
    """Three coordinates: successive rotations about Z, X and Y."""

    joint: str
    """Joint of the skeleton."""
    names: tuple[str, str, str]
    limits: tuple[Pair, Pair, Pair]
    """Usual ranges, degrees; of equivalent triples of angles, the one least outside these is used."""
    signs: tuple[int, int, int] = (1, 1, 1)


class Hinge(NamedTuple):
    """A coordinate that rotates about the axis to the left, `sign` times."""

    joint: str
    name: str
    sign: int
    first: bool = False
    """Whether this rotation precedes the joint's other one (an ankle's inversion); else it follows it (an elbow's about the upper arm)."""


COORDINATES: tuple[Ball | Hinge, ...] = (
    Ball("pelvis", ("pelvis_tilt", "pelvis_list", "pelvis_rotation"), ((-90, 90), (-60, 60), (-180, 180))),
    Ball("chest", ("lumbar_extension", "lumbar_bending", "lumbar_rotation"), ((-90, 45), (-60, 60), (-90, 90))),
    *(part for side, s, mirror in (("right", "r", 1), ("left", "l", -1)) for part in (
        Ball(f"{side}_hip", (f"hip_flexion_{s}", f"hip_adduction_{s}", f"hip_rotation_{s}"),
             ((-60, 150), (-90, 60), (-75, 75)), (1, mirror, mirror)),
        Hinge(f"{side}_knee", f"knee_angle_{s}", 1),
        Hinge(f"{side}_ankle", f"ankle_angle_{s}", -1, first=True),
        Ball(f"{side}_shoulder", (f"arm_flex_{s}", f"arm_add_{s}", f"arm_rot_{s}"),
             ((-80, 150), (-140, 50), (-150, 150)), (1, mirror, mirror)),
        Hinge(f"{side}_elbow", f"elbow_flex_{s}", -1),
    )),
)  # fmt: skip
"""Coordinates in the order of the file. Positive: a knee bends, an ankle bends up; hips and arms move forward, inward, and rotate inward.
The upper body's `torso` is the chest. Not included: the head's rotation, and an ankle's inversion, whose axis is not the model's."""
PELVIS_POSITION = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
TO_MODEL = np.array([[0.0, 0, 1], [0, 1.0, 0], [-1.0, 0, 0]])
"""From a skeleton's axes at rest (left, up, forward) to the model's (forward, up, right)."""


def marker_names(table: JointTable) -> JointTable:
    """The table with names of `MARKERS`, rotated so that Y is up, (x, z, -y); joints without such a name keep theirs."""
    return replace(table, names=tuple(MARKERS.get(name, name) for name in table.names), positions=table.positions @ Y_UP.T)


def coordinates(animation: Animation) -> dict[str, Array]:
    """`COORDINATES` and `PELVIS_POSITION` over time, each (T,), rad or metres, of a skeleton whose joints have our names.

    Angles are continuous over the known frames, NaN in others. An elbow's rotation about the upper arm is added to the shoulder's.
    Raises `ShadowPuppetError` if the root is not the pelvis, or no frame is known.
    """
    known = np.flatnonzero(animation.known)
    if animation.names[0] != "pelvis" or not len(known):
        raise ShadowPuppetError(f"found {len(known)} known frames of a skeleton from {animation.names[0]!r}, expected some, from 'pelvis'")
    turns = {name: animation.rotations[known][:, n] for n, name in enumerate(animation.names)}
    if "torso" in turns:
        turns["chest"] = turns["torso"]
    turns["pelvis"] = Y_UP @ turns["pelvis"] @ TO_MODEL.T
    found: dict[str, Array] = dict(zip(PELVIS_POSITION, (animation.shifts[known, 0] @ Y_UP.T).T))
    for part in COORDINATES:
        if part.joint not in turns or not _rotates(turns[part.joint]):
            continue
        if isinstance(part, Hinge):
            found[part.name] = part.sign * _hinge(turns[part.joint], part.first)
        else:
            own = turns[part.joint] if part.joint == "pelvis" else TO_MODEL @ _with_twist(turns, part.joint) @ TO_MODEL.T
            found |= dict(zip(part.names, _angles(own, part).T))
    return {name: _spread(values, known, len(animation.times)) for name, values in found.items()}


def _angles(rotations: Array, part: Ball) -> Array:
    """Coordinates (T, 3) of rotations (T, 3, 3) in the model's axes."""
    signs = np.array(part.signs)
    limits = np.radians([sorted((sign * low, sign * high)) for sign, (low, high) in zip(part.signs, part.limits)])
    return signs * continuous_angles(rotations, "ZXY", limits)


def _rotates(rotations: Array) -> bool:
    """Whether rotations (T, 3, 3) differ from the identity; an ankle's of a body without feet do not."""
    return bool(np.abs(rotations - np.eye(3)).max() > 0)


def _with_twist(turns: dict[str, Array], joint: str) -> Array:
    """A joint's rotations (T, 3, 3); a shoulder's include the rotation about the upper arm, which our upper bodies have in the elbow."""
    elbow = joint.replace("shoulder", "elbow")
    if elbow == joint or elbow not in turns:
        return turns[joint]
    R = turns[elbow]  # about y (along the arm) by the twist, then about x by the bend: the first column has the twist
    c, s = R[:, 0, 0], -R[:, 2, 0]
    twist = np.zeros_like(R)
    twist[:, 0, 0], twist[:, 0, 2], twist[:, 1, 1], twist[:, 2, 0], twist[:, 2, 2] = c, s, 1, -s, c
    return turns[joint] @ twist


def _hinge(R: Array, first: bool) -> Array:
    """The angle (T,) about x in rotations (T, 3, 3): if `first` before a rotation about z, else after one about y."""
    return np.unwrap(np.arctan2(-R[:, 1, 2], R[:, 2, 2] if first else R[:, 1, 1]))


def _spread(values: Array, known: NDArray[np.int64], frames: int) -> Array:
    out = np.full(frames, np.nan)
    out[known] = values
    return out


class Coordinates(NamedTuple):
    """Coordinates over time."""

    times: Array
    """Seconds (T,)."""
    values: dict[str, Array]
    """Each coordinate's values (T,), rad or metres."""


def write_mot(path: str | Path, times: Array, values: Mapping[str, Array], smoothing: str = "") -> None:
    """Write coordinates (T,), rad or metres, as a MOT file. Frames with an unknown coordinate are left out: OpenSim has no gaps.
    `smoothing`: how the motion was smoothed, a line of the header.

    Raises `ShadowPuppetError` if no frame is known or the file cannot be written.
    """
    path = Path(path)
    table = np.stack([times, *(values[name] if name.endswith(TRANSLATIONS) else np.degrees(values[name]) for name in values)], 1)
    table = table[np.isfinite(table).all(1)]
    if not len(table) or not values:
        raise ShadowPuppetError(f"{path}: found no frame in which all of {len(values)} coordinates are known, expected one at least")
    sizes = [f"nRows={len(table)}", f"nColumns={table.shape[1]}"]
    note = [f"smoothing={smoothing}"] if smoothing else []
    head = [path.stem, "version=1", *sizes, "inDegrees=yes", *note, "endheader", "\t".join(["time", *values])]
    rows = ("\t".join(f"{value + 0.0:.6f}" for value in row) for row in table.round(6).tolist())
    write_whole(path, "\n".join([*head, *rows, ""]))


def read_mot(path: str | Path) -> Coordinates:
    """Read a MOT file. Raises `FormatError`, naming line and column, if it is malformed; warns of a wrong number of rows."""
    path = Path(path)
    lines = read_text(path).splitlines()
    end = next((n for n, line in enumerate(lines[:MAX_HEADER]) if line.strip().lower() == "endheader"), None)
    if end is None or len(lines) < end + 2:
        raise FormatError(f"{path}: found no line endheader with columns behind it, expected a MOT file of OpenSim")
    header = dict(line.strip().split("=", 1) for line in lines[:end] if "=" in line)
    columns = lines[end + 1].split()
    if columns[:1] != ["time"] or len(set(columns)) < len(columns) or len(columns) < 2:
        raise FormatError(f"{path}: line {end + 2}: found {shorten(columns)!r}, expected time and the names of coordinates, each once")
    numbered = [(n, line.split()) for n, line in enumerate(lines[end + 2 :], end + 3) if line.strip()]
    for n, row in numbered:
        if len(row) != len(columns):
            raise FormatError(f"{path}: line {n}: found {len(row)} numbers, expected {len(columns)}, as many as there are columns")
    table = np.array([[number(path, n, column, cell) for column, cell in zip(columns, row)] for n, row in numbered])
    table = table.reshape(-1, len(columns))
    check_times(path, table[:, 0], [n for n, _ in numbered])
    if header.get("nRows", str(len(table))).strip() != str(len(table)):
        warn(f"{path}: nRows: found {header['nRows']}, but the file has {len(table)} rows; those are used", ShadowPuppetWarning,
             stacklevel=2)
    angle = np.pi / 180 if header.get("inDegrees", "no").strip().lower() == "yes" else 1.0
    values = zip(columns[1:], table.T[1:])
    return Coordinates(table[:, 0], {name: column * (1.0 if name.endswith(TRANSLATIONS) else angle) for name, column in values})
