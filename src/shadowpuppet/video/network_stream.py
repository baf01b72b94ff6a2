"""Reads network streams through PyAV: pictures as they arrive, with time-outs."""

from __future__ import annotations

import contextlib
import math
import re
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from shadowpuppet.errors import VideoError, reason
from shadowpuppet.video.container import CONTAINERS, GUARDS, lenient
from shadowpuppet.video.film import converter
from shadowpuppet.video.frames import Image, Size, size_of

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.stream import VideoStream

SCHEMES = ("http", "https", "rtmp", "rtp", "rtsp", "rtsps", "tcp", "udp")
"""Schemes of addresses that can be opened."""
PROTOCOLS = "crypto,http,https,httpproxy,rtmp,rtp,rtsp,srtp,tcp,tls,udp"
"""Protocols that FFmpeg may use; `file` is not among them, so that a stream's play list cannot read this machine's files."""
KINDS = (*CONTAINERS, "aac", "hls", "live_flv", "mp3", "mpegtsraw", "mpjpeg", "rtp", "rtsp", "sdp", "webvtt")
"""FFmpeg's names of the kinds of stream that are read, and of the parts of such streams."""
OPEN_SECONDS, READ_SECONDS = 8.0, 3.0
"""Time-outs, seconds, for an address to answer and for a stream's next data."""


def open_stream(address: str) -> tuple[Iterator[tuple[float, Image]], Size, float]:
    """Open a stream; returns pictures (H, W, 3) with their times, seconds of the monotonic clock, their size, and the stated rate (or NaN).

    A picture's time is when its data arrived, before decoding. Waits for the first picture. Raises `VideoError` if nothing answers
    in time or the stream has no pictures; the iterator raises it if the stream breaks off.
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
    """An address without user name and password, for display and files."""
    return re.sub(r"(?<=://)[^/@]*@", "", address)


def _opened(address: str, name: str) -> tuple[InputContainer, VideoStream]:
    import av
    import av.error

    # Buffer little, for a low latency.
    options = {"protocol_whitelist": PROTOCOLS, "format_whitelist": ",".join(KINDS), **GUARDS, "fflags": "nobuffer",
               "flags": "low_delay", "analyzeduration": "1000000",
               **({"rtsp_transport": "tcp"} if address.lower().startswith("rtsp") else {})}
    try:
        container: Any = av.open(address, options=options, **lenient(), timeout=(OPEN_SECONDS, READ_SECONDS))
    except (OSError, av.error.FFmpegError) as error:
        raise VideoError(f"{name}: no stream of pictures there that can be read ({_why(error)})") from None
    if not any(each.codec_context is not None for each in container.streams.video):
        container.close()
        raise VideoError(f"{name}: found a stream without pictures, expected video")
    stream = next(each for each in container.streams.video if each.codec_context is not None)
    stream.codec_context.options = {**stream.codec_context.options, **GUARDS}
    stream.thread_type = "SLICE"  # threads by frames delay pictures
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
            with contextlib.suppress(av.error.FFmpegError):  # after joining late or losing a packet, wait for the next key frame
                frames = packet.decode()
            for frame in frames:
                healthy = healthy or frame.key_frame
                if healthy and not frame.is_corrupt:
                    yield now, convert(frame)


def _why(error: BaseException) -> str:
    import av.error

    return "it does not answer" if isinstance(error, av.error.ExitError) else reason(error)
