"""A motion as one table, a row a frame: what CSV and Parquet exports have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import cells, csv_line
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.table import joint_columns
from shadowpuppet.motion.motion import JointTable, Motion

LENGTHS = ("torso_y", "root_x", "root_y", "root_z")
"""Degrees of freedom that are places, metres; all others are angles."""
Columns = dict[str, Array | NDArray[np.str_]]
"""Names to values (T,), numbers or words."""


def motion_columns(motion: Motion) -> Columns:
    """`time`, each joint's `_x`, `_y`, `_z` (world, metres) and `_sd_x`, ..., `status`, `cost`, `overlap`, then degrees of freedom.

    The names of these have their unit behind them, `chest_x [rad]`, so that none is taken for a joint's. What is not known in any frame has
    no column.
    """
    found: Columns = table_columns(motion.table)
    spread = motion.joint_sd.reshape(len(motion), 3 * len(motion.joint_names)).T
    found |= dict(zip(joint_columns(motion.joint_names, "_sd"), spread))
    found |= {"status": motion.status, "cost": motion.cost, "overlap": motion.overlap}
    for values, suffix in ((motion.poses, ""), (motion.pose_sd, "_sd")):
        found |= {f"{name}{suffix} [{dof_unit(name)}]": column for name, column in zip(motion.dof_names, values.T)}
    kept = {"time", "status", *joint_columns(motion.joint_names)}
    return {name: column for name, column in found.items() if name in kept or np.isfinite(column.astype(float)).any()}


def table_columns(table: JointTable) -> Columns:
    """`time`, and each joint's `_x`, `_y`, `_z`."""
    found: Columns = {"time": table.times}
    return found | dict(zip(joint_columns(table.names), table.positions.reshape(len(table.times), 3 * len(table.names)).T))


def dof_unit(name: str) -> str:
    """The unit of a degree of freedom."""
    return "m" if name in LENGTHS else "rad"


def write_columns_csv(path: Path, columns: Columns) -> None:
    """Write columns as a table, to the micrometre; empty cells where not a number. Raises `ShadowPuppetError` where that fails."""
    texts = [column.tolist() if column.dtype.kind == "U" else cells(column.tolist()) for column in columns.values()]
    write_whole(path, "".join([csv_line(columns), *map(csv_line, zip(*texts))]))
