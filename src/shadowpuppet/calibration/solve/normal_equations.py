"""Normal equations of a bundle: boards' poses, which touch cameras only and not each other, are taken out first (Schur's complement)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array


class Reduced(NamedTuple):
    """Normal equations of cameras alone: Schur's complement of the boards' blocks."""

    S: Array
    """Of cameras, of shape (P, P)."""
    E: Array
    """Cameras' with boards', of shape (P, 6 B)."""
    inverses: Array
    """Of the boards' own blocks, of shape (B, 6, 6)."""


def reduced(H: Array, P: int) -> Reduced:
    """The complement of normal equations (N, N) whose first `P` columns are the cameras'. Raises `LinAlgError` if a board is free."""
    count = (len(H) - P) // 6
    own = H[P:, P:].reshape(count, 6, count, 6)[np.arange(count), :, np.arange(count)]
    inverses, E = np.asarray(np.linalg.inv(own) if count else np.zeros((0, 6, 6)), float), H[:P, P:]
    spread = np.einsum("pbi,bij->pbj", E.reshape(P, count, 6), inverses).reshape(P, 6 * count)
    return Reduced(H[:P, :P] - spread @ E.T, E, inverses)


def solution(H: Array, g: Array, P: int) -> Array:
    """The solution (N,) of H x = g."""
    try:
        S, E, inverses = reduced(H, P)
        alone = np.einsum("bij,bj->bi", inverses, g[P:].reshape(-1, 6)).ravel()
        first = np.linalg.solve(S, g[:P] - E @ alone) if P else g[:0]
        rest = alone - np.einsum("bij,bj->bi", inverses, (E.T @ first).reshape(-1, 6)).ravel()
        return np.concatenate([first, rest])
    except np.linalg.LinAlgError:
        return np.asarray(np.linalg.lstsq(H, g, rcond=None)[0], float)


def covariance_of(H: Array, P: int) -> Array:
    """Covariance (P, P) of the cameras' columns; infinite variance where the observations say nothing."""
    try:
        return np.asarray(np.linalg.pinv(reduced(H, P).S, hermitian=True), float) if P else np.zeros((0, 0))
    except np.linalg.LinAlgError:
        return np.diag(np.full(P, np.inf))
