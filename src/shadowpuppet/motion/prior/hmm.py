"""Hidden Markov models: which state was when, given a whole sequence and how well every state explains every frame of it.

Knows no densities: their logarithms come in as an array. All sums are of logarithms, so that neither long sequences nor densities that
differ by a factor of e^10000 underflow, and a transition of probability zero is one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.geometry import Array
from shadowpuppet.jit import inline_kernel, kernel

NEGLIGIBLE = -40.0
"""A term of a sum that is less than e^NEGLIGIBLE of its greatest changes no digit of it."""


class Posterior(NamedTuple):
    """What a whole sequence says of its states."""

    states: Array
    """Probability of each state in each frame, gamma of eq. 7, of shape (T, M)."""
    pairs: Array
    """Expected number of transitions from state i to state j, the sum of xi over time (eqs. 15 and 16), of shape (M, M)."""
    log_likelihood: float
    """Of the sequence; -inf where the model cannot make it, and then the arrays are zero."""


def posterior(log_densities: ArrayLike, initial: ArrayLike, transitions: ArrayLike) -> Posterior:
    """The forward-backward algorithm (Ni 2008, eqs. 1 to 7, 15, 16; Rabiner 1989).

    `log_densities` (T, M): log b_j(x_t). `initial` (M,) and `transitions` (M, M), rows summing to one: probabilities.
    """
    with np.errstate(divide="ignore"):
        log_initial, log_transitions = np.log(np.array(initial, float)), np.log(np.array(transitions, float))
    densities = np.ascontiguousarray(log_densities, float)
    alpha, beta, pairs = np.empty(densities.shape), np.empty(densities.shape), np.zeros(log_transitions.shape)
    total = _forward_backward(densities, log_initial, log_transitions, np.empty(len(pairs)), alpha, beta, pairs)
    if total == -np.inf:
        return Posterior(np.zeros(densities.shape), pairs, -np.inf)
    states = np.exp(alpha + beta - total)
    return Posterior(states / states.sum(1, keepdims=True), pairs, float(total))


@inline_kernel
def _log_sum(terms):  # pragma: no cover
    """log(sum(exp(terms)))."""
    top, total = -np.inf, 0.0
    for term in terms:
        top = max(top, term)
    if top == -np.inf:
        return top
    for term in terms:
        if term - top > NEGLIGIBLE:
            total += np.exp(term - top)
    return top + np.log(total)


@kernel
def _forward_backward(densities, initial, transitions, terms, alpha, beta, pairs):  # pragma: no cover
    """Logarithms throughout; fills alpha and beta (T, M), adds to pairs (M, M), returns the log likelihood. `terms` (M,) is scratch."""
    T, M = densities.shape
    for j in range(M):
        alpha[0, j] = initial[j] + densities[0, j]
    for t in range(1, T):
        for j in range(M):
            for i in range(M):
                terms[i] = alpha[t - 1, i] + transitions[i, j]
            alpha[t, j] = _log_sum(terms) + densities[t, j]
    total = _log_sum(alpha[T - 1])
    if total == -np.inf:
        return total
    beta[T - 1] = 0.0
    for t in range(T - 2, -1, -1):
        for i in range(M):
            for j in range(M):
                terms[j] = transitions[i, j] + densities[t + 1, j] + beta[t + 1, j]
                share = alpha[t, i] + terms[j] - total
                if share > NEGLIGIBLE:
                    pairs[i, j] += np.exp(share)
            beta[t, i] = _log_sum(terms)
    return total
