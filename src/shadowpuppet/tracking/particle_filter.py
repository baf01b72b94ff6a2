"""One scheme for both papers: resample, propose, refine, weigh.

Knows no bodies and no pictures, only arrays and the functions that a method is made of.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.resampling import Scheme


class Particles(NamedTuple):
    """Poses and how well each explains the picture."""

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
"""Poses (N, D) to new poses (N, D). The first is the best so far."""
Refine = Callable[[Array], Array]
"""Poses (N, D) to better ones (N, D)."""
Weigh = Callable[[Array], tuple[Array, Array]]
"""Poses (N, D) to costs (N,) and log weights (N,)."""


def evaluate(poses: Array, weigh: Weigh) -> Particles:
    """Particles from poses (N, D)."""
    return Particles(poses, *weigh(poses))


def step(rng: np.random.Generator, particles: Particles, *, resample: Scheme, propose: Propose, weigh: Weigh,
         refine: Refine | None = None, number: int | None = None) -> Particles:
    """One estimation cycle: from the particles of the last to those of this one."""
    ancestors = resample(rng, particles.log_weights, number or len(particles.poses))
    poses = propose(rng, particles.poses[ancestors])
    if refine is not None:
        poses = refine(poses)
    return evaluate(poses, weigh)


def diffuse(rng: np.random.Generator, poses: Array, sigma: Array) -> Array:
    """Gaussian noise of deviations `sigma` (D,) on all poses (N, D) but the first, which stays as it is (Algorithms 3 and 4)."""
    noise = rng.standard_normal(poses.shape) * sigma
    noise[0] = 0
    return poses + noise
