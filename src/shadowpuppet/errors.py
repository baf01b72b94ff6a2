"""The one error family of the package."""

from __future__ import annotations

from collections.abc import Iterable

BROKEN, MISTAKE, SOME_FAILED, INTERRUPTED = 1, 2, 3, 130
"""Exit codes beside 0: the core does not work here (`doctor`), or a mistake of ours; what the user gave cannot be used; some of many runs
failed (`batch`); Ctrl-C."""


class ShadowPuppetError(Exception):
    """A user's mistake or bad input, told in one sentence: where, what was found, what is possible.

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
    """A data file that is not what its name says."""


class SettingsError(ShadowPuppetError, ValueError):
    """A setting with an unknown name or an impossible value."""


def choices(names: Iterable[str]) -> str:
    """Valid names as they are listed in messages: `a, b, c`."""
    return ", ".join(sorted(names)) or "none"


def shown(value: object) -> str:
    """A value as messages show it: NumPy's numbers and arrays as Python's."""
    plain = getattr(value, "tolist", None)
    return repr(plain() if callable(plain) else value)


def reason(error: BaseException) -> str:
    """What the system or a codec says of an error, without its number and path."""
    return (getattr(error, "strerror", None) or str(error) or "unknown reason").lower()


class ShadowPuppetWarning(UserWarning):
    """Something that does not stop the work but that the user should know."""
