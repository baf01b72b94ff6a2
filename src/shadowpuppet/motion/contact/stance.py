"""How well what stands stands: slide and depth of points in contact, and contacts compared with a truth's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array

Flags = NDArray[np.bool_]


def slide(times: Array, points: Array, touching: Flags) -> float:
    """Mean speed along the floor (m/s) of points (T, P, 3), metres, from frame to frame in which they are in contact, `touching` (T, P);
    NaN if they never are."""
    both = touching[1:] & touching[:-1] & np.isfinite(np.diff(points, axis=0)).all(2)
    way = np.linalg.norm(np.diff(points[..., :2], axis=0), axis=2) / np.diff(times)[:, None]
    return float(way[both].mean()) if both.any() else np.nan


def depth(points: Array, touching: Flags, floor: float) -> dict[str, float]:
    """Mean depth (m) below the floor of points (T, P, 3) in contact, 0 for those above it, and the 95th percentile; empty if none is."""
    below = np.maximum(floor - points[..., 2], 0)[touching & np.isfinite(points).all(2)]
    return {"mean": float(below.mean()), "p95": float(np.percentile(below, 95))} if len(below) else {}


def agreement(found: Flags, truth: Flags) -> dict[str, Any]:
    """Precision and recall of contacts found (T, P) against true ones; NaN where there are none."""
    right, said, there = int((found & truth).sum()), int(found.sum()), int(truth.sum())
    return {"precision": right / said if said else np.nan, "recall": right / there if there else np.nan}
