"""Reads and writes archives of arrays (.npz) without pickled objects, so that nothing in them is executed."""

from __future__ import annotations

import io
import lzma
import math
import struct
import sys
import tokenize
import warnings
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import FILE_MEMORY, ShadowPuppetError, check_regular, one_line, reason

BROKEN = (EOFError, ValueError, TypeError, KeyError, AttributeError, OverflowError, MemoryError, RuntimeError, SyntaxError,
          tokenize.TokenError, struct.error, zlib.error, lzma.LZMAError, zipfile.BadZipFile)  # fmt: skip
"""Exceptions, other than `OSError`, that NumPy raises for a file that is damaged, encrypted or no archive."""
UNPACKED, RATIO = FILE_MEMORY // 4, 10
"""Greatest size of the arrays of a packed file: bytes (reading holds up to four copies), or over its own size if that is more. No long
motion can be packed more tightly."""
HEADERS = {(1, 0): np.lib.format.read_array_header_1_0, (2, 0): np.lib.format.read_array_header_2_0}


class BrokenArchive(ShadowPuppetError):
    """A file is not a complete archive of arrays."""


def read_arrays(path: Path, names: Sequence[str] | None = None) -> dict[str, NDArray]:
    """The arrays of an archive, or those of them that are in `names`; sizes are checked before anything is unpacked. Raises
    `ShadowPuppetError` with only the reason, `BrokenArchive` for a damaged file."""
    found = dict[str, NDArray]()
    try:
        check_regular(path)
        with warnings.catch_warnings(), zipfile.ZipFile(path) as archive:
            warnings.simplefilter("ignore")  # of NumPy, on headers that it can still read
            wanted = {info.filename.removesuffix(".npy"): info for info in archive.infolist()}
            wanted = {name: info for name, info in wanted.items() if names is None or name in names}
            most, size = most_unpacked(path), sum(info.file_size for info in wanted.values())
            if size > most:
                raise BrokenArchive(f"found {size} bytes when unpacked, expected at most {most}")
            for name, info in wanted.items():
                found[name] = _array(archive.read(info))
    except OSError as error:
        raise ShadowPuppetError(reason(error)) from None
    except BROKEN as error:
        raise BrokenArchive(one_line(error)) from None
    return found


def most_unpacked(path: Path) -> int:
    """Greatest size of what is packed in a file, bytes."""
    return max(UNPACKED, RATIO * path.stat().st_size)


def check_numbers(path: Path, count: int) -> None:
    """Raise `BrokenArchive`, with only the reason, for more numbers than a packed file may hold, 8 bytes each."""
    most = most_unpacked(path) // 8
    if count > most:
        raise BrokenArchive(f"found {count} numbers, expected at most {most} in a file of this size")


def _array(member: bytes) -> NDArray:
    """The array of a member (.npy). Raises one of `BROKEN`."""
    file = io.BytesIO(member)
    version = np.lib.format.read_magic(file)
    if version not in HEADERS:
        raise ValueError(f"found version {version} of .npy")
    shape, by_columns, dtype = HEADERS[version](file)
    values, expected = memoryview(member)[file.tell() :], math.prod(shape) * dtype.itemsize
    if dtype.hasobject:
        raise ValueError("found Python objects in an array, which are never read")
    if min(shape, default=0) < 0 or len(values) != expected:
        raise ValueError(f"found {len(values)} bytes of an array {shape} of {dtype}, expected {expected}")
    if dtype.kind == "U" and len(values) and np.frombuffer(values, dtype.str[0] + "u4").max() > sys.maxunicode:
        raise ValueError("found a text with impossible characters")
    return np.frombuffer(values, dtype, math.prod(shape)).reshape(shape, order="F" if by_columns else "C").copy("K")


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
