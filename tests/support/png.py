"""Pictures of any size in few bytes, and pictures with a palette."""

from __future__ import annotations

import struct
import zlib

import numpy as np

BEGIN = b"\x89PNG\r\n\x1a\n"


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def png(width, height, mark=b"IHDR"):
    """A black picture of one bit a pixel, in few bytes."""
    row, packer = bytes(1 + (width + 7) // 8), zlib.compressobj()
    rows = b"".join(packer.compress(row) for _ in range(height)) + packer.flush()
    head = chunk(mark, struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0))
    return BEGIN + head + chunk(b"IDAT", rows) + chunk(b"IEND", b"")


def palette_png(places: np.ndarray, palette: tuple[int, ...], opacity: tuple[int, ...] = ()) -> bytes:
    """A picture of places (H, W) in a palette of red, green and blue; `opacity` of its first places."""
    rows = b"".join(b"\0" + row.tobytes() for row in places.astype(np.uint8))
    head = struct.pack(">IIBBBBB", *places.shape[::-1], 8, 3, 0, 0, 0)
    return (BEGIN + chunk(b"IHDR", head) + chunk(b"PLTE", bytes(palette)) + (chunk(b"tRNS", bytes(opacity)) if opacity else b"")
            + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))  # fmt: skip
