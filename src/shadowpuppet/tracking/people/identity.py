"""Who is who: people who were close to each other, or who came back, are told apart by their clothes (`appearance`)."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from shadowpuppet.tracking.people.appearance import Colours, difference

CLEAR = 0.8
"""By how much better, in units of `appearance.difference`, colours must fit one person than another to tell who it is."""
DIFFERENT = 3.5
"""Difference in colours from which on somebody is another person."""
RECENT, LEAST = 1.0, 4
"""Seconds for which colours are held back before they count as a person's own, and the least number of looks that are compared."""
SETTLED = 3.0
"""Seconds after which people who were close are who they were, if motion tells and colours do not."""


class Question(NamedTuple):
    """Two people who may have been exchanged."""

    begin: float
    """When they came close, or one of them was found again; seconds."""
    close: float
    """When they were close for the last time, seconds."""
    is_open: bool
    """Whether motion does not tell either."""


class Exchange(NamedTuple):
    """Two people who were exchanged for some time, and are not any more."""

    begin: float
    """Seconds."""
    end: float
    """Seconds."""
    one: int
    """Number of a person."""
    other: int


@dataclass
class Clothes:
    """The colours of one person."""

    known: Colours | None = None
    """Gathered while it was certain who they are."""
    recent: list[tuple[float, Colours]] = field(default_factory=list)
    """Gathered since, with the time (s) of each."""

    def settle(self, until: float = np.inf) -> None:
        """What was seen until a time (s) is this person's own."""
        for _, colours in (own := [each for each in self.recent if each[0] <= until]):
            self.known = colours.copy() if self.known is None else self.known + colours
        self.recent = self.recent[len(own) :]

    @property
    def now(self) -> Colours | None:
        """Colours seen recently, None if those are few."""
        return np.add.reduce([colours for _, colours in self.recent]) if len(self.recent) >= LEAST else None


class Identity:
    """Gathers people's colours, and says who was exchanged. Without colours it says whose identity is in doubt."""

    def __init__(self) -> None:
        """Nobody has been seen."""
        self.clothes = dict[int, Clothes]()
        self.questions = dict[tuple[int, int], Question]()
        """By the numbers of two people, the lower first."""

    def see(self, number: int, time: float, colours: Colours) -> None:
        """The colours of a person at a time (s), seen apart from others."""
        clothes = self.clothes.setdefault(number, Clothes())
        clothes.recent.append((time, colours))
        if not any(number in pair for pair in self.questions):
            clothes.settle(time - RECENT)

    def meet(self, one: int, other: int, time: float, is_open: bool) -> None:
        """Two people are close at a time (s), or the one who was found may be the other; `is_open`: motion does not tell who is who."""
        pair = min(one, other), max(one, other)
        before = self.questions.get(pair)
        for number in pair:
            clothes = self.clothes.setdefault(number, Clothes())
            if any(number in each for each in self.questions):
                clothes.recent.clear()
            else:
                clothes.settle()
        self.questions[pair] = Question(time if before is None else before.begin, time, is_open or (before is not None and before.is_open))

    def is_doubted(self, number: int) -> bool:
        """Whether a person may be another one."""
        return any(question.is_open for pair, question in self.questions.items() if number in pair)

    def unlike(self, number: int, colours: Colours | None) -> float:
        """How differently a person is dressed from colours; NaN if that is not known."""
        clothes = self.clothes.get(number)
        return np.nan if clothes is None or clothes.known is None or colours is None else difference(clothes.known, colours)

    def decide(self, time: float, present: Iterable[int]) -> Exchange | None:
        """Two people who were exchanged, as their colours say at a time (s), of whom at least one is present; questions that are answered
        are closed."""
        there = set(present)
        pairs = {(n, m) for n in there for m in there if n < m} | {pair for pair in self.questions if there & set(pair)}
        for pair in sorted(pairs):
            lead = self._lead(pair, there)
            question = self.questions.get(pair)
            if lead < -CLEAR:
                return self._exchanged(pair, time, question)
            if question is not None and (lead > CLEAR or (not question.is_open and time - question.close > SETTLED)):
                self._close(pair)
        return None

    def _lead(self, pair: tuple[int, int], there: set[int]) -> float:
        """How much better the recent colours of a pair's people who are there fit themselves than each other, for one person; NaN if
        that is not known."""
        leads = list[float]()
        for number, other in (pair, pair[::-1]):
            if number in there:
                now = self.clothes[number].now if number in self.clothes else None
                leads.append(self.unlike(other, now) - self.unlike(number, now))
        return float(np.mean(leads))

    def _exchanged(self, pair: tuple[int, int], time: float, question: Question | None) -> Exchange:
        one, other = (self.clothes.setdefault(number, Clothes()) for number in pair)
        begin = min([each[0] for each in (*one.recent, *other.recent)], default=time) if question is None else question.begin
        one.recent, other.recent = other.recent, one.recent
        self._close(pair)
        return Exchange(begin, time, *pair)

    def _close(self, pair: tuple[int, int]) -> None:
        self.questions.pop(pair, None)
        for number in pair:
            if not any(number in each for each in self.questions):
                self.clothes[number].settle()
