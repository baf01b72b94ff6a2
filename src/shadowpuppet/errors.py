"""Errors and warnings of the package, and exit codes."""

from __future__ import annotations

import errno
import os
import shlex
import stat
import sys
import warnings
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path

NOTED, HARMFUL, RUINOUS = 1, 2, 3
"""Severities of a `Finding`."""
BROKEN, MISTAKE, SOME_FAILED, PERSON_LOST, INTERRUPTED = 1, 2, 3, 4, 130
"""Exit codes other than 0: the core does not work on this machine (`doctor`) or a bug of the program; unusable input; some of several runs
failed (`batch`); a run that lost the person in most frames (`track`); Ctrl-C."""

FILE_MEMORY = 500_000_000
"""Memory that reading a file may take beyond the file's own size, bytes. Limits of what files state are derived from it."""
LONGEST = 2000
"""Number of characters of a message beyond which its middle is left out."""


def printable(text: object) -> str:
    """A text on one line, without control characters: names and values in it may come from anywhere."""
    line = str(text)
    if line.isprintable():
        return line
    return "".join(each if each.isprintable() else " " if each.isspace() else "\ufffd" for each in line)


def one_line(text: object) -> str:
    """A `printable` message of limited length."""
    line = printable(text)
    return line if len(line) <= LONGEST else f"{line[: LONGEST // 2]} ... {line[-LONGEST // 2 :]}"


class ShadowPuppetError(Exception):
    """A mistake of the user or bad input, in one sentence: where, what was found, what is possible.

    The command line prints it without a traceback and exits with code 2. Its text is one line of limited length (`one_line`).
    """

    def __str__(self) -> str:
        """The sentence."""
        return one_line(super().__str__())


class CalibrationError(ShadowPuppetError):
    """A calibration that cannot be used."""


class VideoError(ShadowPuppetError):
    """A film, picture or camera that cannot be read or written."""


class RecordingError(ShadowPuppetError):
    """A recording folder, or a file in it, that cannot be used."""


class SilhouetteError(ShadowPuppetError):
    """No usable silhouettes or keypoints can be made."""


class TrackingError(ShadowPuppetError):
    """Tracking cannot start or go on."""


class FormatError(ShadowPuppetError):
    """A data file of another format than its name says, or damaged."""


class SettingsError(ShadowPuppetError, ValueError):
    """A setting with an unknown name or an impossible value."""


@dataclass(frozen=True)
class Finding:
    """What was found of a recording or a run that may harm it, and the remedy."""

    words: str
    """A sentence."""
    short: str
    """The same in at most ten words."""
    severity: int
    """`NOTED`: lengths or details may be off; `HARMFUL`: joints are; `RUINOUS`: most of the run is."""
    evidence: Mapping[str, float | str] = field(default_factory=dict, hash=False)
    """The measured figures that say so, by name."""
    what: str = ""
    """The one camera or file that it is about."""

    @classmethod
    def of(cls, words: str, short: str, severity: int, **evidence: float | str) -> Finding:
        """A finding whose words hold its figures' names in braces, with their formats."""
        return cls(words.format_map(evidence), short.format_map(evidence), severity, evidence)

    def __str__(self) -> str:
        """The sentence."""
        return self.words

    def __contains__(self, text: str) -> bool:
        """Whether the sentence has a text."""
        return text in self.words

    def at_most(self, severity: int) -> Finding:
        """The same finding, with this severity if its own is greater."""
        return replace(self, severity=min(self.severity, severity))

    def about(self, what: str) -> Finding:
        """The same finding about one camera or file, which both forms name first."""
        return replace(self, words=f"{what}: {self.words}", short=f"{what}: {self.short}", what=what)


def choices(names: Iterable[str]) -> str:
    """Valid names for a message: `a, b, c`."""
    return ", ".join(sorted(names)) or "none"


def did_you_mean(name: object, known: Iterable[str]) -> str:
    """The one of the `known` names that is nearly `name`, as the end of a message; empty if none is."""
    found = get_close_matches(str(name), list(known), 1)
    return f"; did you mean {found[0]}?" if found else ""


def typed(*words: object) -> str:
    """A command of this program as it is typed here: words with blanks are quoted."""
    return f"{os.environ.get('SHADOWPUPPET_COMMAND', 'shadowpuppet')} {shlex.join(map(str, words))}"


def extra_command(extra: str) -> str:
    """The command that installs an extra of this package where it runs: a plain pip may be another environment's."""
    from shutil import which

    ours, found = Path(sys.executable), which("pip")
    pip = "pip" if found and Path(found).parent == ours.parent else f"{shlex.quote(str(ours))} -m pip"
    return f"{pip} install 'shadowpuppet[{extra}]'"


def shown(value: object) -> str:
    """A value for a message, with NumPy numbers and arrays as those of Python."""
    plain = getattr(value, "tolist", None)
    return repr(plain() if callable(plain) else value)


def reason(error: BaseException) -> str:
    """What the system or a codec says of an error, without its number and path."""
    return (getattr(error, "strerror", None) or str(error) or ("out of memory" if is_out_of_memory(error) else "unknown reason")).lower()


def is_out_of_memory(error: BaseException) -> bool:
    """Whether an error says that memory does not suffice: Python's, NumPy's and FFmpeg's are `MemoryError`, OpenCV's has a code."""
    return isinstance(error, MemoryError) or (type(error).__module__ == "cv2" and getattr(error, "code", None) == -4)


def check_regular(path: Path) -> None:
    """Raise `OSError` for anything but a file, such as a pipe, which would be waited for without end, or a device."""
    kind = path.stat().st_mode
    if not stat.S_ISREG(kind):
        raise OSError(errno.EINVAL, "is a directory" if stat.S_ISDIR(kind) else "is a pipe or a device, expected a file")


class ShadowPuppetWarning(UserWarning):
    """A problem that does not stop the work."""

    def __str__(self) -> str:
        """The sentence, as of a `ShadowPuppetError`."""
        return one_line(super().__str__())


WRAPPERS = ("contextlib", "numpy")
"""Packages whose decorators lie between the caller's code and ours."""


_held: ContextVar[list[str] | None] = ContextVar("held", default=None)


@contextmanager
def held_warnings() -> Iterator[list[str]]:
    """Context in which the warnings of `warn` on this thread are kept back, in the list that it gives, so that work shared out to threads
    warns in its own order. If the work fails they are given at once."""
    held = list[str]()
    token = _held.set(held)
    try:
        yield held
    except BaseException:
        _held.reset(token)
        for message in held:
            warn(message)
        raise
    _held.reset(token)


def warn(message: str) -> None:
    """Warn of a problem that does not stop the work. The warning names the line that led to it in the caller's own code, not here."""
    if (held := _held.get()) is not None:
        held.append(message)
        return
    frame, level = sys._getframe(1), 2
    while frame.f_back is not None and frame.f_globals.get("__name__", "").partition(".")[0] in (__name__.partition(".")[0], *WRAPPERS):
        frame, level = frame.f_back, level + 1
    warnings.warn(message, ShadowPuppetWarning, stacklevel=level)
