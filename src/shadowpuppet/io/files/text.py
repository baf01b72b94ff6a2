"""Text files read and written whole, and what is said where that fails."""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

from shadowpuppet.errors import FormatError, ShadowPuppetError, reason

TEXT_LIMIT = 1_000_000_000
"""Bytes; no table or motion that fits into memory as numbers is longer."""


def read_text(path: Path) -> str:
    """A text file (UTF-8). Raises `FormatError` where it cannot be read, is empty, too long or no text."""
    try:
        if path.stat().st_size > TEXT_LIMIT:
            raise FormatError(f"{path}: found {path.stat().st_size} bytes, expected a text file of at most {TEXT_LIMIT}")
        text = path.read_text("utf-8-sig")
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({reason(error)})") from None
    except UnicodeDecodeError as error:
        raise FormatError(f"{path}: found bytes that are no text at position {error.start}, expected a text file") from None
    if "\0" in text:
        raise FormatError(f"{path}: found a zero byte at position {text.index(chr(0))}, expected a text file")
    if not text.strip():
        raise FormatError(f"{path}: the file is empty")
    return text


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file that is whole or not there. Raises `ShadowPuppetError` where it cannot be written."""
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_bytes(content.encode() if isinstance(content, str) else content)
        os.replace(part, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise ShadowPuppetError(f"{path}: cannot be written ({reason(error)})") from None
