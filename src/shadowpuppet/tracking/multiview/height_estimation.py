"""The person's height from the first frames of several cameras, whether they stand, sit, kneel or lie.

Ni 2008 takes the sizes as known.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import HEIGHTS
from shadowpuppet.body.skeleton import bounded
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.tracking.multiview.observation import MultiviewObservation
from shadowpuppet.tracking.multiview.pose_search import STRAY
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MIN_POINTS, MultiviewTracker

RATIO, FRAMES = 1.09, 5
"""Ratio of neighbouring heights that are tried, and number of frames they are tried on."""
LONGEST = 1.3
"""Height over the longest extent of the hull, at most: of those who sit or kneel upright."""
OUTSIDE = 0.3
"""Weight (m^2) of the share of the limbs that is outside two silhouettes or more: clothes, and furniture that the silhouettes contain, make
large bodies fit, up to the walls of the hull."""
PENALTY, DEVIATION = 0.02, 0.1
"""Relative cost of a height that deviates from the average by `DEVIATION` (m), that of adults in ANSUR II (Gordon et al. 2014), women and
men together; it grows with the square, and is bounded for the sake of children."""
TALL = 2.33
"""Deviations by which a height is unlikely: 99 adults in 100 are less tall."""


class FirstFrame(NamedTuple):
    """One of the first frames."""

    points: SurfacePoints
    masks: Sequence[Mask | None]
    """The masks (H, W) that the points were made from, one per camera."""
    keypoints: Sequence[Keypoints | None] = ()
    """What a detector found, one per camera; empty without one."""


First = Sequence[FirstFrame | tuple[SurfacePoints, Sequence[Mask | None]]]
"""Frames in order of time, without keypoints also as pairs."""


def first_frames(first: First) -> list[FirstFrame]:
    """All of them with keypoints or none."""
    return [each if isinstance(each, FirstFrame) else FirstFrame(each[0], each[1]) for each in first]


class SeenHeight(NamedTuple):
    """A height that was estimated."""

    height: float
    """Metres, shoes on."""
    frame: int
    """Index of the frame that fits best."""


def estimate_height(rng: np.random.Generator, make: Callable[[float], Body], cameras: Sequence[Camera], first: First,
                    settings: MultiviewSettings) -> SeenHeight | None:
    """Height of the person in the `first` frames: that whose body, by `make`, fits a few frames best; None if no person is visible. The
    hull's extent does not give it: arms may be overhead, and the person may sit or lie. Neighbouring heights are tried downhill."""
    longest = longest_extent(first)
    if longest is None:
        return None
    plain, chosen = replace(settings, method="hybrid", refinement="gauss_newton"), evenly_spread(len(first), FRAMES)
    begin, tried = min(AVERAGE_HEIGHT, LONGEST * longest), dict[int, Array]()

    def cost(step: int) -> float:
        height = begin * RATIO**step
        if not HEIGHTS[0] <= height <= HEIGHTS[1]:
            return np.inf
        if step not in tried:
            tracker = MultiviewTracker(make(height), tuple(cameras), plain)
            tried[step] = np.array([_misfit(rng, tracker, *first[n]) for n in chosen])
        seen = tried[step][np.isfinite(tried[step])]
        unusual = bounded(np.array((height - AVERAGE_HEIGHT) / DEVIATION))
        return float(seen.mean() * (1 + PENALTY * unusual)) if len(seen) else np.inf

    at = 0
    while cost(better := min((at - 1, at + 1), key=cost)) < cost(at):
        at = better
    if not np.isfinite(cost(at)):
        return None
    return SeenHeight(begin * RATIO ** (at + lowest_point(cost(at - 1), cost(at), cost(at + 1))), int(chosen[int(tried[at].argmin())]))


def _misfit(rng: np.random.Generator, tracker: MultiviewTracker, points: SurfacePoints, masks: Sequence[Mask | None],
            keypoints: Sequence[Keypoints | None] = ()) -> float:
    """Cost (m^2) of the pose found in a frame; infinite if there is no person."""
    state = tracker.start(rng, points, masks, keypoints=keypoints)
    if state.status == "absent":
        return np.inf
    return state.cost + OUTSIDE * MultiviewObservation(tracker.views, points, masks).outside(state.pose)


def lowest_point(before: float, here: float, after: float) -> float:
    """Abscissa of the minimum of a parabola through values at -1, 0 and 1, where the value at 0 is the least; 0 if a value is infinite."""
    curve = before - 2 * here + after
    return 0.5 * (before - after) / curve if np.isfinite(curve) and curve > 0 else 0.0


def longest_extent(first: First) -> float | None:
    """The longest extent of the frames' surface points along their principal axes, metres, of 9 in 10 frames; None without points."""
    longest = [float(extents(points.points)[0]) for points, *_ in first if len(points.points) > MIN_POINTS]
    return float(np.percentile(longest, 90)) if longest else None


def extents(points: Array) -> Array:
    """Extents (3,) of surface points (P, 3) along their principal axes, the longest first, metres, and 0 of too few points."""
    if len(points) <= MIN_POINTS:
        return np.zeros(3)
    middle = points - points.mean(0)
    along = np.sort(middle @ np.linalg.svd(middle, full_matrices=False)[2].T, axis=0)
    return np.sort(along[-1 - STRAY] - along[STRAY])[::-1]


def is_unlikely(height: float) -> bool:
    """Whether hardly any adult has a height, metres."""
    return height > AVERAGE_HEIGHT + TALL * DEVIATION
