"""Reads and writes Parquet files (Apache): tables of columns; needs the extra `formats` (pyarrow)."""

from __future__ import annotations

import io
from collections.abc import Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

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
            source = parquet.ParquetFile(file, pre_buffer=False)
            columns = tuple(source.schema_arrow.names)
            if "time" not in columns:
                raise FormatError(f"{path}: no column 'time'; columns there: {shorten(columns)}")
            names = column_joints(path, columns)
            _check(source, path, ["time", *joint_columns(names)])
            times = _numbers(source, "time", arrow)
            positions = np.empty((len(times), 3 * len(names)))
            for n, name in enumerate(joint_columns(names)):  # one after another, so that memory holds few copies
                positions[:, n] = _numbers(source, name, arrow)
    except FormatError:
        raise
    except (OSError, arrow.ArrowException, ValueError, KeyError) as error:
        first = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise FormatError(f"{path}: no Parquet table of joints ({shorten([first])})") from None
    with errors_named(path):
        return JointTable(times, names, positions.reshape(len(times), len(names), 3))


def _check(source: Any, path: Path, names: list[str]) -> None:
    """Raise `FormatError` if columns are no numbers, or, by what the file states of them, take too much memory."""
    import pyarrow.types as types

    for name in names:
        kind = source.schema_arrow.field(name).type
        if not any(is_kind(kind) for is_kind in (types.is_integer, types.is_floating, types.is_decimal, types.is_boolean, types.is_null)):
            raise FormatError(f"{path}: no Parquet table of joints (column {name!r}: found {str(kind)[:99]}, expected numbers)")
    groups = [source.metadata.row_group(n) for n in range(source.metadata.num_row_groups)]
    chunks = [group.column(n) for group in groups for n in range(group.num_columns) if group.column(n).path_in_schema in names]
    rows = max(source.metadata.num_rows, sum(group.num_rows for group in groups))
    size = max(8 * max(rows * len(names), sum(each.num_values for each in chunks)), sum(each.total_uncompressed_size for each in chunks))
    if size > most_unpacked(path):
        raise FormatError(f"{path}: found {rows} rows of {len(names)} columns, {size} bytes, expected at most {most_unpacked(path)} "
                          "bytes of them in a file of this size")


def _numbers(source: Any, name: str, arrow: ModuleType) -> NDArray[np.float64]:
    """A column (T,), NaN for null."""
    return source.read([name], use_threads=False).column(name).cast(arrow.float64()).to_numpy()


def _arrow(path: str | Path) -> tuple[ModuleType, ModuleType]:
    try:
        import pyarrow
        import pyarrow.parquet
    except ImportError:
        raise ShadowPuppetError(f"{path}: Parquet needs pyarrow, which is not installed: {extra_command('formats')}") from None
    return pyarrow, pyarrow.parquet
