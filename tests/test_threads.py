from __future__ import annotations

import cv2
import made
import pytest

from shadowpuppet.threads import (
    PARTS,
    THREADS_VARIABLE,
    MadeOnDemand,
    in_parts,
    limit_threads,
    one_opencv_thread,
    shared_out,
    thread_limit,
    usable_cores,
)


@pytest.mark.parametrize(("told", "limit"), [("1", 1), ("3", 3), ("0", None), ("", None), ("many", None), ("-2", None)])
def test_threads_are_those_that_the_environment_allows(monkeypatch, told, limit):
    monkeypatch.delenv(THREADS_VARIABLE, raising=False)
    cores, before = usable_cores(), cv2.getNumThreads()
    monkeypatch.setenv(THREADS_VARIABLE, told)
    assert thread_limit() == limit
    assert usable_cores() == min(cores, limit or cores)
    try:
        limit_threads()
        assert cv2.getNumThreads() == (limit or before)
    finally:
        cv2.setNumThreads(before)


@pytest.mark.parametrize("limit", ["1", "2", ""])
def test_what_is_shared_out_is_done_once_each_and_its_errors_are_raised(monkeypatch, limit):
    monkeypatch.setenv(THREADS_VARIABLE, limit)
    done = list[int]()
    shared_out(done.append, range(50))
    assert sorted(done) == list(range(50))
    with pytest.raises(ZeroDivisionError):
        shared_out(lambda n: 1 / (n - 3), range(6))


@pytest.mark.parametrize("number", [0, 1, 3, 4, 7, 8, 16, 17, 40, 1000])
def test_parts_have_every_item_once_and_do_not_depend_on_the_machine(monkeypatch, number):
    monkeypatch.setenv(THREADS_VARIABLE, "1")
    alone = in_parts(number)
    monkeypatch.delenv(THREADS_VARIABLE)
    assert in_parts(number) == alone
    assert [n for part in alone for n in range(number)[part]] == list(range(number))
    assert len(alone) <= PARTS
    assert len(alone) == 1 or min(part.stop - part.start for part in alone) >= PARTS


def test_opencv_uses_one_thread_where_each_core_has_a_film_of_its_own():
    before = cv2.getNumThreads()
    with one_opencv_thread():
        assert cv2.getNumThreads() == 1
    assert cv2.getNumThreads() == before


def test_films_are_the_same_with_any_number_of_threads(monkeypatch, tmp_path, rng):
    made.write_film(tmp_path / "film.mp4", rng.integers(0, 255, (12, 48, 64, 3), "u1"))
    found = []
    for limit in ("1", "2", ""):
        monkeypatch.setenv(THREADS_VARIABLE, limit)
        found.append([image.tobytes() for image in made.images(tmp_path / "film.mp4")])
    assert found[0] == found[1] == found[2]
    assert len(found[0]) == 12


def test_items_are_made_once_when_they_are_asked_for():
    asked = []

    def make(n):
        asked.append(n)
        return str(n)

    items = MadeOnDemand(make, 6)
    assert len(items) == 6
    assert (items[2], items[-1], items[2]) == ("2", "5", "2")
    assert sorted(asked) == [2, 5]
    assert items[1:3] == items.several([1, 2]) == ["1", "2"]
    assert list(items) == list(items) == list("012345")
    assert sorted(asked) == list(range(6))
    with pytest.raises(IndexError):
        items[6]
    assert not MadeOnDemand(make, 0)
    items = MadeOnDemand(make, 2)
    assert (items[1], items[0]) == ("1", "0")
    assert items._make is None  # what they are made from is not kept longer than needed
