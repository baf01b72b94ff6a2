"""Settings that follow from the film."""

from __future__ import annotations

import pytest

from shadowpuppet.tracking.multiview.settings import MULTIVIEW_PRESETS, for_rate, make_multiview_settings

RATES = [(120, 1, 0), (60, 1, 0), (25, 1, 0), (20, 2, 0), (15, 2, 1), (10, 3, 1), (2, 4, 1)]


@pytest.mark.parametrize(("rate", "cycles", "velocity"), RATES)
def test_long_frames_have_more_cycles_and_take_the_motion_along(rate, cycles, velocity):
    found = for_rate(make_multiview_settings(), rate)
    assert (found.cycles, found.velocity) == (cycles, velocity)


@pytest.mark.parametrize("rate", [60, 5])
def test_what_is_chosen_stays(rate):
    chosen = make_multiview_settings(overrides={"cycles": 7, "velocity": 0.5})
    assert for_rate(chosen, rate) == chosen
    paper = make_multiview_settings("ni2008")
    assert for_rate(paper, rate) == paper
    assert (paper.cycles, paper.velocity) == (1, MULTIVIEW_PRESETS["ni2008"]["velocity"])
