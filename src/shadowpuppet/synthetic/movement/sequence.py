"""A whole performance: gestures, acts and walks one after another, joined where the person stands."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.movement.actions import ACTS
from shadowpuppet.synthetic.movement.gait import Walk
from shadowpuppet.synthetic.movement.gait_cycle import smooth
from shadowpuppet.synthetic.movement.gestures import LEAD, MOTIONS, compose, duration, involuntary, keys_of, settled, through
from shadowpuppet.synthetic.person.kinematics import CHANNELS, Figure, Stance, figure, planted, pose, turns
from shadowpuppet.synthetic.person.mannequin import Mannequin

if TYPE_CHECKING:
    from shadowpuppet.synthetic.movement.script import Gesture

BLEND = 0.4
"""Seconds before and after the change from one part to the next over which trunk and arms go from one to the other."""
SOFT = 0.015
"""Metres below the height that the legs allow from which on the pelvis is held down."""


class Part(Protocol):
    """Something the person does, beginning and ending upright with the feet beside each other."""

    seconds: float

    def at(self, t: Array) -> tuple[Array, Stance]:
        """Postures (T, `CHANNELS`) and stance at its own times (T,), s, from the origin facing -Y."""
        ...


class Standing:
    """Gestures of `motions.MOTIONS` over planted feet."""

    def __init__(self, body: Mannequin, gestures: Sequence[tuple[str, float]], rng: np.random.Generator) -> None:
        """Of gestures `(name, seconds)` one after another."""
        self.body, self.seconds = body, sum(seconds for _, seconds in gestures)
        self.keys = keys_of(gestures, rng)

    def at(self, t: Array) -> tuple[Array, Stance]:
        """As `Part.at`."""
        postures = through(self.keys, np.clip(t + LEAD, 0, None))
        return postures, planted(self.body, postures)


class Place(NamedTuple):
    """Where the person stands, and their heading, rad to the left of -Y."""

    x: float = 0.0
    y: float = 0.0
    turn: float = 0.0


def seconds_of(gestures: Sequence[Gesture]) -> float:
    """Seconds from the first to the last picture."""
    if any(gesture.motion == "mocap" for gesture in gestures):
        from shadowpuppet.synthetic.movement.mocap import seconds_of as played

        return played(gestures)
    return duration([(gesture.motion, gesture.seconds) for gesture in gestures])


def perform(
    body: Mannequin, gestures: Sequence[Gesture], t: Array, rng: np.random.Generator, still: float = 1.0, turn: float = 0.0
) -> Figure:
    """The figure of `body` at times `t` (T,), s, `LEAD` of which it stands before the first of `gestures`.

    still: factor on sway and tremor. turn: heading at the beginning, rad to the left of -Y. Who goes somewhere does so about the
    origin: the middle of the area they cover lies there. A motion from a file stands alone (see `mocap.play`).
    """
    if any(gesture.motion == "mocap" for gesture in gestures):
        from shadowpuppet.synthetic.movement.mocap import play

        return play(body, gestures, t, turn)
    if all(gesture.motion in MOTIONS for gesture in gestures):
        postures = compose([(g.motion, g.seconds) for g in gestures], t, rng, still)
        postures[:, CHANNELS.index("turn")] += turn
        return pose(body, postures)
    parts = _parts(body, gestures, rng)
    postures, stance = _joined(parts, t, turn)
    restless = still * involuntary(t, rng)
    sway = restless[:, [CHANNELS.index("sway_x"), CHANNELS.index("sway_y")]]
    postures = settled(postures + restless)
    shift = _middle(parts, turn) if _goes(gestures) else np.zeros(3)
    moved = stance._replace(pelvis=stance.pelvis - shift + np.column_stack([sway, 0 * t]), ankles=stance.ankles - shift)
    return figure(body, postures, moved, SOFT)


def _middle(parts: Sequence[Part], turn: float) -> Array:
    """The middle (3,) of the area that the person covers, whatever times are shown."""
    whole = np.arange(0, LEAD + sum(part.seconds for part in parts), 0.05)
    places = _joined(parts, whole, turn)[1].pelvis[:, :2]
    return np.append((places.max(0) + places.min(0)) / 2, 0.0)


def _goes(gestures: Sequence[Gesture]) -> bool:
    """Whether the person leaves their place."""
    return any(gesture.motion in ("walk", "jog") for gesture in gestures)


def _parts(body: Mannequin, gestures: Sequence[Gesture], rng: np.random.Generator) -> list[Part]:
    """The parts of a performance: gestures over planted feet that follow each other are one."""
    parts: list[Part] = []
    waiting: list[tuple[str, float]] = []
    for gesture in (*gestures, None):
        if gesture is not None and gesture.motion in MOTIONS:
            waiting.append((gesture.motion, gesture.seconds))
            continue
        if waiting:
            parts.append(Standing(body, waiting, rng))
            waiting = []
        if gesture is not None and gesture.motion in ACTS:
            parts.append(ACTS[gesture.motion](body, gesture.seconds, rng))
        elif gesture is not None:
            jogging = gesture.motion == "jog"
            parts.append(Walk(body, gesture.seconds, rng, jogging, gesture.speed, gesture.path, gesture.size))
    return parts


def _joined(parts: Sequence[Part], t: Array, turn: float) -> tuple[Array, Stance]:
    """Postures and stance of `parts`, each from where the one before ended; trunk and arms go over from one to the next."""
    begin, place = LEAD, Place(turn=turn)
    postures, pieces, of = np.zeros((len(t), len(CHANNELS))), [], np.zeros(len(t), int)
    for n, part in enumerate(parts):
        end = begin + part.seconds
        own, stance = _placed(*part.at(np.clip(t - begin, -BLEND, part.seconds + BLEND)), place)
        enters = smooth((t - begin) / (2 * BLEND) + 0.5) if n else 1.0
        leaves = smooth((end - t) / (2 * BLEND) + 0.5) if n + 1 < len(parts) else 1.0
        postures += np.multiply(enters, leaves)[..., None] * own
        pieces.append(stance)
        of[t >= begin] = n
        last, at_end = _placed(*part.at(np.array([part.seconds])), place)
        middle = at_end.ankles[0].mean(0)
        place, begin = Place(float(middle[0]), float(middle[1]), float(last[0, CHANNELS.index("turn")])), end
    which = (of, np.arange(len(t)))
    return postures, Stance(*(np.stack(values)[which] for values in zip(*pieces)))


def _placed(postures: Array, stance: Stance, place: Place) -> tuple[Array, Stance]:
    """The same, done at `place`."""
    R = turns(*np.zeros((2, 1)), np.array([place.turn]))[0]
    shift = np.array([place.x, place.y, 0.0])
    postures = postures.copy()
    postures[:, CHANNELS.index("turn")] += place.turn
    high = np.column_stack([stance.pelvis[:, :2], np.zeros(len(postures))]) @ R.T + shift
    pelvis = np.column_stack([high[:, :2], stance.pelvis[:, 2]])
    return postures, Stance(pelvis, stance.ankles @ R.T + shift, R @ stance.feet, stance.toes, stance.ahead @ R.T)
