"""A skeleton's motion as coordinates of full-body models for OpenSim.

The models' worlds and bodies have X forward, Y up, Z to the right; ball joints rotate about Z, then X, then Y.
"""

from __future__ import annotations

from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError, warn
from shadowpuppet.geometry import Array, continuous_angles, rotation_about
from shadowpuppet.motion.animation import Y_UP, Animation

Limits = tuple[float, float]


class Ball(NamedTuple):
    """Three coordinates: successive rotations about Z, X and Y."""

    joint: str
    """Joint of the skeleton."""
    names: tuple[str, str, str]
    limits: tuple[Limits, Limits, Limits]
    """Usual ranges, degrees; of equivalent triples of angles, the one least outside these is used."""
    signs: tuple[int, int, int] = (1, 1, 1)


class Hinge(NamedTuple):
    """A coordinate that rotates about an axis of the body at rest, `sign` times."""

    joint: str
    name: str
    sign: int
    first: bool = False
    """Whether this rotation precedes the joint's other one (an ankle's flexion); else it follows it (an elbow's about the upper arm)."""
    axis: Literal["left", "forward"] = "left"
    """About forward, the rotation follows one about the axis to the left."""


ModelJoint = Ball | Hinge
TRUNK = ("lumbar_extension", "lumbar_bending", "lumbar_rotation")


def _trunk(chest: tuple[str, str, str] = TRUNK) -> tuple[ModelJoint, ...]:
    return (Ball("pelvis", ("pelvis_tilt", "pelvis_list", "pelvis_rotation"), ((-90, 90), (-60, 60), (-180, 180))),
            Ball("chest", chest, ((-90, 45), (-60, 60), (-90, 90))))  # fmt: skip


def _leg(side: str, knee: int = 1) -> tuple[ModelJoint, ...]:
    s, mirror = side[0], 1 if side == "right" else -1
    return (Ball(f"{side}_hip", (f"hip_flexion_{s}", f"hip_adduction_{s}", f"hip_rotation_{s}"), ((-60, 150), (-90, 60), (-75, 75)),
                 (1, mirror, mirror)),
            Hinge(f"{side}_knee", f"knee_angle_{s}", knee), Hinge(f"{side}_ankle", f"ankle_angle_{s}", -1, first=True))  # fmt: skip


def _arm(side: str) -> tuple[ModelJoint, ...]:
    s, mirror = side[0], 1 if side == "right" else -1
    return (Ball(f"{side}_shoulder", (f"arm_flex_{s}", f"arm_add_{s}", f"arm_rot_{s}"), ((-80, 150), (-140, 50), (-150, 150)),
                 (1, mirror, mirror)),
            Hinge(f"{side}_elbow", f"elbow_flex_{s}", -1))  # fmt: skip


def _sole(side: str) -> tuple[ModelJoint, ...]:
    return (Hinge(f"{side}_ankle", f"subtalar_angle_{side[0]}", 1 if side == "right" else -1, axis="forward"),)


NECK: tuple[ModelJoint, ...] = (Ball("neck", ("neck_flexion", "neck_bending", "neck_rotation"), ((-90, 60), (-60, 60), (-90, 90))),)


class OsimModel(NamedTuple):
    """A full-body model: its coordinates, and its pelvis' frame."""

    parts: tuple[ModelJoint, ...]
    """In the order of the file."""
    hip: tuple[float, float, float] | None = None
    """Centre of the right hip in the pelvis' frame of the unscaled model, metres; None: the pelvis' frame is our own joint's."""
    heading: float = np.inf
    """Greatest pelvis_rotation, degrees, that the model's clamp admits."""

    def pelvis(self, animation: Animation) -> Array:
        """Origin (3,) of the model's pelvis relative to our pelvis joint, in the pelvis' axes (forward, up, right), metres. The model is
        taken to be scaled so that its hips are as far apart as the skeleton's. Zero for a skeleton without legs."""
        if self.hip is None or "right_hip" not in animation.names:
            return np.zeros(3)
        right, left = (TO_MODEL @ animation.rest[animation.names.index(f"{side}_hip")] for side in ("right", "left"))
        scale = float(np.linalg.norm(right - left)) / (2 * self.hip[2])
        return (right + left) / 2 - scale * np.array([*self.hip[:2], 0.0])


SIDES = ("right", "left")
"""In the models' order."""
MODELS: dict[str, OsimModel] = {
    "rajagopal": OsimModel((*_trunk(), *(part for side in SIDES for part in (*_leg(side), *_arm(side)))), (-0.0563, -0.0785, 0.0773), 90.0),
    "gait2392": OsimModel((*_trunk(), *(part for side in SIDES for part in _leg(side, knee=-1))), (-0.0707, -0.0661, 0.0835), 90.0),
    "pose2sim": OsimModel((*_trunk(("L5_S1_Flex_Ext", "L5_S1_Lat_Bending", "L5_S1_axial_rotation")), *NECK,
                       *(part for side in SIDES for part in (*_leg(side), *_arm(side)))), (-0.0707, -0.0661, 0.0835)),
    "own": OsimModel((*_trunk(), *NECK, *(part for side in SIDES for part in (*_leg(side), *_sole(side), *_arm(side))))),
}  # fmt: skip
"""Models by name: Rajagopal et al. (2016), Delp et al. (1990) as gait2392 (legs and trunk; a bent knee is negative), Pose2Sim's full-body
model, and the one that `write_osim` makes. Else positive: a knee bends, an ankle bends up; hips and arms move forward, inward, and rotate
inward; a sole turns inward. The upper body's `torso` is the chest. An ankle's inversion is the own model's only: its axis is another in the
others, as is the neck in the first two, which have none."""
PELVIS_POSITION = ("pelvis_tx", "pelvis_ty", "pelvis_tz")
SAME = 1e-9
"""Difference of rotations that is rounding."""
TO_MODEL = np.array([[0.0, 0, 1], [0, 1.0, 0], [-1.0, 0, 0]])
"""From a skeleton's axes at rest (left, up, forward) to the model's (forward, up, right)."""


def coordinates(animation: Animation, model: str = "rajagopal") -> dict[str, Array]:
    """A model's coordinates and `PELVIS_POSITION` over time, each (T,), rad or metres, of a skeleton whose joints have our names.

    Angles are continuous over the known frames, NaN in others. An elbow's rotation about the upper arm is added to the shoulder's. Where
    pelvis_rotation would be clamped by the model, the world is rotated about the vertical so that it is not, with a warning.
    Raises `ShadowPuppetError` if the root is not the pelvis, no frame is known, or the model is not one of `MODELS`.
    """
    if model not in MODELS:
        raise ShadowPuppetError(f"model: found {model!r}, expected one of {', '.join(MODELS)}")
    chosen, known = MODELS[model], np.flatnonzero(animation.known)
    if animation.names[0] != "pelvis" or not len(known):
        raise ShadowPuppetError(f"found {len(known)} known frames of a skeleton from {animation.names[0]!r}, expected some, from 'pelvis'")
    turns = {name: animation.rotations[known][:, n] for n, name in enumerate(animation.names)}
    turns |= {name: _as_hinge(R) for name, R in turns.items() if name.endswith("_elbow")}
    if "torso" in turns:
        turns["chest"] = turns["torso"]
    turns["pelvis"] = Y_UP @ turns["pelvis"] @ TO_MODEL.T
    origin = animation.shifts[known, 0] @ Y_UP.T + turns["pelvis"] @ chosen.pelvis(animation)
    found: dict[str, Array] = dict(zip(PELVIS_POSITION, origin.T))
    for part in chosen.parts:
        if part.joint not in turns or (part.joint != "pelvis" and not _rotates(turns[part.joint])):
            continue
        if isinstance(part, Hinge):
            found[part.name] = part.sign * _hinge(turns[part.joint], part)
        else:
            own = turns[part.joint] if part.joint == "pelvis" else TO_MODEL @ _with_twist(turns, part.joint) @ TO_MODEL.T
            found |= dict(zip(part.names, _angles(own, part).T))
    _face_forward(found, np.radians(chosen.heading), model)
    return {name: _spread(values, known, len(animation.times)) for name, values in found.items()}


def _face_forward(found: dict[str, Array], limit: float, model: str) -> None:
    """Rotate the world about Y, in place, where that keeps pelvis_rotation within `limit`, rad; warn if it does, or cannot."""
    heading = found["pelvis_rotation"]
    if np.abs(heading).max() <= limit:
        return
    turn, clamp = -float(heading.min() + heading.max()) / 2, f"{model!r} clamps pelvis_rotation at {np.degrees(limit):.0f} degrees"
    if np.ptp(heading) > 2 * limit:
        warn(f"MOT: pelvis_rotation runs from {np.degrees(heading.min()):.0f} to {np.degrees(heading.max()):.0f} degrees; {clamp}: "
             "clear `clamped` of that coordinate in the model")  # fmt: skip
        return
    found["pelvis_rotation"] = heading + turn
    places = np.stack([found[name] for name in PELVIS_POSITION], 1) @ rotation_about(np.array([0.0, 1, 0]), turn).T
    found |= dict(zip(PELVIS_POSITION, places.T))
    warn(f"MOT: the world is rotated by {np.degrees(turn):.0f} degrees about the vertical, since {clamp}")


def _angles(rotations: Array, part: Ball) -> Array:
    """Coordinates (T, 3) of rotations (T, 3, 3) in the model's axes."""
    signs = np.array(part.signs)
    limits = np.radians([sorted((sign * low, sign * high)) for sign, (low, high) in zip(part.signs, part.limits)])
    return signs * continuous_angles(rotations, "ZXY", limits)


def _rotates(rotations: Array) -> bool:
    """Whether rotations (T, 3, 3) differ from the identity; an ankle's of a body without feet do not."""
    return bool(np.abs(rotations - np.eye(3)).max() > 0)


def _as_hinge(R: Array) -> Array:
    """An elbow's rotations (T, 3, 3) as a twist about the upper arm (y) and then a bend (about x) to the same direction of the forearm;
    those that are so already, such as of straight arms that roll, as they are."""
    if np.abs(R[:, 1, 0]).max() < SAME:
        return R
    along = R[:, :, 1]
    bend = np.hypot(along[:, 0], along[:, 2])
    s, c = (np.divide(along[:, n], bend, out=np.full(len(R), still), where=bend > SAME) for n, still in ((0, 0.0), (2, 1.0)))
    across = np.stack([c, np.zeros(len(R)), -s], 1)
    return np.stack([across, along, np.cross(across, along)], 2)


def _with_twist(turns: dict[str, Array], joint: str) -> Array:
    """A joint's rotations (T, 3, 3); a shoulder's include the rotation about the upper arm, which our upper bodies have in the elbow."""
    elbow = joint.replace("shoulder", "elbow")
    if elbow == joint or elbow not in turns:
        return turns[joint]
    R = turns[elbow]  # about y (along the arm) by the twist, then about x by the bend: the first column has the twist
    c, s = R[:, 0, 0], -R[:, 2, 0]
    twist = np.zeros_like(R)
    twist[:, 0, 0], twist[:, 0, 2], twist[:, 1, 1], twist[:, 2, 0], twist[:, 2, 2] = c, s, 1, -s, c
    return turns[joint] @ twist


def _hinge(R: Array, part: Hinge) -> Array:
    """The angle (T,) of a hinge in rotations (T, 3, 3): about x before one about z (`first`) or after one about y, or about z after x."""
    if part.axis == "forward":
        return np.unwrap(np.arctan2(-R[:, 0, 1], R[:, 0, 0]))
    return np.unwrap(np.arctan2(-R[:, 1, 2], R[:, 2, 2] if part.first else R[:, 1, 1]))


def _spread(values: Array, known: NDArray[np.int64], frames: int) -> Array:
    out = np.full(frames, np.nan)
    out[known] = values
    return out
