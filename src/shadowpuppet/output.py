"""Standard output and standard error: text without control characters, and streams that outlive a closed pipe or a full disk."""

from __future__ import annotations

import contextlib
import errno
import io
import os
import sys
from typing import Any, cast

from shadowpuppet.errors import MISTAKE, printable, reason

DESCRIPTORS = (("stdin", 0, os.O_RDONLY), ("stdout", 1, os.O_WRONLY), ("stderr", 2, os.O_WRONLY))
"""Name in `sys`, number and mode of each standard stream."""


def say(line: object, error: bool = False, end: str = "\n") -> None:
    """Print one line on standard output, or on standard error if `error`. Names in it may come from anywhere (`printable`)."""
    print(printable(line), end=end, file=sys.stderr if error else sys.stdout, flush=True)


def say_text(text: str) -> None:
    """Print a text of several lines on standard output; it may have tabs."""
    print(without_controls(text))  # noqa: T201


def without_controls(text: str) -> str:
    """A text of lines and tabs, its other control characters as in `printable`."""
    return text if text.isprintable() else "".join(sign if sign in "\n\t" else printable(sign) for sign in text)


class Sink(io.FileIO):
    """A file that takes everything: after the first write that fails, what follows is lost, so that the work goes on."""

    failure: OSError | None = None
    """Why the first write failed."""

    def write(self, data: Any, /) -> int | None:
        """Write bytes; returns their number, also if they are lost."""
        if self.failure is None:
            try:
                return super().write(data)
            except OSError as error:
                self.failure = error
        return len(data)


def guard_streams() -> None:
    """Open the standard streams that are closed, on the null device, and give the others a `Sink`.

    A stream that was closed would have its number taken by the next file. A console of Windows, which has a Unicode interface of its own,
    is left as it is.
    """
    for name, number, mode in DESCRIPTORS:
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, mode)  # takes the lowest free number, which is this one
        stream = getattr(sys, name)
        if number and (stream is None or not (sys.platform == "win32" and stream.isatty())):
            setattr(sys, name, _guarded(number))


def output_failure(code: int) -> int:
    """The exit code of a program that ends with `code`: `MISTAKE`, after a sentence, if standard output could not be written. A reader that
    has closed its pipe, as `head` does, is no failure."""
    for stream in (sys.stdout, sys.stderr):
        with contextlib.suppress(OSError, ValueError):
            stream.flush()
    failure = getattr(getattr(getattr(sys.stdout, "buffer", None), "raw", None), "failure", None)
    if failure is None or failure.errno in (errno.EPIPE, errno.EINVAL if sys.platform == "win32" else errno.EPIPE):
        return code
    say(f"error: standard output: cannot be written ({reason(failure)})", error=True)
    return code or MISTAKE


def _guarded(number: int) -> io.TextIOWrapper:
    """A text stream over a `Sink`; characters that its encoding lacks are written as escapes."""
    before = sys.stdout if number == 1 else sys.stderr
    encoding = "utf-8" if before is None else before.encoding
    file = io.BufferedWriter(cast("io.RawIOBase", Sink(number, "w", closefd=False)))
    return io.TextIOWrapper(file, encoding, "backslashreplace", line_buffering=number == 2 or file.isatty())
