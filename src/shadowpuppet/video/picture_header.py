"""Reads how large a picture is from its header, before it is decoded: every kind of picture that is read, and no other.

Own code, as libraries that give the size leave out what memory depends on (tiles and depth of TIFF), or decode.
"""

from __future__ import annotations

import struct
from collections.abc import Callable
from typing import NamedTuple

COLOUR_BITS = 24
"""Bits a pixel of the pictures that are given; deeper ones of TIFF take more memory while they are decoded."""
TIFF_NUMBERS = {1: "B", 3: "H", 4: "I", 16: "Q"}
"""Types of whole numbers in TIFF, by their number there, as `struct` has them."""
WIDTH, HEIGHT, DEPTH, SAMPLES, TILE_WIDTH, TILE_HEIGHT = 256, 257, 258, 277, 322, 323
"""Tags of TIFF."""
NO_SIZE = (0x01, *range(0xD0, 0xD8))
"""Markers of JPEG without content."""
FRAMES = (0xC0, 0xC1, 0xC2, 0xC3, 0xC5, 0xC6, 0xC7, 0xC9, 0xCA, 0xCB, 0xCD, 0xCE, 0xCF)
"""Markers of JPEG before the size of the picture."""
SCAN, END = 0xDA, 0xD9
"""Markers of JPEG before the pixels, and at the end."""


class Header(NamedTuple):
    """Facts in a picture's header."""

    width: int
    height: int
    """Pixels, before the picture is turned as its EXIF data say."""
    most: int
    """Pixels of 24 bits for which its decoder needs memory: those of the picture, or more."""


def read_header(data: bytes) -> Header | None:
    """The header of a picture (.bmp, .jpg, .png, .tif, .webp); None if there is none that can be read."""
    try:
        for mark, read in READERS.items():
            if data.startswith(mark):
                header = read(data)
                return header if header is not None and min(header[:2]) > 0 else None
    except (struct.error, IndexError, ValueError, KeyError):
        pass
    return None


def _same(width: int, height: int) -> Header:
    return Header(width, height, width * height)


def _png(data: bytes) -> Header | None:
    return _same(*struct.unpack_from(">II", data, 16)) if data[12:16] == b"IHDR" else None


def _bmp(data: bytes) -> Header:
    size = struct.unpack_from("<I", data, 14)[0]
    width, height = struct.unpack_from("<HH" if size == 12 else "<ii", data, 18)
    return _same(width, abs(height))  # less than 0: rows from the top


def _jpeg(data: bytes) -> Header | None:
    """Goes from marker to marker, over anything between them, as its decoder does."""
    at = 2
    while True:
        at = data.index(0xFF, at)
        while data[at] == 0xFF:
            at += 1
        kind, at = data[at], at + 1
        if kind in FRAMES:
            height, width = struct.unpack_from(">HH", data, at + 3)
            return _same(width, height)
        if kind in (SCAN, END):
            return None
        if kind and kind not in NO_SIZE:
            at += max(struct.unpack_from(">H", data, at)[0], 2)


def _webp(data: bytes) -> Header | None:
    if data[8:12] != b"WEBP":
        return None
    kind = data[12:16]
    if kind == b"VP8 ":
        return _same(*(side & 0x3FFF for side in struct.unpack_from("<HH", data, 26)))
    if kind == b"VP8L":
        bits = struct.unpack_from("<I", data, 21)[0]
        return _same((bits & 0x3FFF) + 1, (bits >> 14 & 0x3FFF) + 1)
    if kind == b"VP8X":
        return _same(*(int.from_bytes(data[at : at + 3], "little") + 1 for at in (24, 27)))
    return None


def _tiff(data: bytes) -> Header | None:
    """The first picture's; of tags that are there twice, the greater."""
    order = "<" if data.startswith(b"I") else ">"
    big = struct.unpack_from(f"{order}H", data, 2)[0] == 43
    at = struct.unpack_from(f"{order}Q" if big else f"{order}I", data, 8 if big else 4)[0]
    number = struct.unpack_from(f"{order}Q" if big else f"{order}H", data, at)[0]
    at, step, inside = at + (8 if big else 2), 20 if big else 12, 8 if big else 4
    found = dict[int, int]()
    for _ in range(min(number, len(data) // step)):
        tag, kind = struct.unpack_from(f"{order}HH", data, at)
        if tag in (WIDTH, HEIGHT, DEPTH, SAMPLES, TILE_WIDTH, TILE_HEIGHT):
            count = struct.unpack_from(f"{order}Q" if big else f"{order}I", data, at + 4)[0]
            form = f"{order}{TIFF_NUMBERS[kind]}"
            place = at + 4 + inside
            if count * struct.calcsize(form) > inside:  # depths of several colours are elsewhere
                place = struct.unpack_from(f"{order}Q" if big else f"{order}I", data, place)[0]
            found[tag] = max(found.get(tag, 0), struct.unpack_from(form, data, place)[0])
        at += step
    width, height = found[WIDTH], found[HEIGHT]
    pixels = max(width * height, found.get(TILE_WIDTH, 0) * found.get(TILE_HEIGHT, 0))
    return Header(width, height, pixels * max(found.get(DEPTH, 1) * found.get(SAMPLES, 1), COLOUR_BITS) // COLOUR_BITS)


READERS: dict[bytes, Callable[[bytes], Header | None]] = {
    b"\x89PNG\r\n\x1a\n": _png, b"BM": _bmp, b"\xff\xd8": _jpeg, b"RIFF": _webp,
    b"II*\0": _tiff, b"MM\0*": _tiff, b"II+\0": _tiff, b"MM\0+": _tiff,
}  # fmt: skip
"""By the first bytes."""
