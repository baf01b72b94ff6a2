"""Reads and writes Parquet files (Apache): tables of columns; needs the extra `formats` (pyarrow)."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, check_regular, extra_command
from shadowpuppet.io.files.npz import most_unpacked
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import errors_named, write_whole
from shadowpuppet.io.motion.table import Columns, column_joints, joint_columns
from shadowpuppet.motion.motion import JointTable

METADATA = {"made by": "shadowpuppet", "units": "seconds; metres in the world, Z up; radians"}
"""Metadata of every file."""


def write_parquet(path: str | Path, columns: Columns, smoothing: str = "") -> None:
    """Write columns; null for NaN. `smoothing`: how the motion was smoothed, metadata of the file.

    Raises `ShadowPuppetError` if pyarrow is missing or the file cannot be written."""
    write_lists(path, {name: column.tolist() if column.dtype.kind == "U" else column for name, column in columns.items()},
                {"smoothing": smoothing} if smoothing else {})


def write_lists(path: str | Path, columns: Mapping[str, Any], facts: Mapping[str, str] | None = None) -> None:
    """Write columns, each with values of one type or None, and `facts` as metadata. Raises the errors of `write_parquet`."""
    arrow, parquet = _arrow(path)
    arrays = {name: arrow.array(column, from_pandas=True) for name, column in columns.items()}
    out = io.BytesIO()
    parquet.write_table(arrow.table(arrays).replace_schema_metadata(METADATA | dict(facts or {})), out)
    write_whole(Path(path), out.getvalue())


def read_parquet(path: str | Path) -> JointTable:
    """Joints of a table with `time`, `<joint>_x`, `_y`, `_z`, ...; ignores other columns; null if unknown.

    Raises `FormatError` if the file is malformed; `ShadowPuppetError` if pyarrow is missing.
    """
    path = Path(path)
    arrow, parquet = _arrow(path)
    try:
        check_regular(path)
        with path.open("rb") as file:
            source = parquet.ParquetFile(file)
            columns = tuple(source.schema_arrow.names)
            if "time" not in columns:
                raise FormatError(f"{path}: no column 'time'; columns there: {shorten(columns)}")
            names = column_joints(path, columns)
            wanted = ["time", *joint_columns(names)]
            if source.metadata.num_rows * len(wanted) * 8 > most_unpacked(path):
                raise FormatError(f"{path}: found {source.metadata.num_rows} rows of {len(wanted)} columns, expected at most "
                                  f"{most_unpacked(path)} bytes of them in a file of this size")
            table = source.read(wanted)
            values = np.stack([table.column(name).cast(arrow.float64()).to_numpy() for name in wanted], 1)
    except FormatError:
        raise
    except (OSError, arrow.ArrowException, ValueError, KeyError) as error:
        first = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FormatError(f"{path}: no Parquet table of joints ({shorten([first])})") from None
    with errors_named(path):
        return JointTable(values[:, 0], names, values[:, 1:].reshape(len(values), len(names), 3))


def _arrow(path: str | Path) -> tuple[ModuleType, ModuleType]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ShadowPuppetError(f"{path}: Parquet needs pyarrow, which is not installed: {extra_command('formats')}") from None
    return pyarrow, pyarrow.parquet
