"""Where a person of known or average sizes is in front of one camera: many places are tried with coarse poses in masks of several moments.

The distance that fits best is too small by a constant share: clothes and hair make people larger in the picture than bodies of average
proportions, and a coarse pose is nearer to a silhouette if it is drawn larger.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT, sizes_from_height
from shadowpuppet.body.models import Make
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import place
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.pose_search import search_pose
from shadowpuppet.tracking.monocular.size_search import PersonEstimate

RATIO, DISTANCES_TRIED = 1.07, 36
"""Ratio of one tried distance to the one before, and how many are tried from 0.8 m on."""
RAISED = (0.0, 0.1, 0.25, 0.4)
"""Heights of the hands above the crown that are tried, as shares of the stature."""
CLOTHED = 0.89
"""The distance at which an average body in coarse poses fits best, over the true one: 0.891 with a standard deviation of 0.029 for twelve
made people, men, women and children who stand, sit and kneel, 1.3 to 2.4 m away."""
COMPARED = 5
"""Number of moments in which places are compared."""
PRUNED, WELL = 0.15, 0.15
"""A place is compared in all moments if its overlap in its own is at most this much under the best; a moment fits the chosen place if its
overlap is at most this much under the median."""


def find_place(camera: Camera, masks: Sequence[Mask], height: float | None, distance: float | None, sizes: CardboxSizes | None,
               body: str | Make = "rounded") -> tuple[PersonEstimate, list[bool]]:
    """The place that fits most of some masks (H, W), and for each mask whether it fits there.

    Height and distance (m) are kept if given, and so are `sizes`, whose silhouettes are taken to be as large as the person's. The median
    of the overlaps counts: the moments of a person who walks in and sits down may be any share but the most. The overlap, not eq. 2:
    most of the silhouette is where a body that is small, because far away, may have its legs, and would cost nothing.
    """
    compared = [masks[k] for k in _evenly(len(masks), COMPARED)]
    from_masks = [compared[k] for k in _evenly(len(compared), 3)]
    known = height is not None or sizes is not None or distance is None
    heights = [height or AVERAGE_HEIGHT] if known else np.arange(1.0, 2.1, 0.08).tolist()
    distances = [distance] if distance is not None else (0.8 * RATIO ** np.arange(DISTANCES_TRIED)).tolist()
    drawn: str | Make = "rounded" if sizes is None and distance is None else body
    found, overlap = _compared(camera, from_masks, compared, heights, distances, sizes, drawn)
    best = found[int(np.argmax(overlap))]
    if distance is None and sizes is None:
        far = _peak(np.array([each.distance for each in found]), overlap) / CLOTHED
        found, overlap = _compared(camera, from_masks, compared, heights, [far], None, drawn)
        best = found[int(np.argmax(overlap))]
    picture = best.picture(camera, body)
    overlaps = np.array([search_pose(picture, mask).overlap for mask in masks])
    return best, (overlaps >= np.median(overlaps) - WELL).tolist()


def _compared(camera: Camera, from_masks: Sequence[Mask], compared: Sequence[Mask], heights: Sequence[float], distances: Sequence[float],
              sizes: CardboxSizes | None, body: str | Make) -> tuple[list[PersonEstimate], Array]:
    """Places that fit one of the masks (H, W), and the median of their overlaps in all that are `compared`, (N,)."""
    places = [(each, mask) for mask in from_masks for each in _candidates(camera, mask, heights, distances, sizes)]
    own = np.array([search_pose(each.picture(camera, body), mask).overlap for each, mask in places])
    kept = [places[n][0] for n in np.flatnonzero(own >= own.max() - PRUNED)]
    return kept, np.array([np.median([search_pose(each.picture(camera, body), mask).overlap for mask in compared]) for each in kept])


def _candidates(camera: Camera, mask: Mask, heights: Sequence[float], distances: Sequence[float],
                sizes: CardboxSizes | None) -> list[PersonEstimate]:
    """Places with the crown at the upper edge of a mask (H, W) or, for raised arms, below it."""
    top = np.flatnonzero(mask.any(1))[0]
    centre = np.flatnonzero(mask.any(0)).mean()
    up = place(camera, 0.0, 0.0)[:3, 2]
    ray = camera.rays(np.array([centre, top], float))
    out = list[PersonEstimate]()
    for tall, far in product(heights, distances):
        of = sizes or sizes_from_height(tall)
        crown = of.torso_height + of.neck_gap + of.head_height
        at = PersonEstimate(of, tall, far, float(ray / ray[2] * far @ up) - crown)
        out += [replace(at, elevation=at.elevation - raised * tall) for raised in RAISED]
    return out


def _peak(distances: Array, overlaps: Array) -> float:
    """The distance (m) of the greatest overlap, between the tried ones by a parabola through three; both of shape (N,)."""
    tried = np.unique(distances)
    best = np.array([overlaps[distances == each].max() for each in tried])
    k = int(best.argmax())
    if not 0 < k < len(tried) - 1 or tried[k + 1] > RATIO**1.5 * tried[k] or tried[k] > RATIO**1.5 * tried[k - 1]:
        return float(tried[k])
    before, here, after = best[k - 1 : k + 2]
    bend = before - 2 * here + after
    return float(tried[k] * RATIO ** (0.5 * (before - after) / bend if bend < 0 else 0.0))


def _evenly(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the indices below `count`, evenly spread, (K,)."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))
