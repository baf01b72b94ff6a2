"""Resting postures: seated on a chair, kneeling upright, lying on the back, each from the first frame to the last.

The pelvis rests over the person's place and gestures move arms and trunk above it; the legs are solved by inverse kinematics, as in
standing. The floor carries the feet of a seated person, knees and insteps of a kneeling one, back and heels of a lying one.
"""

from __future__ import annotations

from typing import Literal

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.movement.gait_cycle import smoothstep
from shadowpuppet.synthetic.movement.gestures import STANDING, Posture, both, trunk
from shadowpuppet.synthetic.person.kinematics import CHANNELS, SIDES, TOE_OUT, LegPlacement, rotations
from shadowpuppet.synthetic.person.mannequin import Mannequin

PostureName = Literal["standing", "seated", "kneeling", "lying"]
SEAT_HEIGHT = 0.47
"""Height of a chair's seat, metres; children sit lower."""
SEAT_LEG_SHARE = 0.94
"""Height of the hollow of the knee over that of the knee's centre: the highest seat on which the soles stay on the floor."""
BACK_REST = 0.17
"""Distance of the back rest behind the middle of a chair's seat, metres."""
BACKWARD = 0.42
"""Distance that the pelvis moves backward to sit down on a chair, leg lengths."""
NOD_LEVER = 0.22
"""Distance by which a radian of nodding moves the back of the head, metres."""
LYING_GESTURES = ("stand", "wave_hands", "reach", "forearms_up", "overhead")
"""Gestures that a lying person can perform: the others move the trunk or the arms into the floor."""

RESTS: dict[str, Posture] = {
    "seated": both(front=20, side=2, roll=-30, elbow=38, supination=-65, wrist_flex=-6) | trunk(pelvis_bow=-4, spine_bow=8),
    "kneeling": trunk(pelvis_bow=2, spine_bow=3),
    "lying": both(front=-7, side=8, elbow=2) | trunk(pelvis_bow=-90, spine_bow=2),
}
"""Values that each posture adds to the channels of a gesture, rad; to an arm's while it hangs."""
RAISED = np.radians(45)
"""Change of an arm's swing and elbow against standing beyond which it no longer hangs, rad."""


def seat_height(body: Mannequin) -> float:
    """Height of the seat that fits a person, metres."""
    return float(min(SEAT_HEIGHT, SEAT_LEG_SHARE * (body.length("shank") + body.length("ankle"))))


def seated_pelvis(body: Mannequin) -> float:
    """Height of a seated person's hips, metres: the seat's and the flesh below the hip, a tenth of it compressed."""
    return seat_height(body) + 0.92 * body.measure("thigh") / (2 * np.pi)


def kneeling_knee(body: Mannequin) -> float:
    """Height of a kneeling person's knee centre, metres."""
    return 0.97 * body.measure("knee") / (2 * np.pi) + 0.012


def chair_place(body: Mannequin, posture: PostureName, turn: float) -> tuple[float, float, float]:
    """Place of the chair's middle to the person's left and ahead, metres, and its scale.

    A standing person sits down behind their place. turn: heading, rad to the left.
    """
    scale = seat_height(body) / SEAT_HEIGHT
    back = body.measure("buttock_depth") / 2 + 0.03
    hips = BACKWARD * (body.length("thigh") + body.length("shank")) if posture == "standing" else 0.0
    ahead = BACK_REST * scale - back - hips
    return float(ahead * np.sin(turn)), float(ahead * np.cos(turn)), scale


def resting_stance(body: Mannequin, posture: PostureName, postures: Array) -> tuple[Array, LegPlacement]:
    """Postures (T, `CHANNELS`) of gestures, changed to those of a resting person, and where pelvis and feet are."""
    postures = _rested(posture, postures)
    if posture == "lying":
        gap = float(_back(body) - (body.measure("head_length") / 2 - 0.008 * body.stature))  # of the head while the neck is straight
        postures[:, CHANNELS.index("head_nod")] -= gap / NOD_LEVER
    yaw = rotations(*np.zeros((2, 1)), postures[:, CHANNELS.index("turn")])
    high, ankles, pitch, knees = {"seated": _seated, "kneeling": _kneeling, "lying": _lying}[posture](body)
    count, out = len(postures), np.array([1, -1]) * (0.35 if posture == "lying" else TOE_OUT)
    feet = np.stack([rotations(*np.zeros((2, 1)), out[n : n + 1]) @ rotations(np.full(1, -pitch), *np.zeros((2, 1))) for n in (0, 1)], 1)
    pelvis = np.broadcast_to([0.0, 0.0, high], (count, 3))
    ahead = np.stack([knees * [1, 1, 1], knees * [-1, 1, 1]])
    return postures, LegPlacement(pelvis, (yaw[:, None] @ ankles[..., None])[..., 0], yaw[:, None] @ feet, np.zeros((count, 2)),
                            (yaw[:, None] @ ahead[..., None])[..., 0])  # fmt: skip


def _rested(posture: PostureName, postures: Array) -> Array:
    """Postures (T, `CHANNELS`) with what `RESTS` adds: to the trunk always, to an arm while it hangs."""
    of, rested = {name: n for n, name in enumerate(CHANNELS)}, postures.copy()
    hangs = {}
    for side in SIDES:
        off = [postures[:, of[f"{side}_{name}"]] - STANDING[f"{side}_{name}"] for name in ("side", "front", "elbow")]
        hangs[side] = 1 - smoothstep(np.linalg.norm(off, axis=0) / RAISED - 0.2)
    for name, value in RESTS[posture].items():
        rested[:, of[name]] += value * hangs.get(name.partition("_")[0], 1.0)
    return rested


def _back(body: Mannequin) -> float:
    """Height of a lying person's hips, metres."""
    return body.measure("buttock_depth") / 2 + 0.01


def _feet(aside: float, ahead: float, up: float) -> Array:
    """Left and right ankle (2, 3), metres, before the person turns."""
    return np.array([[sign * aside, -ahead, up] for sign in (1, -1)])


def _seated(body: Mannequin) -> tuple[float, Array, float, Array]:
    """Height of the pelvis, ankles (2, 3), pitch of the feet (rad, toes up), direction of the left knee (3,): the shanks upright."""
    leg = body.length("thigh") + body.length("shank")
    return seated_pelvis(body), _feet(0.13 * leg, 0.97 * body.length("thigh"), body.length("ankle")), 0.0, np.array([0.1, -1.0, 0.3])


def _kneeling(body: Mannequin) -> tuple[float, Array, float, Array]:
    """The same: the thighs upright, shanks and insteps on the floor."""
    knee = kneeling_knee(body)
    aside, back = float(body.rest()["left_hip"][0]), body.length("shank")
    instep = 0.115 - body.length("ankle")
    return knee + body.length("thigh"), _feet(aside, -0.998 * back, instep), np.radians(-165.0), np.array([0.0, -1.0, -0.5])


def _lying(body: Mannequin) -> tuple[float, Array, float, Array]:
    """The same: on the back, the knees slightly bent, the toes up."""
    leg, long = body.length("thigh") + body.length("shank"), body.measure("foot_length")
    return _back(body), _feet(0.16 * leg, 0.985 * leg, 0.20 * long + 0.015), np.radians(62.0), np.array([0.15, 0.0, 1.0])
