"""Reads and writes joints, and whole motions of runs, as archives of arrays (NPZ)."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.files.npz import archive_bytes, check_numbers, read_all_arrays, read_arrays
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.motion.motion import OF_LATER_RUNS, JointTable, Motion

JOINT_ARRAYS = ("times", "joint_names", "joints")
"""Seconds (T,), names (J,), and positions (T, J, 3) in the world, metres, NaN if unknown. A run's motion.npz has these arrays, too."""
MOTION_ARRAYS = tuple(field.name for field in fields(Motion))


def read_npz(path: str | Path) -> JointTable:
    """Joints of an archive with `JOINT_ARRAYS`; ignores others. Raises `FormatError`."""
    try:
        arrays = read_all_arrays(Path(path), JOINT_ARRAYS)
        check_numbers(Path(path), sum(array.size for array in arrays.values()))
        times, names, joints = (arrays[name] for name in JOINT_ARRAYS)
        return JointTable(times, tuple(names.astype(str).ravel().tolist()), joints)
    except (ShadowPuppetError, ValueError, TypeError) as error:
        expected = f"expected an archive with the arrays {', '.join(JOINT_ARRAYS)}"
        raise FormatError(f"{path}: no joints ({str(error).lower()}), {expected}") from None


def write_npz(path: str | Path, table: JointTable) -> None:
    """Write joints as `JOINT_ARRAYS`. Raises `ShadowPuppetError` if that fails."""
    write_whole(Path(path), archive_bytes(times=table.times, joint_names=np.array(table.names), joints=table.positions))


def read_motion_npz(path: Path) -> Motion:
    """Read a run's motion. Raises `FormatError`."""
    try:
        arrays: dict[str, Any] = read_all_arrays(path, [name for name in MOTION_ARRAYS if name not in OF_LATER_RUNS])
        arrays |= read_arrays(path, OF_LATER_RUNS)
        check_numbers(path, sum(array.size for array in arrays.values()))
        arrays["body_name"] = str(arrays["body_name"])
        return Motion(**arrays)
    except (ShadowPuppetError, ValueError, TypeError) as error:
        raise FormatError(f"{path}: not a motion ({error}); without this file the run is read from joints.csv and angles.csv") from None


def write_motion_npz(path: str | Path, motion: Motion) -> None:
    """Write all fields of a motion. Raises `ShadowPuppetError` if that fails."""
    write_whole(Path(path), archive_bytes(**{name: getattr(motion, name) for name in MOTION_ARRAYS}))
