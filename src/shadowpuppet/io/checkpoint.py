"""What a run needs to go on after it was killed: `checkpoint.npz`, the state after some frame, and `checkpoint.frames`, the frames exactly.

Frames are flushed one by one, so that they reach at least as far as the checkpoint. The run's tables are written again from them.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from shadowpuppet.errors import FormatError, ShadowPuppetError, reason
from shadowpuppet.geometry import Array
from shadowpuppet.io.files.nested import read_nested, write_nested
from shadowpuppet.motion.limbs import LIMBS
from shadowpuppet.motion.motion import SCALARS, STATUSES, Mode, MotionFrame

STATE, FRAMES = "checkpoint.npz", "checkpoint.frames"
MODES = 6
"""Greatest number of modes of a frame: three of each arm."""


class Checkpoint(NamedTuple):
    """A run after one of its frames."""

    frames: int
    """Number of frames."""
    state: Any
    """State that the next frame needs, as `io.files.nested` can write it."""


def write_checkpoint(folder: Path, checkpoint: Checkpoint) -> None:
    """Replace a run's checkpoint, completely or not at all. Raises `ShadowPuppetError` if it cannot be written."""
    write_nested(folder / STATE, checkpoint)


def read_checkpoint(folder: Path, types: Iterable[type]) -> Checkpoint | None:
    """A run's checkpoint, None if it has none; `types`: the named tuples in its state. Raises `FormatError`."""
    if not (folder / STATE).exists():
        return None
    found = read_nested(folder / STATE, [*types, Checkpoint])
    if not isinstance(found, Checkpoint):
        raise FormatError(f"{folder / STATE}: found another content, expected a run's checkpoint")
    return found


def frame_bytes(frame: MotionFrame) -> bytes:
    """A frame as `MotionBuilder.append` returns it: numbers and arrays, its modes, then the indices of its statuses. Raises
    `ShadowPuppetError` for more than `MODES` modes."""
    if len(frame.modes) > MODES:
        raise ShadowPuppetError(f"modes: found {len(frame.modes)} in a frame, expected {MODES} at most")
    modes = np.full((MODES, 2 + np.asarray(frame.joints).size), np.nan)
    for row, mode in zip(modes, frame.modes):
        row[:] = [LIMBS.index(mode.limb), mode.weight, *mode.joints.ravel()]
    statuses = [STATUSES.index(each) for each in (frame.status, *(frame.limb_status or ()))]
    head = [frame.time, *(getattr(frame, name) for name in SCALARS)]
    parts = (head, frame.pose, frame.pose_sd, frame.joints, frame.joint_sd, modes, statuses)
    return np.concatenate([np.asarray(part, float).ravel() for part in parts]).tobytes()


def read_frames(folder: Path, number: int, dofs: int, joints: int, limbs: int) -> list[MotionFrame]:
    """The first `number` frames of a run. Raises `FormatError` if there are fewer."""
    path, width = folder / FRAMES, 2 + len(SCALARS) + 2 * dofs + 6 * joints + MODES * (2 + 3 * joints) + limbs
    try:
        values = np.fromfile(path, float, number * width)
    except OSError as error:
        raise FormatError(f"{path}: cannot be read ({reason(error)})") from None
    if len(values) != number * width:
        raise FormatError(f"{path}: found {len(values) // width} frames, expected {number}")
    return [_frame(row, dofs, joints) for row in values.reshape(number, width)]


def _frame(row: Array, dofs: int, joints: int) -> MotionFrame:
    sizes = [1 + len(SCALARS), dofs, dofs, 3 * joints, 3 * joints, MODES * (2 + 3 * joints)]
    head, pose, pose_sd, places, places_sd, others, statuses = np.split(row, np.cumsum(sizes))
    modes = [Mode(LIMBS[int(each[0])], float(each[1]), each[2:].reshape(joints, 3)) for each in others.reshape(MODES, -1) if each[0] >= 0]
    status, *limbs = (STATUSES[int(each)] for each in statuses)
    return MotionFrame(float(head[0]), status, pose, places.reshape(joints, 3), pose_sd, places_sd.reshape(joints, 3),
                       limb_status=tuple(limbs), modes=modes, **dict(zip(SCALARS, head[1:].tolist())))


def open_frames(folder: Path, frames: Sequence[MotionFrame]) -> BinaryIO:
    """The file of a run's frames, to go on after these, which are its first. Raises `OSError`."""
    file = (folder / FRAMES).open("r+b" if frames else "wb")
    file.seek(sum(map(len, map(frame_bytes, frames))))
    file.truncate()
    return file
