"""Several people in one scene: their places, headings and motions, so that they meet without passing through one another."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

import numpy as np

Together = Literal["round", "past", "dance", "shake_hands"]

LANE = 1.7
"""Distance from one pair of people who walk past each other to the next, metres."""
HANDSHAKE = 0.92, 0.3
"""Distance of two people who shake hands, and how far the second stands to the first's right, metres."""
PAIRS_APART = 1.7
"""Distance from one pair of people who shake hands to the next, metres."""
DANCES = ("random_body", "march", "box", "wave_hands", "jump", "squat")
"""Motions of people who dance, one after another."""
RING_RADIUS, RING_RADIUS_EACH, RING_FOV = 4.0, 0.2, 52.0
"""Radius (m) of the ring of cameras around two people, and what each further person adds; field of view (degrees)."""
SEED = 11
"""Seed of the second person's body and clothes; the others' follow."""


class Member(NamedTuple):
    """One of several people."""

    motion: dict[str, Any]
    """The values of a `Gesture`."""
    x: float = 0.0
    """Place, world, metres: the middle of the area walked over, or where the person stands."""
    y: float = 0.0
    turn_deg: float = 0.0
    """Heading, degrees to the left of -Y."""


def members(together: Together, count: int) -> list[Member]:
    """The `count` people of a scene, the tracked person first, who is at the origin."""
    people = {"round": _round, "past": _past, "dance": _dance, "shake_hands": _shake_hands}[together](count)
    first = people[0]
    return [one._replace(x=one.x - first.x, y=one.y - first.y) for one in people]


def _round(count: int) -> list[Member]:
    """People who walk round each other, evenly spaced on one circle."""
    walk = {"motion": "walk", "path": "circle", "size": max(0.75, 0.3 * count), "speed": 1.0}
    return [Member(walk, turn_deg=_half_open(360 * n / count)) for n in range(count)]


def _past(count: int) -> list[Member]:
    """Pairs of people who walk to and fro in opposite directions, past each other in the middle."""
    walk = {"motion": "walk", "path": "line", "size": 2.2, "speed": 1.1}
    return [Member(walk, y=LANE * (n // 2), turn_deg=90.0 if n % 2 == 0 else -90.0) for n in range(count)]


def _dance(count: int) -> list[Member]:
    """People who stand in a circle, face its middle, and move differently on the spot."""
    radius = max(0.65, 0.3 * count)
    angles = 2 * np.pi * np.arange(count) / count
    return [Member({"motion": DANCES[n % len(DANCES)]}, -radius * float(np.sin(angle)), radius * float(np.cos(angle)),
                   _half_open(float(np.degrees(angle)))) for n, angle in enumerate(angles)]  # fmt: skip


def _shake_hands(count: int) -> list[Member]:
    """Pairs of people who face each other and shake hands; an odd one waves beside them."""
    distance, aside = HANDSHAKE
    people = list[Member]()
    for n in range(count):
        x, second = PAIRS_APART * (n // 2), n % 2 == 1
        alone = n == count - 1 and not second
        motion = {"motion": "wave_hands" if alone else "shake_hands"}
        people.append(Member(motion, x - aside if second else x, -distance if second else 0.0, 180.0 if second else 0.0))
    return people


def _half_open(degrees: float) -> float:
    """The same angle from -180 to below 180, degrees."""
    return (degrees + 180) % 360 - 180
