"""Settings of the streams to other programs, documented here and nowhere else."""

from __future__ import annotations

from typing import Literal

from pydantic.dataclasses import dataclass

from shadowpuppet.settings import STRICT


@dataclass(frozen=True, config=STRICT, kw_only=True)
class OutletSettings:
    """Where joints and rotations are sent while a person is tracked; nowhere by default."""

    osc: str | None = None
    """Send VMC messages (OSC over UDP) to [HOST:]PORT, by default on this machine. Receivers usually listen at port 39539."""
    websocket: str | None = None
    """Serve JSON by WebSocket at [HOST:]PORT, by default to programs on this machine only; 0.0.0.0 lets others in."""
    origin: str | None = None
    """Origins of web pages that may use the WebSocket, separated by commas (https://example.org); * for all. Programs need none."""
    lsl: str | None = None
    """Name of the stream of the lab streaming layer (LSL)."""
    lsl_scope: Literal["machine", "link", "site"] = "machine"
    """How far the stream is announced: this machine, the local network (link), or beyond (site)."""
