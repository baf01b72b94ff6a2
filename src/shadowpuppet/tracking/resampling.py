"""Resampling schemes, all of one signature:

    scheme(rng, log_weights, number) -> ancestors (number,), indices of particles

`log_weights` (N,) need not be normalised. In Liu 2011 the best particle comes first and stays as it is: `deterministic` (DRS, Algorithm 4)
puts it there, `stratified` (SRS, Algorithm 3) and the others through `with_best`.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.geometry import Array

Indices = NDArray[np.int64]
Scheme = Callable[[np.random.Generator, Array, int], Indices]


def normalise(log_weights: ArrayLike) -> Array:
    """Weights (N,) that sum to one; the largest exponent is subtracted first. All -inf gives equal weights."""
    log_weights = np.asarray(log_weights, float)
    top = log_weights.max()
    if not np.isfinite(top):
        return np.full(len(log_weights), 1 / len(log_weights))
    weights = np.exp(log_weights - top)
    return weights / weights.sum()


def _inverse(log_weights: ArrayLike, points: Array) -> Indices:
    """psi = min{j : r <= L_j} for sorted points r in (0, 1] (Algorithm 3 with L of eq. 7)."""
    cumulative = np.cumsum(normalise(log_weights))
    cumulative /= cumulative[-1]  # exactly 1 at the end: rounding must lead neither past it nor to a last particle without weight
    return np.searchsorted(cumulative, points, side="left")


def multinomial(rng: np.random.Generator, log_weights: ArrayLike, number: int) -> Indices:
    """Independent draws by weight."""
    return _inverse(log_weights, np.sort(1 - rng.random(number)))


def stratified(rng: np.random.Generator, log_weights: ArrayLike, number: int) -> Indices:
    """One draw in each of `number` equal strata of the cumulative weight (Kitagawa 1996), eq. 7."""
    return _inverse(log_weights, (np.arange(number) + 1 - rng.random(number)) / number)


def systematic(rng: np.random.Generator, log_weights: ArrayLike, number: int) -> Indices:
    """One uniform draw, shared by all strata."""
    return _inverse(log_weights, (np.arange(number) + 1 - rng.random()) / number)


def residual(rng: np.random.Generator, log_weights: ArrayLike, number: int) -> Indices:
    """floor(number * weight) copies of each, the rest drawn by the remainders (Liu & Chen 1998)."""
    expected = normalise(log_weights) * number
    copies = np.floor(expected + 1e-9).astype(np.int64)  # a weight of exactly k / number must not lose a copy to rounding
    certain = np.repeat(np.arange(len(copies)), copies)
    rest = number - len(certain)
    if rest == 0:
        return certain
    with np.errstate(divide="ignore"):
        remaining = np.log(np.maximum(expected - copies, 0))
    return np.sort(np.concatenate([certain, multinomial(rng, remaining, rest)]))


def deterministic(rng: np.random.Generator, log_weights: ArrayLike, number: int, survival: float = 0.2) -> Indices:
    """DRS (Liu 2011, Algorithm 4): the best `survival` * number particles survive in their order; copies of the best fill the rest."""
    ranked = np.argsort(-np.asarray(log_weights, float), kind="stable")
    survivors = ranked[: int(survival * number + 1e-9)]
    return np.concatenate([survivors, np.full(number - len(survivors), ranked[0])])


def with_best(scheme: Scheme) -> Scheme:
    """The scheme with the best particle put first, as in Algorithm 3; it draws the others."""

    def kept(rng: np.random.Generator, log_weights: ArrayLike, number: int) -> Indices:
        best = np.argmax(np.asarray(log_weights, float))
        return np.concatenate([[best], scheme(rng, np.asarray(log_weights, float), number - 1)])

    return kept


SCHEMES: dict[str, Scheme] = {
    "deterministic": deterministic,
    "stratified": stratified,
    "systematic": systematic,
    "multinomial": multinomial,
    "residual": residual,
}


def make_scheme(name: str, survival: float) -> Scheme:
    """The scheme of this name, with the best particle first. Raises `SettingsError` with the valid names."""
    if name not in SCHEMES:
        raise SettingsError(f"unknown resampling {name!r}; there are: {choices(SCHEMES)}")
    if name == "deterministic":
        return lambda rng, log_weights, number: deterministic(rng, log_weights, number, survival)
    return with_best(SCHEMES[name])
