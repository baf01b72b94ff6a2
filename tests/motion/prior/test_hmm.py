"""Forward-backward against all paths one by one; what is impossible, and what is long."""

from __future__ import annotations

import naive
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.motion.prior.hmm import posterior

pytestmark = pytest.mark.kernels


def chances(rng: np.random.Generator, shape: tuple[int, ...], impossible: float = 0.0) -> np.ndarray:
    """Probabilities that sum to one along the last axis, some of them zero."""
    values = rng.random(shape) * (rng.random(shape) >= impossible)
    values[..., 0] += values.sum(-1) == 0
    return values / values.sum(-1, keepdims=True)


@settings(deadline=None, max_examples=80)
@given(frames=st.integers(1, 5), states=st.integers(1, 4), impossible=st.sampled_from([0.0, 0.4]),
       sharp=st.sampled_from([1.0, 30.0, 3000.0]), seed=st.integers(0, 2**32 - 1))
def test_all_paths_one_by_one_say_the_same(frames, states, impossible, sharp, seed):
    rng = np.random.default_rng(seed)
    densities = sharp * rng.standard_normal((frames, states))
    initial, transitions = chances(rng, (states,), impossible), chances(rng, (states, states), impossible)
    found, wanted = posterior(densities, initial, transitions), naive.posterior(densities, initial, transitions)
    assert found.log_likelihood == pytest.approx(wanted.log_likelihood, rel=1e-12, abs=1e-12)
    np.testing.assert_allclose(found.states, wanted.states, atol=1e-9)
    np.testing.assert_allclose(found.pairs, wanted.pairs, atol=1e-9)


def test_pairs_and_states_agree(rng):
    densities, initial, transitions = 5 * rng.standard_normal((50, 6)), chances(rng, (6,)), chances(rng, (6, 6))
    found = posterior(densities, initial, transitions)
    np.testing.assert_allclose(found.states.sum(1), 1)
    np.testing.assert_allclose(found.pairs.sum(1), found.states[:-1].sum(0))
    np.testing.assert_allclose(found.pairs.sum(0), found.states[1:].sum(0))


def test_a_sequence_that_cannot_be_has_no_likelihood_and_no_numbers_that_are_none():
    stay = np.eye(2)
    densities = np.array([[0.0, -np.inf], [-np.inf, 0.0]])
    found = posterior(densities, [0.5, 0.5], stay)
    assert found.log_likelihood == -np.inf
    assert (found.states == 0).all()
    assert (found.pairs == 0).all()


def test_a_path_that_looked_hopeless_is_found_where_it_is_the_only_one():
    """The second state is e^2000 less likely in the first frame, but no other leads to the third frame: scaled numbers lose it."""
    densities = np.array([[0.0, -2000.0], [-3000.0, 0.0], [-3000.0, 0.0]])
    found = posterior(densities, [0.5, 0.5], np.eye(2))
    np.testing.assert_allclose(found.states[:, 1], 1)
    assert found.log_likelihood == pytest.approx(np.log(0.5) - 2000)


def test_long_sequences_do_not_underflow(rng):
    """5,000 frames alike: every frame adds the same."""
    transitions = np.full((3, 3), 1 / 3)
    found = posterior(np.full((5000, 3), -400.0), np.full(3, 1 / 3), transitions)
    assert found.log_likelihood == pytest.approx(-400.0 * 5000, rel=1e-12)
    np.testing.assert_allclose(found.states, 1 / 3)
    np.testing.assert_allclose(found.pairs, 4999 / 9)


def test_strided_and_single_arrays_are_taken(rng):
    densities = rng.standard_normal((8, 6)).astype(np.float32)[::2, ::2]
    assert posterior(densities, np.full(3, 1 / 3), np.full((3, 3), 1 / 3)).states.shape == (4, 3)
