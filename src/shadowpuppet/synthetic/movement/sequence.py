"""The motion of a spec: gestures, actions and walks one after another, joined in standing."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.movement.actions import ACTIONS
from shadowpuppet.synthetic.movement.gait import PathWalk
from shadowpuppet.synthetic.movement.gait_cycle import smoothstep
from shadowpuppet.synthetic.movement.gestures import (
    GESTURES,
    PAUSE_SECONDS,
    clamp_joints,
    duration,
    gesture_postures,
    interpolate_keys,
    involuntary_motion,
    key_postures,
)
from shadowpuppet.synthetic.movement.resting import PostureName, resting_stance
from shadowpuppet.synthetic.person.kinematics import CHANNELS, LegPlacement, PosedBody, planted_stance, pose, pose_over, rotations
from shadowpuppet.synthetic.person.mannequin import Mannequin

if TYPE_CHECKING:
    from shadowpuppet.synthetic.movement.script import Gesture

BLEND_SECONDS = 0.4
"""Seconds before and after a change of parts over which trunk and arms are blended."""
SOFT_LIMIT = 0.015
"""Metres below the legs' limit from which on the pelvis is held down smoothly."""


class MotionPart(Protocol):
    """A part of the motion, beginning and ending upright with the feet side by side."""

    seconds: float

    def at(self, t: Array) -> tuple[Array, LegPlacement]:
        """Postures (T, `CHANNELS`) and stance at its own times (T,), s, from the origin facing -Y."""
        ...


class PlantedGestures:
    """Gestures of `gestures.GESTURES` over planted feet."""

    def __init__(self, body: Mannequin, gestures: Sequence[tuple[str, float]], rng: np.random.Generator) -> None:
        """gestures: `(name, seconds)` one after another."""
        self.body, self.seconds = body, sum(seconds for _, seconds in gestures)
        self.keys = key_postures(gestures, rng)

    def at(self, t: Array) -> tuple[Array, LegPlacement]:
        """As `MotionPart.at`."""
        postures = interpolate_keys(self.keys, np.clip(t + PAUSE_SECONDS, 0, None))
        return postures, planted_stance(self.body, postures)


class FloorPose(NamedTuple):
    """Place on the floor, metres, and heading, rad to the left of -Y."""

    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0


def sequence_seconds(gestures: Sequence[Gesture]) -> float:
    """Seconds from the first to the last frame."""
    if any(gesture.motion == "mocap" for gesture in gestures):
        from shadowpuppet.synthetic.movement.mocap import mocap_seconds as played

        return played(gestures)
    return duration([(gesture.motion, gesture.seconds) for gesture in gestures])


def animate(body: Mannequin, gestures: Sequence[Gesture], t: Array, rng: np.random.Generator, still: float = 1.0, turn: float = 0.0,
            posture: PostureName = "standing") -> PosedBody:
    """The figure of `body` at times `t` (T,), s; it stands for `PAUSE_SECONDS` before the first of `gestures`.

    still: factor on sway and tremor. turn: initial heading, rad to the left of -Y. The area covered in walking is centred at the origin.
    posture: the one in which the person performs gestures of arms and trunk; all other motions begin and end standing.
    A motion from a file cannot be combined with others (see `mocap.animate_mocap`).
    """
    if any(gesture.motion == "mocap" for gesture in gestures):
        from shadowpuppet.synthetic.movement.mocap import animate_mocap

        return animate_mocap(body, gestures, t, turn)
    if all(gesture.motion in GESTURES for gesture in gestures):
        postures = gesture_postures([(g.motion, g.seconds) for g in gestures], t, rng, still)
        postures[:, CHANNELS.index("turn")] += turn
        if posture != "standing":
            return pose_over(body, *resting_stance(body, posture, postures))
        return pose(body, postures)
    parts = _parts(body, gestures, rng)
    postures, stance = _joined(parts, t, turn)
    restless = still * involuntary_motion(t, rng)
    sway = restless[:, [CHANNELS.index("sway_x"), CHANNELS.index("sway_y")]]
    postures = clamp_joints(postures + restless)
    shift = _middle(parts, turn) if any(gesture.motion in ("walk", "jog") for gesture in gestures) else np.zeros(3)
    moved = stance._replace(pelvis=stance.pelvis - shift + np.column_stack([sway, 0 * t]), ankles=stance.ankles - shift)
    return pose_over(body, postures, moved, SOFT_LIMIT)


def _middle(parts: Sequence[MotionPart], turn: float) -> Array:
    """The middle (3,) of the area that the person covers in the whole motion."""
    whole = np.arange(0, PAUSE_SECONDS + sum(part.seconds for part in parts), 0.05)
    places = _joined(parts, whole, turn)[1].pelvis[:, :2]
    return np.append((places.max(0) + places.min(0)) / 2, 0.0)


def _parts(body: Mannequin, gestures: Sequence[Gesture], rng: np.random.Generator) -> list[MotionPart]:
    """The parts of the motion; consecutive gestures over planted feet are one part."""
    parts: list[MotionPart] = []
    waiting: list[tuple[str, float]] = []
    for gesture in (*gestures, None):
        if gesture is not None and gesture.motion in GESTURES:
            waiting.append((gesture.motion, gesture.seconds))
            continue
        if waiting:
            parts.append(PlantedGestures(body, waiting, rng))
            waiting = []
        if gesture is not None and gesture.motion in ACTIONS:
            parts.append(ACTIONS[gesture.motion](body, gesture.seconds, rng))
        elif gesture is not None:
            jogging = gesture.motion == "jog"
            parts.append(PathWalk(body, gesture.seconds, rng, jogging, gesture.speed, gesture.path, gesture.size))
    return parts


def _joined(parts: Sequence[MotionPart], t: Array, turn: float) -> tuple[Array, LegPlacement]:
    """Postures and stance of `parts`, each starting where the one before ended, with trunk and arms blended."""
    begin, place = PAUSE_SECONDS, FloorPose(turn=turn)
    postures, pieces, of = np.zeros((len(t), len(CHANNELS))), [], np.zeros(len(t), int)
    for n, part in enumerate(parts):
        end = begin + part.seconds
        own, stance = _placed(*part.at(np.clip(t - begin, -BLEND_SECONDS, part.seconds + BLEND_SECONDS)), place)
        enters = smoothstep((t - begin) / (2 * BLEND_SECONDS) + 0.5) if n else 1.0
        leaves = smoothstep((end - t) / (2 * BLEND_SECONDS) + 0.5) if n + 1 < len(parts) else 1.0
        postures += np.multiply(enters, leaves)[..., None] * own
        pieces.append(stance)
        of[t >= begin] = n
        last, at_end = _placed(*part.at(np.array([part.seconds])), place)
        middle = at_end.ankles[0].mean(0)
        place, begin = FloorPose(float(middle[0]), float(middle[1]), float(last[0, CHANNELS.index("turn")])), end
    which = (of, np.arange(len(t)))
    return postures, LegPlacement(*(np.stack(values)[which] for values in zip(*pieces)))


def _placed(postures: Array, stance: LegPlacement, place: FloorPose) -> tuple[Array, LegPlacement]:
    """Postures and stance moved to `place`."""
    R = rotations(*np.zeros((2, 1)), np.array([place.turn]))[0]
    shift = np.array([place.x, place.y, 0.0])
    postures = postures.copy()
    postures[:, CHANNELS.index("turn")] += place.turn
    high = np.column_stack([stance.pelvis[:, :2], np.zeros(len(postures))]) @ R.T + shift
    pelvis = np.column_stack([high[:, :2], stance.pelvis[:, 2]])
    return postures, LegPlacement(pelvis, stance.ankles @ R.T + shift, R @ stance.feet, stance.toes, stance.ahead @ R.T)
