"""Motion of a person from any file that holds joints: ours, markers, skeletons of other programs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from warnings import warn

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning, choices
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.npz import read_npz
from shadowpuppet.io.motion.amc import read_mocap
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.c3d import read_c3d
from shadowpuppet.io.motion.joint_names import renamed
from shadowpuppet.io.motion.parquet import read_parquet
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.motion import JointTable

ENDINGS = (".amc", ".bvh", ".c3d", ".csv", ".npz", ".parquet", ".trc")
"""Of the files that are read."""
AMC_RATE = 120.0
"""Frames/s of files that tell none: the CMU laboratory's."""
UNITS = {"metres": (0.35, 1.1, 1.0), "centimetres": (42.0, 110.0, 0.01), "millimetres": (350.0, 1100.0, 0.001),
         "inches": (21.0, 42.0, 0.0254), "units of the CMU database": (7.0, 21.0, 0.0254 / 0.45)}
"""Lengths of a leg, from hip to ankle, in a file's unit by which that is told, and the unit in metres. They do not overlap: people's
legs are 0.4 to 1.1 m long, and who is measured in inches is no small child."""
ARM_TO_LEG = 1.48
"""Length of a leg by that of an arm from shoulder to wrist (Drillis and Contini, in Winter 2009: 0.491 and 0.332 of the stature)."""
CLEAR = 0.7
"""Cosine from which on the direction from legs to head is taken for an axis."""
TURNS = {"+x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)), "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)), "+y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
         "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)), "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1))}
"""Rotations by which each axis comes to point up."""


def read_motion(path: str | Path, rate: float | None = None, own_names: bool = False, unit: float | None = None) -> JointTable:
    """Joints from a file of motion: .csv or .trc (`read_joints`), .bvh, .c3d, .npz, .parquet, or .amc with its .asf beside it.

    Joints have our names, metres, Z up, whatever the file's names, unit and axes are; joints of other names are left out, or all are kept
    as they are called there (`own_names`). What the file does not tell, its unit (BVH) or which axis is up, is found from the person's legs
    and posture, and said as a warning. `unit`: metres of a BVH file's unit, where that is known. `rate`: frames/s of an .amc file, which
    tells none (default 120). Raises `FormatError`, naming the file.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise FormatError(f"{path}: found the ending {path.suffix!r}, expected one of {choices(ENDINGS)}")
    if ending == ".amc":
        table = read_mocap(path).joints(rate or AMC_RATE)
        return table if own_names else _ours(path, table)
    table = read_bvh(path).joints() if ending == ".bvh" else READERS[ending](path)
    scale, up = 1.0 if ending != ".bvh" else unit_of(path, table) if unit is None else unit, turn_of(path, table)
    table = table if own_names else _ours(path, table)
    return replace(table, positions=table.positions * scale @ up.T)


READERS = {".c3d": read_c3d, ".csv": read_joints, ".npz": read_npz, ".parquet": read_parquet, ".trc": read_joints}
"""How files are read that tell their unit."""


def _ours(path: Path, table: JointTable) -> JointTable:
    try:
        return renamed(table)
    except ShadowPuppetError as error:
        raise FormatError(f"{path}: {error}") from None


def _known(table: JointTable) -> JointTable:
    """Those joints that are ours, by our names; none where none is."""
    try:
        return renamed(table)
    except ShadowPuppetError:
        return JointTable(table.times, (), np.empty((len(table.times), 0, 3)))


def unit_of(path: Path, table: JointTable) -> float:
    """Metres of the unknown unit of a table, by the length of the legs, or arms; said as a warning. Raises `FormatError`."""
    length = leg_length(_known(table))
    for unit, (low, high, metres) in UNITS.items():
        if low <= length < high:
            if metres != 1:
                warn(f"{path}: BVH files do not tell their unit; legs {length:.4g} long make it {unit}", ShadowPuppetWarning, stacklevel=3)
            return metres
    raise FormatError(f"{path}: found legs {length:.4g} long in an unknown unit, expected a person's in metres, centimetres, millimetres "
                      "or inches")


def leg_length(table: JointTable) -> float:
    """Median length of the legs, or of the arms in proportion, in the table's unit; not a number where neither is known."""
    p = dict(zip(table.names, np.moveaxis(table.positions, 1, 0)))
    for chain, factor in ((("hip", "knee", "ankle"), 1.0), (("shoulder", "elbow", "wrist"), ARM_TO_LEG)):
        sides = [[p.get(f"{side}_{joint}") for joint in chain] for side in ("left", "right")]
        sums = [np.linalg.norm(a - b, axis=1) + np.linalg.norm(b - c, axis=1) for a, b, c in sides
                if a is not None and b is not None and c is not None]
        known = np.concatenate([np.zeros(0), *sums])
        known = known[np.isfinite(known)]
        if len(known):
            return factor * float(np.median(known))
    return np.nan


def turn_of(path: Path, table: JointTable) -> Array:
    """The rotation (3, 3) by which Z comes to point up: along that axis the head is over the legs for most of the time. Warns of one."""
    axis = up_axis(_known(table))
    if axis not in TURNS:
        return np.eye(3)
    warn(f"{path}: {axis.upper()} points up there; turned so that Z does", ShadowPuppetWarning, stacklevel=3)
    return np.array(TURNS[axis], float)


def up_axis(table: JointTable) -> str:
    """The axis along which a person is upright, such as `+y`; `+z` where none is clearly."""
    low, high = (_middle(table, joints) for joints in (("ankle", "knee", "hip", "pelvis"), ("neck", "head", "shoulder")))
    up = high - low
    lengths = np.linalg.norm(up, axis=1, keepdims=True)
    known = np.isfinite(lengths[:, 0]) & (lengths[:, 0] > 0)
    if not known.any():
        return "+z"
    mean = (up[known] / lengths[known]).mean(0)
    n = int(np.abs(mean).argmax())
    return f"{'+' if mean[n] > 0 else '-'}{'xyz'[n]}" if abs(mean[n]) >= CLEAR else "+z"


def _middle(table: JointTable, joints: tuple[str, ...]) -> Array:
    """The middle (T, 3) of the first of `joints` that the table has, of both sides; not a number where it has none."""
    for joint in joints:
        columns = [n for n, name in enumerate(table.names) if name in (joint, f"left_{joint}", f"right_{joint}")]
        if columns:
            return table.positions[:, columns].mean(1)
    return np.full((len(table.times), 3), np.nan)
