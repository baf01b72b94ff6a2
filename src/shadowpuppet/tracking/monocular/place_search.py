"""Where a person of known or average sizes is in front of one camera: many places are tried with coarse poses in masks of several moments.

The distance that fits best is too small by a constant share: clothes and hair make people larger in the picture than bodies of average
proportions, and a coarse pose is nearer to a silhouette if it is drawn larger.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT, sizes_from_height
from shadowpuppet.body.models import Make
from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.pose_search import search_pose
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.status import UNCERTAIN_OVERLAP

RATIO, DISTANCES_TRIED = 1.07, 36
"""Ratio of one tried distance to the one before, and how many are tried from 0.8 m on."""
RAISED = (0.0, 0.1, 0.25, 0.4)
"""Heights of the hands above the crown that are tried, as shares of the stature."""
PLATEAU = 0.05
"""Overlap under the greatest within which distances fit about as well."""
CLOTHED = 0.87
"""The middle of the distances at which an average body in coarse poses fits best, over the true one: 0.85 in 19 made films of 14 people,
0.89 in films of twelve others, men, women and children who stand, sit and kneel, 1.3 to 4 m away. Its standard deviation among films is
3.5 % of the mean, and that of the peak 4.4 %."""
ASIDE = (0.87, -0.87)
"""Directions (rad) to both sides that are tried if the person who faces the camera fits badly."""
COMPARED = 5
"""Number of moments in which places are compared."""
UNDER = 0.15
"""A place is compared in all moments if its overlap in its own is at most this much under the best; so a moment fits the chosen place, but
under the median."""


class Place(NamedTuple):
    """Result of `find_place`."""

    estimate: PersonEstimate
    fits: list[bool]
    """For each mask whether it fits the place."""
    overlap: float
    """The greatest median overlap of coarse poses with the masks at any distance."""


def find_place(camera: Camera, masks: Sequence[Mask], height: float | None, distance: float | None, sizes: CardboxSizes | None,
               body: str | Make = "rounded") -> Place:
    """The place that fits most of some masks (H, W).

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
    turn = 0.0
    found, overlap = _compared(camera, from_masks, compared, heights, distances, sizes, drawn, turn)
    if overlap.max() < UNCERTAIN_OVERLAP:
        for other in ASIDE:
            found_aside, overlap_aside = _compared(camera, from_masks, compared, heights, distances, sizes, drawn, other)
            if overlap_aside.max() > overlap.max():
                found, overlap, turn = found_aside, overlap_aside, other
    best, reached = found[int(np.argmax(overlap))], float(overlap.max())
    if distance is None and sizes is None:
        far = _middle(np.array([each.distance for each in found]), overlap) / CLOTHED
        found, overlap = _compared(camera, from_masks, compared, heights, [far], None, drawn, turn)
        best = found[int(np.argmax(overlap))]
    picture = best.picture(camera, body)
    overlaps = np.array([_overlap(picture, mask, turn) for mask in masks])
    return Place(best, (overlaps >= np.median(overlaps) - UNDER).tolist(), reached)


def _compared(camera: Camera, from_masks: Sequence[Mask], compared: Sequence[Mask], heights: Sequence[float], distances: Sequence[float],
              sizes: CardboxSizes | None, body: str | Make, turn: float) -> tuple[list[PersonEstimate], Array]:
    """Places that fit one of the masks (H, W), and the median of their overlaps in all that are `compared`, (N,); the person is turned
    (rad)."""
    places = [(each, mask) for mask in from_masks for each in _candidates(camera, mask, heights, distances, sizes)]
    own = np.array([_overlap(each.picture(camera, body), mask, turn) for each, mask in places])
    kept = [places[n][0] for n in np.flatnonzero(own >= own.max() - UNDER)]
    pictures = [each.picture(camera, body) for each in kept]
    return kept, np.array([np.median([_overlap(picture, mask, turn) for mask in compared]) for picture in pictures])


def _overlap(picture: Picture, mask: Mask, turn: float) -> float:
    """Overlap of the best coarse pose of an upper body that is turned (rad) with a mask (H, W)."""
    skeleton = picture.body.skeleton
    return search_pose(picture, mask, skeleton.pose(torso_twist=turn) if turn else None).overlap


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


def _middle(distances: Array, overlaps: Array) -> float:
    """The middle (m) of the distances at which the overlap is within `PLATEAU` of the greatest, both of shape (N,). The peak itself
    wanders on that plateau with the poses in a few moments."""
    tried = np.unique(distances)
    best = np.array([overlaps[distances == each].max() for each in tried])
    least, peak, scale = best.max() - PLATEAU, int(best.argmax()), np.log(tried)

    def crossed(beyond: NDArray[np.intp]) -> float:
        """Where the overlap falls below the plateau, going through the indices `beyond` the peak."""
        for k, before in zip(beyond, [peak, *beyond]):
            if best[k] < least:
                return float(np.interp(least, best[[k, before]], scale[[k, before]]))
        return float(scale[beyond[-1]] if len(beyond) else scale[peak])

    return float(np.exp((crossed(np.arange(peak)[::-1]) + crossed(np.arange(peak + 1, len(tried)))) / 2))


def _evenly(count: int, most: int) -> NDArray[np.int64]:
    """At most `most` of the indices below `count`, evenly spread, (K,)."""
    return np.unique(np.linspace(0, count - 1, most).round().astype(np.int64))
