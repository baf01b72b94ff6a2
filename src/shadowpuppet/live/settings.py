"""Settings of a live session, documented here and nowhere else."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field
from pydantic.dataclasses import dataclass

from shadowpuppet.settings import STRICT

Seconds = Annotated[float, Field(ge=0, le=600)]


def _listed(value: object) -> object:
    return tuple(value.split(",")) if isinstance(value, str) else value


@dataclass(frozen=True, config=STRICT, kw_only=True)
class LiveSettings:
    """Settings of a live session, in addition to the `Options` of any run."""

    camera: str = "0"
    """Number of a camera, a network address (http, rtsp, tcp, udp, ...), or a film or folder of pictures, played as if live. For several
    cameras, give these separated by commas, in the order of the calibration, or the folder of a recording."""
    rate: Annotated[float, Field(gt=0, le=10_000)] | None = None
    """Frames/s requested from a camera, or of a film without time stamps."""
    delay: Annotated[tuple[Annotated[float, Field(ge=0, le=10)], ...], BeforeValidator(_listed)] = ()
    """Seconds from a picture's capture until it arrives here, of each camera or stream in turn: they are taken off the time of arrival.
    Differences between cameras suffice to keep them in step."""
    speed: Annotated[float, Field(gt=0, le=100)] = 1.0
    """Speed at which a film is played, as a multiple of its own."""
    countdown: Seconds | None = None
    """Seconds to step out of the picture, before the empty scene is looked for. Left out: 5, and 0 for a film."""
    learn: Annotated[float, Field(ge=0.3, le=600)] = 3.0
    """Duration, in seconds, in which the empty scene is found: behind who moves, if there is a person."""
    still: Annotated[float, Field(ge=0.1, le=60)] = 1.0
    """Seconds after which a still person is measured; a moving one is measured after three."""
    show: Literal["auto", "browser", "none", "window", "viewer"] = "auto"
    """Where the session is shown. browser: on a page, and its address is printed; auto: the same, and the page is opened if there is a
    screen."""
    listen: str = "127.0.0.1"
    """Address at which the page is served; any but the loopback address lets other machines see the person."""
    port: Annotated[int, Field(ge=0, le=65535)] | None = None
    """Port of the page; 0 for any that is free. Left out: 8600, or any that is free."""
    lag: Annotated[float, Field(ge=0, le=2)] | None = None
    """Seconds by which the motion shown, and sent to other programs, waits for the next pictures, which smooth it; 0: as tracked, at once.
    By default 0.1, and 0 if nothing is smoothed (`smooth = "off"`, the papers' presets)."""
    record: bool = False
    """Also save the pictures, in RUN/recording, which `track` can read. Without this no picture is saved."""
