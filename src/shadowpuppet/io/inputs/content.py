"""What files hold, as a hash. It does not depend on their place, nor on the time at which they were written."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import BinaryIO

WHOLE, LEAST = 1 << 24, 1 << 17
"""Bytes that are hashed of one film or folder at most, and of each file of a folder at most where these are many."""
BLOCKS = 16
"""Number of blocks, spread evenly from a long file's first byte to its last, that stand for all of it: films are too long to be read whole.
Another encoding of a film changes its size and each block, and other pictures in an uncompressed one change all blocks that they reach."""


def content_of(files: Sequence[tuple[str, Path]]) -> str:
    """A hash of files: of each its name, its size, and all of its bytes or `BLOCKS` blocks of them; that of no files is the hash of no
    data."""
    digest, most = hashlib.sha256(), max(WHOLE // max(len(files), 1), LEAST)
    for name, file in files:
        try:
            with file.open("rb") as data:
                size = file.stat().st_size
                digest.update(f"{name}\0{size}\0".encode("utf-8", "surrogateescape"))
                for block in _blocks(data, size, most):
                    digest.update(block)
        except OSError:
            digest.update(f"{name}\0unreadable\0".encode("utf-8", "surrogateescape"))
    return digest.hexdigest()


def _blocks(data: BinaryIO, size: int, most: int) -> Iterator[bytes]:
    """All of a file of this size, or blocks of `most` bytes together."""
    if size <= most:
        yield data.read(size)
        return
    length = most // BLOCKS
    for n in range(BLOCKS):
        data.seek((size - length) * n // (BLOCKS - 1))
        yield data.read(length)
