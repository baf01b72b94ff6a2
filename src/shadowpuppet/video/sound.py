"""Reads the sound of films through PyAV, on the clock of their pictures."""

from __future__ import annotations

import contextlib
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.video.container import opened

if TYPE_CHECKING:
    from av.container import InputContainer

LONGEST_GAP = 60.0
"""Seconds; sound that pauses for longer by its time stamps is read up to there."""


class Sound(NamedTuple):
    """The sound of a film, all channels mixed."""

    samples: NDArray[np.float32]
    """Of shape (N,), -1..1; pauses are zeros."""
    rate: int
    """Samples/s."""
    begin: float
    """Time of the first sample, seconds after the film's first picture."""


def read_sound(path: Path, rate: int, longest: float) -> Sound | None:
    """The first `longest` seconds of a film's sound, resampled to `rate`; None if it has none. A damaged film's sound ends at the break.

    Raises `VideoError` if the film cannot be opened.
    """
    with opened(path) as (container, pictures):
        first_picture = float((pictures.start_time or 0) * pictures.time_base) if pictures.time_base is not None else 0.0
        if not container.streams.audio:
            return None
        samples, begin = _decoded(container, rate, longest)
    return Sound(samples, rate, begin - first_picture) if len(samples) else None


def _decoded(container: InputContainer, rate: int, longest: float) -> tuple[NDArray[np.float32], float]:
    """Samples (N,) and the time stamp of the first, seconds."""
    import av
    from av.error import FFmpegError

    resampler = av.AudioResampler(format="fltp", layout="mono", rate=rate)
    parts, count, begin = [np.zeros(0, np.float32)], 0, 0.0
    with contextlib.suppress(FFmpegError):
        for frame in container.decode(audio=0):
            at = frame.time if frame.time is not None else begin + count / rate
            begin = at if count == 0 else begin
            pause = round((at - begin) * rate) - count  # of the resampler's delay, or of sound that was not recorded
            if pause > rate * LONGEST_GAP:
                break
            if pause > rate // 10:
                parts.append(np.zeros(pause, np.float32))
                count += pause
            for piece in resampler.resample(frame):
                parts.append(piece.to_ndarray()[0].astype(np.float32))
                count += piece.samples
            if count > longest * rate:
                break
    return np.concatenate(parts)[: round(longest * rate)], begin
