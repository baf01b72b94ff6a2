"""What can be set about giving motion to other programs, documented here and nowhere else."""

from __future__ import annotations

from typing import Literal

from pydantic.dataclasses import dataclass

from shadowpuppet.settings import STRICT


@dataclass(frozen=True, config=STRICT, kw_only=True)
class OutletSettings:
    """To whom joints and rotations are given while somebody is tracked; to nobody by default."""

    osc: str | None = None
    """Send OSC in VMC's messages, by UDP, to [HOST:]PORT; to this machine where no host is given. Receivers usually listen at 39539."""
    websocket: str | None = None
    """Serve JSON at [HOST:]PORT of this machine, to itself alone where no host is given; 0.0.0.0 lets others in."""
    origin: str | None = None
    """Origins of web pages that may listen to the WebSocket, with commas, such as https://example.org; this machine's own always may."""
    lsl: str | None = None
    """Name of a stream for the lab streaming layer."""
    lsl_scope: Literal["machine", "link", "site"] = "machine"
    """How far that stream is announced: on this machine, in the local network, or beyond."""
