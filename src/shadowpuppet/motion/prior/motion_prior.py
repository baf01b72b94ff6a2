"""The motion prior (Ni 2008, IV): regions of poses, each with a subspace, and the transitions between them.

A VQPCA in a hidden Markov model, learnt by `vqpca.fit_prior`. Poses are arrays (N, D) of numbers that vary smoothly and are of comparable
size; angles must be unwrapped.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.prior.local_pca import TOLERANCE, Regions, Subspaces


class Codes(NamedTuple):
    """Encoded poses (eq. 18)."""

    regions: Regions
    """The region of each, of shape (N,)."""
    values: Array
    """Coordinates in the region's subspace, of shape (N, m)."""


class Proposal(NamedTuple):
    """Poses drawn for the next frame, and the regions (states) drawn for them."""

    poses: Array
    """Of shape (N, D)."""
    regions: Regions
    """The region of each, of shape (N,)."""


@dataclass(frozen=True, eq=False)
class MotionPrior:
    """A learnt model of motion. Raises `ShadowPuppetError` for arrays that do not fit together and for invalid probabilities."""

    subspaces: Subspaces
    """M regions of poses of D numbers."""
    transitions: Array
    """a_ij: probability that region j follows region i in the next frame, of shape (M, M)."""
    initial: Array
    """pi_j: probability of each region in the first frame, of shape (M,)."""
    names: tuple[str, ...] = ()
    """D names of a pose's numbers; empty if unknown."""
    rate: float | None = None
    """Frames per second of the training motion, for which `transitions` hold; None if unknown."""

    def __post_init__(self) -> None:
        """Check."""
        M, D = len(self.subspaces), self.subspaces.width
        for name, shape in {"transitions": (M, M), "initial": (M,)}.items():
            values = np.asarray(getattr(self, name), float)
            object.__setattr__(self, name, values)
            if values.shape != shape:
                raise ShadowPuppetError(f"{name}: found shape {values.shape}, expected {shape}")
            if not ((values >= 0).all() and np.abs(values.sum(-1) - 1).max() <= TOLERANCE):
                raise ShadowPuppetError(f"{name}: found numbers that are no probabilities, expected none below zero and a sum of one")
        object.__setattr__(self, "names", tuple(str(name) for name in self.names))
        if self.names and (len(self.names) != D or len(set(self.names)) != D):
            raise ShadowPuppetError(f"names: found {len(set(self.names))} different ones, expected {D}, one for each number of a pose")
        if self.rate is not None and not 0 < self.rate < np.inf:
            raise ShadowPuppetError(f"rate: found {self.rate}, expected frames a second, more than zero")

    def encode(self, poses: ArrayLike) -> Codes:
        """Region of the nearest subspace, and coordinates in it, of poses (N, D) (eqs. 8, 18). Raises `ShadowPuppetError`."""
        return Codes(*self.subspaces.nearest(self._checked(poses)))

    def reconstruct(self, codes: Codes) -> Array:
        """Poses (N, D) of codes (eq. 19). Raises `ShadowPuppetError` for codes of another prior."""
        values = np.asarray(codes.values, float)
        if values.ndim != 2 or values.shape[1] != self.subspaces.dimensions:
            raise ShadowPuppetError(f"values: found shape {values.shape}, expected (N, {self.subspaces.dimensions})")
        return self.subspaces.reconstruct(values, self._checked_regions(codes.regions, len(values)))

    def propose(self, rng: np.random.Generator, poses: ArrayLike, regions: ArrayLike | None = None, keep: float = 0.0) -> Proposal:
        """Poses drawn for the next frame, from poses (N, D) in regions (N,; default: the nearest) (Ni 2008, V-A, step 3).

        `keep`: share of a pose's offset from its last region's subspace that the proposal keeps; none in the paper. Raises
        `ShadowPuppetError` for arrays of the wrong shape.
        """
        poses = self._checked(poses)
        regions = self.subspaces.nearest(poses)[0] if regions is None else self._checked_regions(regions, len(poses))
        drawn = self._follow(regions, 1 - rng.random(len(poses)))  # step 3a: the next state, eq. 24
        values = self.subspaces.project(poses, drawn)  # step 3b: project into its subspace, eq. 27
        values += rng.standard_normal(values.shape) * np.sqrt(self.subspaces.variances)[drawn]  # step 3c: noise of the region's variances
        proposed = self.subspaces.reconstruct(values, drawn)  # step 3d: reconstruct, eq. 28
        if keep:
            proposed += keep * (poses - self.subspaces.reconstruct(self.subspaces.project(poses, regions), regions))
        return Proposal(proposed, drawn)

    @cached_property
    def _cumulative(self) -> Array:
        """Cumulative transitions of each row, exactly one at the end."""
        cumulative = np.cumsum(self.transitions, 1)
        return cumulative / cumulative[:, -1:]

    def _follow(self, regions: Regions, points: Array) -> Regions:
        """The next region after each of `regions` (N,), by inversion of uniform numbers `points` (N,) in (0, 1]."""
        return (self._cumulative[regions] < points[:, None]).sum(1)

    def _checked(self, poses: ArrayLike) -> Array:
        poses = np.asarray(poses, float)
        if poses.ndim != 2 or poses.shape[1] != self.subspaces.width:
            raise ShadowPuppetError(f"poses: found shape {poses.shape}, expected (N, {self.subspaces.width}), as the prior has learnt them")
        if not np.isfinite(poses).all():
            raise ShadowPuppetError("poses: found a number that is not finite, expected finite ones")
        return poses

    def _checked_regions(self, regions: ArrayLike, number: int) -> Regions:
        regions, known = np.asarray(regions), range(len(self.subspaces))
        if regions.shape != (number,) or regions.dtype.kind not in "iu" or (number and not {regions.min(), regions.max()} <= {*known}):
            raise ShadowPuppetError(f"regions: found an array {regions.shape} of {regions.dtype}, expected {number} whole numbers "
                                    f"from 0 to {known[-1]}")
        return regions
