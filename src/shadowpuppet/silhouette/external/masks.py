"""Runs a segmentation script on a film: frames go into its standard input, masks come out of its standard output."""

from __future__ import annotations

import contextlib
import subprocess
from collections import deque
from collections.abc import Generator, Iterable
from pathlib import Path
from threading import Thread
from typing import IO

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import SilhouetteError, reason
from shadowpuppet.silhouette.external.environment import LAST_LINES, last_words, variables
from shadowpuppet.silhouette.external.ready_mask import ready_mask
from shadowpuppet.video import Image, Size

PATIENCE = 5.0
"""Seconds that a stopped script has for its end."""


def external_masks(command: list[str], name: str, film: Path, size: Size, frames: Iterable[Image]) -> Generator[Mask]:
    """Masks (H, W) that a script makes of a film's frames (H, W, 3), one after another; exactly one for each frame.

    command: the script's command line; FILM, WIDTH and HEIGHT are added. name: the script in messages. size: width and height.
    Raises `SilhouetteError`, which names script, film and frame, if the script fails, or its masks are not as many as the frames, not of
    their size, or no masks; and the errors of `frames`.
    """
    width, height = size
    try:
        process = subprocess.Popen([*command, str(film.resolve()), str(width), str(height)], env=variables(), stdin=subprocess.PIPE,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # fmt: skip
    except OSError as error:
        raise SilhouetteError(f"{name}: {command[0]} cannot be started ({reason(error)})") from None
    assert process.stdin is not None, "it is a pipe"
    assert process.stdout is not None, "it is a pipe"
    assert process.stderr is not None, "it is a pipe"
    feeder, listener = _Feeder(process.stdin, frames), _Listener(process.stderr)
    count, where = 0, f"{name}: {film}"
    try:
        while len(data := process.stdout.read(width * height)) == width * height:
            if feeder.finished and count >= feeder.count:
                raise SilhouetteError(f"{where}: found more masks than the film's {feeder.count} frames of {width} x {height} pixels; "
                                      "expected one byte a pixel and one mask a frame: has the script printed to standard output, or "
                                      "written numbers of more than 8 bits?")
            yield _checked(data, size, where, count)
            count += 1
        _check_end(process, feeder, listener, where, count, data)
    finally:
        _stop(process)
        feeder.join(PATIENCE)
        listener.join(PATIENCE)
        for pipe in (process.stdout, process.stderr):
            pipe.close()


def _checked(data: bytes, size: Size, where: str, n: int) -> Mask:
    try:
        return ready_mask(np.frombuffer(data, np.uint8).reshape(size[::-1]))
    except SilhouetteError as error:
        raise SilhouetteError(f"{where}: frame {n}: {error}") from None


def _check_end(process: subprocess.Popen[bytes], feeder: _Feeder, listener: _Listener, where: str, count: int, rest: bytes) -> None:
    """Raise an error unless the script ended well after one mask a frame."""
    code = process.wait()
    feeder.join(PATIENCE)
    listener.join(PATIENCE)
    if feeder.error is not None:
        raise feeder.error
    if code != 0:
        raise SilhouetteError(f"{where}: the script failed after {count} masks (exit code {code}); its last words: "
                              f"{last_words(list(listener.lines))}")
    if rest:
        raise SilhouetteError(f"{where}: frame {count}: found {len(rest)} bytes, expected the frame's width x height = "
                              f"{feeder.pixels} bytes, one a pixel")
    if not feeder.finished or count != feeder.count:
        of = "" if feeder.finished else " or more"
        raise SilhouetteError(f"{where}: found {count} masks, expected {feeder.count}{of}, one for each frame; the script's last words: "
                              f"{last_words(list(listener.lines))}")


def _stop(process: subprocess.Popen[bytes]) -> None:
    """End a process, gently at first: uv passes that on to the script."""
    if process.poll() is None:
        process.terminate()
        try:
            process.wait(PATIENCE)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


class _Feeder(Thread):
    """Writes frames into a pipe, and closes it."""

    def __init__(self, pipe: IO[bytes], frames: Iterable[Image]) -> None:
        super().__init__(daemon=True, name="frames")
        self.pipe, self.frames = pipe, frames
        self.count, self.pixels, self.finished = 0, 0, False
        self.error: BaseException | None = None
        self.start()

    def run(self) -> None:
        """Write all frames; stop early if the script reads no more."""
        try:
            for image in self.frames:
                self.count, self.pixels = self.count + 1, image.shape[0] * image.shape[1]
                self.pipe.write(np.ascontiguousarray(image).data)
                self.pipe.flush()
            self.finished = True
        except OSError:
            self.finished = False  # the script closed its input
        except BaseException as error:
            self.error = error
        finally:
            with contextlib.suppress(OSError):
                self.pipe.close()


class _Listener(Thread):
    """Keeps the last lines of a pipe."""

    def __init__(self, pipe: IO[bytes]) -> None:
        super().__init__(daemon=True, name="errors")
        self.pipe, self.lines = pipe, deque[str](maxlen=4 * LAST_LINES)
        self.start()

    def run(self) -> None:
        """Read to the end."""
        with contextlib.suppress(OSError, ValueError):
            while line := self.pipe.readline(10_000):
                self.lines.append(line.decode("utf-8", "replace"))
