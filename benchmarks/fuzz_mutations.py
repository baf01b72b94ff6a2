"""Random changes of files: bytes, numbers, words and lines of texts, members of archives."""

from __future__ import annotations

import codecs
import io
import re
import zipfile
from collections.abc import Callable

import numpy as np

NUMBERS = (b"0", b"-1", b"1", b"nan", b"inf", b"-inf", b"1e308", b"-1e308", b"1e-320", b"2147483648", b"65536", b"9223372036854775808",
           b"9" * 400, b"1e400", b"0x10", b"1_000", b"3.", b".5", b"", b"1 2", b"1,5", b"\xd9\xa3", b"true", b"1e5", b"100000000")
WORDS = (b"[", b"]", b"{", b"}", b'"', b"'''", b"\n", b"\r", b"\t", b"\0", b"\xff\xfe", b"\xed\xa0\x80", b"#", b"=", b".", b"a.b.c",
         b"<", b">", b"&amp;", b"<!DOCTYPE a>", b"<!ENTITY a 'b'>", b"..", b"/dev/zero", b"a" * 5000, b"\x1b[31m", b"\xe2\x80\xae",
         b"nan", b"null", b"__proto__", b"[[", b"." * 100, b"a." * 60 + b"a", b"[" * 1500,
         b"{a=" * 200, b"\\u0000", b"\xef\xbb\xbf")  # fmt: skip
INTEGERS = (0, 1, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF, 0x7FFFFFFFFFFFFFFF, 0xFFFFFFFFFFFFFFFF)
TOKEN = re.compile(rb"[^\s,=\[\]{}<>\"]+")
NUMBER = re.compile(rb"-?\d+\.?\d*(?:e[+-]?\d+)?")
MOST = 3_000_000
"""Greatest size of an input, bytes."""

Change = Callable[[np.random.Generator, bytes, bytes], bytes]


def mutated(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    """A file's content after one or more changes; `other`: another file's content, parts of which may be inserted."""
    if content[:2] == b"PK" and rng.random() < 0.9:
        return in_archive(rng, content)
    if content.startswith(codecs.BOM_UTF16_LE) and rng.random() < 0.9:
        text = [each.decode("utf-16", "ignore").encode("utf-8", "ignore") for each in (content, other)]
        return mutated(rng, *text).decode("utf-8", "ignore").encode("utf-16")
    is_text = b"\0" not in content[:2000]
    for _ in range(1 + int(rng.geometric(0.6))):
        change = (TEXT if is_text and rng.random() < 0.8 else BINARY)[rng.integers(len(TEXT if is_text else BINARY)) % len(BINARY)]
        content = change(rng, content, other)[:MOST] or b""
    return content


def in_archive(rng: np.random.Generator, content: bytes) -> bytes:
    """An archive with one member changed: its bytes, its header, its name, or packed more than it says."""
    out = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as archive, zipfile.ZipFile(out, "w") as new:
        members = {info.filename: archive.read(info) for info in archive.infolist()}
        chosen = list(members)[rng.integers(len(members))]
        kind = rng.integers(6)
        if kind == 0:
            del members[chosen]
        elif kind == 1:
            members[chosen] = members[list(members)[rng.integers(len(members))]]
        elif kind == 2:
            members[chosen] = flipped(rng, members[chosen], b"")
        elif kind == 3:
            members[chosen] = NUMBER.sub(lambda found: NUMBERS[rng.integers(len(NUMBERS))] if rng.random() < 0.4 else found[0],
                                         members[chosen][:128]) + members[chosen][128:]
        elif kind == 4:
            members[chosen] = overwritten(rng, members[chosen], b"")
        else:
            members[chosen] = (members[chosen] * 2)[: int(rng.integers(1, 2 * len(members[chosen]) + 1))]
        for name, member in members.items():
            new.writestr(name, member, zipfile.ZIP_DEFLATED if rng.random() < 0.5 else zipfile.ZIP_STORED)
    return flipped(rng, out.getvalue(), b"") if rng.random() < 0.05 else out.getvalue()


def span(rng: np.random.Generator, content: bytes, longest: int = 64) -> tuple[int, int]:
    """A random part of a content: from and to."""
    begin = int(rng.integers(len(content) + 1))
    return begin, min(len(content), begin + int(rng.integers(longest + 1)))


def flipped(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    data = bytearray(content)
    for at in rng.integers(len(data), size=int(rng.integers(1, 4))) if data else ():
        data[at] ^= 1 << int(rng.integers(8))
    return bytes(data)


def overwritten(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    size, order = int(rng.choice([1, 2, 4, 8])), "little" if rng.random() < 0.7 else "big"
    at = int(rng.integers(max(len(content) - size, 0) + 1))
    at = int(rng.integers(min(512, at + 1))) if rng.random() < 0.4 else at
    value = INTEGERS[rng.integers(len(INTEGERS))] & (256**size - 1)
    return content[:at] + value.to_bytes(size, order) + content[at + size :]


def deleted(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    begin, end = span(rng, content)
    return content[:begin] + content[end:]


def repeated(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    begin, end = span(rng, content, 400)
    return content[:begin] + content[begin:end] * int(rng.choice([2, 3, 10, 1000])) + content[end:]


def cut(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    return content[: int(rng.integers(len(content) + 1))]


def spliced(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    return content[: int(rng.integers(len(content) + 1))] + other[int(rng.integers(len(other) + 1)) :]


def of_random(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    begin, end = span(rng, content, 16)
    return content[:begin] + rng.bytes(int(rng.integers(16))) + content[end:]


def replaced(pattern: re.Pattern[bytes], values: tuple[bytes, ...]) -> Change:
    """Replaces something in a text by one of values, or by another such thing."""

    def change(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
        begin = int(rng.integers(len(content) + 1))
        found = pattern.search(content, begin) or pattern.search(content)
        if found is None:
            return content
        value = values[rng.integers(len(values))]
        if rng.random() < 0.3 and (another := pattern.search(content, int(rng.integers(len(content) + 1)))) is not None:
            value = another[0]
        return content[: found.start()] + value + content[found.end() :]

    return change


def lines_changed(rng: np.random.Generator, content: bytes, other: bytes) -> bytes:
    lines = content.split(b"\n")
    a, b, kind = int(rng.integers(len(lines))), int(rng.integers(len(lines))), rng.integers(4)
    if kind == 0:
        del lines[a]
    elif kind == 1:
        lines[a], lines[b] = lines[b], lines[a]
    elif kind == 2:
        lines[a:a] = [lines[b]] * int(rng.choice([1, 2, 2000]))
    else:
        lines[a:a] = other.split(b"\n")[:20]
    return b"\n".join(lines)


BINARY: tuple[Change, ...] = (flipped, overwritten, deleted, repeated, cut, spliced, of_random, overwritten)
TEXT: tuple[Change, ...] = (replaced(NUMBER, NUMBERS), replaced(TOKEN, WORDS),
                             lines_changed, replaced(NUMBER, NUMBERS), replaced(TOKEN, WORDS),
                            deleted, repeated, flipped)
