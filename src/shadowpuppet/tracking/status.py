"""Status of an estimate from the overlap of model and silhouette."""

from __future__ import annotations

ABSENT_AREA, LOST_OVERLAP, UNCERTAIN_OVERLAP = 0.2, 0.5, 0.7
"""A silhouette under this share of the drawn body's area is nobody; an overlap (intersection over union) under these is lost or
uncertain. A cardbox that fits overlaps by 0.8 to 0.9."""


def status_of(overlap: float) -> str:
    """What an overlap says of an estimate."""
    return "lost" if overlap < LOST_OVERLAP else "uncertain" if overlap < UNCERTAIN_OVERLAP else "tracked"


SETTLE_CYCLES = 10
"""Frames' worth of cycles on the first frame, after the search."""
