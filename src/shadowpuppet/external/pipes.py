"""Runs a script on a film: frames go into its standard input, and what it makes of each comes out of its standard output."""

from __future__ import annotations

import contextlib
import subprocess
from collections import deque
from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from pathlib import Path
from threading import Thread
from typing import IO

import numpy as np

from shadowpuppet.errors import SilhouetteError, reason
from shadowpuppet.external.environment import LAST_LINES, last_words, variables
from shadowpuppet.video import Image, Size

PATIENCE = 5.0
"""Seconds that a stopped script has for its end."""


@dataclass(frozen=True)
class Output:
    """How a script writes what it makes."""

    what: str
    """What it makes of frames, such as masks."""
    rule: str
    """How it writes them, for a message about output after the last frame's."""
    read: Callable[[IO[bytes]], tuple[bytes, str]]
    """The next frame's bytes, none where the output ends, and their fault in words if they are not whole."""


@dataclass(frozen=True)
class FilmScript:
    """A script to be run on a film."""

    command: list[str]
    """Its command line; FILM, WIDTH, HEIGHT and `options` are added."""
    name: str
    """The script in messages."""
    film: Path
    size: Size
    """Width and height of the frames."""
    options: tuple[str, ...] = ()

    @property
    def where(self) -> str:
        """Script and film, for a message."""
        return f"{self.name}: {self.film}"

    def outputs(self, frames: Iterable[Image], output: Output) -> Generator[bytes]:
        """What the script writes for a film's frames (H, W, 3), one after another; exactly one for each frame.

        Raises `SilhouetteError`, which names script and film, if the script fails, or does not write one for each frame; and the errors of
        `frames` and `output`.
        """
        process = self._start()
        assert process.stdin is not None, "it is a pipe"
        assert process.stdout is not None, "it is a pipe"
        assert process.stderr is not None, "it is a pipe"
        feeder, listener = _Feeder(process.stdin, frames), _Listener(process.stderr)
        count = 0
        try:
            while (read := output.read(process.stdout))[0] and not read[1]:
                if feeder.finished and count >= feeder.count:
                    raise SilhouetteError(f"{self.where}: found more {output.what} than the film's {feeder.count} frames of "
                                          f"{self.size[0]} x {self.size[1]} pixels; expected {output.rule}")
                yield read[0]
                count += 1
            self._check_end(process, feeder, listener, (count, output.what, read[1] if read[0] else ""))
        finally:
            _stop(process)
            feeder.join(PATIENCE)
            listener.join(PATIENCE)
            for pipe in (process.stdout, process.stderr):
                pipe.close()

    def _start(self) -> subprocess.Popen[bytes]:
        width, height = self.size
        try:
            return subprocess.Popen([*self.command, str(self.film.resolve()), str(width), str(height), *self.options], env=variables(),
                                    stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.PIPE)  # fmt: skip
        except OSError as error:
            raise SilhouetteError(f"{self.name}: {self.command[0]} cannot be started ({reason(error)})") from None

    def _check_end(self, process: subprocess.Popen[bytes], feeder: _Feeder, listener: _Listener, made: tuple[int, str, str]) -> None:
        """Raise an error unless the script ended well after one output a frame. made: their number, what they are, the last one's fault."""
        count, what, fault = made
        code = process.wait()
        feeder.join(PATIENCE)
        listener.join(PATIENCE)
        if feeder.error is not None:
            raise feeder.error
        words = last_words(list(listener.lines))
        if code != 0:
            raise SilhouetteError(f"{self.where}: the script failed after {count} {what} (exit code {code}); its last words: {words}")
        if fault:
            raise SilhouetteError(f"{self.where}: frame {count}: {fault}")
        if not feeder.finished or count != feeder.count:
            of = "" if feeder.finished else " or more"
            raise SilhouetteError(f"{self.where}: found {count} {what}, expected {feeder.count}{of}, one for each frame; the script's last "
                                  f"words: {words}")


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
        self.count, self.finished = 0, False
        self.error: BaseException | None = None
        self.start()

    def run(self) -> None:
        """Write all frames; stop early if the script reads no more."""
        try:
            for image in self.frames:
                self.count += 1
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
