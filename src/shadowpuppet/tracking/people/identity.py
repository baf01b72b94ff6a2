"""Who is who: people who were close to each other, or who came back, are told apart by their clothes (`appearance`)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from types import MappingProxyType
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

    pair: tuple[int, int]
    """Their numbers, the lower first."""
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


class Clothes(NamedTuple):
    """The colours of one person."""

    known: Colours | None = None
    """Gathered while it was certain whose they are."""
    recent: tuple[tuple[float, Colours], ...] = ()
    """Gathered since, with the time (s) of each."""

    def settled(self, until: float = np.inf) -> Clothes:
        """The same once what was seen until a time (s) is this person's own."""
        own = [colours for time, colours in self.recent if time <= until]
        known = own if self.known is None else [self.known, *own]
        return Clothes(np.add.reduce(known) if known else None, self.recent[len(own) :])

    @property
    def now(self) -> Colours | None:
        """Colours seen recently, None if those are few."""
        return np.add.reduce([colours for _, colours in self.recent]) if len(self.recent) >= LEAST else None


class Identity(NamedTuple):
    """People's colours, and the pairs that may have been exchanged. Without colours it says whose identity is in doubt."""

    clothes: Mapping[str, Clothes] = MappingProxyType({})
    """By the person's number."""
    questions: tuple[Question, ...] = ()

    def of(self, number: int) -> Clothes:
        """The clothes of a person."""
        return self.clothes.get(str(number), Clothes())

    def is_asked(self, number: int) -> bool:
        """Whether a person is in a question."""
        return any(number in question.pair for question in self.questions)

    def is_doubted(self, number: int) -> bool:
        """Whether a person may be another one."""
        return any(question.is_open for question in self.questions if number in question.pair)

    def see(self, number: int, time: float, colours: Colours) -> Identity:
        """The identity after the colours of a person were seen at a time (s), apart from others."""
        own = self.of(number)
        own = own._replace(recent=(*own.recent, (time, colours)))
        return self._with({number: own if self.is_asked(number) else own.settled(time - RECENT)})

    def meet(self, one: int, other: int, time: float, is_open: bool) -> Identity:
        """The identity after two people are close at a time (s), or the one found may be the other; `is_open`: motion does not tell."""
        pair = min(one, other), max(one, other)
        before = next((each for each in self.questions if each.pair == pair), Question(pair, time, time, False))
        clothes = {n: self.of(n)._replace(recent=()) if self.is_asked(n) else self.of(n).settled() for n in pair}
        rest = tuple(each for each in self.questions if each.pair != pair)
        return self._with(clothes)._replace(questions=(*rest, before._replace(close=time, is_open=is_open or before.is_open)))

    def unlike(self, number: int, colours: Colours | None) -> float:
        """How differently a person is dressed from colours; NaN if that is not known."""
        known = self.of(number).known
        return np.nan if known is None or colours is None else difference(known, colours)

    def decided(self, time: float, present: Iterable[int]) -> tuple[Identity, Exchange | None]:
        """The identity without the questions that are answered at a time (s), and two people who were exchanged, as their colours say, of
        whom at least one is present."""
        there, asked, out = set(present), {each.pair: each for each in self.questions}, self
        for pair in sorted({(n, m) for n in there for m in there if n < m} | {pair for pair in asked if there & set(pair)}):
            lead, question = out._lead(pair, there), asked.get(pair)
            if lead < -CLEAR:
                return out._exchanged(pair, time, question)
            if question is not None and (lead > CLEAR or (not question.is_open and time - question.close > SETTLED)):
                out = out._closed(pair)
        return out, None

    def _lead(self, pair: tuple[int, int], there: set[int]) -> float:
        """How much better the recent colours of a pair's people who are there fit themselves than each other, for one person; NaN if
        that is not known."""
        leads = [self.unlike(other, self.of(number).now) - self.unlike(number, self.of(number).now)
                 for number, other in (pair, pair[::-1]) if number in there]  # fmt: skip
        return float(np.mean(leads))

    def _exchanged(self, pair: tuple[int, int], time: float, question: Question | None) -> tuple[Identity, Exchange]:
        one, other = map(self.of, pair)
        begin = min([each[0] for each in (*one.recent, *other.recent)], default=time) if question is None else question.begin
        swapped = {pair[0]: one._replace(recent=other.recent), pair[1]: other._replace(recent=one.recent)}
        return self._with(swapped)._closed(pair), Exchange(begin, time, *pair)

    def _closed(self, pair: tuple[int, int]) -> Identity:
        rest = self._replace(questions=tuple(each for each in self.questions if each.pair != pair))
        return rest._with({number: rest.of(number).settled() for number in pair if not rest.is_asked(number)})

    def _with(self, clothes: Mapping[int, Clothes]) -> Identity:
        return self._replace(clothes={**self.clothes, **{str(number): each for number, each in clothes.items()}})
