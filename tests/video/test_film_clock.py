"""The times of frames: the container's where they can be, always increasing."""

from __future__ import annotations

from fractions import Fraction
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.errors import ShadowPuppetWarning
from shadowpuppet.video.film import _Clock


def clocked(stamps, decoding=None):
    clock = _Clock("a.mp4", 0.1)
    frames = [SimpleNamespace(pts=p, dts=d, time_base=Fraction(1, 10)) for p, d in zip(stamps, decoding or [None] * len(stamps))]
    return np.array([clock(frame) for frame in frames])


def test_a_stutter_moves_one_time_only():
    with pytest.warns(ShadowPuppetWarning, match=r"the frame at 0.200 s is followed by one that is not later"):
        times = clocked([0, 1, 2, 2, 3, 4])
    np.testing.assert_allclose(times, [0, 0.1, 0.2, 0.25, 0.3, 0.4])


def test_times_that_start_again_go_on():
    with pytest.warns(ShadowPuppetWarning):
        times = clocked([*range(20), 0, 3, 4])
    np.testing.assert_allclose(times, np.array([*range(21), 23, 24]) / 10)


def test_scrambled_times_give_way_to_decoding_times():
    with pytest.warns(ShadowPuppetWarning):
        times = clocked([1, 2, 5, 4, 6, 3, 8, 7], range(2, 10))
    np.testing.assert_allclose(times[4:], np.arange(5, 9) / 10)


@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")
@given(st.lists(st.none() | st.integers(-5, 5), min_size=1, max_size=30))
def test_times_always_increase(stamps):
    assert (np.diff(clocked(stamps)) > 0).all()
