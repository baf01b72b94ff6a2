"""The distance of a whole body before one camera: several are tried, with whole poses in some moments of the film.

A person of known stature must have their feet where the legs reach, and on the floor if the camera's height over it is known. That shows
the distance of whoever sits, kneels or squats, too, whose upper body alone leaves it open.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.tracking.monocular.leg_postures import CONTACT_WEIGHT, contact_cost
from shadowpuppet.tracking.monocular.settings import MonocularSettings, pixel_scale
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State

STEP, STEPS = 1.08, 4
"""Ratio of one tried distance to the one before, and how many are tried nearer and farther than the upper body's."""
NEAR_BEST = 1.5
"""The distances whose cost is at most this much of the least one determine the best: single costs have noise."""
DRESSED = 0.95
"""The best distance over the true one: clothes and hair make people larger than bodies of average proportions (as `CLOTHED` of the place's
search, which has coarse poses). Its standard deviation is 3 %."""
MOMENTS, PARTICLES = 4, 120
"""Number of moments in which poses are searched, and of particles."""
DOUBT, WEIGHT = 0.1, 20.0
"""The upper body's distance costs its squared relative difference over that of `DOUBT`, times `WEIGHT` (pixels at 320 x 240)."""


def whole_distance(camera: Camera, masks: Sequence[Mask], body: str, at: Callable[[float], PersonEstimate]) -> float:
    """The factor on the upper body's distance at which a whole body fits best in masks (H, W), with few different pixels, in usual
    postures, and on the floor. `at`: the estimate for a factor."""
    chosen = [masks[k] for k in evenly_spread(len(masks), MOMENTS)]
    factors = STEP ** np.arange(-STEPS, STEPS + 1.0)
    costs = np.array([_cost(camera, chosen, body, at(factor), factor) for factor in factors.tolist()])
    return _vertex(factors, costs) / DRESSED


def _vertex(factors: Array, costs: Array) -> float:
    """The factor of least cost by a parabola through the costs near the least one, over the factors' logarithms, all (N,)."""
    least = int(np.argmin(costs))
    near = np.isfinite(costs) & (costs <= NEAR_BEST * costs[least])
    near[max(least - 1, 0) : least + 2] = True
    near &= np.isfinite(costs)
    if near.sum() < 3:
        return float(factors[least])
    scale = np.log(factors)
    square, slope, _ = np.polyfit(scale[near], costs[near], 2)
    if square <= 0:
        return float(factors[least])
    return float(np.exp(np.clip(-slope / (2 * square), *scale[near][[0, -1]])))


def _cost(camera: Camera, masks: Sequence[Mask], body: str, estimate: PersonEstimate, factor: float) -> float:
    """Mean cost of the poses found in masks (H, W), pixels at 320 x 240."""
    tracker, scale = _tracker(camera, body, estimate), pixel_scale(camera.size)
    floor, total = tracker.floor, 0.0
    for state in _started(tracker, masks):
        if state.status == "absent":
            return np.inf
        total += tracker.misfit(state) / scale
        total += 0.0 if floor is None else float(contact_cost(tracker.picture, floor, CONTACT_WEIGHT)(state.pose[None])[0])
    return total / len(masks) + WEIGHT * (np.log(factor) / DOUBT) ** 2


def whole_poses(camera: Camera, masks: Sequence[Mask], body: str, estimate: PersonEstimate) -> Array:
    """Whole poses (K, D) searched for in masks (H, W), each by itself."""
    return np.array([state.pose for state in _started(_tracker(camera, body, estimate), masks)])


def _started(tracker: MonocularTracker, masks: Sequence[Mask]) -> list[State]:
    return [tracker.start(np.random.default_rng(k), mask) for k, mask in enumerate(masks)]


def _tracker(camera: Camera, body: str, estimate: PersonEstimate) -> MonocularTracker:
    settings = MonocularSettings(body=body, explore=PARTICLES)
    parts = {name: replace(getattr(settings, name), particles=PARTICLES) for name in ("torso", "arm")}
    return MonocularTracker(estimate.picture(camera, body), replace(settings, **parts), moves=False)
