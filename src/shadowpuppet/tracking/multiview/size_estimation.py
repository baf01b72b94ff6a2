"""Who is in the first frames of several cameras: sizes and poses of a whole body, solved together.

Ni 2008 takes the sizes as known. Here bones come from training motion where there is some, else from the height, and all sizes are then
refined on the hulls of the first frames.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Generic

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT, stature_of
from shadowpuppet.body.models import shares_of
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import HEIGHTS, BoneSizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.bundle_adjustment import Measured, solve_bundle
from shadowpuppet.tracking.multiview.observation import Evidence
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker

SHOWN = ("hip_distance", "hip_drop", "hip_forward", "shoulder_distance", "shoulder_drop", "shoulder_forward", "upper_arm_length",
         "forearm_length", "hand_point", "thigh_length", "shank_length", "trunk_height", "lumbar_height", "thorax_height")  # fmt: skip
"""Sizes that joints of training motion show."""
EXACT = 0.001
"""Deviation of those (m)."""
ROUNDS = 2
"""How often the first frames are tracked and the sizes solved for."""
FRAMES, SHARE = 24, 4
"""Frames that are solved for together, at most, and every which of their points is taken."""
WORTH = {"anatomical": 10.0, "cylinders": 0.2}
"""What a frame's points are worth for the sizes (see `bundle.WORTH`): cylinders fit nobody, and would pay for it with wrong bones."""
SIZE_PULL = 1e-5
"""Pull of the poses to where the tracker had them."""
WORSE = 0.06
"""A frame whose overlap is less than the best one's by this was misunderstood."""
SHARES, TRIED = (0.8, 0.86, 0.93, 1.0, 1.08, 1.2), 5
"""Heights that are tried, as shares of the extent, and frames in which they are."""
UNUSUAL, DEVIATION = 0.02, 0.1
"""What a height costs more for each squared deviation (m) from the average."""
ENOUGH = 4
"""Frames in which the person must be found."""


@dataclass(frozen=True, eq=False)
class Person(Generic[Measured]):
    """A person measured in the first frames."""

    sizes: Measured
    body: Body
    residual: float
    """Root mean square distance of the surface points to the tangent planes, metres."""
    overlap: float
    """Mean intersection over union of body and silhouettes."""
    frames: int
    """In which the person was found."""


def spread_of(sizes: BoneSizes, shown: bool) -> Array:
    """Deviations (K,), metres, of sizes that are those of an average person; where bones are `shown` by joints, these are exact."""
    shares = shares_of(type(sizes))
    stature = stature_of({name: getattr(sizes, name) for name in ("thigh_length", "shank_length", "upper_arm_length", "forearm_length")})
    return np.array([EXACT if shown and name in SHOWN else shares[name][1] * stature for name in sizes.names()])


def measure(rng: np.random.Generator, make: Callable[[Measured], Body], expected: Measured, spread: Array, cameras: Sequence[Camera],
            first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]], settings: MultiviewSettings,
            library: Array | None = None) -> Person[Measured]:
    """Sizes of whoever the `first` frames (surface points and masks, in order of time) show, near `expected` with deviations `spread` (K,).

    Raises `TrackingError` where nobody is found in them.
    """
    plain, sizes, residual = replace(settings, method="hybrid", refinement="gauss_newton"), expected, np.nan
    for _ in range(ROUNDS if (spread > 0).any() else 0):
        tracker = MultiviewTracker(make(sizes), tuple(cameras), plain, None, library)
        found = _followed(rng, tracker, first)
        if len(found) < ENOUGH:
            break
        chosen = np.unique(np.linspace(0, len(found) - 1, FRAMES).astype(int))
        poses = np.array([found[i][1].pose for i in chosen])
        clouds = [Evidence(tracker.stage, *first[found[i][0]]).cloud(SHARE) for i in chosen]
        centre, pull = map(np.array, zip(*(tracker.usual.held(pose, SIZE_PULL, settings.posture) for pose in poses), strict=True))
        bundle = solve_bundle(make, expected, spread, poses, clouds, settings.surface, pull=pull, centre=centre, first=sizes,
                              worth=WORTH[settings.body])
        sizes, residual = bundle.sizes, bundle.residual
    tracker = MultiviewTracker(make(sizes), tuple(cameras), plain, None, library)
    found = _followed(rng, tracker, first)
    if not found:
        raise TrackingError(f"nobody is found in the first {len(first)} frames' silhouettes: are they a whole person's, in two cameras or "
                            "more at once, and do the cameras agree? `shadowpuppet info` tells")
    return Person(sizes, tracker.body, residual, float(np.mean([state.overlap for _, state in found])), len(found))


def likely_height(rng: np.random.Generator, make: Callable[[float], Body], cameras: Sequence[Camera],
                  first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]], settings: MultiviewSettings) -> float | None:
    """How tall (m) whoever the `first` frames show may be: of bodies of several heights, `make` makes them, the one that is found best in
    some frames. None where nobody is. Arms overhead look tall and who crouches looks small, so that the extent alone does not tell."""
    seen = seen_height(first)
    if seen is None:
        return None
    plain, chosen = replace(settings, method="hybrid", refinement="gauss_newton"), first[:: max(1, len(first) // TRIED)][:TRIED]
    costs = []
    for height in (heights := [seen * share for share in SHARES if HEIGHTS[0] <= seen * share <= HEIGHTS[1]]):
        tracker = MultiviewTracker(make(height), tuple(cameras), plain)
        found = [tracker.start(rng, points, masks) for points, masks in chosen]
        unusual = 1 + UNUSUAL * ((height - AVERAGE_HEIGHT) / DEVIATION) ** 2
        costs.append(unusual * np.mean([state.cost for state in found if state.status != "absent"] or [np.inf]))
    return heights[int(np.argmin(costs))] if heights else None


def _followed(rng: np.random.Generator, tracker: MultiviewTracker,
              first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]]) -> list[tuple[int, MultiviewState]]:
    """Frames in which the person is found, and the tracker's states: followed, or, where that goes badly, found anew if that is better."""
    state, found, best = None, [], 0.0
    for n, (points, masks) in enumerate(first):
        state = tracker.start(rng, points, masks) if state is None else tracker.step(rng, state, points, masks)
        if state.overlap < best - WORSE and state.status != "absent":
            state = min(state, tracker.start(rng, points, masks), key=lambda each: each.cost)
        best = max(best, state.overlap)
        if state.status in ("tracked", "uncertain"):
            found.append((n, state))
    return [(n, state) for n, state in found if state.overlap > best - WORSE]


def seen_height(first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]]) -> float | None:
    """How tall whoever the frames show is when they stand tallest, metres; None where there are no points."""
    extents = [float(np.ptp(np.sort(points.points[:, 2])[2:-2])) for points, _ in first if len(points.points) > 50]
    return float(np.percentile(extents, 90)) if extents else None
