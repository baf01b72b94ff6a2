"""What postures are usual: a weak prior that decides what surface points do not tell, such as how a bend is shared by pelvis and chest."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.skeleton import Skeleton

WIDER, LEAST = 1.5, 0.15
"""What training poses' deviations are multiplied by, and what they are at least (rad): others than those come."""
SEEN = ("left_", "right_")
"""Joints whose angles the surface shows well enough."""
BOUND = 9.0
"""No DOF counts for more than this, three deviations' worth (see `Skeleton.strain`)."""


@dataclass(frozen=True, eq=False)
class Usual:
    """Rest and deviations of every DOF; infinite where nothing is usual."""

    rest: Array
    below: Array
    above: Array

    @classmethod
    def of(cls, skeleton: Skeleton, library: Array | None = None) -> Usual:
        """As the skeleton has it; angles but the heading as the poses of a `library` (L, D), such as training motion, have it."""
        rest, below, above = (np.array(each) for each in skeleton.usual)
        if library is not None and len(library) > 1:
            known = np.isfinite(below)
            spread = np.maximum(WIDER * library.std(0), LEAST)
            rest, below, above = (np.where(known, new, old) for new, old in ((library.mean(0), rest), (spread, below), (spread, above)))
        seen = np.array([not dof.joint.startswith(SEEN) for dof in skeleton.dofs])
        return cls(rest, np.where(seen, below, np.inf), np.where(seen, above, np.inf))

    def strain(self, poses: Array) -> Array:
        """Squared deviations of poses (N, D), summed (N,), each DOF bounded."""
        squared = self._squared(poses)
        return (squared / (1 + squared / BOUND)).sum(1)

    def pull(self, pose: Array) -> Array:
        """Weights (D,) of squared distances from rest that make up the strain near a pose (D,), 1 / rad^2."""
        fade = 1 + self._squared(pose[None])[0] / BOUND
        return 1 / (np.where(pose < self.rest, self.below, self.above) * fade) ** 2

    def _squared(self, poses: Array) -> Array:
        off = poses - self.rest
        return (off / np.where(off < 0, self.below, self.above)) ** 2
