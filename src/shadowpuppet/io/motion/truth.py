"""True joints to compare a run with, from any file of motion, by the names that the run has."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError, choices
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.motion.c3d import read_c3d
from shadowpuppet.io.motion.joint_names import JOINTS, columns_of, pairs_of, renamed
from shadowpuppet.io.motion.motion_files import ENDINGS, read_motion
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.motion.motion import JointTable


def read_truth(path: str | Path, known: Sequence[str] = JOINTS) -> JointTable:
    """Joints from .csv, .trc, .c3d, .bvh or .amc by our names, metres; and those of the run's (`known`) that the file has by the same name.

    CSV, TRC and C3D stay in the world of the file, axes and all, for a truth must be in the cameras' world; BVH and AMC, which have worlds
    of their own, are read as `read_motion` does. Raises `FormatError`, naming the file and what is in it.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise FormatError(f"{path}: found the ending {path.suffix!r}, expected one of {choices(ENDINGS)}")
    if ending in (".bvh", ".amc"):
        return read_motion(path)
    table = read_c3d(path) if ending == ".c3d" else read_joints(path)
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


def names_in(path: str | Path) -> str:
    """What a file calls its joints, for messages; nothing where that is not quickly said."""
    path = Path(path)
    return shorten(read_joints(path).names) if path.suffix.lower() in (".csv", ".trc") else ""
