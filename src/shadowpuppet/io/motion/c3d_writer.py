"""Writes C3D files (read by `c3d.py`): points as floats with residuals, and angles as analog channels."""

from __future__ import annotations

import struct
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError, warn
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.table import shorten
from shadowpuppet.io.files.text import write_whole
from shadowpuppet.io.motion.c3d import BYTES, CHAR, FLOAT, INT, INTEL, KEY
from shadowpuppet.motion.contact.contact import FootEvent
from shadowpuppet.motion.interpolation import resample, uniform_sampling
from shadowpuppet.motion.motion import JointTable

MAX_BYTE, MAX_LETTERS = np.iinfo(np.uint8).max, 120
"""The format's limits: of what it keeps in a byte (blocks of parameters, names in a list, residuals in mm), and letters of a name."""
MAX_FRAME = 2**31
"""Greatest number of a frame."""
EVENTS = {True: "Foot Strike", False: "Foot Off"}
"""Events of a foot, in the words of Vicon's programs."""
Parameter = tuple[str, int, Sequence[int], bytes]
"""Name, kind, shape and value."""
Angles = Mapping[str, tuple[str, Array]]
"""Units and values (T,) by name."""


def write_c3d(path: str | Path, table: JointTable, spread: Array | None = None, angles: Angles | None = None,
              smoothing: str = "", events: Sequence[FootEvent] = ()) -> None:
    """Write joints as points in millimetres, without changing axes, and `angles` as analog channels, one value per frame.

    The file has a constant rate: missing frames become unknown; frames at a varying rate are resampled, with a warning. The first time is
    kept as the number of the first frame, to the nearest one from 0 s. Raises `ShadowPuppetError` if there is no frame, a name is too long,
    or the file cannot be written.

    Args:
        path: the file.
        table: the joints; an unknown one gets the residual -1.
        spread: standard deviations (T, J), metres, written as residuals in whole millimetres; 0 for None or NaN.
        angles: unit and values (T,) of each angle; NaN if unknown.
        smoothing: how the motion was smoothed, written as PROCESSING:SMOOTHING; empty if unknown.
        events: strikes and offs of the feet, written as the group EVENT, as Vicon's programs do; at most 255.
    """
    path, angles = Path(path), angles or {}
    bad = [name for name in (*table.names, *angles) if not 0 < len(name.encode()) <= MAX_LETTERS]
    if bad or not table.names:
        raise ShadowPuppetError(f"{path}: found the name {shorten(bad, 60)!r}, expected points with names of at most {MAX_LETTERS} letters")
    deviations = np.full(table.positions.shape[:2], np.nan) if spread is None else spread
    count, points = len(table.times), len(table.names)
    columns = [table.positions.reshape(count, 3 * points), deviations, *(values[:, None] for _, values in angles.values())]
    rate, columns = _at_constant_rate(path, table.times, np.concatenate(columns, 1))
    count, first = len(columns), 1 + max(round(float(table.times[0]) * rate), 0)
    if first + count > MAX_FRAME:
        raise ShadowPuppetError(f"{path}: found {count} frames from {table.times[0]:g} s on, expected at most {MAX_FRAME} from 0 s on")
    places, deviations, analog = np.split(columns, [3 * points, 4 * points], 1)
    data = np.concatenate([_points(places.reshape(count, points, 3), deviations).reshape(count, -1), analog], 1).astype("<f4")
    blocks, section = 0, b""
    while True:  # the parameters state where the data begins, which depends on their length
        section = _section(_groups(table.names, angles, rate, (first, count), 2 + blocks, smoothing)
                           | _events(events), blocks)
        if len(section) <= blocks * BYTES:
            break
        blocks = -(-len(section) // BYTES)
    if blocks > MAX_BYTE:
        raise ShadowPuppetError(f"{path}: found {points} points, whose names need more than this format holds ({MAX_BYTE} blocks)")
    head = _header(points, len(angles), (first, count), 2 + blocks, rate)
    write_whole(path, head + section.ljust(blocks * BYTES, b"\0") + data.tobytes() + b"\0" * (-data.nbytes % BYTES))


def _at_constant_rate(path: Path, times: Array, values: Array) -> tuple[float, Array]:
    """Frames/s of a constant rate, and values (T, C) at it, (K, C)."""
    try:
        grid = uniform_sampling(times)
    except ShadowPuppetError as error:
        raise ShadowPuppetError(f"{path}: {error}") from None
    if grid.frames is not None:
        return grid.rate, np.where((grid.frames >= 0)[:, None], values[np.maximum(grid.frames, 0)], np.nan)
    warn(f"{path}: the frames do not come at a constant rate, which this format needs; they were resampled at {grid.rate:g} frames/s")
    return grid.rate, resample(times, values, grid.rate)[1]


def _points(places: Array, deviations: Array) -> Array:
    """Positions (T, J, 3) with their residuals, (T, J, 4), millimetres; -1 for unknown positions."""
    known: NDArray[np.bool_] = np.asarray(np.isfinite(places).all(2))
    residuals = np.where(np.isfinite(deviations), np.round(np.minimum(1000 * np.nan_to_num(deviations), MAX_BYTE)), 0.0)
    return np.concatenate([np.where(known[..., None], 1000 * places, 0.0), np.where(known, residuals, -1.0)[..., None]], 2)


def _header(points: int, analog: int, frames: tuple[int, int], start: int, rate: float) -> bytes:
    """The first block, for the number of the first frame and the count of `frames`; its 16 bits are too few for large numbers."""
    first, count = frames
    ends = (first, first + count - 1) if first + count - 1 <= 0xFFFF else (1, min(count, 0xFFFF))
    head = struct.pack("<2B5HfHHf", 2, KEY, points, analog, *ends, 0, -1.0, start, 1 if analog else 0, rate)
    return head.ljust(BYTES, b"\0")


def _groups(names: Sequence[str], angles: Angles, rate: float, frames: tuple[int, int], start: int,
            smoothing: str) -> dict[str, list[Parameter]]:
    first, count = frames
    ends = [struct.pack("<2H", number & 0xFFFF, number >> 16) for number in (first, first + count - 1)]
    point = [_whole("USED", len(names)), _whole("FRAMES", min(count, 0xFFFF)), _whole("DATA_START", start), _real("SCALE", -1.0),
             _real("RATE", rate), _real("LONG_FRAMES", count), *_words("LABELS", names), *_words("DESCRIPTIONS", [" "] * len(names)),
             _word("UNITS", "mm"), _word("X_SCREEN", "+X"), _word("Y_SCREEN", "+Z")]  # fmt: skip
    used = len(angles)
    analog = [_whole("USED", used)]
    if used:  # else no rate: readers refuse or divide by one without channels
        analog += [_real("RATE", rate), _real("GEN_SCALE", 1.0), _word("FORMAT", "SIGNED"), _whole("BITS", 16)]
        units = [unit for unit, _ in angles.values()]
        analog += [*_words("LABELS", tuple(angles)), *_words("DESCRIPTIONS", [" "] * used), *_words("UNITS", units),
                   ("SCALE", FLOAT, (used,), np.ones(used, "<f4").tobytes()), ("OFFSET", INT, (used,), np.zeros(used, "<i2").tobytes())]
    trial = [("ACTUAL_START_FIELD", INT, (2,), ends[0]), ("ACTUAL_END_FIELD", INT, (2,), ends[1]),
             _real("CAMERA_RATE", rate)]
    done = {"PROCESSING": [_word("SMOOTHING", smoothing)]} if smoothing else {}
    return {"POINT": point, "ANALOG": analog, "TRIAL": trial, "MANUFACTURER": [_word("SOFTWARE", "shadowpuppet")], **done}


def _events(events: Sequence[FootEvent]) -> dict[str, list[Parameter]]:
    """The group EVENT: of each its time in minutes and seconds, the side, and what happens."""
    events = events[:MAX_BYTE]
    if not events:
        return {}
    times = np.array([divmod(event.time, 60) for event in events], "<f4")
    sides = [event.side.capitalize() for event in events]
    return {"EVENT": [_whole("USED", len(events)), *_words("CONTEXTS", sides), *_words("LABELS", [EVENTS[e.strike] for e in events]),
                      ("TIMES", FLOAT, (2, len(events)), times.tobytes())]}  # fmt: skip


def _whole(name: str, value: int) -> Parameter:
    return name, INT, (), struct.pack("<H", value)


def _real(name: str, value: float) -> Parameter:
    return name, FLOAT, (), struct.pack("<f", value)


def _word(name: str, word: str) -> Parameter:
    return name, CHAR, (len(word),), word.encode()


def _words(name: str, words: Sequence[str]) -> list[Parameter]:
    """A list of words, continued in NAME2, NAME3, ... if it is too long."""
    parts = [[word.encode() for word in words[n : n + MAX_BYTE]] for n in range(0, len(words), MAX_BYTE)]
    widths = [max(map(len, part)) for part in parts]
    return [(f"{name}{n if n > 1 else ''}", CHAR, (width, len(part)), b"".join(word.ljust(width) for word in part))
            for n, (part, width) in enumerate(zip(parts, widths), 1)]  # fmt: skip


def _section(groups: Mapping[str, Sequence[Parameter]], blocks: int) -> bytes:
    """The section of parameters, without padding."""
    records = list[bytes]()
    for n, (group, parameters) in enumerate(groups.items(), 1):
        records.append(_record(group, -n, b"\0"))
        for name, kind, shape, value in parameters:
            records.append(_record(name, n, struct.pack("<bB", kind, len(shape)) + bytes(shape) + value + b"\0"))
    return bytes([1, KEY, blocks & 0xFF, INTEL]) + b"".join(records) + b"\0\0"


def _record(name: str, group: int, content: bytes) -> bytes:
    """A group or parameter, with the offset of the next from that number."""
    return struct.pack("<2b", len(name), group) + name.encode() + struct.pack("<H", 2 + len(content)) + content


