"""The person's body sizes from the first frames of several cameras, solved together with the poses.

Ni 2008 takes the sizes as known. Here bones come from training motion if there is any, else from the height; then all sizes are refined on
the hulls of the first frames.
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
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.tracking.multiview.bundle_adjustment import Measured, solve_bundle
from shadowpuppet.tracking.multiview.observation import MultiviewObservation
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.unexplained import Unexplained

SIZES_FROM_JOINTS = (
    "hip_distance", "hip_drop", "hip_forward", "shoulder_distance", "shoulder_drop", "shoulder_forward", "upper_arm_length",
    "forearm_length", "hand_point", "thigh_length", "shank_length", "trunk_height", "lumbar_height", "thorax_height",
)  # fmt: skip
"""Sizes that follow from the joints of training motion."""
JOINT_DEVIATION = 0.001
"""Their standard deviation (m)."""
ROUNDS = 2
"""Number of rounds; each tracks the first frames, then solves for the sizes."""
MAX_FRAMES, POINT_STRIDE = 24, 4
"""Largest number of frames that are solved together, and the stride of their points."""
INDEPENDENT_POINTS = {"anatomical": 10.0, "cylinders": 0.2}
"""Effective number of independent points per frame, by body. Cylinders fit no person well: more weight would distort the bones."""
SIZE_PULL = 1e-5
"""Weight of the pull of the poses to the tracked ones."""
OVERLAP_LOSS = 0.06
"""A frame whose overlap is lower than the best by more than this is left out: its pose is wrong."""
HEIGHT_SHARES, HEIGHT_FRAMES = (0.8, 0.86, 0.93, 1.0, 1.08, 1.2), 5
"""Heights tried, as shares of the hull's extent, and the number of frames they are tried on."""
HEIGHT_PENALTY, HEIGHT_DEVIATION = 0.02, 0.1
"""Relative cost of a height that deviates from the average by `HEIGHT_DEVIATION` (m); it grows with the square."""
MIN_FRAMES = 4
"""Smallest number of frames with a person from which sizes are solved."""


@dataclass(frozen=True, eq=False)
class SizeEstimate(Generic[Measured]):
    """Sizes measured on the first frames."""

    sizes: Measured
    body: Body
    residual: float
    """Root mean square distance of the surface points to the tangent planes, metres."""
    overlap: float
    """Mean intersection over union of body and silhouettes."""
    frames: int
    """Frames in which the person was found."""
    pose: Array
    """The last of these frames' pose, of shape (D,)."""
    unexplained: tuple[Unexplained | None, ...] = ()
    """What the silhouettes have beside the body, by camera."""


def size_deviations(sizes: BoneSizes, shown: bool) -> Array:
    """Standard deviations (K,), metres, of the sizes among people; `JOINT_DEVIATION` for bones that joints have `shown`."""
    shares = shares_of(type(sizes))
    stature = stature_of({name: getattr(sizes, name) for name in ("thigh_length", "shank_length", "upper_arm_length", "forearm_length")})
    return np.array([JOINT_DEVIATION if shown and name in SIZES_FROM_JOINTS else shares[name][1] * stature for name in sizes.names()])


def estimate_sizes(rng: np.random.Generator, make: Callable[[Measured], Body], expected: Measured, spread: Array, cameras: Sequence[Camera],
            first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]], settings: MultiviewSettings,
            library: Array | None = None, looks: int = 0) -> SizeEstimate[Measured]:
    """Sizes of the person in the `first` frames (surface points and masks, in order of time), `expected` with standard deviations `spread`
    (K,). `looks`: number of frames after which what the body does not explain is left out; 0: never. Raises `TrackingError` if no person
    is found."""
    plain, sizes, residual = replace(settings, method="hybrid", refinement="gauss_newton"), expected, np.nan
    for _ in range(ROUNDS if (spread > 0).any() else 0):
        tracker = MultiviewTracker(make(sizes), tuple(cameras), plain, None, library, looks=looks)
        found = _followed(rng, tracker, first)
        if len(found) < MIN_FRAMES:
            break
        chosen = evenly_spread(len(found), MAX_FRAMES)
        poses = np.array([found[i][1].pose for i in chosen])
        clouds = [MultiviewObservation(tracker.views, *first[found[i][0]]).cloud(POINT_STRIDE) for i in chosen]
        pulls = [tracker.posture_prior.quadratic(pose, SIZE_PULL, settings.posture) for pose in poses]
        centre, pull = map(np.array, zip(*pulls, strict=True))
        bundle = solve_bundle(make, expected, spread, poses, clouds, settings.surface, pull=pull, centre=centre, first=sizes,
                              worth=INDEPENDENT_POINTS[settings.body])
        sizes, residual = bundle.sizes, bundle.residual
    tracker = MultiviewTracker(make(sizes), tuple(cameras), plain, None, library, looks=looks)
    found = _followed(rng, tracker, first)
    if not found:
        raise TrackingError(f"nobody is found in the first {len(first)} frames' silhouettes: are they a whole person's, in two cameras or "
                            "more at once, and do the cameras agree? `shadowpuppet info` tells")
    return SizeEstimate(sizes, tracker.body, residual, float(np.mean([state.overlap for _, state in found])), len(found),
                        found[-1][1].pose, found[-1][1].unexplained)


def estimate_height(rng: np.random.Generator, make: Callable[[float], Body], cameras: Sequence[Camera],
                  first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]], settings: MultiviewSettings) -> float | None:
    """Height (m) of the person in the `first` frames: that of several which fits a few frames best; None if no person is visible. The
    hull's extent alone does not give it: arms may be overhead, or the person may crouch."""
    extent = observed_height(first)
    if extent is None:
        return None
    plain = replace(settings, method="hybrid", refinement="gauss_newton")
    chosen = first[:: max(1, len(first) // HEIGHT_FRAMES)][:HEIGHT_FRAMES]
    costs = []
    heights = [extent * share for share in HEIGHT_SHARES if HEIGHTS[0] <= extent * share <= HEIGHTS[1]]
    for height in heights:
        tracker = MultiviewTracker(make(height), tuple(cameras), plain)
        found = [tracker.start(rng, points, masks) for points, masks in chosen]
        unusual = 1 + HEIGHT_PENALTY * ((height - AVERAGE_HEIGHT) / HEIGHT_DEVIATION) ** 2
        costs.append(unusual * np.mean([state.cost for state in found if state.status != "absent"] or [np.inf]))
    return heights[int(np.argmin(costs))] if heights else None


def _followed(rng: np.random.Generator, tracker: MultiviewTracker,
              first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]]) -> list[tuple[int, MultiviewState]]:
    """Indices and states of the frames in which the person is found: tracked, or searched for again if the overlap falls."""
    state, found, best = None, [], 0.0
    for n, (points, masks) in enumerate(first):
        state = tracker.start(rng, points, masks) if state is None else tracker.step(rng, state, points, masks)
        if state.overlap < best - OVERLAP_LOSS and state.status != "absent":
            again = tracker.start(rng, points, masks)._replace(unexplained=state.unexplained)
            state = min(state, again, key=lambda each: each.cost)
        best = max(best, state.overlap)
        if state.status in ("tracked", "uncertain"):
            found.append((n, state))
    return [(n, state) for n, state in found if state.overlap > best - OVERLAP_LOSS]


def observed_height(first: Sequence[tuple[SurfacePoints, Sequence[Mask | None]]]) -> float | None:
    """The hull's vertical extent, metres, when the person stands tallest; None without points."""
    extents = [float(np.ptp(np.sort(points.points[:, 2])[2:-2])) for points, _ in first if len(points.points) > 50]
    return float(np.percentile(extents, 90)) if extents else None
