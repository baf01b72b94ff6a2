"""Gaps: which are bridged, and how far bridged joints may stray."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.tracking.smoothing.gaps import bridged, stray

RATE = 20


def joints(known) -> np.ndarray:
    return np.where(np.asarray(known)[:, None, None], 0.5, np.nan) * np.ones((1, 2, 3))


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.floats(0, 1))
def test_gaps_between_known_frames_are_bridged_if_they_are_short(known, longest):
    found = bridged(np.arange(len(known)) / RATE, joints(known), longest)
    for begin, end in true_runs(~np.array(known)):
        inner = begin > 0 and end < len(known)
        assert found[begin:end].all() == found[begin:end].any() == (inner and (end - begin) / RATE <= longest + 1e-6)
    assert not found[np.array(known)].any()


def test_a_gap_over_which_the_person_would_fly_stays():
    places = joints([True] * 3 + [False] * 2 + [True] * 3)
    assert bridged(np.arange(8) / RATE, places, 0.5)[3:5].all()
    places[5:] += 3.0
    assert not bridged(np.arange(8) / RATE, places, 0.5).any()


def test_the_stray_grows_into_a_gap_and_with_speed():
    times, inside = np.arange(20) / RATE, np.zeros(20, bool)
    inside[6:13] = True
    slow, quick = (np.cumsum(np.full((20, 1, 3), speed / RATE), axis=0) for speed in (0.1, 2.0))
    found = stray(times, slow, inside)[:, 0]
    assert (found[~inside] == 0).all()
    assert (np.diff(found[6:10]) > 0).all()
    assert (np.diff(found[9:13]) < 0).all()
    assert (stray(times, quick, inside)[inside, 0] > 3 * found[inside]).all()
