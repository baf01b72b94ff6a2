"""Colour models of person and scene: smoothed histograms of Y, Cr, Cb, compared by their likelihood ratio."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.silhouette.background import Floats

BINS = (24, 56, 56)
"""Number of bins of Y, Cr, Cb."""
LOWEST, WIDTH = np.array([0, 16, 16], np.float32), np.array([256 / BINS[0], 4, 4], np.float32)
"""Where the bins begin, and their width, grey levels. Chroma has all values of video: before a blue or green wall, shades of it and the
person's shadow on it must not fall into one bin."""
SMOOTHING = 0.8
"""Standard deviation, bins, of the smoothing."""
UNKNOWN = 5e-4
"""Share of a colour below which a model hardly knows it: where neither does, the ratio is 1."""

Model = NDArray[np.float64]
"""Shares of the colours, of shape `BINS`."""


def colour_model(colours: Floats, weights: NDArray[np.floating]) -> Model:
    """The model of colours (N, 3) with weights (N,)."""
    from scipy.ndimage import gaussian_filter

    counts = np.bincount(_bin(colours), weights, int(np.prod(BINS))).reshape(BINS)
    smooth = gaussian_filter(counts, SMOOTHING)
    return smooth / max(smooth.sum(), 1e-9)


def log_ratio(colours: Floats, person: Model, scene: Model) -> NDArray[np.float64]:
    """Logarithm (...) of the likelihood of colours (..., 3) by the model of the person over that of the scene."""
    found = _bin(colours)
    return np.log((person.reshape(-1)[found] + UNKNOWN) / (scene.reshape(-1)[found] + UNKNOWN))


def known(colours: Floats, model: Model) -> NDArray[np.float64]:
    """Share (...) of colours (..., 3) in a model."""
    return model.reshape(-1)[_bin(colours)]


def _bin(colours: Floats) -> NDArray[np.intp]:
    places = np.clip((colours - LOWEST) / WIDTH, 0, np.array(BINS) - 1).astype(np.intp)
    return (places[..., 0] * BINS[1] + places[..., 1]) * BINS[2] + places[..., 2]
