"""Sizes of a person whom no view shows apart from others: solved on the person's share of the evidence of several frames, together with
the poses, for both ways in which the person may face.

With average sizes a body and the same body turned round fit too alike. Each with the sizes that suit it does not.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.models import MODELS
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import BoneSizes
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.bundle_adjustment import solve_bundle
from shadowpuppet.tracking.multiview.size_estimation import POINT_STRIDE, SIZE_PULL, size_deviations
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.people.tracker import Share, at_pose, is_shown, observed

CYCLES = 3
"""Number of estimation cycles in which poses are fitted to the silhouettes of a frame."""
LEAST_POINTS = 100
"""Least number of surface points of a person in such a frame."""


class Measure(NamedTuple):
    """A person measured, facing one way."""

    tracker: MultiviewTracker
    """With the body of the sizes."""
    sizes: BoneSizes
    poses: Array
    """In the frames, (F, D)."""
    overlaps: Array
    """Of the drawn poses with the silhouettes in the frames, (F,)."""
    residual: float
    """Root mean square distance of the surface points from the body, metres."""


def shows(share: Share) -> bool:
    """Whether a frame shows enough of a person apart from others to measure them in it."""
    enough = share.state.status in ("tracked", "uncertain") and len(share.points.points) >= LEAST_POINTS
    return enough and is_shown(share)


def measure(rng: np.random.Generator, make: Callable[[BoneSizes], Body], expected: BoneSizes, tracker: MultiviewTracker,
            shares: Sequence[Share], poses: Array) -> Measure:
    """Sizes that suit a person's shares of F frames, from poses (F, D) of a body of the `expected` sizes; `tracker`: of any body."""
    settings, own = tracker.settings, replace(tracker, body=make(expected), looks=0)
    clouds = [observed(own, share).cloud(POINT_STRIDE) for share in shares]
    pulls = [own.posture_prior.quadratic(pose, SIZE_PULL, settings.posture) for pose in poses]
    centre, pull = map(np.array, zip(*pulls, strict=True))
    bundle = solve_bundle(make, expected, size_deviations(expected, shown=False), poses, clouds, settings.surface, pull=pull, centre=centre,
                          worth=MODELS[settings.body].independent_points)
    own = replace(own, body=make(bundle.sizes))
    states = [_fitted(rng, own, share, pose) for share, pose in zip(shares, bundle.poses)]
    found, overlaps = np.array([state.pose for state in states]), np.array([state.overlap for state in states])
    return Measure(own, bundle.sizes, found, overlaps, bundle.residual)


def _fitted(rng: np.random.Generator, tracker: MultiviewTracker, share: Share, pose: Array) -> MultiviewState:
    """The state of a pose (D,) fitted to a share, also to its silhouettes: sizes are solved on the surface points alone."""
    single = replace(tracker, settings=replace(tracker.settings, cycles=1))
    observation, state = observed(single, share), at_pose(single, share.state, pose)
    for _ in range(CYCLES):
        state = single.cycle(rng, state, observation)
    return state
