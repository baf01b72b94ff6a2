"""What there is to be seen of a live session, and a display that shows nothing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Self

import numpy as np

if TYPE_CHECKING:  # they bring a compiler with them
    from numpy.typing import NDArray

    from shadowpuppet.camera.rasterize import Picture
    from shadowpuppet.video import Image

PHASES = ("learning", "waiting", "measuring", "tracking")
"""What a session does: it learns the empty scene, waits for a person, finds their sizes and place, and tracks them."""
WISHES = ("stop", "learn", "measure")
"""What can be asked of a session: to end, to learn the background anew, to find the person anew."""


class Angle(NamedTuple):
    """A joint's angle with its limits, degrees."""

    name: str
    value: float
    """Not a number where it is not known."""
    low: float
    high: float


@dataclass(frozen=True, eq=False, kw_only=True)
class View:
    """What is known after a picture."""

    phase: str
    """One of `PHASES`."""
    message: str = ""
    """What the person is to do, or what is being done."""
    countdown: float | None = None
    """Seconds until the phase goes on, where that is known."""
    trouble: str = ""
    """Why there are no pictures; empty where there are."""
    status: str = ""
    """Of the person, while they are tracked: one of `motion.STATUSES`."""
    overlap: float = np.nan
    """Of the body and the silhouette, 0..1."""
    angles: tuple[Angle, ...] = ()
    latency: float = np.nan
    """Seconds from capture to pose, of this picture."""
    rate: float = np.nan
    """Pictures worked on a second."""
    interval: float = np.nan
    """Seconds from picture to picture, as the camera gives them."""
    dropped: int = 0
    """Pictures that came while another was worked on."""
    image: Image | None = None
    """The picture (H, W, 3), blue green red, or (H, W) grey; not to be written to."""
    mask: NDArray[np.bool_] | None = None
    """The silhouette (H, W)."""
    picture: Picture | None = None
    """How the camera sees the body; None before it is known."""
    pose: NDArray[np.float64] | None = None
    """Degrees of freedom (D,); None where there is no honest one."""

    @property
    def chip(self) -> str:
        """The state in a word."""
        return "paused" if self.trouble else self.status if self.phase == "tracking" and self.status else self.phase

    def figures(self) -> dict[str, Any]:
        """All but the pictures, as JSON has it: milliseconds and degrees, null for what is not known."""
        return {"phase": self.phase, "chip": self.chip, "message": self.trouble or self.message, "countdown": _number(self.countdown, 1),
                "overlap": _number(self.overlap, 3), "latency": _number(1000 * self.latency, 1),
                "interval": _number(1000 * self.interval, 1), "rate": _number(self.rate, 1), "dropped": self.dropped,
                "angles": [[a.name, _number(a.value, 1), a.low, a.high] for a in self.angles]}


class Display:
    """Shows nothing: derive from it. Used in a `with` block."""

    where = ""
    """Where it can be seen, in words; empty where nowhere."""

    def __enter__(self) -> Self:
        """Open it."""
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""

    def show(self, view: View) -> None:
        """Show a view; called at least ten times a second, whether anything changed or not."""

    def wish(self) -> str:
        """What is asked of the session, one of `WISHES`, once; empty where nothing is."""
        return ""


def _number(value: float | None, digits: int) -> float | None:
    return None if value is None or not np.isfinite(value) else round(float(value), digits)
