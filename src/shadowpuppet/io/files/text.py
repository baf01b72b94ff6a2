"""Reads text and TOML files, UTF-8 or UTF-16 with its mark; writes files completely or not at all."""

from __future__ import annotations

import codecs
import contextlib
import os
import re
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from shadowpuppet.errors import FormatError, ShadowPuppetError, check_regular, reason

TEXT_LIMIT = 1_000_000_000
"""Greatest size of a table or motion, bytes; a longer one would not fit into memory as numbers."""
TOML_LIMIT = 2_000_000
"""Greatest size of a calibration or settings file, bytes: what is longer takes many seconds to be parsed, or is a film given by mistake."""

JSON_LIMIT = 50_000_000
"""Greatest size of a file of JSON that a run writes, bytes."""
MARKS = {codecs.BOM_UTF32_LE: "utf-32", codecs.BOM_UTF32_BE: "utf-32", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
"""Encodings by the first bytes of a file, longer marks first; UTF-8 has its mark or none."""
UNMARKED = re.compile(rb"[^\0]\0[^\0]\0|\0[^\0]\0[^\0]|[^\0]\0\0\0|\0\0\0[^\0]")
"""First four bytes of a text in UTF-16 or UTF-32 without a mark."""

DEEPEST = 20
"""Greatest number of parts of a dotted key of TOML; the parser's memory grows with the square of them."""
TOO_DEEP = re.compile(rf"""(?<![\w-])(?:(?:[\w-]+|"[^"\n]*"|'[^'\n]*')[ \t]*\.[ \t]*){{{DEEPEST}}}""", re.ASCII)


def read_text(path: Path) -> str:
    """The text of a file. Raises `FormatError` if it cannot be read, is empty, too long or no text."""
    text = read_limited(path, TEXT_LIMIT, FormatError, "a text file")
    if "\0" in text:
        raise FormatError(f"{path}: found a zero byte at position {text.index(chr(0))}, expected a text file")
    if not text.strip():
        raise FormatError(f"{path}: the file is empty")
    return text


def read_toml(path: str | Path, error: type[ShadowPuppetError]) -> dict[str, Any]:
    """The tables of a TOML file. Raises `error` if it is missing, too long or not TOML."""
    text = read_limited(Path(path), TOML_LIMIT, error, "a TOML file")
    if (found := TOO_DEEP.search(text)) is not None:
        line = text.count("\n", 0, found.start()) + 1
        raise error(f"{path}: line {line}: found a key of more than {DEEPEST} parts, expected fewer")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as problem:
        raise error(f"{path}: not valid TOML: {problem}") from None


def read_limited(path: Path, limit: int, error: type[ShadowPuppetError], kind: str, kind_if_long: str = "") -> str:
    """The text of a file of at most `limit` bytes, UTF-8 or UTF-16 with its mark, as Windows' programs write it. Raises `error`, which
    names the `kind` of file that is expected."""
    try:
        check_regular(path)
        if path.stat().st_size > limit:
            raise error(f"{path}: found {path.stat().st_size} bytes, expected {kind_if_long or kind} of at most {limit}")
        with path.open("rb") as file:
            found = encoding_of(file.read(4))
        if found is None or found == "utf-32":
            raise error(f"{path}: found text in {'UTF-32' if found else 'UTF-16 or UTF-32 without its mark'}, expected {kind} in UTF-8, or "
                        "in UTF-16 with its mark (FF FE or FE FF at the beginning): save it as UTF-8")
        return path.read_text(found)
    except OSError as problem:
        raise error(f"{path}: cannot be read ({reason(problem)})") from None
    except UnicodeDecodeError as problem:
        what = "no UTF-16" if problem.encoding.startswith("utf-16") else "no text"
        raise error(f"{path}: found bytes that are {what} at position {problem.start}, expected {kind}") from None


def encoding_of(head: bytes) -> str | None:
    """Python's name of a text's encoding by its first bytes; None for UTF-16 or UTF-32 without a mark."""
    found = next((name for mark, name in MARKS.items() if head.startswith(mark)), "utf-8-sig")
    return None if UNMARKED.match(head) else found


@contextlib.contextmanager
def errors_named(where: object) -> Iterator[None]:
    """Convert `ShadowPuppetError` to `FormatError`, whose message begins with the file."""
    try:
        yield
    except FormatError:
        raise
    except ShadowPuppetError as error:
        raise FormatError(f"{where}: {error}") from None


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file completely or not at all. Raises `ShadowPuppetError` if it cannot be written."""
    part = path.with_name(f"{path.name}.part")
    try:
        part.write_bytes(content.encode("utf-8", "replace") if isinstance(content, str) else content)
        os.replace(part, path)
    except OSError as error:
        with contextlib.suppress(OSError):
            part.unlink(missing_ok=True)
        raise ShadowPuppetError(f"{path}: cannot be written ({reason(error)})") from None
