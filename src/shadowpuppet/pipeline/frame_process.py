"""Frame sets of several cameras, made by a process of their own.

Threads of one Python process wait for each other whenever they are not in OpenCV or a kernel: silhouettes made by a thread slow tracking
down while a core is idle. Another process does not. The sets are the same.
"""

from __future__ import annotations

import os
import pickle
import queue
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Generator
from contextlib import closing, suppress
from dataclasses import dataclass
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.colour_codes import colour_codes
from shadowpuppet.camera.mask import half_size
from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning, warn
from shadowpuppet.pipeline.rig import FrameSet, Rig, read_frames
from shadowpuppet.pipeline.silhouettes import Silhouettes, segments_of
from shadowpuppet.threads import child_environment, usable_cores
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull

WORTHWHILE = 100_000_000
"""Number of pixels of all films from which on a process pays for its start, one to two seconds: 65 sets of five cameras of 640 x 480."""
AHEAD = 2
"""Number of frame sets that may wait for the tracker."""
NICE = 10
"""By how much the process yields to the tracker, which has to wait for nothing else."""
GRACE = 5.0
"""Time (s) that a process has to end."""


@dataclass(frozen=True, eq=False)
class Task:
    """The frame sets that are wanted of a recording."""

    rig: Rig
    silhouettes: tuple[Silhouettes, ...]
    """Of each camera; empty if keypoints alone are evidence."""
    ready: bool = False
    """Whether ready silhouettes are read."""
    every: int = 1
    images: bool = True
    """Whether `FrameSet.images` are wanted."""
    corrected: bool = True
    """Whether `FrameSet.corrected` are wanted, at half size: every second pixel of every second row."""
    codes: bool = False
    """Whether the colours (`Seen.codes`) of several cameras are wanted."""
    hull: VisualHull | None = None
    """Computes `FrameSet.points`; None: they are not wanted."""

    def frames(self) -> Generator[FrameSet]:
        """The frame sets, made here."""
        with closing(read_frames(self.rig, segments_of(self.rig, self.silhouettes), ready=self.ready, every=self.every)) as frames:
            for each in frames:
                begin = time.perf_counter()
                points = None if self.hull is None else self.hull.points(each.seen.masks)
                images = each.images if self.images else (None,) * len(each.images)
                corrected = tuple(None if image is None else half_size(image) for image in each.corrected) if self.corrected else ()
                seen = each.seen
                if self.codes and any(image is not None for image in each.corrected):
                    seen = seen._replace(codes=tuple(map(colour_codes, each.corrected)))
                yield each._replace(images=images, seen=seen, corrected=corrected, points=points, carving=time.perf_counter() - begin)

    @property
    def is_long(self) -> bool:
        """Whether the films are worth a process; those that do not state their lengths may be short."""
        sizes, count = [footage.camera.size for footage in self.rig.footage], self.rig.count
        return count is not None and count // self.every * sum(width * height for width, height in sizes) >= WORTHWHILE


class _Message(NamedTuple):
    """What the process sends: a frame set, an error, or neither at the end."""

    seen: FrameSet | None = None
    warnings: tuple[Warning | str, ...] = ()
    error: Exception | None = None


def frames_beside(task: Task) -> Generator[FrameSet]:
    """The task's frame sets: those of long films of several cameras are made by another process if there is a core for it.

    Raises what `read_frames` does, and `ShadowPuppetError` if the process is killed.
    """
    if not task.rig.is_multiview or not task.is_long or usable_cores() < 2 or getattr(sys, "frozen", False):
        return task.frames()
    try:
        return _received(pickle.dumps(task, pickle.HIGHEST_PROTOCOL))
    except (TypeError, AttributeError, pickle.PicklingError):  # it holds an object of OpenCV, or a function without a place in a module
        return task.frames()


def _received(packed: bytes) -> Generator[FrameSet]:
    """The frame sets that another process makes of a packed task."""
    windows = os.name == "nt"  # Ctrl-C is for this process alone
    process = subprocess.Popen([sys.executable, "-P", "-c", f"from {__name__} import main; main()"], env=child_environment({}),
                               stdin=subprocess.PIPE, stdout=subprocess.PIPE, creationflags=0x200 if windows else 0,
                               process_group=None if windows else 0)
    messages, ended = queue.Queue[_Message](AHEAD), threading.Event()
    thread = threading.Thread(target=_converse, args=(process, packed, messages, ended), name="frames", daemon=True)
    thread.start()
    try:
        while (message := _next(messages, thread)) is not None:
            for each in message.warnings:
                if isinstance(each, ShadowPuppetWarning):
                    warn(str(each))
                else:
                    warnings.warn(each, stacklevel=2)
            if message.error is not None:
                raise message.error
            if message.seen is None:
                return
            yield message.seen
        with suppress(subprocess.TimeoutExpired):
            process.wait(GRACE)
        raise ShadowPuppetError(f"the process that makes silhouettes ended with code {process.returncode}, as when memory runs out; "
                                "SHADOWPUPPET_THREADS=1 does without it")
    finally:
        ended.set()
        process.kill()
        with suppress(queue.Empty):
            messages.get_nowait()  # if the thread waits for room
        thread.join()
        process.wait()


def _next(messages: queue.Queue[_Message], thread: threading.Thread) -> _Message | None:
    """The next message; None if the thread has ended without one."""
    while True:
        alive = thread.is_alive()
        with suppress(queue.Empty):
            return messages.get(timeout=1.0 if alive else 0.001)  # on Windows, Ctrl-C is heard between waits
        if not alive:
            return None


def _converse(process: subprocess.Popen[bytes], packed: bytes, messages: queue.Queue[_Message], ended: threading.Event) -> None:
    """Send the process its task, and queue its messages, until it ends or is to end."""
    assert process.stdin is not None
    assert process.stdout is not None
    with suppress(OSError, EOFError), process.stdout as made:
        with process.stdin as given:
            given.write(packed)
        while not ended.is_set():
            messages.put(_read(made))


def _write(file: BinaryIO, message: _Message) -> None:
    """Write a message: the number of its parts, the length of each, and the parts, which are arrays but for the first."""
    buffers = list[pickle.PickleBuffer]()
    parts = [pickle.dumps(message, pickle.HIGHEST_PROTOCOL, buffer_callback=buffers.append), *(each.raw() for each in buffers)]
    file.write(np.array([len(parts), *(len(part) for part in parts)]).tobytes())
    for part in parts:
        file.write(part)
    file.flush()


def _read(file: Any) -> _Message:
    """Read what `_write` has written. Raises `EOFError` if it is cut off."""
    (number,) = _bytes(file, 8).view(np.int64)
    message, *buffers = (_bytes(file, length) for length in _bytes(file, 8 * number).view(np.int64))
    return pickle.loads(message.data, buffers=buffers)


def _bytes(file: Any, length: int) -> NDArray[np.uint8]:
    out = np.empty(length, np.uint8)
    view = out.data
    while view:
        if not (read := file.readinto(view)):
            raise EOFError
        view = view[read:]
    return out


def main() -> None:
    """Make the frame sets of the task on standard input, in the process that `frames_beside` starts."""
    if hasattr(os, "nice"):
        os.nice(NICE)
    made = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what libraries print is no message
    with suppress(BrokenPipeError), warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            with closing(pickle.load(sys.stdin.buffer).frames()) as frames:
                for seen in frames:
                    _write(made, _Message(seen, _taken(caught)))
            _write(made, _Message(warnings=_taken(caught)))
        except BrokenPipeError:  # no frame set is wanted any more
            raise
        except Exception as error:
            _write(made, _Message(warnings=_taken(caught), error=error))


def _taken(caught: list[warnings.WarningMessage]) -> tuple[Warning | str, ...]:
    """Caught warnings, which are then forgotten."""
    taken = tuple(each.message for each in caught)
    caught.clear()
    return taken
