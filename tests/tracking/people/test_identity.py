"""Who was exchanged, as colours tell, and who is in doubt."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.tracking.people.appearance import nothing
from shadowpuppet.tracking.people.identity import LEAST, RECENT, SETTLED, Identity

STEP = 0.2


def dressed(bin: int):
    """Colours of somebody who is all of one colour."""
    found = nothing(1)
    found[..., bin] = 50
    return found


RED, BLUE = dressed(20), dressed(8)
REDDISH = 0.7 * RED + 0.3 * dressed(21)


class Film:
    """People in clothes, seen every `STEP` s."""

    def __init__(self) -> None:
        self.identity, self.time = Identity(), 0.0

    def pass_by(self, seconds: float, close: bool = False, is_open: bool = False, **clothes):
        """The exchanges of some seconds in which people 1, 2, ... wear what is given as _1, _2, ..."""
        found = []
        for _ in range(round(seconds / STEP)):
            for name, colours in clothes.items():
                self.identity = self.identity.see(int(name[1:]), self.time, colours)
            if close:
                self.identity = self.identity.meet(1, 2, self.time, is_open)
            if (exchange := self.decide(self.time, [int(name[1:]) for name in clothes])) is not None:
                found.append(exchange)
            self.time += STEP
        return found

    def decide(self, time: float, present: list[int]):
        self.identity, exchange = self.identity.decided(time, present)
        return exchange


@pytest.fixture
def film():
    return Film()


def test_nothing_happens_to_people_who_wear_what_they_wore(film):
    assert film.pass_by(3, _1=RED, _2=BLUE) == []
    assert film.pass_by(0.4, close=True, _1=RED, _2=BLUE) == []
    assert film.pass_by(3, _1=RED, _2=BLUE) == []
    assert film.identity.questions == ()


def test_people_who_were_exchanged_while_close_are_found(film):
    film.pass_by(3, _1=RED, _2=BLUE)
    begin = film.time
    film.pass_by(0.4, close=True, _1=RED, _2=BLUE)
    (exchange,) = film.pass_by(3, _1=BLUE, _2=RED)[:1]
    assert (exchange.one, exchange.other) == (1, 2)
    assert exchange.begin == begin
    assert exchange.end - begin <= 0.4 + (LEAST + 1) * STEP


def test_people_are_also_exchanged_without_having_been_close(film):
    film.pass_by(3, _1=RED, _2=BLUE)
    (exchange,) = film.pass_by(RECENT, _1=BLUE, _2=RED)
    assert exchange.end - exchange.begin <= 2 * RECENT


def test_after_an_exchange_each_has_their_own_colours(film):
    film.pass_by(3, _1=RED, _2=BLUE)
    assert len(film.pass_by(1, _1=BLUE, _2=RED)) == 1
    assert film.pass_by(3, _1=RED, _2=BLUE) == []  # put right: as at first


def test_where_neither_motion_nor_colours_tell_there_is_doubt(film):
    film.pass_by(3, _1=RED, _2=REDDISH)
    film.pass_by(0.4, close=True, is_open=True, _1=RED, _2=REDDISH)
    assert film.identity.is_doubted(1)
    film.pass_by(3 * SETTLED, _1=RED, _2=REDDISH)
    assert film.identity.is_doubted(1)
    assert film.identity.is_doubted(2)
    assert not film.identity.is_doubted(3)


def test_colours_end_the_doubt(film):
    film.pass_by(3, _1=RED, _2=BLUE)
    film.pass_by(0.4, close=True, is_open=True, _1=RED, _2=BLUE)
    assert film.identity.is_doubted(1)
    assert film.pass_by(1, _1=RED, _2=BLUE) == []
    assert not film.identity.is_doubted(1)


def test_without_colours_motion_is_believed_where_it_tells(film):
    film.identity = film.identity.meet(1, 2, 0.0, is_open=False)
    assert not film.identity.is_doubted(1)
    assert film.decide(SETTLED + 0.1, [1, 2]) is None
    assert film.identity.questions == ()
    film.identity = film.identity.meet(1, 2, 5.0, is_open=True)
    assert film.decide(5.1 + SETTLED, [1, 2]) is None
    assert film.identity.is_doubted(2)


def test_who_came_back_as_another_gets_their_number(film):
    film.pass_by(3, _1=RED, _2=BLUE)
    film.identity = film.identity.meet(1, 2, film.time, is_open=True)  # both have left, and one of them is back, as 1 it is thought
    begin = film.time
    (exchange,) = film.pass_by(1, _1=BLUE)
    assert exchange.begin == begin
    assert not film.identity.is_doubted(1)
    assert film.identity.unlike(2, BLUE) < 0.1
    assert np.isnan(film.identity.unlike(3, BLUE))
    assert film.identity.unlike(1, BLUE) > 3
