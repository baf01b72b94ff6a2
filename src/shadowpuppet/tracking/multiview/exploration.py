"""Proposals of the default preset that ask no motion prior (not in Ni 2008): noise on some joints, and arms in other postures."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.posture_prior import usual_arms

NOISE_SCALES = (0.3, 1.0, 2.0)
"""Each proposal's noise is multiplied by one of these."""
JOINT_CHANCE = 0.3
"""Probability of each joint to be moved: a limb that was lost is found again while the rest of the body stays."""
ARM_NOISE, ARM_CANDIDATES = 0.4, 16
"""Noise (rad) of arm candidates, and how many are drawn per pose; the one of least silhouette cost is kept."""


class Exploration:
    """Poses near and far from the last ones, for a refinement to improve."""

    def __init__(self, skeleton: Skeleton, sigma: Array, share: float) -> None:
        """`sigma`: deviations (D,) of the noise; `share`: of the poses that get another arm."""
        self.skeleton, self.sigma, self.share = skeleton, sigma, share
        self.owners = np.array([skeleton.joint_index(dof.joint) for dof in skeleton.dofs])
        arms = (usual_arms(skeleton, side) for side in ("left", "right"))
        self.arms = [(skeleton.dof_indices(arm), np.stack(list(arm.values()), 1)) for arm in arms]

    def __call__(self, rng: np.random.Generator, poses: Array, mismatch: Callable[[Array], Array], scale: float) -> Array:
        """Poses (N, D) with `scale` times the noise on some joints, the last of them with another arm.

        `mismatch`: silhouette cost (M,) of poses (M, D), which decides between candidates for an arm.
        """
        noise = scale * self.sigma * rng.standard_normal(poses.shape)
        scales = rng.choice(NOISE_SCALES, size=(len(poses), 1))
        moved = rng.random((len(poses), len(self.skeleton.joints))) < JOINT_CHANCE
        out = poses + noise * scales * moved[:, self.owners]
        explored = round(self.share * len(poses))
        if explored:
            out[-explored:] = self._other_arms(rng, out[-explored:], mismatch)
        return out

    def _other_arms(self, rng: np.random.Generator, poses: Array, mismatch: Callable[[Array], Array]) -> Array:
        """Poses (N, D) with another arm each: of candidates near their own and near usual ones, the one of least silhouette cost."""
        out = np.repeat(poses, ARM_CANDIDATES, axis=0)
        for n, pose in enumerate(poses):
            dofs, arms = self.arms[rng.integers(2)]
            usual = arms[rng.integers(len(arms), size=ARM_CANDIDATES)]
            about = np.where(rng.random((ARM_CANDIDATES, 1)) < 0.5, pose[dofs], usual)
            candidates = about + ARM_NOISE * rng.standard_normal((ARM_CANDIDATES, len(dofs)))
            out[n * ARM_CANDIDATES : (n + 1) * ARM_CANDIDATES, dofs] = candidates
        out = self.skeleton.clamp(out)
        return out[np.arange(len(poses)) * ARM_CANDIDATES + mismatch(out).reshape(-1, ARM_CANDIDATES).argmin(1)]
