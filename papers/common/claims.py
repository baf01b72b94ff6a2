"""What a paper says beside what we got, judged by numbers: never typed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

SURE = 2.0
"""Standard errors from which on a difference between two sets of runs counts as one."""
HEADER = ("paper said", "where", "we got", "same conclusion?")
ANSWERS = {True: "yes", False: "**no**", None: "inconclusive"}


@dataclass(frozen=True)
class Verdict:
    """One claim, and what our runs say of it."""

    claim: str
    """What the paper says, in our words."""
    where: str
    """Section, figure or table of the paper."""
    got: str
    """What was measured, made from the figures."""
    same: bool | None
    """Whether the conclusion is the same; None: the runs do not tell, and `got` says why."""
    shown: str = ""
    """The file that shows it, where there is one."""

    @property
    def row(self) -> tuple[str, str, str, str]:
        """As a row under `HEADER`."""
        return self.claim, self.where, self.got, ANSWERS[self.same]

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return asdict(self)


class Difference(NamedTuple):
    """How much greater one set of runs is than another, in the mean."""

    value: float
    """Mean of the first less mean of the second."""
    error: float
    """Standard error of that."""

    @property
    def greater(self) -> bool | None:
        """True: the first is greater; False: it is less; None: the runs do not tell them apart (`SURE` standard errors)."""
        return None if abs(self.value) <= SURE * self.error or not np.isfinite(self.value) else bool(self.value > 0)


def difference(first: ArrayLike, second: ArrayLike) -> Difference:
    """Of two sets of independent runs, a number each (R,), (Q,). With a single run in a set the error is infinite."""
    first, second = np.asarray(first, float), np.asarray(second, float)
    squares = [values.var(ddof=1) / len(values) if len(values) > 1 else np.inf for values in (first, second)]
    return Difference(float(first.mean() - second.mean()), float(np.sqrt(sum(squares))))


def all_of(answers: Sequence[bool | None]) -> bool | None:
    """Whether all are so: one no is a no, else one that is inconclusive leaves it open."""
    return False if False in answers else None if None in answers else True
