"""The particle filter: weighted poses, and one estimation cycle (resample, propose, weigh).

It works on arrays, without bodies and pictures; a method passes its own functions. `MultiviewTracker.cycle` has the cycle of Ni 2008, which
also refines.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.resampling import Scheme


class Particles(NamedTuple):
    """Poses and how well each explains the observation."""

    poses: Array
    """Of shape (N, D)."""
    costs: Array
    """Of shape (N,), the lower the better (pixels for silhouettes)."""
    log_weights: Array
    """Of shape (N,), not normalised."""

    @property
    def best(self) -> Array:
        """The pose (D,) of least cost."""
        return self.poses[np.argmin(self.costs)]


Propose = Callable[[np.random.Generator, Array], Array]
"""Function from poses (N, D), the best first, to new poses (N, D)."""
Weigh = Callable[[Array], tuple[Array, Array]]
"""Function from poses (N, D) to costs (N,) and log weights (N,)."""


def evaluate(poses: Array, weigh: Weigh) -> Particles:
    """Particles of poses (N, D), with their costs and weights."""
    return Particles(poses, *weigh(poses))


def gathered(pose: Array, number: int) -> Particles:
    """A number of particles, all in one pose (D,), with no costs yet."""
    return Particles(np.repeat(pose[None], number, 0), *np.zeros((2, number)))


def best_of(sets: Sequence[Particles], number: int) -> Particles:
    """The `number` particles of least cost in some sets, best first; repeated if there are fewer."""
    found = Particles(*(np.concatenate(values) for values in zip(*sets, strict=True)))
    order = found.costs.argsort(kind="stable")[:number]
    order = order[np.arange(number) % len(order)]
    return Particles(*(values[order] for values in found))


def better_of(first: Particles, second: Particles) -> Particles:
    """Of each pair of N particles the one of less cost, the first where they cost the same."""
    better = second.costs < first.costs
    return Particles(np.where(better[:, None], second.poses, first.poses), np.where(better, second.costs, first.costs),
                     np.where(better, second.log_weights, first.log_weights))


def step(rng: np.random.Generator, particles: Particles, *, resample: Scheme, propose: Propose, weigh: Weigh,
         number: int | None = None) -> Particles:
    """One estimation cycle: the last cycle's particles to `number` new ones (default: the same number)."""
    ancestors = resample(rng, particles.log_weights, number or len(particles.poses))
    return evaluate(propose(rng, particles.poses[ancestors]), weigh)


def diffuse(rng: np.random.Generator, poses: Array, sigma: Array) -> Array:
    """Poses (N, D) with Gaussian noise of deviations `sigma` (D,); the first stays as it is (Algorithms 3 and 4)."""
    noise = rng.standard_normal(poses.shape) * sigma
    noise[0] = 0
    return poses + noise
