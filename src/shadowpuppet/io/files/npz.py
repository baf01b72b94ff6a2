"""Reads and writes archives of arrays (.npz) without pickled objects, so that nothing in them is executed."""

from __future__ import annotations

import io
import lzma
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError, reason

BROKEN = (EOFError, ValueError, TypeError, KeyError, AttributeError, OverflowError, MemoryError, RuntimeError, SyntaxError,
          tokenize.TokenError, struct.error, zlib.error, lzma.LZMAError, zipfile.BadZipFile)  # fmt: skip
"""Exceptions, other than `OSError`, that NumPy raises for a file that is damaged, encrypted or no archive."""


class BrokenArchive(ShadowPuppetError):
    """A file is not a complete archive of arrays."""


def read_arrays(path: Path, names: Sequence[str]) -> dict[str, NDArray]:
    """The arrays of an archive that are in `names`. Raises `ShadowPuppetError` with only the reason, `BrokenArchive` for a damaged file."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            return {name: np.asarray(data[name]) for name in names if name in data}
    except OSError as error:
        raise ShadowPuppetError(reason(error)) from None
    except BROKEN as error:
        raise BrokenArchive(str(error)) from None


def read_all_arrays(path: Path, names: Sequence[str]) -> dict[str, NDArray]:
    """The arrays `names` of an archive. Raises the errors of `read_arrays`, and `ShadowPuppetError` if an array is missing."""
    arrays = read_arrays(path, names)
    missing = [name for name in names if name not in arrays]
    if missing:
        raise ShadowPuppetError(f"no array {missing[0]!r}")
    return arrays


def archive_bytes(**arrays: ArrayLike) -> bytes:
    """The bytes of an archive of arrays."""
    out = io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, **{name: np.asarray(values) for name, values in arrays.items()})
    return out.getvalue()
