"""Resampling: expected offspring, bounds on it, rounding boundaries, Algorithms 3 and 4; a published bias is caught."""

from __future__ import annotations

from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import SettingsError
from shadowpuppet.tracking.resampling import (
    SCHEMES,
    deterministic,
    make_scheme,
    multinomial,
    normalise,
    residual,
    stratified,
    systematic,
    with_best,
)  # fmt: skip

DRAWN = {name: scheme for name, scheme in SCHEMES.items() if name != "deterministic"}
BOUND = {"multinomial": np.inf, "stratified": 2, "systematic": 1, "residual": np.inf}
"""How far the offspring of a particle can lie from number * weight."""

log_weights = st.lists(st.one_of(st.floats(-30, 0), st.just(-np.inf)), min_size=1, max_size=40).filter(lambda w: max(w) > -np.inf)
seeds = st.integers(0, 2**32 - 1)


class Fixed:
    """A generator that draws one and the same number always: the ends of [0, 1) are drawn once in 2^53 times otherwise."""

    def __init__(self, value: float) -> None:
        self.value = value

    def random(self, size: int | None = None):
        return self.value if size is None else np.full(size, self.value)


ENDS = [Fixed(0.0), Fixed(np.nextafter(1.0, 0.0))]


def offspring(ancestors: np.ndarray, number: int) -> np.ndarray:
    return np.bincount(ancestors, minlength=number)


def mean_offspring(scheme: Callable, weights: np.ndarray, number: int, draws: int) -> tuple[np.ndarray, np.ndarray]:
    """Mean offspring of every particle, and five of its standard errors."""
    rng = np.random.default_rng(1)
    with np.errstate(divide="ignore"):
        counts = np.array([offspring(scheme(rng, np.log(weights), number), len(weights)) for _ in range(draws)])
    return counts.mean(0), 5 * counts.std(0) / np.sqrt(draws) + 1e-9


# Weights --------------------------------------------------------------------------------------------------------------


@given(log_weights, st.floats(-1e6, 1e6))
def test_weights_sum_to_one_and_do_not_depend_on_a_factor(values, shift):
    values = np.array(values)
    weights = normalise(values)
    assert weights.sum() == pytest.approx(1)
    assert (weights >= 0).all()
    assert (weights[values == -np.inf] == 0).all()
    np.testing.assert_allclose(normalise(values + shift), weights, rtol=1e-6, atol=1e-12)


@pytest.mark.parametrize("values", [[-np.inf] * 4, [-1e300] * 4, [0.0] * 4, [-1e5] * 4])
def test_no_information_means_equal_weights(values):
    np.testing.assert_allclose(normalise(values), 0.25)


def test_hopeless_costs_keep_their_ratios():
    """exp(-W^2 / (2 sigma^2)) of eq. 6 is zero in floating point for all of these."""
    np.testing.assert_allclose(normalise([-1e4, -1e4 - np.log(3)]), [0.75, 0.25])


# Offspring ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DRAWN)
@given(values=log_weights, number=st.integers(1, 60), seed=seeds)
@settings(deadline=None)
def test_as_many_as_asked_for_all_of_some_weight_in_order(name, values, number, seed):
    ancestors = SCHEMES[name](np.random.default_rng(seed), np.array(values), number)
    assert ancestors.shape == (number,)
    assert np.issubdtype(ancestors.dtype, np.integer)
    assert (np.diff(ancestors) >= 0).all()
    assert np.isfinite(np.array(values)[ancestors]).all()
    counts, expected = offspring(ancestors, len(values)), number * normalise(values)
    assert (np.abs(counts - expected) < BOUND[name] + 1e-9).all()
    if name == "residual":
        assert (counts >= np.floor(expected - 1e-9)).all()


@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize("number", [4, 10, 23])
def test_offspring_are_expected_by_weight(name, number):
    """Over many draws; five standard errors, so that one test in a million fails by chance, and the seed is fixed."""
    weights = np.array([0.02, 0.4, 0.0, 0.13, 0.0501, 0.3, 0.0999])
    mean, margin = mean_offspring(SCHEMES[name], weights, number, 4000)
    assert (np.abs(mean - number * weights) <= margin).all(), (mean, number * weights)


def filterpy_residual(rng: np.random.Generator, log_weights: np.ndarray, number: int) -> np.ndarray:
    """filterpy 1.4.5's `residual_resample`, which takes for the remaining weights w - floor(N w), not N w - floor(N w)."""
    weights = normalise(log_weights)
    copies = np.floor(number * weights).astype(int)
    certain = np.repeat(np.arange(len(weights)), copies)
    remaining = np.maximum(weights - copies, 0)  # negative there; as good as none
    cumulative = np.cumsum(remaining / remaining.sum())
    cumulative[-1] = 1.0
    return np.concatenate([certain, np.searchsorted(cumulative, rng.random(number - len(certain)))])


def test_the_bound_on_expected_offspring_catches_a_published_bias():
    weights = np.array([0.02, 0.4, 0.13, 0.0501, 0.3, 0.0999])
    mean, margin = mean_offspring(filterpy_residual, weights, 10, 4000)
    assert (np.abs(mean - 10 * weights) > margin).any()


def test_strata_are_drawn_one_by_one_or_together():
    """Of weights 1/4, 1/2, 1/4 and two strata: both outer particles with chance 1/4, or never."""
    values, rng = np.log([0.25, 0.5, 0.25]), np.random.default_rng(2)
    both = [np.mean([set(scheme(rng, values, 2).tolist()) == {0, 2} for _ in range(2000)]) for scheme in (stratified, systematic)]
    assert both[0] == pytest.approx(0.25, abs=0.05)
    assert both[1] == 0


def test_strata_vary_less_than_independent_draws(rng):
    weights = normalise(rng.standard_normal(30))
    spread = {}
    for name, scheme in DRAWN.items():
        spread[name] = np.array([offspring(scheme(rng, np.log(weights), 60), 30) for _ in range(300)]).var(0).sum()
    assert spread["stratified"] < 0.6 * spread["multinomial"]
    assert spread["systematic"] < 0.6 * spread["multinomial"]
    assert spread["residual"] < 0.8 * spread["multinomial"]


# Rounding boundaries --------------------------------------------------------------------------------------------------


@given(st.lists(st.integers(0, 9), min_size=1, max_size=30).filter(any), seeds)
@settings(deadline=None)
def test_weights_of_k_nths_get_exactly_k_copies(copies, seed):
    number = sum(copies)
    weights = np.array([float(Fraction(k, number)) for k in copies])
    with np.errstate(divide="ignore"):
        values = np.log(weights)
    for scheme in (stratified, systematic, residual):
        np.testing.assert_array_equal(offspring(scheme(np.random.default_rng(seed), values, number), len(copies)), copies)


@pytest.mark.parametrize("name", DRAWN)
@pytest.mark.parametrize("rng", ENDS, ids=["first", "last"])
@pytest.mark.parametrize("weights", [
    [0.1] * 10,  # sums to 1 - 1e-16
    [*[0.1] * 10, 0.0], [0.0, *[0.1] * 10, 0.0], [1 / 3] * 3, [1 / 49] * 49, [1e-300, 1.0], [1.0, 1e-300], [1.0, 0.0], [0.0, 1.0],
    [0.25 - 1e-12, 0.25, 0.25, 0.25],
])  # fmt: skip
def test_the_ends_of_the_unit_interval_draw_no_particle_without_weight_and_none_past_the_end(name, rng, weights):
    with np.errstate(divide="ignore"):
        values = np.log(weights)
    for number in (1, 3, len(weights), 100):
        ancestors = SCHEMES[name](rng, values, number)
        assert len(ancestors) == number
        assert ancestors.max() < len(weights)
        assert (np.array(weights)[ancestors] > 0).all()


@pytest.mark.parametrize("name", SCHEMES)
def test_one_particle_takes_all(name, rng):
    for number in (1, 2, 7):
        np.testing.assert_array_equal(SCHEMES[name](rng, np.array([-3.0]), number), np.zeros(number))
    one_hot = np.array([-np.inf, -np.inf, -700.0, -np.inf])
    found = SCHEMES[name](rng, one_hot, 6)
    if name != "deterministic":
        np.testing.assert_array_equal(found, np.full(6, 2))
    assert found[0] == 2


@pytest.mark.parametrize("name", DRAWN)
def test_without_any_weight_all_are_alike(name):
    mean, margin = mean_offspring(SCHEMES[name], np.zeros(5), 12, 2000)
    assert (np.abs(mean - 12 / 5) <= margin).all()


# Algorithm 3 and Algorithm 4 ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", DRAWN)
@given(values=log_weights, number=st.integers(1, 30), seed=seeds)
@settings(deadline=None, max_examples=40)
def test_algorithm_3_keeps_the_best_first_and_draws_the_others(name, values, number, seed):
    values = np.array(values)
    ancestors = with_best(SCHEMES[name])(np.random.default_rng(seed), values, number)
    assert ancestors.shape == (number,)
    assert ancestors[0] == np.argmax(values)
    np.testing.assert_array_equal(ancestors[1:], SCHEMES[name](np.random.default_rng(seed), values, number - 1))


@given(st.lists(st.floats(-1e4, 0), min_size=1, max_size=50), st.integers(1, 60), st.floats(0, 1))
def test_algorithm_4_ranks_and_fills_with_the_best(values, number, survival):
    values = np.array(values)
    ancestors = deterministic(np.random.default_rng(0), values, number, survival)
    live = min(max(int(survival * number + 1e-9), 1), len(values))
    assert ancestors.shape == (number,)
    np.testing.assert_array_equal(ancestors[:live], np.argsort(-values, kind="stable")[:live])
    assert (ancestors[live:] == np.argmax(values)).all()


@pytest.mark.parametrize(("survival", "wanted"), [
    (0.0, [3, 3, 3, 3, 3]), (0.2, [3, 3, 3, 3, 3]), (0.39, [3, 3, 3, 3, 3]), (0.4, [3, 1, 3, 3, 3]), (0.6, [3, 1, 4, 3, 3]),
    (1.0, [3, 1, 4, 0, 2]),
])  # fmt: skip
def test_shares_that_survive(survival, wanted):
    values = -np.array([40.0, 20, 50, 10, 30])
    np.testing.assert_array_equal(deterministic(np.random.default_rng(0), values, 5, survival), wanted)


@pytest.mark.parametrize("survival", [k / 10 for k in range(11)])
def test_a_share_is_not_lost_to_rounding(survival):
    """0.7 * 10 = 7.000000000000001, but 0.29 * 100 = 28.999999999999996."""
    for number in (10, 100, 200):
        ancestors = deterministic(np.random.default_rng(0), -np.arange(number, dtype=float), number, survival)
        assert len(set(ancestors.tolist())) == max(round(survival * number), 1)
    assert len(set(deterministic(np.random.default_rng(0), -np.arange(100.0), 100, 0.29).tolist())) == 29


def test_algorithm_4_draws_no_random_number():
    rng = np.random.default_rng(7)
    deterministic(rng, -np.arange(9.0), 9, 0.5)
    assert rng.random() == np.random.default_rng(7).random()


def test_ties_go_to_the_first():
    np.testing.assert_array_equal(deterministic(np.random.default_rng(0), np.zeros(4), 4, 0.75), [0, 1, 2, 0])


# By name --------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", SCHEMES)
def test_every_scheme_made_by_name_puts_the_best_first(name, rng):
    values = -np.array([0.3, 0.2, 0.1, 0.4])  # all are drawn, and those drawn come in order
    ancestors = make_scheme(name, 0.5)(rng, values, 8)
    assert len(ancestors) == 8
    assert ancestors[0] == 2
    if name == "deterministic":
        np.testing.assert_array_equal(ancestors, [2, 1, 0, 3, 2, 2, 2, 2])


def test_unknown_schemes_are_said_with_those_there_are():
    with pytest.raises(SettingsError) as error:
        make_scheme("best", 0.2)
    assert "unknown resampling 'best'; there are: deterministic, multinomial, residual, stratified, systematic" in str(error.value)


def test_same_seed_same_ancestors():
    values = np.random.default_rng(3).standard_normal(50)
    for scheme in (multinomial, stratified, systematic, residual):
        np.testing.assert_array_equal(*(scheme(np.random.default_rng(5), values, 50) for _ in range(2)))
