"""Status of an estimate, from the overlap of the drawn model and the silhouettes."""

from __future__ import annotations

ABSENT_AREA = 0.2
"""If the silhouette is smaller than this share of the drawn body's area, the person is absent."""
LOST_OVERLAP, UNCERTAIN_OVERLAP = 0.5, 0.7
"""An overlap (intersection over union) below these is `lost` or `uncertain`; a cardbox model that fits overlaps by 0.8 to 0.9."""

PER_OVERLAP = 180.0
"""Log odds of a body that fits the silhouettes better by an overlap of 1 for a second."""


def status_of(overlap: float) -> str:
    """`lost`, `uncertain` or `tracked`."""
    return "lost" if overlap < LOST_OVERLAP else "uncertain" if overlap < UNCERTAIN_OVERLAP else "tracked"
