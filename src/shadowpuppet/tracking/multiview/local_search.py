"""A local search around the best pose, after refinement (default preset; not in Ni 2008).

Refinement descends on the surface points; particles are ranked by the silhouettes, too. A pose that refinement has made worse by that
cost stays as proposed; then single joints of the best pose are turned at random, and the better poses kept.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.exploration import NOISE_SCALES
from shadowpuppet.tracking.particle_filter import Particles, Weigh, best_of, evaluate


class LocalSearch:
    """Turns single joints of the best particle at random."""

    def __init__(self, skeleton: Skeleton, sigma: Array, rounds: int) -> None:
        """`sigma`: standard deviations (D,) of the noise; `rounds`: how often the best pose is varied."""
        self.skeleton, self.sigma, self.rounds = skeleton, sigma, rounds

    def __call__(self, rng: np.random.Generator, particles: Particles, weigh: Weigh, number: int) -> Particles:
        """The `number` best of the particles and of half that number of variants of the best one in each round."""
        for _ in range(self.rounds):
            tried = evaluate(self._variants(rng, particles.best, (number + 1) // 2), weigh)
            particles = best_of((particles, tried), number)
        return particles

    def _variants(self, rng: np.random.Generator, pose: Array, number: int) -> Array:
        """Copies (number, D) of a pose (D,), each with noise on the DOF of one joint."""
        joints = rng.integers(len(self.skeleton.joints), size=(number, 1))
        noise = rng.choice(NOISE_SCALES, size=(number, 1)) * self.sigma * rng.standard_normal((number, len(pose)))
        return self.skeleton.clamp(pose + noise * (self.skeleton.dof_joints == joints))
