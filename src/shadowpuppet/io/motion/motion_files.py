"""Reads motion files of any format: joints by our names, in metres, Z up; and the ground truth with which a run is compared."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, choices, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.motion import READABLE
from shadowpuppet.io.motion.amc import read_mocap
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.c3d import read_c3d
from shadowpuppet.io.motion.joint_names import JOINTS, columns_of, pairs_of, renamed, with_names
from shadowpuppet.io.motion.npz import read_npz
from shadowpuppet.io.motion.parquet import read_parquet
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.names import spelled_as

AMC_RATE = 120.0
"""Default frames/s of .amc files, which do not state it: the CMU laboratory's."""
LEG_LENGTHS = {"metres": (0.35, 1.1, 1.0), "centimetres": (42.0, 110.0, 0.01), "millimetres": (350.0, 1100.0, 0.001),
               "inches": (21.0, 42.0, 0.0254), "units of the CMU database": (7.0, 21.0, 0.0254 / 0.45)}
"""Range of a leg's length, hip to ankle, in each unit, and the unit in metres. Ranges do not overlap for legs of 0.4 to 1.1 m,
assuming that small children are not measured in inches."""
ARM_TO_LEG = 1.48
"""Ratio of a leg's length to an arm's, shoulder to wrist (Drillis and Contini, in Winter 2009: 0.491 and 0.332 of the stature)."""
OTHER_UNIT = 10.0
"""Ratio of the sizes of the truth's person and the run's from which one of them is in another unit."""
MIN_COSINE = 0.7
"""Least cosine between an axis and the mean direction from legs to head for the axis to count as up."""
TO_Z_UP = {"+x": ((0, 1, 0), (0, 0, 1), (1, 0, 0)), "-x": ((0, 0, 1), (0, 1, 0), (-1, 0, 0)), "+y": ((1, 0, 0), (0, 0, -1), (0, 1, 0)),
         "-y": ((1, 0, 0), (0, 0, 1), (0, -1, 0)), "-z": ((1, 0, 0), (0, -1, 0), (0, 0, -1))}
"""Rotations from worlds in which another axis is up."""


@np.errstate(all="ignore")  # impossible numbers become unknown, or are refused where they are checked
def read_motion(path: str | Path, rate: float | None = None, own_names: bool = False, unit: float | None = None,
                names: Mapping[str, str] | None = None) -> JointTable:
    """Read joints from a motion file (ending in `READABLE`; .amc needs its .asf in the same folder), in metres, Z up.

    If the file does not state the unit (BVH) or the up axis, they are estimated from the person's legs and posture, with a warning.
    Raises `FormatError`, naming the file.

    Args:
        path: the file.
        rate: frames/s of an .amc file (default 120).
        own_names: keep all joints under the file's names; else keep only our joints, by our names.
        unit: metres of a BVH file's unit, if known.
        names: the file's names of our joints, by ours (`read_names`), if they are not known.
    """
    path = Path(path)
    ending = path.suffix.lower()
    _check_ending(path)
    if ending == ".amc":
        table = named(path, read_mocap(path).joints(rate or AMC_RATE), names)
        return table if own_names else _ours(path, table)
    table = named(path, read_bvh(path).joints() if ending == ".bvh" else READERS[ending](path), names)
    scale = 1.0 if ending != ".bvh" else unit_of(path, table) if unit is None else unit
    up = _markers_up(path, table) if ending == ".trc" and own_names else rotation_to_z_up(path, table)
    table = table if own_names else _ours(path, table)
    return replace(table, positions=table.positions * scale @ up.T)


READERS = {".c3d": read_c3d, ".csv": read_joints, ".npz": read_npz, ".parquet": read_parquet, ".trc": read_joints}
"""Readers of the formats that state their unit."""


@np.errstate(all="ignore")
def read_truth(path: str | Path, known: Sequence[str] = JOINTS) -> JointTable:
    """Read the ground truth of a run: joints by our names, metres; joints named in `known` (the run's) are kept, too.

    The file's axes are kept, as the truth must be in the cameras' world; BVH and AMC files, which have their own worlds, are read by
    `read_motion`. Raises `FormatError`, naming the file and its content.
    """
    path = Path(path)
    ending = path.suffix.lower()
    _check_ending(path)
    if ending in (".bvh", ".amc"):
        return read_motion(path)
    table = READERS[ending](path)
    table = replace(table, names=tuple(spelled_as(dict.fromkeys(table.names), known)))
    same = [name for name in table.names if name in known and name not in JOINTS]
    if not columns_of(table.names) and not pairs_of(table.names):
        if same:
            return table.select(same)
        raise FormatError(f"{path}: found no joint of a known name, but {shorten(table.names)}; known are ours ({', '.join(JOINTS[:4])}, "
                          "...), those of COCO, HALPE_26 and BODY_25 (LShoulder, ...), Vicon's and HumanEva's (LCLO, upperLArmProximal, "
                          "...), OpenSim's (RHJC, R.Knee.Lat with R.Knee.Med, ...), and those of BVH files (LeftArm, ...)")
    ours = renamed(table)
    others = table.select(same)
    return JointTable(table.times, (*ours.names, *others.names), np.concatenate([ours.positions, others.positions], 1))


def check_unit(run: JointTable, truth: JointTable, path: str | Path) -> None:
    """Raise `FormatError` if the truth's person is far from the size of the run's."""
    shared = [name for name in run.names if name in truth.names]
    ours, theirs = (_extent(table.select(shared)) for table in (run, truth))
    ratio = theirs / ours if ours > 0 else np.nan
    if ratio > OTHER_UNIT or ratio < 1 / OTHER_UNIT:
        unit = "mm" if 500 < ratio < 2000 else "cm" if 50 < ratio < 200 else ""
        remedy = f": are these {unit}? divide them by {1000 if unit == 'mm' else 100}" if unit else ""
        raise FormatError(f"{path}: found a person {ratio:,.5g} times as large as the run's, expected metres{remedy}")


def _extent(table: JointTable) -> float:
    """Median distance of the joints from their middle; NaN if nothing is known."""
    frames = table.positions[np.isfinite(table.positions).all(2).sum(1) > 1]
    away = np.linalg.norm(frames - np.nanmean(frames, axis=1, keepdims=True), axis=2)
    return float(np.nanmedian(away)) if len(frames) else np.nan


def names_in(path: str | Path) -> str:
    """The names of joints in a table, for messages; empty for other formats."""
    path = Path(path)
    return shorten(read_joints(path).names) if path.suffix.lower() in (".csv", ".trc") else ""


def _check_ending(path: Path) -> None:
    if path.suffix.lower() not in READABLE:
        raise FormatError(f"{path}: found the ending {path.suffix!r}, expected one of {choices(READABLE)}")


def _ours(path: Path, table: JointTable) -> JointTable:
    try:
        return renamed(table)
    except ShadowPuppetError as error:
        raise FormatError(f"{path}: {error}") from None


def _known(table: JointTable) -> JointTable:
    """Our joints in a table, by our names; may be empty."""
    try:
        return renamed(table)
    except ShadowPuppetError:
        return JointTable(table.times, (), np.empty((len(table.times), 0, 3)))


def named(path: Path, table: JointTable, names: Mapping[str, str] | None) -> JointTable:
    """The table with our names for the joints in `names`, by ours. Raises `FormatError`."""
    if not names:
        return table
    try:
        return replace(table, names=with_names(table.names, names))
    except ShadowPuppetError as error:
        raise FormatError(f"{path}: {error}") from None


def unit_of(path: Path, table: JointTable) -> float:
    """A table's unit in metres, estimated from the length of legs or arms, with a warning. Raises `FormatError` if no unit fits."""
    length = leg_length(_known(table))
    if not np.isfinite(length):
        raise FormatError(f"{path}: found neither legs nor arms of known names among {shorten(table.names, 400)!r}, by whose length the "
                          "unit is known; give the unit (--source-unit), or the names (--names FILE)")
    for unit, (low, high, metres) in LEG_LENGTHS.items():
        if low <= length < high:
            if metres != 1:
                warn(f"{path}: BVH files do not tell their unit; legs {length:.4g} long make it {unit}")
            return metres
    raise FormatError(f"{path}: found legs {length:.4g} long in an unknown unit, expected a person's in metres, centimetres, millimetres "
                      "or inches; --source-unit gives another")


def leg_length(table: JointTable) -> float:
    """Median length of the legs, or of the arms in proportion, in the table's unit; NaN if unknown."""
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


def rotation_to_z_up(path: Path, table: JointTable) -> Array:
    """The rotation (3, 3) to Z up, estimated from the mean direction from legs to head. Warns unless it is the identity."""
    axis = up_axis(_known(table))
    if axis not in TO_Z_UP:
        return np.eye(3)
    warn(f"{path}: {axis.upper()} points up there; turned so that Z does")
    return np.array(TO_Z_UP[axis], float)


def _markers_up(path: Path, table: JointTable) -> Array:
    """As `rotation_to_z_up`, for all markers of a .trc file: if no legs and head have known names, Y is up, as OpenSim requires."""
    if np.isfinite(_upward(_known(table))).any():
        return rotation_to_z_up(path, table)
    warn(f"{path}: found no legs and head of known names that show which axis is up: Y is taken, as in OpenSim, and turned to Z")
    return np.array(TO_Z_UP["+y"], float)


def up_axis(table: JointTable) -> str:
    """The axis along which a person stands, for example `+y`; `+z` if none is clear."""
    up = _upward(table)
    lengths = np.linalg.norm(up, axis=1, keepdims=True)
    known = np.isfinite(lengths[:, 0]) & (lengths[:, 0] > 0)
    if not known.any():
        return "+z"
    mean = (up[known] / lengths[known]).mean(0)
    n = int(np.abs(mean).argmax())
    return f"{'+' if mean[n] > 0 else '-'}{'xyz'[n]}" if abs(mean[n]) >= MIN_COSINE else "+z"


def _upward(table: JointTable) -> Array:
    """The way (T, 3) from the legs to the head; NaN if unknown."""
    low, high = (_middle(table, joints) for joints in (("ankle", "knee", "hip", "pelvis"), ("neck", "head", "shoulder")))
    return high - low


def _middle(table: JointTable, joints: tuple[str, ...]) -> Array:
    """The middle (T, 3) of the first of `joints` that the table has, both sides; NaN if it has none."""
    for joint in joints:
        columns = [n for n, name in enumerate(table.names) if name in (joint, f"left_{joint}", f"right_{joint}")]
        if columns:
            return table.positions[:, columns].mean(1)
    return np.full((len(table.times), 3), np.nan)
