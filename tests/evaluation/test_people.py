"""Who is who: misses, false positives, swaps, and their figures."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.errors import FormatError
from shadowpuppet.evaluation.people import identities, measure_people

T = 20


def places(*lines) -> np.ndarray:
    """Places (T, K, 2) of people who stand at x."""
    return np.stack([np.column_stack([np.full(T, x), np.arange(T) * 0.01]) for x in lines], 1)


def test_all_right():
    found = identities(places(0.0, 2.0), places(2.1, 0.1))
    assert (found.mota, found.idf1, found.swaps, found.misses, found.false_positives, found.count_right) == (1, 1, 0, 0, 0, 1)
    assert found.of == {0: 1, 1: 0}


def test_a_swap_in_the_middle():
    found = places(0.0, 2.0)
    found[T // 2 :] = found[T // 2 :, ::-1]
    who = identities(places(0.0, 2.0), found)
    assert who.swaps == 2
    assert who.mota == pytest.approx(1 - 2 / (2 * T))
    assert who.idf1 == pytest.approx(0.5)


def test_misses_and_ghosts():
    found = places(0.0, 5.0)
    found[:5, 0] = np.nan
    who = identities(places(0.0), found)
    assert (who.misses, who.false_positives, who.swaps) == (5, T, 0)
    assert who.count_right == pytest.approx(5 / T)


def test_a_person_who_leaves_is_not_missed():
    truth, found = places(0.0, 2.0), places(0.0, 2.0)
    truth[10:, 1] = found[10:, 1] = np.nan
    assert identities(truth, found).mota == 1


def test_nobody_at_all():
    who = identities(np.zeros((T, 0, 2)), np.zeros((T, 0, 2)))
    assert (who.swaps, who.misses, who.of) == (0, 0, {})


def test_a_run_of_one_person_is_refused(tmp_path):
    with pytest.raises(FormatError, match=r"found no people\.csv"):
        measure_people(tmp_path)
