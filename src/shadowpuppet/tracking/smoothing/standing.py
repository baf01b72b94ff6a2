"""What stands neither slides nor sinks: points of soles in contact with the floor, as terms of the cost of a path."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.motion.contact.contact import find_contacts

STILL_SD = 0.01
"""Deviation (m/s) of the speed of a point that stands: shoes give way a little, and the body's soles are not the person's."""
FLOOR_SD = 0.01
"""Deviation (m) of its height from the floor's."""


class Standing(NamedTuple):
    """Weights of the terms, by axis of M markers; 0 for markers that do not stand."""

    still: Array
    """Precision of the steps from frame to frame, of shape (T - 1, M, 3), 1/m^2."""
    level: Array
    """Precision of the places, of shape (T, M, 3), 1/m^2: of heights alone."""
    floor: float
    """Height of the floor, metres."""


def standing(times: Array, names: Sequence[str], markers: Array, floor: float | None) -> Standing | None:
    """The terms for smoothed markers (T, M, 3), metres, at `times` (T,) s; the first markers are the joints `names`. None without soles or
    without a floor."""
    contacts = find_contacts(times, names, markers[:, : len(names)], floor)
    if contacts is None:
        return None
    held = np.where(contacts.touching, contacts.probability, 0.0)
    which = [list(names).index(name) for name in contacts.names]
    still, level = np.zeros((len(times) - 1, *markers.shape[1:])), np.zeros(markers.shape)
    still[:, which] = (np.minimum(held[1:], held[:-1]) / (STILL_SD * np.diff(times)[:, None]) ** 2)[..., None]
    level[:, which, 2] = held / FLOOR_SD**2
    return Standing(still, level, contacts.floor)
