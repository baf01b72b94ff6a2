"""Opens local films through PyAV: the only place that does. A film opens no other file, and its frames have a limited size."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from shadowpuppet.errors import FILE_MEMORY, VideoError, check_regular, choices, reason
from shadowpuppet.threads import thread_limit
from shadowpuppet.video.frames import MOST_PIXELS, within_memory

if TYPE_CHECKING:
    from av.container import InputContainer
    from av.video.stream import VideoStream

FILM_SUFFIXES = (".264", ".3gp", ".avi", ".flv", ".gif", ".h264", ".hevc", ".m2ts", ".m4v", ".mjpeg", ".mkv", ".mov", ".mp4",
                 ".mpeg", ".mpg", ".mts", ".mxf", ".ogv", ".ts", ".webm", ".wmv", ".y4m")
"""Endings of films that are found in a folder; others must be named."""
CONTAINERS = ("mov", "matroska", "avi", "mpegts", "mpeg", "mpegvideo", "ogg", "flv", "asf", "mxf", "gif", "mjpeg", "h264", "hevc", "m4v",
              "yuv4mpegpipe", "dv", "ivf", "nut", "av1", "obu")
"""FFmpeg's names of the kinds of file that are read as films: each holds its own pictures. Others name files or addresses to open (play
lists, scripts, descriptions of sessions), or are no film."""
LISTS = {b"#EXTM3U": "a play list (HLS)", b"ffconcat": "a list of films (ffconcat)", b"v=0": "the description of a session (SDP)",
         b"<?xml": "an XML file", b"<MPD": "a play list (DASH)"}
"""Kind of a file by its first bytes, for messages."""
DOORS = {"protocol_whitelist": "file", "format_whitelist": ",".join(CONTAINERS), "enable_drefs": "0", "use_absolute_path": "0"}
"""Options of FFmpeg, which compares the kind of a file with the list before anything else is opened: .mov files that refer to data in other
files do not open them."""
GUARDS = {"max_pixels": str(MOST_PIXELS)}
"""Options of FFmpeg: no decoder makes larger pictures."""


@contextlib.contextmanager
def opened(path: Path, threads: int | None = None) -> Iterator[tuple[InputContainer, VideoStream]]:
    """Open a film; gives its container and video stream. `threads`: number of threads that decode; one is quicker for a few frames, as each
    of several decodes a frame before the first comes. Raises `VideoError`."""
    import av
    import av.error

    try:
        check_regular(path)
        # "file:": a name with a colon is no protocol.
        with within_memory(path):
            container = av.open(f"file:{path}", options=DOORS | GUARDS, **lenient())
    except (OSError, av.error.FFmpegError) as error:
        raise VideoError(_why_not(path, error)) from None
    with within_memory(path), container:
        streams = [s for s in container.streams.video if not s.disposition & s.disposition.attached_pic]
        if not streams:
            raise VideoError(f"{path}: no video stream in it; a film or a picture is expected")
        codec = streams[0].codec_context
        if codec is None:
            raise VideoError(f"{path}: its pictures are of a kind that cannot be decoded; convert it to .mp4 or .mkv")
        width, height = (codec.width, codec.height) if codec.width else _stated_size(path)
        if width * height > MOST_PIXELS:
            raise VideoError(f"{path}: found frames of {width} x {height} pixels, expected at most {MOST_PIXELS} in a frame: scale it")
        codec.options = {**codec.options, **GUARDS}
        streams[0].thread_type = "AUTO"
        codec.thread_count = threads or _threads(width * height)
        yield container, streams[0]


def lenient() -> dict[str, Any]:
    """Arguments of `av.open` with which names in a file need be no text: PyAV 19 needs none, and knows none."""
    from av import __version__

    return {"metadata_errors": "replace"} if int(__version__.split(".")[0]) < 19 else {}


def _stated_size(path: Path) -> tuple[int, int]:
    """Width and height of a film's frames that are too large to be decoded, without decoding any; 0, 0 if they are not stated, or are more
    than FFmpeg can count."""
    import av
    import av.error

    options = DOORS | {"skip_frame": "all"}
    with (contextlib.suppress(OSError, av.error.FFmpegError),
          av.open(f"file:{path}", options=options, **lenient()) as container):  # fmt: skip
        return next(((each.codec_context.width, each.codec_context.height) for each in container.streams.video
                     if each.codec_context is not None), (0, 0))
    return 0, 0


def _threads(pixels: int) -> int:
    """Number of threads that decode frames of `pixels`; each thread holds one frame, of 3 bytes a pixel. 0: FFmpeg's default."""
    most, limit = FILE_MEMORY // (3 * max(pixels, 1)), thread_limit() or 0
    return limit if most >= (limit or os.cpu_count() or 1) else max(most, 1)


def _why_not(path: Path, error: Exception) -> str:
    """Why a file cannot be opened as a film."""
    begin = b""
    with contextlib.suppress(OSError):
        check_regular(path)
        with path.open("rb") as file:
            begin = file.read(16).removeprefix(b"\xef\xbb\xbf")
    found = next((kind for mark, kind in LISTS.items() if begin.startswith(mark)), None)
    if found is not None:
        return f"{path}: found {found}, expected a film that holds its own pictures, such as .mp4, .mov, .mkv or .avi; name the film itself"
    if not isinstance(error, OSError) and getattr(error, "errno", None) == errno.EINVAL:  # is not on the list
        return f"{path}: no film that can be read (none of {choices(FILM_SUFFIXES)}); convert it to .mp4 or .mkv"
    return (f"{path}: no film that can be read ({reason(error)}); an .mp4 that was cut off while being written lacks its index and cannot "
            "be played")
