"""Synthetic training motions as arrays of poses, and priors with known parameters."""

from __future__ import annotations

import numpy as np

from shadowpuppet.motion.prior.local_pca import Subspaces
from shadowpuppet.motion.prior.motion_prior import MotionPrior


def gait(frames: int, width: int = 25, rate: float = 60.0, phase: float = 0.0) -> np.ndarray:
    """Joint angles (T, D) of a walk with one cycle per second, radians: each angle is a sine and its first harmonic."""
    rng = np.random.default_rng(4)
    sizes, phases = 0.4 * rng.random((2, width)), 2 * np.pi * rng.random((2, width))
    turn = 2 * np.pi * np.arange(frames)[:, None] / rate + phase
    return sizes[0] * np.sin(turn + phases[0]) + 0.3 * sizes[1] * np.sin(2 * turn + phases[1])


def subspaces(rng: np.random.Generator, regions: int, width: int, dimensions: int, apart: float = 1.0) -> Subspaces:
    """Regions with random centres and directions."""
    bases = np.linalg.qr(rng.standard_normal((regions, width, width)))[0][:, :, :dimensions]
    variances = np.sort(0.01 + 0.1 * rng.random((regions, dimensions)), 1)[:, ::-1]
    return Subspaces(apart * rng.standard_normal((regions, width)), bases, variances, 0.001 + 0.001 * rng.random(regions))


def ring(regions: int, stay: float = 0.7) -> np.ndarray:
    """Transition probabilities (M, M) to the same or the next region."""
    return stay * np.eye(regions) + (1 - stay) * np.roll(np.eye(regions), 1, 1)


def prior(rng: np.random.Generator, regions: int = 5, width: int = 6, dimensions: int = 2, **known) -> MotionPrior:
    return MotionPrior(subspaces(rng, regions, width, dimensions), ring(regions), np.full(regions, 1 / regions), **known)


def walk(rng: np.random.Generator, of: MotionPrior, frames: int) -> tuple[np.ndarray, np.ndarray]:
    """A sequence sampled from the hidden Markov model: poses (T, D) and their regions (T,)."""
    M, inner = len(of.subspaces), of.subspaces
    regions = np.empty(frames, np.int64)
    regions[0] = rng.choice(M, p=of.initial)
    for t in range(1, frames):
        regions[t] = rng.choice(M, p=of.transitions[regions[t - 1]])
    along = rng.standard_normal((frames, inner.dimensions)) * np.sqrt(inner.variances[regions])
    beside = rng.standard_normal((frames, inner.width)) * np.sqrt(inner.noise[regions])[:, None]
    beside -= inner.reconstruct(inner.project(beside + inner.centres[regions], regions), regions) - inner.centres[regions]
    return inner.reconstruct(along, regions) + beside, regions
