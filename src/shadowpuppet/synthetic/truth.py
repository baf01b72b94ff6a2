"""The truth of a synthetic recording: joints, points of the soles and their contact with the floor, as tables."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from shadowpuppet.errors import RecordingError
from shadowpuppet.geometry import Array
from shadowpuppet.io.motion.table import joint_columns
from shadowpuppet.synthetic.movement.gait_cycle import Sole
from shadowpuppet.synthetic.person.kinematics import SEGMENTS, PosedBody
from shadowpuppet.synthetic.person.mannequin import JOINTS, Mannequin

SOLES = ("left_heel", "left_toe", "right_heel", "right_toe")
"""Points on the soles: below the heel bone, over which a foot rolls at contact, and below the tips of the toes."""
CONTACT_HEIGHT, CONTACT_SPEED = 0.02, 0.5
"""A point of a sole is in contact with the floor while it is lower (m) and slower (m/s) than that: in swing the toes pass as low, but ten
times as fast."""
SPEED_STEP = 0.005
"""Seconds before and after a frame between which speeds are measured."""


class Soles(NamedTuple):
    """The points of `SOLES` in T frames."""

    points: Array
    """Of shape (T, 4, 3), metres, world; 0 m high while the sole is flat on the floor."""
    contact: np.ndarray
    """Whether each is in contact with the floor, of shape (T, 4), true or false."""


def sole_points(body: Mannequin, figure: PosedBody) -> Array:
    """The points of `SOLES`, of shape (T, 4, 3), metres, world."""
    sole, found = Sole.of(body), []
    heel = np.array([0.0, sole.heel, -sole.ankle])
    toe = np.array([0.0, -sole.tip, -sole.ankle]) - body.ball()
    for name in SOLES:
        side, point = name.split("_")
        segment = SEGMENTS.index(f"{side}_{'foot' if point == 'heel' else 'toes'}")
        found.append(figure.origin[:, segment] + figure.rotation[:, segment] @ (heel if point == "heel" else toe))
    return np.stack(found, 1)


def soles(body: Mannequin, figure: PosedBody, moving: PosedBody, seconds: Array) -> Soles:
    """The soles of a figure in T frames; moving: the figure shortly before each of them, then shortly after (2 T), `seconds` (T,) apart."""
    points, (before, after) = sole_points(body, figure), np.split(sole_points(body, moving), 2)
    way = np.linalg.norm(after - before, axis=2)
    return Soles(points, (points[..., 2] < CONTACT_HEIGHT) & (way < CONTACT_SPEED * seconds[:, None]))


def write_truth(path: Path, times: Array, joints: Array, rate: float, feet: Soles | None = None,
                absent: np.ndarray | None = None) -> None:
    """Write `<path>.csv` (metres) and `<path>.trc` (millimetres) of joints (T, 17, 3) at times (T,), seconds.

    feet: also written, after the joints; their contacts, 0 or 1, in the .csv only. absent: frames (T,) without the person, in which places
    are "nan" and nothing touches the floor. Raises `RecordingError`.
    """
    names, contacts = JOINTS, np.zeros((len(times), 0), bool)
    if feet is not None:
        joints, names, contacts = np.concatenate([joints, feet.points], 1), (*JOINTS, *SOLES), feet.contact
    if absent is not None and absent.any():
        joints, contacts = np.where(absent[:, None, None], np.nan, joints), contacts & ~absent[:, None]
    rows = joints.reshape(len(joints), -1)
    lines = [",".join([*(f"{value:.5f}" for value in (t, *row)), *(str(int(held)) for held in held_by)])
             for t, row, held_by in zip(times, rows, contacts)]
    flags = [f"{name}_contact" for name in SOLES] if feet is not None else []
    write_lines(path.with_suffix(".csv"), [",".join(["time", *joint_columns(names), *flags]), *lines])
    _write_trc(path.with_suffix(".trc"), times, rows, names, rate)


def _write_trc(path: Path, times: Array, rows: Array, names: Sequence[str], rate: float) -> None:
    """Write markers (T, 3 J), metres, as a TRC file."""
    count = len(rows)
    head = [
        f"PathFileType\t4\t(X/Y/Z)\t{path.name}",
        "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames",
        f"{rate:g}\t{rate:g}\t{count}\t{len(names)}\tmm\t{rate:g}\t1\t{count}",
        "Frame#\tTime\t" + "\t\t\t".join(names),
        "\t\t" + "\t".join(f"{axis}{n}" for n in range(1, len(names) + 1) for axis in "XYZ"),
        "",
    ]
    lines = ["\t".join([str(n), f"{t:.5f}", *(f"{1000 * value:.2f}" for value in row)]) for n, (t, row) in enumerate(zip(times, rows), 1)]
    write_lines(path, [*head, *lines])


def write_lines(path: Path, lines: Sequence[str]) -> None:
    """Write lines of text. Raises `RecordingError` if that fails."""
    try:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    except OSError as error:
        raise RecordingError(f"{path}: cannot be written ({(error.strerror or str(error)).lower()})") from None
