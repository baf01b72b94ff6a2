"""Frames as JSON: a first message about the person, then one per frame. The schema is in docs/live.md."""

from __future__ import annotations

import json

import numpy as np
from scipy.spatial.transform import Rotation

from shadowpuppet.geometry import Array
from shadowpuppet.live.display.view import rounded
from shadowpuppet.live.stream.outlet import StreamFrame, StreamSubject

FRAME = "right-handed, Z up: the calibration's world, or of a camera that has none its own, X right, Y away from it"
ROTATIONS = "quaternions x, y, z, w, from the axes of who stands at zero with hanging arms (X forward, Y left, Z up) to the world"


def beginning(subject: StreamSubject) -> str:
    """The first message: the person, and what the lists in frames mean."""
    return _text({  # the version is raised by changes that break programs which read the messages
        "type": "begin", "format": "shadowpuppet", "version": 1, "body": subject.body.name, "height": rounded(subject.height, 4),
        "joints": subject.names, "parents": subject.parents, "angles": subject.body.skeleton.dof_names,
        "units": {"time": "s", "length": "m", "angle": "rad"}, "frame": FRAME, "rotations": ROTATIONS,
    })  # fmt: skip


def framed(frame: StreamFrame) -> str:
    """The message of one frame; unknown values are null."""
    rotations = None if frame.rotations is None else Rotation.from_matrix(frame.rotations).as_quat(canonical=True)
    return _text({
        "type": "frame", "time": rounded(frame.time, 6), "status": frame.status, "overlap": rounded(frame.overlap, 4),
        "age": rounded(frame.age, 4), "joints": _numbers(frame.positions, 5), "rotations": _numbers(rotations, 6),
        "angles": _numbers(frame.pose, 5), "statuses": frame.statuses,
    })  # fmt: skip


def _text(value: object) -> str:
    return json.dumps(value, allow_nan=False, separators=(",", ":"))


def _numbers(values: Array | None, digits: int) -> object:
    return None if values is None else (np.round(values, digits) + 0.0).tolist()
