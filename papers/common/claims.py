"""Claims of a paper beside our results; whether they agree is computed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

SURE = 2.0
"""A difference between two sets of runs counts from this many standard errors."""
HEADER = ("paper said", "where", "we got", "same conclusion?")
DEPENDS: Literal["depends"] = "depends"
"""The answer where fair readings of the paper lead to different ones."""
Answer = bool | Literal["depends"] | None
"""Whether our conclusion is the paper's; None where the runs do not decide."""
ANSWERS = {True: "yes", False: "**no**", DEPENDS: "depends on the reading", None: "inconclusive"}
CONFIDENCE, NORMAL = 0.9, 1.645
"""Of the intervals of shares, and how many standard deviations that is on either side."""


@dataclass(frozen=True)
class Verdict:
    """One claim of a paper, and our result."""

    claim: str
    """The claim, in our words."""
    where: str
    """Section, figure or table of the paper."""
    got: str
    """Our result, as text made from the figures."""
    same: Answer
    """Whether our conclusion is the same; None where the runs do not decide, `DEPENDS` where readings differ: `got` says why."""
    shown: str = ""
    """The file of its picture, if any."""
    own: bool = False
    """Whether this is a question of our own beside the paper's claims."""

    @property
    def row(self) -> tuple[str, str, str, str]:
        """The row of a table with `HEADER`."""
        return self.claim, self.where, self.got, ANSWERS[self.same]

    def plain(self) -> dict[str, Any]:
        """The fields, for JSON."""
        return asdict(self)


class Difference(NamedTuple):
    """Difference of the means of two sets of runs."""

    value: float
    """Mean of the first less mean of the second."""
    error: float
    """Its standard error."""

    @property
    def greater(self) -> bool | None:
        """Whether the first is greater; None where they differ by less than `SURE` standard errors."""
        return None if abs(self.value) <= SURE * self.error or not np.isfinite(self.value) else bool(self.value > 0)


    def under(self, limit: float) -> bool | None:
        """Whether the first is greater by less than `limit`; None where `SURE` standard errors leave it open."""
        if not np.isfinite(self.value) or abs(self.value - limit) <= SURE * self.error:
            return None
        return bool(self.value < limit)


def difference(first: ArrayLike, second: ArrayLike) -> Difference:
    """Difference of two sets of independent runs (R,), (Q,). With a single run in a set the error is infinite."""
    first, second = np.asarray(first, float), np.asarray(second, float)
    squares = [values.var(ddof=1) / len(values) if len(values) > 1 else np.inf for values in (first, second)]
    return Difference(float(first.mean() - second.mean()), float(np.sqrt(sum(squares))))


class Share(NamedTuple):
    """How many of some independent runs something happened in."""

    number: int
    of: int

    @property
    def interval(self) -> tuple[float, float]:
        """Bounds of the probability with `CONFIDENCE` (Wilson 1927)."""
        n, z = self.of, NORMAL
        middle, half = self.number + z * z / 2, z * np.sqrt(self.number * (n - self.number) / n + z * z / 4)
        return float((middle - half) / (n + z * z)), float((middle + half) / (n + z * z))

    @property
    def usual(self) -> bool | None:
        """Whether it happens in more than half of all runs; None where the interval has both."""
        low, high = self.interval
        return True if low > 0.5 else False if high < 0.5 else None

    def __str__(self) -> str:
        return f"{self.number} of {self.of} runs ({self.interval[0]:.0%} to {self.interval[1]:.0%})"


def opposite(answer: bool | None) -> bool | None:
    """The answer to the opposite question."""
    return None if answer is None else not answer


def all_of(answers: Sequence[Answer]) -> Answer:
    """False where any answer is False, else `DEPENDS` where any depends on the reading, else None where any is None, else True."""
    return next((answer for answer in (False, DEPENDS, None) if answer in answers), True)


def by_reading(answers: Mapping[str, bool | None]) -> Answer:
    """The answer that all readings of the paper give, `DEPENDS` where one says yes and another no, else None."""
    given = set(answers.values())
    return DEPENDS if {True, False} <= given else given.pop() if len(given) == 1 else None
