"""Quality of standing feet: slide and depth in contact, and contacts compared with a truth's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.io.contacts import ContactTable
from shadowpuppet.motion.contact.contact import contacts_of
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.synchronization import match

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


def standing_figures(run: JointTable, truth: JointTable | None = None, true_contacts: ContactTable | None = None) -> dict[str, Any]:
    """How a run's heels and toes stand; empty for a run without them.

    Slide (mm/s) and depth (mm) while they are in contact as found in the run itself, and the height of the floor (m). With a truth that has
    contacts, on the run's clock and in its world: the same of the run's points while the truth's are in contact, slide of the truth's,
    precision and recall of the run's contacts.
    """
    found = contacts_of(run)
    if found is None:
        return {}
    points = run.select(found.names).positions
    out: dict[str, Any] = {"floor_m": found.floor, "slide_mm_s": 1000 * slide(run.times, points, found.touching),
                           "depth_mm": {name: 1000 * value for name, value in depth(points, found.touching, found.floor).items()}}
    names = [name for name in found.names if true_contacts is not None and truth is not None and name in true_contacts.names
             and name in truth.names]
    if not names or truth is None or true_contacts is None:
        return out
    index, near = match(run.times, truth.times)
    flag, also = match(true_contacts.times, truth.times)
    used = near & also
    touching = true_contacts.touching[flag[used]][:, [true_contacts.names.index(name) for name in names]]
    times, theirs, ours = truth.times[used], truth.select(names).positions[used], run.select(names).positions[index[used]]
    own = found.touching[index[used]][:, [found.names.index(name) for name in names]]
    touching = touching & np.isfinite(theirs).all(2)
    true = {"slide_mm_s": 1000 * slide(times, ours, touching), "truth_slide_mm_s": 1000 * slide(times, theirs, touching),
            "depth_mm": {name: 1000 * value for name, value in depth(ours, touching, found.floor).items()}}
    return out | {"true_stance": true | agreement(own, touching)}
