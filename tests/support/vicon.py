"""C3D files written byte by byte, for any processor, with the contents of a motion capture system."""

from __future__ import annotations

import struct

import numpy as np

INTEL, DEC, MIPS = 84, 85, 86


def c3d(labels, places, *, rate: float = 120.0, unit: str | None = "mm", processor: int = INTEL, scale: float = -1.0, residuals=None,
        analog: int = 0, first: int = 1, parameters=(), trial: bool = False) -> bytes:
    """A file's bytes. `places` (T, N, 3) in the file's unit, NaN for invisible points; `scale`: positive for integers;
    `residuals` (T, N); `analog`: values a frame; `trial`: frame numbers in 32 bits."""
    places = np.asarray(places, float)
    T, N = places.shape[:2]
    order = ">" if processor == MIPS else "<"
    gaps = ~np.isfinite(places).all(2)
    residuals = np.where(gaps, -1.0, 0.0) if residuals is None else np.asarray(residuals, float)
    groups = {"POINT": [("USED", [N]), ("SCALE", scale), ("RATE", rate), ("DATA_START", None), ("FRAMES", [min(T, 65535)]),
                        ("LABELS", list(labels))]}
    groups["POINT"] += [("UNITS", [unit])] if unit is not None else []
    if trial:
        last = first + T - 1
        groups["TRIAL"] = [("ACTUAL_START_FIELD", [first & 0xFFFF, first >> 16]), ("ACTUAL_END_FIELD", [last & 0xFFFF, last >> 16])]
    for group, name, value in parameters:
        groups.setdefault(group, []).append((name, value))
    section = _section(groups, processor, 2)
    blocks = -(-len(section) // 512)
    section = _section(groups, processor, 2 + blocks).ljust(512 * blocks, b"\0")
    head = bytes([2, 0x50]) + struct.pack(f"{order}5H", N, analog, first, min(first + T - 1, 65535), 0) + real(scale, processor)
    head += struct.pack(f"{order}2H", 2 + blocks, 1) + real(rate, processor)
    frames = np.zeros((T, 4 * N + analog))
    factor = 1.0 if scale < 0 else scale
    frames[:, : 4 * N] = np.concatenate([np.where(gaps[..., None], 0, places) / factor, residuals[..., None]], 2).reshape(T, 4 * N)
    frames[:, 4 * N :] = 7
    if scale > 0:
        data = np.round(frames).astype(f"{order}i2").tobytes()
    elif processor == DEC:
        data = to_dec(frames.astype("<f4"))
    else:
        data = frames.astype(f"{order}f4").tobytes()
    return head.ljust(512, b"\0") + section + data


def to_dec(values: np.ndarray) -> bytes:
    """Little-endian floats in DEC format."""
    words = (np.asarray(values, "<f4") * np.float32(4)).view("<u4")
    return ((words >> 16) | (words << 16)).astype("<u4").tobytes()


def real(value: float, processor: int) -> bytes:
    if processor == DEC:
        return to_dec(np.array([value], "<f4"))
    return struct.pack(">f" if processor == MIPS else "<f", value)


def _section(groups, processor: int, start: int) -> bytes:
    order, out = ">" if processor == MIPS else "<", b""
    for number, (group, members) in enumerate(groups.items(), 1):
        name = group.encode()
        out += struct.pack("2b", len(name), -number) + name + struct.pack(f"{order}H", 2 + 1 + 3) + b"\3abc"
        for key, value in members:
            name = key.encode()
            body = _value([start + 0] if value is None else value, processor) + b"\0"
            out += struct.pack("2b", -len(name), number) + name + struct.pack(f"{order}H", 2 + len(body)) + body
    count = -(-(len(out) + 6) // 512)
    return bytes([1, 0x50, count, processor]) + out + b"\0\0"


def _value(value, processor: int) -> bytes:
    order = ">" if processor == MIPS else "<"
    if isinstance(value, float):
        return struct.pack("bB", 4, 0) + real(value, processor)
    if value and isinstance(value[0], str):
        width = max(map(len, value))
        text = "".join(word.ljust(width) for word in value).encode("latin-1")
        return struct.pack("bB2B", -1, 2, width, len(value)) + text
    return struct.pack("bBB", 2, 1, len(value)) + struct.pack(f"{order}{len(value)}H", *value)
