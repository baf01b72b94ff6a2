"""Writes films; an interrupted one can be played."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np

from shadowpuppet.errors import VideoError, reason
from shadowpuppet.video.frames import Image, Size, size_of
from shadowpuppet.video.images import check_image

if TYPE_CHECKING:
    from av import VideoFrame

CRF = 18
"""Constant rate factor of H.264 with hardly visible loss."""
BT601 = 6
"""FFmpeg's AVCOL_SPC_SMPTE170M, stated with the range of luma so that players need not guess the conversion of colours."""


def write_frames(path: str | Path, rate: float, *, size: Size | None = None, lossless: bool = False, crf: int = CRF,
                 threads: int = 0) -> FrameWriter:
    """Write a film of `rate` frames/s: `with write_frames("film.mp4", 25) as film: film.write(image)`.

    The codec is H.264 (.mp4, .mov, .mkv; odd sizes are made even by repeating the last row or column), or FFV1 if `lossless` (.mkv; grey
    or colour like the first picture). The film is named `<name>.part.<ending>` until it is finished; an interrupted one can be
    played under that name. Raises `VideoError` if it cannot be written (no such folder, disk full, no frames).

    Args:
        path: the film.
        rate: frames/s.
        size: width and height to which pictures are scaled.
        lossless: write FFV1.
        crf: constant rate factor of H.264, 0 to 51.
        threads: threads of the encoder, 0: as many as it likes. Then libx264's film depends on the machine's cores and, if pictures are
            less than 640 pixels wide, on chance; with 1 it is the same every time, and larger.
    """
    path, endings = Path(path), [".mkv"] if lossless else [".mkv", ".mov", ".mp4"]
    if path.suffix not in endings:
        kind = "lossless film" if lossless else "film"
        raise VideoError(f"{path}: found the ending {path.suffix!r}, a {kind} is written to {' or '.join(endings)}")
    if not 0.01 <= rate <= 10_000:
        raise VideoError(f"{path}: rate: found {rate}, expected 0.01 to 10000 frames/s")
    return FrameWriter(path, rate, size, lossless, crf, threads)


class FrameWriter:
    """Writes a film within its `with` block; made by `write_frames`."""

    def __init__(self, path: Path, rate: float, size: Size | None, lossless: bool, crf: int = CRF, threads: int = 0) -> None:
        """The file is created at the first picture."""
        self.crf, self.threads = crf, threads
        self.path, self.partial = path, path.with_name(f"{path.stem}.part{path.suffix}")
        self.rate, self.size, self.lossless = Fraction(rate).limit_denominator(1001), size, lossless
        self.count, self._stamp = 0, -1
        self._base: Fraction
        """Seconds of a unit of `_stamp`; set by the first picture."""
        self._shape: tuple[int, ...] = ()
        self._container: Any = None
        self._stream: Any = None
        self._intact = False

    def __enter__(self) -> Self:
        """Return itself."""
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        """Finish the film; after an error it keeps its partial name."""
        if kind is not None:
            with contextlib.suppress(VideoError), self._system_errors():
                self._close()
            return
        if self._container is None:
            raise VideoError(f"{self.path}: no frame was given, so no film was written")
        with self._system_errors():
            self._close()
            os.replace(self.partial, self.path)

    def write(self, image: Image, time: float | None = None) -> None:
        """Add a picture, (H, W, 3) blue green red or (H, W) grey, 8 bit; all pictures have the same shape.

        `time`: its time in seconds, stored to the millisecond, if the rate is not constant; give it for all pictures or none.
        """
        check_image(self.path, image)
        image = self._fitted(image)
        with self._system_errors():
            if self._container is None:
                self._base = 1 / self.rate if time is None else Fraction(1, 1000)
                self._open(image)
            self._encode(self._frame(image, time))
        self.count += 1

    def _fitted(self, image: Image) -> Image:
        import cv2

        if self.size is not None and size_of(image) != self.size:
            image = np.asarray(cv2.resize(image, self.size, interpolation=cv2.INTER_AREA), np.uint8)
        self._shape = self._shape or image.shape
        if image.shape != self._shape:
            raise VideoError(f"{self.path}: picture {self.count} has the shape {image.shape}, those before it {self._shape}")
        if not self.lossless:  # H.264 with 4:2:0 colours has even sizes only
            image = np.pad(image, [(0, image.shape[0] % 2), (0, image.shape[1] % 2), (0, 0)][: image.ndim], "edge")
        return np.ascontiguousarray(image)

    def _frame(self, image: Image, time: float | None) -> VideoFrame:
        import av

        frame = av.VideoFrame.from_ndarray(image, format="gray" if image.ndim == 2 else "bgr24")
        self._stamp = self.count if time is None else max(round(time / self._base), self._stamp + 1)
        frame.pts, frame.time_base = self._stamp, self._base
        return frame

    def _open(self, image: Image) -> None:
        import av
        from av.video.reformatter import ColorRange

        # Readable at any time, even after a kill: flushed, .mp4 and .mov in fragments.
        options = {"flush_packets": "1"} | ({} if self.path.suffix == ".mkv" else {"movflags": "hybrid_fragmented"})
        self._container = container = av.open(f"file:{self.partial}", "w", options=options)
        if self.lossless:
            codec, settings = "ffv1", {"level": "3", "slicecrc": "1", "g": "1"}
        else:
            codec, settings = "libx264", {"preset": "veryfast", "crf": str(self.crf), "bf": "0", "g": str(max(1, round(self.rate)))}
            if self.threads == 1:
                settings["mbtree"] = "0"  # its look-ahead reads memory that nothing has written
        stream: Any = container.add_stream(codec, rate=self.rate, options=settings)
        stream.width, stream.height = size_of(image)
        stream.pix_fmt = "yuv420p" if not self.lossless else "gray" if image.ndim == 2 else "bgr0"
        stream.codec_context.time_base, stream.codec_context.thread_count = self._base, self.threads
        if not self.lossless:
            stream.codec_context.colorspace, stream.codec_context.color_range = BT601, ColorRange.MPEG
        self._stream = stream
        container.start_encoding()  # creates the file, so that an error is raised now
        self._intact = True

    def _encode(self, frame: VideoFrame | None) -> None:
        try:
            self._container.mux(self._stream.encode(frame))
        except Exception:  # FFmpeg crashes if more is written after a failure; after Ctrl-C the film can be finished
            self._intact = False
            raise

    def _close(self) -> None:
        if self._container is None:
            return
        try:
            if self._intact:
                self._encode(None)
        finally:
            self._container.close()
            self._container = None

    @contextlib.contextmanager
    def _system_errors(self) -> Iterator[None]:
        """Convert errors of the system and FFmpeg to `VideoError`, which states what was saved."""
        import av.error
        from av.codec.codec import UnknownCodecError

        try:
            yield
        except (OSError, av.error.FFmpegError, UnknownCodecError) as error:
            kept = f"; what was written so far is in {self.partial.name}" if self.count else ""
            raise VideoError(f"{self.path}: the film cannot be written ({reason(error)}){kept}") from None
