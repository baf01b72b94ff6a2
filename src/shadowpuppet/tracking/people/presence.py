"""Who is there: figures on the floor followed over time, for births, deaths and the number of people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.tracking.people.appearance import Colours
from shadowpuppet.tracking.people.figures import Figure

SPEED = 3.0
"""Greatest speed (m/s) at which a figure is the same person's as one before."""
NEAR = 0.35
"""Distance (m) by which a figure may jump besides, as a stride changes it."""
UPRIGHT = 80
"""Percentile of the heights of figures."""
COUNTED = 0.2
"""Least share of the frame sets in which that many people must be seen to be counted."""
MIN_COUNTED = 2
"""Least number of these sets."""

SURE, CERTAIN = 1.0, 1.5
"""Evidence, in views, from which on a figure is a person beside two others; from which on it is a second person who is seldom seen, or who
stands close to another."""
CLOSE = 0.7
"""Distance (m) of two figures up to which one may be a part of the other's person: the legs of one who sits or lies."""


class Sighting(NamedTuple):
    """A person in a frame set, among others."""

    time: float
    """Seconds."""
    figure: Figure
    others: tuple[Figure, ...]
    masks: tuple[Mask | None, ...]
    """Silhouettes (H, W) of all people together, one per camera."""
    worn: Colours | None = None
    """Colours of the figure; None without pictures."""


class Followed(NamedTuple):
    """A person's figures over time."""

    sightings: tuple[Sighting, ...]

    @property
    def height(self) -> float:
        """Height of the figures, metres, when the person stands upright: few are higher."""
        return float(np.percentile([each.figure.height for each in self.sightings], UPRIGHT))

    @property
    def last(self) -> Sighting:
        """The last sighting."""
        return self.sightings[-1]


def sure_number(figures: Sequence[Figure]) -> int:
    """Number of people in a frame set's figures, the most certain first: without uncertain ones close to another, and without those beyond
    the second that have less than a whole view of evidence, as what bodies leave over where they reach beyond their figures may look like
    a person."""
    apart = [one for n, one in enumerate(figures)
             if one.evidence >= CERTAIN or all(np.linalg.norm(one.place - other.place) >= CLOSE for other in figures[:n])]  # fmt: skip
    return max(sum(figure.evidence >= SURE for figure in apart), min(len(apart), 2))


def certain_number(figures: Sequence[Figure]) -> int:
    """Number of people in a frame set's figures that are certain, but 2 at most."""
    return min(sum(figure.evidence >= CERTAIN for figure in figures), 2)


def counted(numbers: Sequence[int], share: float = COUNTED) -> int:
    """Number of people in a recording from the numbers seen in some frame sets: the greatest that is seen often enough to be no chance, in
    a `share` of the sets and in `MIN_COUNTED`."""
    least = max(MIN_COUNTED, share * len(numbers))
    return max((n for n in set(numbers) if sum(each >= n for each in numbers) >= least), default=min(max(numbers, default=0), 1))


def sightings(time: float, figures: Sequence[Figure], masks: Sequence[Mask | None]) -> list[Sighting]:
    """Each of a frame set's figures, at a time (s), among the others."""
    return [Sighting(time, one, tuple(other for other in figures if other is not one), tuple(masks)) for one in figures]


def follow(before: Sequence[Followed], found: Sequence[Sighting]) -> list[Followed]:
    """The people followed after one more frame set's sightings: those of `before`, extended, and the new ones."""
    people, free = list(before), list(range(len(found)))
    pairs = sorted((float(np.linalg.norm(found[c].figure.place - each.last.figure.place)), n, c)
                   for n, each in enumerate(people) for c in free)  # fmt: skip
    taken = set[int]()
    for away, n, c in pairs:
        if n in taken or c not in free or away > NEAR + SPEED * (found[c].time - people[n].last.time):
            continue
        people[n] = Followed((*people[n].sightings, found[c]))
        taken.add(n)
        free.remove(c)
    return [*people, *(Followed((found[c],)) for c in free)]
