"""Offsets of films by timecode."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.constants import day

from shadowpuppet.calibration.clock_offset import timecode_offsets

NAMES = ("a", "b", "c")


def offsets(codes, starts=(0.0, 0.0, 0.0), rate=25.0):
    return timecode_offsets(NAMES, codes, starts, rate)


def test_a_film_that_began_earlier_is_late_by_what_it_shows_before_the_others():
    found = offsets((100.0, 98.0, 100.0))
    assert (found.by, found.seconds) == ("timecode", (0.0, 2.0, 0.0))
    assert found.spread == (0.02,) * 3


def test_starts_that_a_recording_states_count():
    assert offsets((100.0, 98.0, 100.0), (0.0, 2.0, 0.0)).seconds == (0.0, 0.0, 0.0)


def test_a_film_without_timecode_has_no_offset():
    assert offsets((None, 98.0, 100.0)).seconds == (None, 1.0, -1.0)


@pytest.mark.parametrize("codes", [(None, 98.0, None), (None, None, None), (3600.0, 3600.0, 3600.0)])
def test_what_tells_nothing_is_none(codes):
    assert offsets(codes) is None


@given(st.lists(st.floats(0, 600), min_size=3, max_size=3), st.floats(0, day))
def test_midnight_changes_nothing(begins, at):
    if len({(at + begin) % day for begin in begins}) < 3 or len({*begins}) < 3:
        return
    np.testing.assert_allclose(offsets([(at + begin) % day for begin in begins]).seconds, offsets(begins).seconds, atol=1e-6)
