"""Intervals: honest ones hold what they say, narrow and wide ones are told apart."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.evaluation.interval_coverage import LEVELS, coverage, rank_histogram


def test_the_widths_are_those_of_a_normal_distribution():
    from scipy.stats import norm

    for level, width in LEVELS.items():
        assert 100 * (2 * norm.cdf(width) - 1) == pytest.approx(float(level), abs=1e-9)


@pytest.mark.parametrize(("stated", "rms"), [(1.0, 1.0), (0.5, 2.0), (2.0, 0.5)])
def test_shares_are_those_of_the_distribution(rng, stated, rms):
    from scipy.stats import norm

    sd = rng.uniform(0.01, 0.05, (4000, 3, 3))
    found = coverage(sd * rng.standard_normal(sd.shape), stated * sd, ("neck", "head", "pelvis"))
    assert found is not None
    for level, width in LEVELS.items():
        assert found[f"within_{level}"] == pytest.approx(2 * norm.cdf(width * stated) - 1, abs=0.01)
    assert found["rms_z"] == pytest.approx(rms, rel=0.02)
    assert found["count"] == sd.size
    assert found["joints"]["head"]["sd_mean_mm"] == pytest.approx(1000 * stated * sd[:, 1].mean())


def test_only_where_both_are_known_counts():
    delta, sd = np.zeros((4, 2, 3)), np.full((4, 2, 3), 0.01)
    delta[0], sd[1], sd[2, 0] = np.nan, np.nan, 0
    found = coverage(delta, sd, ("neck", "head"))
    assert found is not None
    assert (found["count"], found["joints"]["neck"]["count"], found["joints"]["head"]["count"]) == (9, 3, 6)
    assert coverage(delta, np.full_like(sd, np.nan), ("neck", "head")) is None


@pytest.mark.parametrize(("stated", "shift", "highest"), [(0.5, 0, {0, 9}), (2.0, 0, {4, 5}), (1.0, 2.0, {9}), (1.0, -2.0, {0})])
def test_ranks_of_the_truth_are_even_only_if_the_stated_distribution_is_right(rng, stated, shift, highest):
    sd = rng.uniform(0.01, 0.05, 20000)
    drawn = sd * rng.standard_normal(len(sd))
    np.testing.assert_allclose(rank_histogram(drawn, sd), 0.1, atol=0.01)
    wrong = rank_histogram(drawn + shift * sd, stated * sd)
    assert set(np.argsort(-wrong)[: len(highest)].tolist()) == highest
    assert wrong.sum() == pytest.approx(1)
    assert wrong.max() > 0.13
