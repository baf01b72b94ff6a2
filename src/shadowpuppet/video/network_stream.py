"""Network streams through PyAV: pictures as they arrive, with time-outs."""

from __future__ import annotations

import contextlib
import math
import re
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from shadowpuppet.errors import VideoError, reason
from shadowpuppet.video.film import converter
from shadowpuppet.video.frames import Image, Size, size_of

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.stream import VideoStream

SCHEMES = ("http", "https", "rtmp", "rtp", "rtsp", "rtsps", "tcp", "udp")
"""Kinds of addresses."""
PROTOCOLS = "crypto,http,https,httpproxy,rtmp,rtp,rtsp,srtp,tcp,tls,udp"
"""What FFmpeg may use on its way: no files, so that a stream's play list reads none of this machine."""
OPEN_SECONDS, READ_SECONDS = 8.0, 3.0
"""How long an address may take to answer, and a stream to go on."""


def open_stream(address: str) -> tuple[Iterator[tuple[float, Image]], Size, float]:
    """A stream's pictures (H, W, 3) as they arrive, with the monotonic clock's seconds; their size, and the rate that it tells.

    The seconds are those at which a picture's data were there, before it was decoded. The first picture is waited for.
    Raises `VideoError` where nothing answers in time or there are no pictures in it; the iterator, where the stream breaks off.
    """
    name = without_secrets(address)
    container, stream = _opened(address, name)
    shown = _pictures(container, stream, name)
    try:
        first = next(shown, None)
    except BaseException:
        container.close()
        raise
    if first is None:
        raise VideoError(f"{name}: the stream ended before its first picture")
    rate = stream.average_rate or stream.guessed_rate

    def read() -> Iterator[tuple[float, Image]]:
        yield first
        yield from shown

    return read(), size_of(first[1]), float(rate) if rate else math.nan


def without_secrets(address: str) -> str:
    """An address without a user's name and password, so that it can be shown and saved."""
    return re.sub(r"(?<=://)[^/@]*@", "", address)


def _opened(address: str, name: str) -> tuple[InputContainer, VideoStream]:
    import av
    import av.error

    # Little is buffered on the way: a picture that waited is an old one.
    options = {"protocol_whitelist": PROTOCOLS, "fflags": "nobuffer", "flags": "low_delay", "analyzeduration": "1000000",
               **({"rtsp_transport": "tcp"} if address.lower().startswith("rtsp") else {})}
    try:
        container: Any = av.open(address, options=options, timeout=(OPEN_SECONDS, READ_SECONDS))
    except (OSError, av.error.FFmpegError) as error:
        raise VideoError(f"{name}: no stream of pictures there that can be read ({_why(error)})") from None
    if not container.streams.video:
        container.close()
        raise VideoError(f"{name}: found a stream without pictures, expected video")
    stream = container.streams.video[0]
    stream.thread_type = "SLICE"  # threads by frames hold some back
    return container, stream


def _pictures(container: InputContainer, stream: VideoStream, name: str) -> Iterator[tuple[float, Image]]:
    import av.error

    convert, healthy = converter(grey=False), False
    with contextlib.closing(container):
        packets = container.demux(stream)
        while True:
            try:
                if (packet := next(packets, None)) is None:
                    return
                now = time.monotonic()
            except (OSError, av.error.FFmpegError) as error:
                raise VideoError(f"{name}: the stream broke off ({_why(error)})") from None
            frames = []
            with contextlib.suppress(av.error.FFmpegError):  # who joins late, or loses a packet, waits for the next whole picture
                frames = packet.decode()
            for frame in frames:
                healthy = healthy or frame.key_frame
                if healthy and not frame.is_corrupt:
                    yield now, convert(frame)


def _why(error: BaseException) -> str:
    import av.error

    return "it does not answer" if isinstance(error, av.error.ExitError) else reason(error)
