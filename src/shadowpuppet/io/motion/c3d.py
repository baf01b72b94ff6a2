"""Reads C3D files (c3d.org): markers over time in blocks of 512 bytes, as integers or floats of three kinds of processors.

The library ezc3d is not used because damaged files crash it.
"""

from __future__ import annotations

import math
import struct
from dataclasses import dataclass
from itertools import takewhile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import FormatError, check_regular, choices, reason, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import errors_named
from shadowpuppet.io.motion.trc import METRES
from shadowpuppet.motion.motion import JointTable

BYTES = 512
"""Size of a block."""
KEY = 0x50
"""The second byte of every file."""
INTEL, DEC, MIPS = 84, 85, 86
"""Kinds of processors in the parameter section."""
BITS = np.iinfo(np.uint16).max
"""Greatest number of frames that the header can state."""
MAX_COORDINATE = 1e6
"""Largest coordinate, metres; larger ones count as unknown."""
CHAR, BYTE, INT, FLOAT = -1, 1, 2, 4
"""Types of parameters, by their bytes."""


@dataclass(frozen=True, eq=False)
class C3d:
    """A file's header and parameters."""

    path: Path
    parameters: dict[str, Any]
    """Parameters by GROUP:NAME, each a list of words or an array of numbers."""
    points: int
    """Number of markers, N."""
    analog: int
    """Number of analog values per frame."""
    frames: int
    """Number of frames that are both stated and present."""
    first: int
    """Number of the first frame; frame 1 is at 0 s."""
    start: int
    """First byte of the data."""
    scale: float
    """Factor of integers; negative for floats."""
    rate: float
    """Frames/s."""
    processor: int

    @property
    def channels(self) -> list[str]:
        """Names of the analog channels; empty if the file has none."""
        return self.words("ANALOG:LABELS")[: int(next(iter(self.numbers("ANALOG:USED")), 0))] or ["unnamed"] if self.analog else []

    def numbers(self, name: str) -> Array:
        """A parameter's numbers (n,); empty if it is missing or text."""
        value = self.parameters.get(name)
        return value.ravel().astype(float) if isinstance(value, np.ndarray) else np.zeros(0)

    def words(self, name: str) -> list[str]:
        """A parameter's words; empty if it is missing or numeric."""
        value = self.parameters.get(name)
        return value if isinstance(value, list) else []

    @property
    def labels(self) -> list[str]:
        """Names of the N points; empty for points without one."""
        more = (self.words(f"POINT:LABELS{n}") for n in ("", *range(2, 200)))
        found = [word for words in more for word in words][: self.points]
        return found + [""] * (self.points - len(found))


def read_c3d(path: str | Path) -> JointTable:
    """Named points of a C3D file in metres, in the file's axes; NaN if not measured. Frame 1 is at 0 s, and cut trials begin later.

    A point is not measured if its residual is negative, or its position is not finite or exactly the origin, as some programs write it.
    Raises `FormatError` if the file is malformed; warns if it breaks off or has no unit.
    """
    path = Path(path)
    header = read_header(path)
    names = header.labels
    first = {name: n for n, name in reversed([*enumerate(names)]) if name and not name.startswith("*")}  # unnamed ones have a star
    if not first:
        raise FormatError(f"{path}: POINT:LABELS: found {shorten(names)!r}, expected names of points")
    chosen = sorted(first.values())
    positions, measured = _points(header, chosen)
    positions *= _metres(header)
    positions[~measured | ~(np.abs(positions) < MAX_COORDINATE).all(2)] = np.nan
    with errors_named(path):
        return JointTable((header.first - 1 + np.arange(len(positions))) / header.rate, tuple(names[n] for n in chosen), positions)


def read_header(path: Path) -> C3d:
    """Read a file's header and parameters. Raises `FormatError`."""
    try:
        check_regular(path)
        size = path.stat().st_size
        with path.open("rb") as file:
            head = file.read(BYTES)
            if len(head) < BYTES or head[1] != KEY or not head[0]:
                raise FormatError(f"{path}: found no C3D header, expected 512 bytes whose second is 0x50")
            file.seek((head[0] - 1) * BYTES)
            section = file.read(256 * BYTES)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({reason(error)})") from None
    if len(section) < 4 or section[3] not in (INTEL, DEC, MIPS):
        raise FormatError(f"{path}: found no parameters in block {head[0]}, expected those of an Intel, DEC or MIPS processor")
    processor = section[3]
    try:
        parameters = _parameters(section[: (section[2] or 256) * BYTES], processor)
    except (struct.error, IndexError, ValueError):
        raise FormatError(f"{path}: the parameters break off or are damaged, expected groups of named values") from None
    return _header(path, size, head, parameters, processor)


def _header(path: Path, size: int, head: bytes, parameters: dict[str, Any], processor: int) -> C3d:
    order = ">" if processor == MIPS else "<"
    points, analog, first, last = struct.unpack(f"{order}4H", head[2:10])
    block = struct.unpack(f"{order}H", head[16:18])[0]
    known = C3d(path, parameters, points, analog, 0, 1, 0, 0.0, 0.0, processor)

    def value_of(name: str, otherwise: float) -> float:
        values = known.numbers(name)
        return float(values[0]) if len(values) else otherwise

    points, block = (int(value_of(name, value)) & 0xFFFF or value for name, value in (("POINT:USED", points), ("POINT:DATA_START", block)))
    scale = value_of("POINT:SCALE", _float(head[12:16], processor))
    rate = value_of("POINT:RATE", _float(head[20:24], processor))
    if not (math.isfinite(scale) and scale != 0) or not 0 < rate < 1e6 or not points or not block:
        raise FormatError(f"{path}: found {points} points at {rate:g} frames/s, scale {scale:g}, data from block {block}, expected some, "
                          "each more than zero (the scale less where they are floats)")
    start, width = (block - 1) * BYTES, (4 * points + analog) * (4 if scale < 0 else 2)
    stated, there = _stated_frames(known, first, last), max(size - start, 0) // width
    if _is_cut(known, stated, last, there, width):
        there = max(_without_padding(path, start, width, there), stated)
        warn(f"{path}: the header's 16 bits state {stated} frames, but the file has {there} by its length; those are used")
        stated = there
    if there < stated:
        warn(f"{path}: found {there} frames, but it tells of {stated}; those are used")
    if not min(stated, there):
        raise FormatError(f"{path}: found no frame of {points} points from byte {start} on, expected a motion")
    begins = _fields(known, "START") or first
    return C3d(path, parameters, points, analog, min(stated, there), max(begins, 1), start, scale, rate, processor)


def _stated_frames(known: C3d, first: int, last: int) -> int:
    """Number of frames, by the most reliable entry: the header's 16 bits are too few for long files."""
    start, end = (_fields(known, end) for end in ("START", "END"))
    if end >= start > 0:
        return end - start + 1
    words, few = (known.numbers(f"POINT:{name}") for name in ("LONG_FRAMES", "FRAMES")), max(last - first + 1, 0)
    long, short = (int(word[0]) if len(word) and 0 < word[0] < 2**31 else 0 for word in words)
    return long or (short if short > BITS else few)  # FRAMES as a float may be right where 16 bits are not


def _is_cut(known: C3d, stated: int, last: int, there: int, width: int) -> bool:
    """Whether the last frame by the header, in 16 bits, is before that of the `there` frames of `width` bytes in the file: it is at its
    limit, or less by 65,536. Parameters that state more count first."""
    if len(known.numbers("POINT:LONG_FRAMES")) or _fields(known, "END") or stated > BITS:
        return False
    return there > stated and (last == BITS or (there - stated > BITS and (there - stated) % (BITS + 1) <= (BYTES - 1) // width))


def _without_padding(path: Path, start: int, width: int, there: int) -> int:
    """The number of frames of `width` bytes from byte `start` on, of `there`, before those of zeros that fill the file's last block."""
    most = (BYTES - 1) // width
    with path.open("rb") as file:
        file.seek(start + (there - most) * width)
        end = file.read(most * width)
    empty = (not any(end[n * width : (n + 1) * width]) for n in reversed(range(most)))
    return there - sum(takewhile(bool, empty))


def _fields(known: C3d, end: str) -> int:
    """The number of the first (START) or last (END) frame by the parameters of the trial; 0 if they do not say."""
    words = known.numbers(f"TRIAL:ACTUAL_{end}_FIELD").astype(np.int64) & 0xFFFF
    return int(words[0]) + 65536 * int(words[1]) if len(words) >= 2 else 0


def _points(header: C3d, chosen: list[int]) -> tuple[Array, NDArray[np.bool_]]:
    """Positions (T, len(chosen), 3) in the file's unit, and whether each was measured."""
    order, floats = ">" if header.processor == MIPS else "<", header.scale < 0
    kind = np.dtype(f"{order}f4" if floats else f"{order}i2")
    frame = np.dtype([("points", kind, (header.points, 4)), ("analog", kind, (header.analog,))])
    try:
        data = np.memmap(header.path, frame, "r", header.start, (header.frames,))["points"][:, chosen]
    except (OSError, ValueError, OverflowError):
        raise FormatError(f"{header.path}: the data cannot be read from byte {header.start} on") from None
    with np.errstate(all="ignore"):  # damaged floats become NaN or infinite
        if floats and header.processor == DEC:
            data = _from_dec(np.ascontiguousarray(data).view("<u4"))
        values = data.astype(float)
    positions, residuals = values[..., :3], values[..., 3]
    measured = ~(residuals < 0) & positions.any(2)
    return positions if floats else positions * header.scale, measured


def _metres(header: C3d) -> float:
    unit = "".join(header.words("POINT:UNITS")[:1]).lower()
    if not unit:
        warn(f"{header.path}: POINT:UNITS: found none, millimetres are taken")
    if (unit or "mm") not in METRES:
        raise FormatError(f"{header.path}: POINT:UNITS: found {shorten([unit])!r}, expected one of {choices(METRES)}")
    return METRES[unit or "mm"]


# Parameters


def _parameters(section: bytes, processor: int) -> dict[str, Any]:
    """Values by GROUP:NAME. Raises `struct.error`, `IndexError` or `ValueError` if the section is damaged."""
    groups, found = dict[int, str](), list[tuple[int, str, Any]]()
    at, order = 4, ">" if processor == MIPS else "<"
    while at + 2 <= len(section):
        length, group = struct.unpack("2b", section[at : at + 2])
        length = abs(length)
        if not length:
            break
        name = section[at + 2 : at + 2 + length].decode("latin-1").strip().upper()
        at += 2 + length
        following = struct.unpack(f"{order}H", section[at : at + 2])[0]
        if group < 0:
            groups[-group] = name
        else:
            found.append((group, name, _value(section, at + 2, processor)))
        if not following:
            break
        at += following
    return {f"{groups.get(group, '')}:{name}": value for group, name, value in found}


def _value(section: bytes, at: int, processor: int) -> Any:
    """The parameter whose type is at byte `at`: words, or numbers (n,)."""
    kind, count = struct.unpack("bB", section[at : at + 2])
    shape = list(section[at + 2 : at + 2 + count])
    if kind not in (CHAR, BYTE, INT, FLOAT) or len(shape) < count:
        raise ValueError(kind)
    start, total = at + 2 + count, math.prod(shape)
    raw = section[start : start + total * abs(kind)]
    if len(raw) < total * abs(kind):
        raise ValueError(total)
    if kind == CHAR:
        width = shape[0] if shape else 1
        return [_text(raw[n : n + width]).strip(" \0\t") for n in range(0, len(raw), width)] if width else []
    if kind == FLOAT and processor == DEC:
        return _from_dec(np.frombuffer(raw, "<u4"))
    order = ">" if processor == MIPS else "<"
    return np.frombuffer(raw, f"{order}{ {BYTE: 'u1', INT: 'i2', FLOAT: 'f4'}[kind]}").astype(float)


def _text(raw: bytes) -> str:
    """Text of newer programs is UTF-8, of others Latin-1."""
    try:
        return raw.decode("utf-8")
    except UnicodeDecodeError:
        return raw.decode("latin-1")


def _float(raw: bytes, processor: int) -> float:
    if processor == DEC:
        return float(_from_dec(np.frombuffer(raw, "<u4"))[0])
    return struct.unpack(">f" if processor == MIPS else "<f", raw)[0]


def _from_dec(words: NDArray[np.uint32]) -> NDArray[np.float32]:
    """Convert floats of a DEC processor: halves of 16 bits are swapped, and the exponent is greater by two."""
    swapped = (words >> 16) | (words << 16)
    with np.errstate(all="ignore"):
        return swapped.astype(np.uint32).view(np.float32) / np.float32(4)
