"""Content of a motion file, for `info`."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shadowpuppet.errors import FormatError
from shadowpuppet.io.motion import READABLE
from shadowpuppet.io.motion.c3d import read_header
from shadowpuppet.io.motion.joint_names import columns_of, pairs_of, renamed
from shadowpuppet.io.motion.motion_files import leg_length, read_motion
from shadowpuppet.motion.interpolation import rate_of
from shadowpuppet.motion.motion import JointTable


@dataclass(frozen=True, eq=False)
class MotionLook:
    """A motion file in figures and words."""

    path: str
    format: str
    frames: int
    rate: float | None
    """Frames/s, the median; None for a single frame."""
    start: float
    """Time of the first frame, seconds."""
    end: float
    """Time of the last frame, seconds."""
    known: Mapping[str, str]
    """The file's names of our joints, by ours."""
    others: tuple[str, ...]
    """Joints and points of other names."""
    unknown: float
    """Share of positions that are not known."""
    leg: float | None
    """Length of a leg in the file, metres; None if unknown, or in an unknown unit."""
    channels: tuple[str, ...]
    """Names of analog channels, which are not read."""
    notes: tuple[str, ...]
    """Assumptions about unit, axes and frames, a sentence each."""


@np.errstate(all="ignore")  # impossible numbers, as in `read_motion`
def look_at_motion(path: str | Path) -> MotionLook:
    """What a motion file holds; a BVH file of unknown names is read in its own unit. Raises `FormatError` if it is malformed."""
    path = Path(path)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        table, problem = _read(path)
    if not len(table.times):
        raise FormatError(f"{path}: found no frame, expected a motion")
    notes = [str(warning.message).removeprefix(f"{path}: ") for warning in said]
    names = table.names
    known = {ours: names[n] for ours, n in columns_of(names).items()}
    known |= {ours: " and ".join(names[n] for n in pair) for ours, pair in pairs_of(names).items()}
    used = {*(names[n] for n in columns_of(names).values()), *(names[n] for pair in pairs_of(names).values() for n in pair)}
    length = leg_length(renamed(table)) if known and not problem else np.nan
    return MotionLook(
        str(path), READABLE[path.suffix.lower()], len(table.times),
        rate_of(table.times) if len(table.times) > 1 else None, float(table.times[0]), float(table.times[-1]),
        known, tuple(name for name in names if name not in used), float((~np.isfinite(table.positions).all(2)).mean()),
        float(length) if np.isfinite(length) else None,
        tuple(read_header(path).channels) if path.suffix.lower() == ".c3d" else (), (*problem, *notes),
    )  # fmt: skip


def _read(path: Path) -> tuple[JointTable, list[str]]:
    """All joints of a file under its own names, and why its unit is not known, if so."""
    try:
        return read_motion(path, own_names=True), []
    except FormatError as error:
        if path.suffix.lower() != ".bvh":
            raise
        return read_motion(path, own_names=True, unit=1.0), [str(error).removeprefix(f"{path}: ")]
