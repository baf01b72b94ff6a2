"""What a motion is like: regions of poses with a subspace each, and how it goes from one to the next (Ni 2008, IV).

A VQPCA in a hidden Markov model, learnt by `vqpca.fit_prior`. Poses are arrays (N, D) of any numbers that vary smoothly and are of
comparable size: angles must have been unwrapped.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.prior.local_pca import Regions, Subspaces

SUM_TOLERANCE = 1e-6
"""How far the sum of probabilities may be from one."""


class Codes(NamedTuple):
    """Poses in few numbers (eq. 18)."""

    regions: Regions
    """The region of each, of shape (N,)."""
    values: Array
    """Coordinates in the region's subspace, of shape (N, m)."""


class Proposal(NamedTuple):
    """Poses that may come next."""

    poses: Array
    """Of shape (N, D)."""
    regions: Regions
    """The region of each, of shape (N,)."""


@dataclass(frozen=True, eq=False)
class MotionPrior:
    """A learnt motion. Raises `ShadowPuppetError` where shapes do not fit or probabilities are none."""

    subspaces: Subspaces
    """The regions, M of them, of poses of D numbers."""
    transitions: Array
    """a_ij: probability that region j follows region i, a frame later, of shape (M, M)."""
    initial: Array
    """pi_j: probability of each region in the first frame, of shape (M,)."""
    names: tuple[str, ...] = ()
    """What the numbers of a pose are, D of them; none where that was not told."""
    rate: float | None = None
    """Frames a second of the motion it was learnt from: `transitions` hold for that step. None where it was not told."""

    def __post_init__(self) -> None:
        """Check."""
        M, D = len(self.subspaces), self.subspaces.width
        for name, shape in {"transitions": (M, M), "initial": (M,)}.items():
            values = np.asarray(getattr(self, name), float)
            object.__setattr__(self, name, values)
            if values.shape != shape:
                raise ShadowPuppetError(f"{name}: found shape {values.shape}, expected {shape}")
            if not ((values >= 0).all() and np.abs(values.sum(-1) - 1).max() <= SUM_TOLERANCE):
                raise ShadowPuppetError(f"{name}: found numbers that are no probabilities, expected none below zero and a sum of one")
        object.__setattr__(self, "names", tuple(str(name) for name in self.names))
        if self.names and (len(self.names) != D or len(set(self.names)) != D):
            raise ShadowPuppetError(f"names: found {len(set(self.names))} different ones, expected {D}, one for each number of a pose")
        if self.rate is not None and not 0 < self.rate < np.inf:
            raise ShadowPuppetError(f"rate: found {self.rate}, expected frames a second, more than zero")

    def encode(self, poses: ArrayLike) -> Codes:
        """Poses (N, D) by the region whose subspace is nearest, and the coordinates there (eqs. 8, 18). Raises `ShadowPuppetError`."""
        return Codes(*self.subspaces.nearest(self._checked(poses)))

    def reconstruct(self, codes: Codes) -> Array:
        """Poses (N, D) of codes (eq. 19). Raises `ShadowPuppetError` where they are none of this prior's."""
        values = np.asarray(codes.values, float)
        if values.ndim != 2 or values.shape[1] != self.subspaces.dimensions:
            raise ShadowPuppetError(f"values: found shape {values.shape}, expected (N, {self.subspaces.dimensions})")
        return self.subspaces.reconstruct(values, self._checked_regions(codes.regions, len(values)))

    def propose(self, rng: np.random.Generator, poses: ArrayLike, regions: ArrayLike | None = None, keep: float = 0.0) -> Proposal:
        """Where poses (N, D) in regions (N,) may be a frame later (Ni 2008, V-A, step 3).

        The next region is drawn from the transitions, the pose projected into its subspace and moved there by Gaussian noise of the
        region's own variances. Without `regions` each pose has its nearest. In the paper a proposal forgets all that the subspace cannot
        hold, such as another person's posture; `keep` is the share of that which stays, where a pose is from its last region's subspace.
        Raises `ShadowPuppetError` where an array does not fit.
        """
        poses = self._checked(poses)
        regions = self.subspaces.nearest(poses)[0] if regions is None else self._checked_regions(regions, len(poses))
        drawn = self._follow(regions, 1 - rng.random(len(poses)))  # step 3a, eq. 24
        values = self.subspaces.project(poses, drawn)  # step 3b, eq. 27
        values += rng.standard_normal(values.shape) * self._deviations[drawn]  # step 3c
        proposed = self.subspaces.reconstruct(values, drawn)  # step 3d, eq. 28
        if keep:
            proposed += keep * (poses - self.subspaces.reconstruct(self.subspaces.project(poses, regions), regions))
        return Proposal(proposed, drawn)

    @cached_property
    def _deviations(self) -> Array:
        return np.sqrt(self.subspaces.variances)

    @cached_property
    def _cumulative(self) -> Array:
        """Transitions added up along each row, exactly one from the last that is possible on."""
        cumulative = np.cumsum(self.transitions, 1)
        return cumulative / cumulative[:, -1:]

    def _follow(self, regions: Regions, points: Array) -> Regions:
        """The region after each, by points (N,) in (0, 1]: the first whose cumulative probability reaches the point."""
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
