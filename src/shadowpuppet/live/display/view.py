"""Output of a live session: its state after a picture, the base class of displays, the display of `--show`, and messages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

from shadowpuppet.errors import SettingsError, warn
from shadowpuppet.pipeline.progress import Listener

if TYPE_CHECKING:  # these import Numba
    from numpy.typing import NDArray

    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.live.display.web import WebDisplay
    from shadowpuppet.video import Image

PHASES = ("learning", "waiting", "measuring", "tracking")
"""Phases of a session: learning the empty scene, waiting for a person, measuring their sizes and place, tracking them."""
COMMANDS = ("stop", "learn", "measure")
"""Commands to a session: end, learn the background again, find the person again."""


class DofAngle(NamedTuple):
    """A joint angle and its limits, degrees."""

    name: str
    value: float
    """NaN if unknown."""
    low: float
    high: float


@dataclass(frozen=True, eq=False, kw_only=True)
class SessionState:
    """State of a session after a picture."""

    phase: str
    """One of `PHASES`."""
    message: str = ""
    """Instruction to the person, or what the session is doing."""
    countdown: float | None = None
    """Seconds until the next phase; None if unknown."""
    trouble: str = ""
    """Why there are no pictures; empty while they come."""
    status: str = ""
    """One of `motion.STATUSES` while tracking, else empty."""
    overlap: float = np.nan
    """Overlap of body and silhouette, 0..1."""
    angles: tuple[DofAngle, ...] = ()
    latency: float = np.nan
    """Seconds from capture to pose; with a lag, to the smoothed one."""
    lag: float = 0.0
    """Seconds of it that the frame waits for the next ones, which smooth it."""
    rate: float = np.nan
    """Pictures processed per second."""
    interval: float = np.nan
    """Seconds between the camera's pictures."""
    dropped: int = 0
    """Pictures skipped because they came while another was processed."""
    image: Image | None = None
    """The picture (H, W, 3), blue green red, or (H, W) grey; read only."""
    mask: NDArray[np.bool_] | None = None
    """The silhouette (H, W)."""
    picture: Picture | None = None
    """The body as the camera sees it; None before it is known, and for several cameras, whose bodies are drawn in `image` already."""
    pictures: tuple[Picture, ...] = ()
    """The body as each camera sees it, for drawing it in space; empty before it is known."""
    pose: NDArray[np.float64] | None = None
    """Degrees of freedom (D,); None without a trustworthy pose."""
    doubtful: frozenset[str] = frozenset()
    """Names of the landmarks and shape parts that belong to limbs that are not vouched for."""

    @property
    def chip(self) -> str:
        """The state as one word: paused, a status, or the phase."""
        return "paused" if self.trouble else self.status if self.phase == "tracking" and self.status else self.phase

    def figures(self) -> dict[str, Any]:
        """Everything but the arrays, for JSON: milliseconds and degrees, None if unknown."""
        return {"phase": self.phase, "chip": self.chip, "message": self.trouble or self.message, "countdown": rounded(self.countdown, 1),
                "overlap": rounded(self.overlap, 3), "latency": rounded(1000 * self.latency, 1), "lag": rounded(1000 * self.lag, 0),
                "interval": rounded(1000 * self.interval, 1), "rate": rounded(self.rate, 1), "dropped": self.dropped,
                "angles": [[a.name, rounded(a.value, 1), a.low, a.high] for a in self.angles]}


class Display:
    """Base class of displays, used in a `with` block; shows nothing."""

    where = ""
    """Where it is shown, for messages; empty if nowhere."""

    def __enter__(self) -> Self:
        """Open it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""

    def show(self, view: SessionState) -> None:
        """Show a view; called at least ten times a second, changed or not."""

    def command(self) -> str:
        """The last command given, one of `COMMANDS`, once; else empty."""
        return ""


def rounded(value: float | None, digits: int) -> float | None:
    """A number for JSON; None if it is not known."""
    return None if value is None or not np.isfinite(value) else round(float(value), digits)


class LiveListener(Listener):
    """Receives messages of a session. Every method does nothing: override those of interest."""

    def note(self, message: str) -> None:
        """A message for the person before the camera or at the terminal."""

    def trouble(self, message: str) -> None:
        """A problem: no usable pictures come, or the motion cannot be sent to other programs."""


FOOTERS = {
    False: "Pictures stay in this machine's memory; joints and angles alone are saved.",
    True: "The pictures are recorded (--record).",
}
GONE = {
    "window": "--show browser shows the same on a page, with the same keys",
    "viewer": "--show browser shows the body in space too, beside the picture",
}
"""Displays that are gone, and what replaces them."""


def open_display(show: str, listen: str = "127.0.0.1", port: int | None = None, record: bool = False,
                 page: type[WebDisplay] | None = None) -> Display:
    """The display for `auto`, `browser` or `none`; `auto` also opens the page in a browser if there is a screen.

    `page`: the kind of page; None: the plain one. Raises `SettingsError` if it cannot be served.
    """
    if show == "none":
        return Display()
    if show in GONE:
        raise SettingsError(f"show: found {show!r}, which is gone: {GONE[show]}")
    from shadowpuppet.live.display.web import WebDisplay
    from shadowpuppet.network import is_loopback

    display = (page or WebDisplay)(listen, port, FOOTERS[record], opening=show == "auto")
    if not is_loopback(listen):
        warn(f"the page is served at {listen}: everybody who reaches this machine can see the person there, and press the buttons")
    return display
