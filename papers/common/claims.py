"""Claims of a paper beside our results; whether they agree is computed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

SURE = 2.0
"""A difference between two sets of runs counts from this many standard errors."""
HEADER = ("paper said", "where", "we got", "same conclusion?")
ANSWERS = {True: "yes", False: "**no**", None: "cannot be told"}


@dataclass(frozen=True)
class Verdict:
    """One claim of a paper, and our result."""

    claim: str
    """The claim, in our words."""
    where: str
    """Section, figure or table of the paper."""
    got: str
    """Our result, as text made from the figures."""
    same: bool | None
    """Whether our conclusion is the same; None where the runs do not decide, and `got` says why."""
    shown: str = ""
    """The file of its picture, if any."""

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


def difference(first: ArrayLike, second: ArrayLike) -> Difference:
    """Difference of two sets of independent runs (R,), (Q,). With a single run in a set the error is infinite."""
    first, second = np.asarray(first, float), np.asarray(second, float)
    squares = [values.var(ddof=1) / len(values) if len(values) > 1 else np.inf for values in (first, second)]
    return Difference(float(first.mean() - second.mean()), float(np.sqrt(sum(squares))))


def all_of(answers: Sequence[bool | None]) -> bool | None:
    """False where any answer is False, else None where any is None, else True."""
    return False if False in answers else None if None in answers else True
