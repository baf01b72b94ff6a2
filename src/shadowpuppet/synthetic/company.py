"""Several people in one scene: their places, headings and motions, so that they meet without passing through one another."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

from shadowpuppet.synthetic.movement.paths import TURN_RADIUS
from shadowpuppet.synthetic.viewpoint import wrapped

Together = Literal["round", "past", "dance", "shake_hands"]

LANE = 2.0
"""Distance between pairs of people walking past each other, metres."""
HANDSHAKE = 0.92, 0.3
"""Distance of two people shaking hands, and of the second to the right of the first, metres."""
PAIRS_APART = 1.7
"""Distance between pairs of people shaking hands, metres."""
DANCES = ("random_body", "march", "box", "wave_hands", "jump", "squat")
"""Motions of dancing people, in turn."""
RING_RADIUS, RING_RADIUS_EACH, RING_FOV = 4.0, 0.2, 52.0
"""Radius (m) of the ring of cameras around two people, and what each further person adds; field of view (degrees)."""
SEED = 11
"""Seed of the second person's body and clothes; the others' follow."""


class Companion(NamedTuple):
    """One of several people."""

    motion: dict[str, Any]
    """The values of a `Gesture`."""
    x: float = 0.0
    """Place in the first frame, world, metres."""
    y: float = 0.0
    turn_deg: float = 0.0
    """Heading, degrees to the left of -Y."""


def members(together: Together, count: int) -> list[Companion]:
    """The `count` people of a scene; the first is at the origin when the film begins."""
    people = {"round": _round, "past": _past, "dance": _dance, "shake_hands": _shake_hands}[together](count)
    first = people[0]
    return [one._replace(x=one.x - first.x, y=one.y - first.y) for one in people]


def _round(count: int) -> list[Companion]:
    """People who walk round each other, evenly spaced on one circle."""
    radius = max(0.75, 0.3 * count)
    walk = {"motion": "walk", "path": "circle", "size": radius, "speed": 1.0}
    angles = 2 * np.pi * np.arange(count) / count  # of the headings; the circle's middle is to the left of each person
    return [Companion(walk, -radius * float(np.cos(angle)), -radius * float(np.sin(angle)), wrapped(float(np.degrees(angle))))
            for angle in angles]  # fmt: skip


def _past(count: int) -> list[Companion]:
    """Pairs of people who walk to and fro in opposite directions, past each other in the middle."""
    length, aside = 2.2, 2 * TURN_RADIUS  # there and back are a lane each, the second to the left of the first
    walk = {"motion": "walk", "path": "line", "size": length, "speed": 1.1}
    return [Companion(walk, length if n % 2 else 0.0, LANE * (n // 2) + (aside if n % 2 else 0.0), -90.0 if n % 2 else 90.0)
            for n in range(count)]  # fmt: skip


def _dance(count: int) -> list[Companion]:
    """People who stand in a circle, face its middle, and move differently on the spot."""
    radius = max(0.65, 0.3 * count)
    angles = 2 * np.pi * np.arange(count) / count
    return [Companion({"motion": DANCES[n % len(DANCES)]}, -radius * float(np.sin(angle)), radius * float(np.cos(angle)),
                   wrapped(float(np.degrees(angle)))) for n, angle in enumerate(angles)]  # fmt: skip


def _shake_hands(count: int) -> list[Companion]:
    """Pairs of people who face each other and shake hands; an odd one waves beside them."""
    distance, aside = HANDSHAKE
    people = list[Companion]()
    for n in range(count):
        x, second = PAIRS_APART * (n // 2), n % 2 == 1
        alone = n == count - 1 and not second
        motion = {"motion": "wave_hands" if alone else "shake_hands"}
        people.append(Companion(motion, x - aside if second else x, -distance if second else 0.0, 180.0 if second else 0.0))
    return people
