"""Errors and warnings of the package, and exit codes."""

from __future__ import annotations

from collections.abc import Iterable

NOTED, HARMFUL, RUINOUS = 1, 2, 3
"""Weights of a `Caution`."""
BROKEN, MISTAKE, SOME_FAILED, PERSON_LOST, INTERRUPTED = 1, 2, 3, 4, 130
"""Exit codes other than 0: the core does not work on this machine (`doctor`) or a bug of the program; unusable input; some of several runs
failed (`batch`); a run that lost the person in most frames (`track`); Ctrl-C."""


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


class Caution(str):
    """What may harm a run, and its remedy, in a sentence; `short` says both in at most ten words."""

    short: str
    weight: int
    """`NOTED`: lengths or details may be off; `HARMFUL`: joints are; `RUINOUS`: most of the run is."""

    def __new__(cls, sentence: str, short: str, weight: int) -> Caution:
        """A sentence with its short form and weight."""
        made = super().__new__(cls, sentence)
        made.short, made.weight = short, weight
        return made

    def __getnewargs__(self) -> tuple[str, str, int]:
        """What `__new__` takes, for copies."""
        return str(self), self.short, self.weight

    def about(self, what: str) -> Caution:
        """The same doubt about one camera or file, which both forms name first."""
        return Caution(f"{what}: {self}", f"{what}: {self.short}", self.weight)


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


class ShadowPuppetWarning(UserWarning):
    """A problem that does not stop the work."""
