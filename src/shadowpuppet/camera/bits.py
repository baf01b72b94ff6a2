"""Masks packed as bits `[word_column][row]`, 64 pixels of a row in a 64-bit word, so that inner loops run over rows and vectorise."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.jit import device, kernel

Bits = NDArray[np.uint64]


def pack(mask: ArrayLike) -> Bits:
    """Bits (ceil(W / 64), H) of a mask (H, W)."""
    mask = np.asarray(mask, bool)
    height, width = mask.shape
    padded = np.zeros((height, -(-width // 64) * 64), bool)
    padded[:, :width] = mask
    words = np.packbits(padded, axis=1, bitorder="little").view("<u8")
    return np.ascontiguousarray(words.T, np.uint64)


def unpack(bits: Bits, width: int) -> NDArray[np.bool_]:
    """The mask (H, W) of bits (C, H)."""
    rows = np.ascontiguousarray(bits.T).astype("<u8").view(np.uint8)
    return np.unpackbits(rows, axis=1, bitorder="little")[:, :width].astype(bool)


def count(bits: Bits) -> int:
    """Number of set pixels."""
    return int(np.bitwise_count(bits).sum())


def grown_bits(bits: Bits, by: int, width: int) -> Bits:
    """Bits (C, H) of a mask `width` pixels wide, grown by a number of pixels to all sides, corners included."""
    out = bits.copy()
    _grow(out, by, width, np.empty_like(bits))
    return out


@device
def is_set(bits, x, y):  # pragma: no cover
    """Whether pixel (x, y), which must be in the picture, is set."""
    return (bits[x >> 6, y] >> np.uint64(x & 63)) & np.uint64(1) != 0


@kernel
def _grow(bits, by, width, room):  # pragma: no cover
    """Grow bits (C, H) in place; `room`: (C, H). To each side alone: what leaves the picture does not come back. What is grown by n, moved
    by at most n + 1 and laid over itself, is grown by both."""
    words, height = bits.shape
    for sideways in (True, False):
        for c in range(words):
            for r in range(height):
                room[c, r] = bits[c, r]
        reach = 0
        while reach < by:
            step = min(reach + 1, by - reach)
            if sideways:
                _lay_right(bits, step)
                _lay_left(room, step)
            else:
                _lay_below(bits, step)
                _lay_above(room, step)
            reach += step
        for c in range(words):
            for r in range(height):
                bits[c, r] |= room[c, r]
    if width & 63:
        inside = (np.uint64(1) << np.uint64(width & 63)) - np.uint64(1)
        for r in range(height):
            bits[words - 1, r] &= inside


@device
def _lay_right(bits, step):  # pragma: no cover
    """Lay bits (C, H), moved to the right by some pixels, over themselves."""
    q, low, high = step >> 6, np.uint64(step & 63), np.uint64(64 - (step & 63))
    for c in range(bits.shape[0] - 1, q - 1, -1):
        for r in range(bits.shape[1]):
            bits[c, r] |= bits[c - q, r] << low
        if low and c > q:
            for r in range(bits.shape[1]):
                bits[c, r] |= bits[c - q - 1, r] >> high


@device
def _lay_left(bits, step):  # pragma: no cover
    """The same to the left."""
    q, low, high = step >> 6, np.uint64(step & 63), np.uint64(64 - (step & 63))
    for c in range(bits.shape[0] - q):
        for r in range(bits.shape[1]):
            bits[c, r] |= bits[c + q, r] >> low
        if low and c + q + 1 < bits.shape[0]:
            for r in range(bits.shape[1]):
                bits[c, r] |= bits[c + q + 1, r] << high


@device
def _lay_below(bits, step):  # pragma: no cover
    """The same down."""
    for c in range(bits.shape[0]):
        for r in range(bits.shape[1] - 1, step - 1, -1):
            bits[c, r] |= bits[c, r - step]


@device
def _lay_above(bits, step):  # pragma: no cover
    """The same up."""
    for c in range(bits.shape[0]):
        for r in range(bits.shape[1] - step):
            bits[c, r] |= bits[c, r + step]
