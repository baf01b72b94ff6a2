"""Whole-body motion from key postures and steps of the feet.

A motion begins and ends standing, in its own frame: the person stands at the origin facing -Y. Lengths are in leg lengths, so that
motions fit children and adults.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.movement.gait_cycle import GRAVITY, Sole, smoothstep
from shadowpuppet.synthetic.movement.gestures import Keys, interpolate_keys, time_average
from shadowpuppet.synthetic.person.kinematics import CHANNELS, TOE_OUT, LegPlacement, rotations
from shadowpuppet.synthetic.person.mannequin import Mannequin

HALF_STANCE = 0.13
"""Half the distance between a standing person's ankles, leg lengths."""
GROUND_CHANNELS = ("drop", "aside", "ahead", "left_heel", "right_heel")
"""Channels of key postures besides `CHANNELS`: lowering of the pelvis, its shift to the left and forward, leg lengths; raising of the
heels, rad. A leg that would not reach its foot lowers the pelvis further."""


class FootStep(NamedTuple):
    """A step of one foot."""

    foot: int
    """0 left, 1 right."""
    begin: float
    """Start, seconds."""
    seconds: float
    """Time in the air."""
    aside: float
    """Its goal to the left, leg lengths."""
    ahead: float
    """Its goal forward, leg lengths."""
    turn: float = 0.0
    """Heading, rad to the left; the toes point outward from it."""
    height: float = 0.08
    """Greatest height, leg lengths."""


class Hop(NamedTuple):
    """A jump: both feet leave the floor."""

    begin: float
    """Start, seconds."""
    seconds: float
    """Time in the air."""


class KeyframeMotion:
    """A motion through key postures, with steps and hops of the feet."""

    def __init__(self, body: Mannequin, seconds: float, keys: Keys, steps: Sequence[FootStep] = (), hops: Sequence[Hop] = (),
                 rounding: float = 0.16) -> None:
        """keys: values of `CHANNELS` and `GROUND_CHANNELS` at times from 0 to `seconds`; channels not named are as in standing.

        rounding: see `interpolate_keys`.
        """
        self.body, self.seconds, self.hops, self.rounding = body, seconds, tuple(hops), rounding
        self.leg, self.sole = body.length("thigh") + body.length("shank"), Sole.of(body)
        last = {"turn": max((s.begin, s.turn) for s in steps)[1]} if steps else {}
        if steps:
            last |= {"aside": _last(steps, "aside"), "ahead": _last(steps, "ahead")}
        self.keys: Keys = [(-1.0, {}), (0.0, {}), *keys, (seconds, last), (seconds + 1.0, last)]
        self.steps = tuple(tuple(sorted((s for s in steps if s.foot == n), key=lambda s: s.begin)) for n in (0, 1))

    def at(self, t: Array) -> tuple[Array, LegPlacement]:
        """Postures (T, `CHANNELS`) and stance at times `t` (T,), s."""
        values = interpolate_keys(self.keys, np.clip(t, 0, self.seconds), (*CHANNELS, *GROUND_CHANNELS), self.rounding)
        postures, (drop, aside, ahead, *heels) = values[:, : len(CHANNELS)], values[:, len(CHANNELS) :].T
        lift = time_average(self._flight, t, 0.1)
        feet = [self._foot(n, t, heels[n]) for n in (0, 1)]
        ankles, frames, toes, looks = (np.stack(part, 1) for part in zip(*feet))
        ankles = ankles + (lift[:, None] * [0, 0, 1])[:, None]
        top = self.leg + self.sole.ankle + 0.02 + lift
        pelvis = np.column_stack([self.leg * aside, -self.leg * ahead, top - self.leg * drop])
        turn = postures[:, CHANNELS.index("turn")]
        looks = looks + np.stack([np.sin(turn), -np.cos(turn), 0 * turn], -1)[:, None]
        return postures, LegPlacement(pelvis, ankles, frames, toes, looks)

    def _flight(self, t: Array) -> Array:
        """Height of both feet in hops at times `t` (T,), metres, of shape (T,)."""
        spans = [(np.clip(t - h.begin, 0, h.seconds), h.seconds) for h in self.hops]
        return sum((0.5 * GRAVITY * past * (whole - past) for past, whole in spans), 0.0 * t)

    def _foot(self, n: int, t: Array, heel: Array) -> tuple[Array, Array, Array, Array]:
        """Ankle (T, 3), frame (T, 3, 3), bend of the toes (T,) and direction of the foot (T, 3) at times `t` (T,)."""
        out = TOE_OUT * (1 - 2 * n)
        place = np.array([HALF_STANCE * (1 - 2 * n), 0.0, 0.0])
        values, up = np.repeat(place[None], len(t), 0), 0 * t
        for step in self.steps[n]:
            share, goal = np.clip((t - step.begin) / step.seconds, 0, 1), np.array([step.aside, step.ahead, step.turn])
            values = values + smoothstep(share)[:, None] * (goal - place)
            up, place = up + step.height * 16 * (share * (1 - share)) ** 2, goal
        turn, pitch = values[:, 2] + out, -np.maximum(heel, 0) - 2.5 * up
        forward, rise = self.sole.rolled(pitch)
        heading = np.column_stack([np.sin(turn), -np.cos(turn)])
        floor = self.leg * values[:, :2] * [1, -1] + forward[:, None] * heading
        frame = rotations(0 * turn, 0 * turn, turn) @ rotations(-pitch, 0 * pitch, 0 * pitch)
        ankle = np.column_stack([floor, rise + self.leg * up])
        return ankle, frame, np.clip(-pitch, 0, 0.9), np.column_stack([heading, 0 * turn])


def _last(steps: Sequence[FootStep], what: str) -> float:
    """Final shift of the pelvis, leg lengths, midway between the feet; what: "aside" or "ahead"."""
    places = [(HALF_STANCE if n == 0 else -HALF_STANCE) if what == "aside" else 0.0 for n in (0, 1)]
    for step in sorted(steps, key=lambda s: s.begin):
        places[step.foot] = getattr(step, what)
    return sum(places) / 2
