"""Status of an estimate, from the overlap of the drawn model and the silhouettes, and from keypoints near it."""

from __future__ import annotations

import numpy as np

ABSENT_AREA = 0.2
"""If the silhouette is smaller than this share of the drawn body's area, the person is absent."""
LOST_OVERLAP, UNCERTAIN_OVERLAP = 0.5, 0.7
"""An overlap (intersection over union) below these is `lost` or `uncertain`; a cardbox model that fits overlaps by 0.8 to 0.9."""

PER_OVERLAP = 180.0
"""Log odds of a body that fits the silhouettes better by an overlap of 1 for a second."""
CONTRADICTION = 0.4
"""Difference of overlap and support from which on silhouettes and keypoints are of different things."""


def agreement_of(overlap: float, support: float = np.nan) -> float:
    """The overlap, or the share of the keypoints that support the estimate where that is greater: furniture in silhouettes and a poor
    detector are no loss. NaN: not known."""
    return float(np.fmax(overlap, support))


def status_of(overlap: float, support: float = np.nan) -> str:
    """`lost`, `uncertain` or `tracked`, by `agreement_of`."""
    agreement = agreement_of(overlap, support)
    unsure = agreement < UNCERTAIN_OVERLAP or abs(overlap - support) > CONTRADICTION
    return "lost" if agreement < LOST_OVERLAP else "uncertain" if unsure else "tracked"
