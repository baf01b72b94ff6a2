"""Points laid over others as well as a rigid motion can (Procrustes; Kabsch 1976, with the scale of Umeyama 1991)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.geometry import Array

FEWEST = 3
"""Points that a rotation needs."""


class Alignment(NamedTuple):
    """What lays points over others: `scale * R @ point + translation`."""

    rotation: Array
    """Of shape (..., 3, 3)."""
    translation: Array
    """Of shape (..., 3)."""
    scale: Array
    """Of shape (...)."""

    def apply(self, points: ArrayLike) -> Array:
        """Points (..., P, 3) laid over."""
        moved = np.asarray(points, float) @ np.swapaxes(self.rotation, -1, -2)
        return self.scale[..., None, None] * moved + self.translation[..., None, :]


def align(points: ArrayLike, targets: ArrayLike, scaled: bool = False) -> Alignment:
    """The rotation, translation and, if `scaled`, scale that bring points (..., P, 3) nearest to targets, by least squares.

    Each leading index is one of its own. Pairs of which one is not a number do not count; with fewer than three left nothing is told
    (not a number). A mirror image is never an answer.
    """
    points, targets = np.asarray(points, float), np.asarray(targets, float)
    known = (np.isfinite(points) & np.isfinite(targets)).all(-1, keepdims=True)
    count = known.sum(-2)
    middles = [np.where(known, each, 0).sum(-2) / np.maximum(count, 1) for each in (points, targets)]
    a, b = (np.where(known, each - middle[..., None, :], 0) for each, middle in zip((points, targets), middles))
    U, S, Vt = np.linalg.svd(np.swapaxes(b, -1, -2) @ a)
    signs = np.ones(S.shape)
    signs[..., 2] = np.where(np.linalg.det(U @ Vt) < 0, -1, 1)
    R = (U * signs[..., None, :]) @ Vt
    spread = (a**2).sum((-1, -2))
    scale = np.divide((S * signs).sum(-1), spread, out=np.ones(spread.shape), where=spread > 0) if scaled else np.ones(spread.shape)
    few = count[..., 0] < FEWEST
    scale = np.where(few, np.nan, scale)
    return Alignment(R, middles[1] - scale[..., None] * (R @ middles[0][..., None])[..., 0], scale)
