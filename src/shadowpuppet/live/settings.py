"""What can be set about a live session, documented here and nowhere else."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field
from pydantic.dataclasses import dataclass

from shadowpuppet.settings import STRICT

Seconds = Annotated[float, Field(ge=0, le=600)]


@dataclass(frozen=True, config=STRICT, kw_only=True)
class LiveSettings:
    """A live session, beside what any run can be told."""

    camera: str = "0"
    """Number of a camera, a network address (http, rtsp, tcp, udp, ...), or a film or folder of pictures, played as if live. Several with
    commas between, in the order of the calibration; or the folder of a recording of several cameras."""
    rate: Annotated[float, Field(gt=0, le=10_000)] | None = None
    """Frames/s asked of a camera, or of a film that does not tell its times."""
    speed: Annotated[float, Field(gt=0, le=100)] = 1.0
    """How many times as fast a film is played."""
    countdown: Seconds = 5.0
    """Seconds to step out of the picture, before the empty scene is learnt."""
    learn: Annotated[float, Field(ge=0.3, le=600)] = 3.0
    """Seconds of the empty scene that are learnt."""
    still: Annotated[float, Field(ge=0.1, le=60)] = 1.0
    """Seconds that a person must stand still to be measured."""
    show: Literal["auto", "browser", "viewer", "none", "window"] = "auto"
    """Where it is shown. browser: on a page, whose address is printed; auto: the same, and opened where there is a screen; viewer: the
    puppet in space, on the page of `shadowpuppet view`."""
    listen: str = "127.0.0.1"
    """Address at which the page is served; any but this machine's own lets others see the person."""
    port: Annotated[int, Field(ge=0, le=65535)] | None = None
    """Port of the page; 0 for any that is free. Left out: 8600, or any that is free."""
    record: bool = False
    """Keep the pictures too, in RUN/recording, where `track` can read them. Without this no picture is kept."""
