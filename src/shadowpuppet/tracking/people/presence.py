"""Who is there: columns of the coarse hull followed over time, for births, deaths and the number of people."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.people.columns import Column

SPEED = 3.0
"""Greatest speed (m/s) at which a column is the same person's as one before."""
NEAR = 0.35
"""Distance (m) by which a column's axis may jump besides, as a stride changes it."""
COUNTED = 0.1
"""Least share of the frame sets in which that many people must be seen to be counted."""
MIN_COUNTED = 2
"""Least number of these sets."""


@dataclass
class Followed:
    """A person's columns over time."""

    times: list[float] = field(default_factory=list)
    """Seconds."""
    columns: list[Column] = field(default_factory=list)
    sets: list[int] = field(default_factory=list)
    """Number of the frame set of each column."""

    def add(self, number: int, time: float, column: Column) -> None:
        """The column of one more frame set, at a time (s)."""
        self.times.append(time)
        self.columns.append(column)
        self.sets.append(number)

    @property
    def height(self) -> float:
        """Greatest extent of the columns, metres."""
        return max(column.height for column in self.columns)

    @property
    def place(self) -> Array:
        """Last place on the floor plan, of shape (2,), metres."""
        return self.columns[-1].place


def counted(numbers: Sequence[int]) -> int:
    """Number of people in a recording from the numbers seen in some frame sets: the greatest that is seen often enough to be no chance."""
    least = max(MIN_COUNTED, COUNTED * len(numbers))
    return max((n for n in set(numbers) if sum(each >= n for each in numbers) >= least), default=min(max(numbers, default=0), 1))


def follow(before: Sequence[Followed], number: int, time: float, columns: Sequence[Column]) -> list[Followed]:
    """The people followed after one more frame set's columns: those of `before`, extended, and the new ones."""
    people, free = list(before), list(range(len(columns)))
    pairs = sorted((float(np.linalg.norm(columns[c].place - each.place)), n, c) for n, each in enumerate(people) for c in free)
    taken = set[int]()
    for away, n, c in pairs:
        if n in taken or c not in free or away > NEAR + SPEED * (time - people[n].times[-1]):
            continue
        people[n].add(number, time, columns[c])
        taken.add(n)
        free.remove(c)
    for c in free:
        people.append(Followed())
        people[-1].add(number, time, columns[c])
    return people
