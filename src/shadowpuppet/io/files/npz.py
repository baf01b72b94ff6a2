"""Joints as an archive of arrays (NPZ), with the names that a run's motion.npz has, which is read as well."""

from __future__ import annotations

import io
import lzma
import struct
import zipfile
import zlib
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.motion.motion import JointTable

ARRAYS = ("times", "joint_names", "joints")
"""Seconds (T,), names (J,), and places (T, J, 3) in the world, metres, not a number where unknown."""

BROKEN = (EOFError, ValueError, TypeError, KeyError, OverflowError, MemoryError, RuntimeError, SyntaxError, struct.error, zlib.error,
          lzma.LZMAError, zipfile.BadZipFile)  # fmt: skip
"""What reading raises, beside `OSError`, where an archive is damaged, encrypted or none."""


def write_npz(path: str | Path, table: JointTable) -> None:
    """Write joints as arrays. Raises `ShadowPuppetError` where that fails."""
    out = io.BytesIO()
    np.savez_compressed(out, allow_pickle=False, times=table.times, joint_names=np.array(table.names), joints=table.positions)
    write_whole(Path(path), out.getvalue())


def read_npz(path: str | Path) -> JointTable:
    """Joints of an archive that has `ARRAYS`; others are skipped. Raises `FormatError`."""
    path = Path(path)
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as data:
            missing = [name for name in ARRAYS if name not in data]
            if missing:
                raise ShadowPuppetError(f"no array {missing[0]!r}")
            times, names, joints = (data[name] for name in ARRAYS)
        return JointTable(times, tuple(names.astype(str).ravel().tolist()), joints)
    except OSError as error:
        problem = error.strerror or str(error)
    except (*BROKEN, AttributeError, ShadowPuppetError) as error:
        problem = str(error)
    raise FormatError(f"{path}: no joints ({problem.lower()}), expected an archive with the arrays {', '.join(ARRAYS)}")
