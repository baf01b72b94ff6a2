"""What OpenSim calls our joints, and a skeleton's motion as the coordinates of its full-body model.

Markers are called as Pose2Sim's marker sets for OpenSim call them; coordinates are those of the full-body model of Rajagopal et al.
(2016), which has arms. Its world and its bodies have X forward, Y up, Z to the right, and ball joints turn about Z, then X, then Y.
"""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, continuous_angles
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.motion import JointTable

MARKERS = {
    "pelvis": "CHip", "neck": "Neck", "head": "HeadBase",
    **{f"{side}_{joint}": f"{side[0].upper()}{name}" for side in ("left", "right") for joint, name in (
        ("shoulder", "Shoulder"), ("elbow", "Elbow"), ("wrist", "Wrist"), ("hand", "Middle1"), ("hip", "Hip"), ("knee", "Knee"),
        ("ankle", "Ankle"))},
}  # fmt: skip
"""What a joint of ours is called as a marker. `Head` is the crown there, so the base of the skull has another name."""


Pair = tuple[float, float]


class Ball(NamedTuple):
    """Three coordinates that turn about Z, X and Y of the joint above, one after another."""

    joint: str
    """Of our trees."""
    names: tuple[str, str, str]
    limits: tuple[Pair, Pair, Pair]
    """What is usual, degrees: of the triples of angles that make a turn, the one that strays least is taken."""
    signs: tuple[int, int, int] = (1, 1, 1)


class Hinge(NamedTuple):
    """A coordinate that turns about the axis to the left, or the other way."""

    joint: str
    name: str
    sign: int
    first: bool = False
    """Whether that turn comes before the joint's other one (an ankle's inversion); else after it (an elbow's about the upper arm)."""


COORDINATES: tuple[Ball | Hinge, ...] = (
    Ball("pelvis", ("pelvis_tilt", "pelvis_list", "pelvis_rotation"), ((-90, 90), (-60, 60), (-180, 180))),
    Ball("chest", ("lumbar_extension", "lumbar_bending", "lumbar_rotation"), ((-90, 45), (-60, 60), (-90, 90))),
    *(part for side, s, mirror in (("right", "r", 1), ("left", "l", -1)) for part in (
        Ball(f"{side}_hip", (f"hip_flexion_{s}", f"hip_adduction_{s}", f"hip_rotation_{s}"),
             ((-60, 150), (-90, 60), (-75, 75)), (1, mirror, mirror)),
        Hinge(f"{side}_knee", f"knee_angle_{s}", 1),
        Hinge(f"{side}_ankle", f"ankle_angle_{s}", -1, first=True),
        Ball(f"{side}_shoulder", (f"arm_flex_{s}", f"arm_add_{s}", f"arm_rot_{s}"),
             ((-80, 150), (-140, 50), (-150, 150)), (1, mirror, mirror)),
        Hinge(f"{side}_elbow", f"elbow_flex_{s}", -1),
    )),
)  # fmt: skip
"""In the order of the file. A knee bends by positive angles, an ankle bends up; hips and arms are positive forward, inward, and turned
inward. The upper body's `torso` is the chest. The turn of the head, and an ankle's inversion, about an axis that is not the model's, are
left out."""
PLACES = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
TO_MODEL = np.array([[0.0, 0, 1], [0, 1.0, 0], [-1.0, 0, 0]])
"""From a skeleton's axes at rest (left, up, forward) to the model's (forward, up, right)."""


def marker_names(table: JointTable) -> JointTable:
    """The table with the names of `MARKERS`, turned so that Y is up, as (x, z, -y); joints without such a name keep theirs."""
    return replace(table, names=tuple(MARKERS.get(name, name) for name in table.names), positions=table.positions @ Y_UP.T)


def coordinates(animation: Animation) -> dict[str, Array]:
    """Coordinates of `COORDINATES` and `PLACES` over time, each (T,), rad or metres, of a skeleton that has our joints' names.

    Of known frames angles are continuous; others are not numbers. Where an elbow turns about the upper arm, too, that is the arm's turn.
    Raises `ShadowPuppetError` where the pelvis has no name of ours, or no frame is known.
    """
    known = np.flatnonzero(animation.known)
    if animation.names[0] != "pelvis" or not len(known):
        raise ShadowPuppetError(f"found {len(known)} known frames of a skeleton from {animation.names[0]!r}, expected some, from 'pelvis'")
    turns = {name: animation.rotations[known][:, n] for n, name in enumerate(animation.names)}
    if "torso" in turns:
        turns["chest"] = turns["torso"]
    turns["pelvis"] = Y_UP @ turns["pelvis"] @ TO_MODEL.T
    found: dict[str, Array] = dict(zip(PLACES, (animation.shifts[known, 0] @ Y_UP.T).T))
    for part in COORDINATES:
        if part.joint not in turns or not _turns(turns[part.joint]):
            continue
        if isinstance(part, Hinge):
            found[part.name] = part.sign * _hinge(turns[part.joint], part.first)
        else:
            own = turns[part.joint] if part.joint == "pelvis" else TO_MODEL @ _with_twist(turns, part.joint) @ TO_MODEL.T
            found |= dict(zip(part.names, _angles(own, part).T))
    return {name: _spread(values, known, len(animation.times)) for name, values in found.items()}


def _angles(rotations: Array, part: Ball) -> Array:
    """Coordinates (T, 3) of rotations (T, 3, 3) in the model's axes."""
    signs = np.array(part.signs)
    limits = np.radians([sorted((sign * low, sign * high)) for sign, (low, high) in zip(part.signs, part.limits)])
    return signs * continuous_angles(rotations, "ZXY", limits)


def _turns(rotations: Array) -> bool:
    """Whether a joint of rotations (T, 3, 3) ever turns: an ankle of a body without feet does not."""
    return bool(np.abs(rotations - np.eye(3)).max() > 0)


def _with_twist(turns: dict[str, Array], joint: str) -> Array:
    """A joint's rotations (T, 3, 3); a shoulder's with the turn about the upper arm that the elbow has in an upper body."""
    elbow = joint.replace("shoulder", "elbow")
    if elbow == joint or elbow not in turns:
        return turns[joint]
    R = turns[elbow]  # about y (along the arm) by the twist, then about x by the bend: the first column tells the twist
    c, s = R[:, 0, 0], -R[:, 2, 0]
    twist = np.zeros_like(R)
    twist[:, 0, 0], twist[:, 0, 2], twist[:, 1, 1], twist[:, 2, 0], twist[:, 2, 2] = c, s, 1, -s, c
    return turns[joint] @ twist


def _hinge(R: Array, first: bool) -> Array:
    """The angle (T,) about x in rotations (T, 3, 3), before a turn about z where it is the `first`, else after one about y."""
    return np.unwrap(np.arctan2(-R[:, 1, 2], R[:, 2, 2] if first else R[:, 1, 1]))


def _spread(values: Array, known: NDArray[np.int64], frames: int) -> Array:
    out = np.full(frames, np.nan)
    out[known] = values
    return out
