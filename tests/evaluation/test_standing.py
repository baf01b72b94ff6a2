"""Feet of a run beside those of a truth: slide, depth, precision and recall, of contacts known by construction."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.evaluation.standing import standing_figures
from shadowpuppet.evaluation.summary_text import feet_text
from shadowpuppet.io.contacts import ContactTable
from shadowpuppet.motion.motion import JointTable

TIMES, NAMES = np.arange(90) / 30, ("left_heel", "right_toe")


def feet(drift: float = 0.0, height: float = 0.0) -> JointTable:
    """A heel that stands and drifts (m/s), and a toe that stands for the first second alone."""
    places = np.zeros((90, 2, 3))
    places[:, 0, 0], places[..., 2] = drift * TIMES, height
    places[30:, 1, 0], places[30:, 1, 2] = 2 * (TIMES[30:] - 1), height + 0.3
    return JointTable(TIMES, NAMES, places)


def test_figures_of_a_run_alone():
    found = standing_figures(feet(drift=0.05, height=0.4))
    assert found["floor_m"] == pytest.approx(0.4)
    assert 0.02 < found["slide_mm_s"] / 1000 < 0.06
    assert found["depth_mm"]["mean"] == pytest.approx(0)
    assert "true_stance" not in found
    assert "floor at 0.400 m" in str(feet_text(found))


def test_figures_beside_true_contacts():
    truth = ContactTable(TIMES, NAMES, np.column_stack([TIMES < 2, TIMES < 0.9]))
    found = standing_figures(feet(drift=0.04), feet(), truth)["true_stance"]
    assert found["truth_slide_mm_s"] == pytest.approx(0)
    assert found["slide_mm_s"] == pytest.approx(40 * 59 / (59 + 26))  # the toe's 26 steps do not slide
    assert found["recall"] == 1
    assert found["precision"] == pytest.approx((60 + 27) / (90 + 30), abs=0.03)
    text = str(feet_text(standing_figures(feet(drift=0.04), feet(), truth)))
    assert "slide by 28 mm/s (the truth's points 0)" in text
    assert "100 % of the true ones are found" in text


def test_without_soles_there_is_nothing():
    hands = JointTable(TIMES, ("left_hand", "right_hand"), feet().positions)
    assert standing_figures(hands) == {}
    assert feet_text({}) is None
