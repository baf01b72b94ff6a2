"""Streams a recorded run to other programs at its own rate, like a live session."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.models import make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import FormatError
from shadowpuppet.geometry import Array
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import read_run
from shadowpuppet.live.display.view import LiveListener
from shadowpuppet.live.interrupt import Stop
from shadowpuppet.live.stream.outlet import Outlets, StreamSubject
from shadowpuppet.motion.body_animation import base_in_world
from shadowpuppet.motion.motion import Motion, MotionFrame

NAP = 0.05
"""Longest sleep, seconds, between checks for Ctrl-C."""
MOVED = 0.01
"""Change of the body's frame, in metres and radians, above which the person was measured again."""
UNMOVED = 2e-3
"""Difference of the body's frame from the world's up to which they are equal: the run has several calibrated cameras, and the floor is at
Z = 0."""


def play_run(folder: str | Path, outlets: Outlets, listener: LiveListener | None = None, *, speed: float = 1.0, loop: bool = False,
             clock: Callable[[], float] = time.monotonic, sleep: Callable[[float], None] = time.sleep) -> int:
    """Send every frame of a run to outlets when it is due, until the run's end, or with `loop` until Ctrl-C. Returns the number sent.

    `speed`: ratio to the run's own rate. With `loop`, times keep increasing when the run begins again. Raises a `ShadowPuppetError` if the
    run cannot be read, has no person.toml, which rotations need, or has no frame with a pose.
    """
    listener = listener or LiveListener()
    with outlets, Stop() as stop:
        played = _read(Path(folder))
        motion, given, base = played.motion, 0, np.full((4, 4), np.inf)
        listener.note(f"given to other programs: {outlets.where}")
        listener.begin("playing", None if loop else len(motion))
        begun = clock()
        for n, frame in _frames(motion, loop):
            due = begun + (frame.time - motion.times[0]) / speed
            while (left := due - clock()) > 0 and not stop.wished:
                sleep(min(left, NAP))
            if stop.wished:
                break
            if np.isfinite(motion.poses[n]).all() and np.abs(played.bases[n] - base).max() > MOVED:
                base = played.bases[n]
                outlets.begin(StreamSubject(played.body, base, played.height, 0.0 if np.abs(base - np.eye(4)).max() < UNMOVED else None))
            outlets.follow(frame, max(clock() - due, 0.0))
            given += 1
            listener.advance(given)
            if said := outlets.trouble():
                listener.trouble(said)
    return given


class _Played(NamedTuple):
    """A run, and the body that the joints' rotations are computed with."""

    motion: Motion
    body: Body
    height: float | None
    """Height with shoes, metres; None if unknown."""
    bases: Array
    """The body's frame in the world, (T, 4, 4)."""


def _read(folder: Path) -> _Played:
    motion, path = read_run(folder).motion, folder / "person.toml"
    if not path.exists():
        raise FormatError(f"{path}: found no such file, expected the person's sizes, which rotations of joints need")
    person = read_person(path, motion.body_name)
    body = make_body(motion.body_name, person.sizes)
    if motion.dof_names != body.skeleton.dof_names:
        raise FormatError(f"{folder}: found degrees of freedom that are not those of the body {body.name!r}")
    return _Played(motion, body, person.height, np.broadcast_to(base_in_world(body, motion)[0], (len(motion), 4, 4)))


def _frames(motion: Motion, loop: bool) -> Iterator[tuple[int, MotionFrame]]:
    """Yields each frame with its number; with `loop` endlessly, at increasing times."""
    step = float(np.median(np.diff(motion.times))) if len(motion) > 1 else 1.0
    length = float(motion.times[-1] - motion.times[0]) + step
    for turn in count() if loop else (0,):
        for n, frame in enumerate(motion.frames()):
            yield n, frame._replace(time=frame.time + turn * length, pose_sd=None, joint_sd=None)
