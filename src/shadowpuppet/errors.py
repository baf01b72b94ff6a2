"""Errors and warnings of the package, and exit codes."""

from __future__ import annotations

from collections.abc import Iterable

BROKEN, MISTAKE, SOME_FAILED, INTERRUPTED = 1, 2, 3, 130
"""Exit codes other than 0: the core does not work on this machine (`doctor`) or a bug of the program; unusable input; some of several runs
failed (`batch`); Ctrl-C."""


class ShadowPuppetError(Exception):
    """A mistake of the user or bad input, in one sentence: where, what was found, what is possible.

    The command line prints it without a traceback and exits with code 2.
    """


class CalibrationError(ShadowPuppetError):
    """A calibration that cannot be used."""


class VideoError(ShadowPuppetError):
    """A film, picture or camera that cannot be read or written."""


class RecordingError(ShadowPuppetError):
    """A recording folder, or a file in it, that cannot be used."""


class SilhouetteError(ShadowPuppetError):
    """No usable silhouette can be made."""


class TrackingError(ShadowPuppetError):
    """Tracking cannot start or go on."""


class FormatError(ShadowPuppetError):
    """A data file of another format than its name says, or damaged."""


class SettingsError(ShadowPuppetError, ValueError):
    """A setting with an unknown name or an impossible value."""


def choices(names: Iterable[str]) -> str:
    """Valid names for a message: `a, b, c`."""
    return ", ".join(sorted(names)) or "none"


def shown(value: object) -> str:
    """A value for a message, with NumPy numbers and arrays as those of Python."""
    plain = getattr(value, "tolist", None)
    return repr(plain() if callable(plain) else value)


def reason(error: BaseException) -> str:
    """What the system or a codec says of an error, without its number and path."""
    return (getattr(error, "strerror", None) or str(error) or "unknown reason").lower()


def one_line(text: object, most: int = 2000) -> str:
    """A message on one line, without control characters, at most about `most` characters long: names and values in it are others'."""
    line = " ".join("".join(each if each.isprintable() else " " for each in str(text)).split())
    return line if len(line) <= most else f"{line[: most // 2]} ... {line[-most // 2 :]}"


class ShadowPuppetWarning(UserWarning):
    """A problem that does not stop the work."""
