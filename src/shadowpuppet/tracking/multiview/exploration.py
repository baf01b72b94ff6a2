"""Proposals of the default preset without a motion prior (not in Ni 2008): noise on some joints, and other postures of an arm."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.posture_prior import usual_arms

NOISE_SCALES = (0.3, 1.0, 2.0)
"""Factors of the noise; each proposal draws one."""
JOINT_CHANCE = 0.3
"""Probability that a joint is moved: with few joints moved, a lost limb is found again while the rest of the body stays."""
ARM_NOISE, ARM_CANDIDATES = 0.4, 16
"""Noise (rad) of arm candidates, and how many are drawn per pose; the one of least silhouette cost is kept."""


class Exploration:
    """Draws poses near the last ones and far from them, which are then refined."""

    def __init__(self, skeleton: Skeleton, sigma: Array, share: float) -> None:
        """`sigma`: standard deviations (D,) of the noise; `share`: share of the poses in which one arm is replaced."""
        self.skeleton, self.sigma, self.share = skeleton, sigma, share
        arms = (usual_arms(skeleton, side) for side in ("left", "right"))
        self.arms = [(skeleton.dof_indices(arm), np.stack(list(arm.values()), 1)) for arm in arms]

    def __call__(self, rng: np.random.Generator, poses: Array, mismatch: Callable[[Array], Array], scale: float) -> Array:
        """Poses (N, D) with noise, times `scale`, on some joints; in the last `share` of them one arm is replaced.

        `mismatch`: silhouette cost (M,) of poses (M, D), which selects among the candidates for an arm.
        """
        noise = scale * self.sigma * rng.standard_normal(poses.shape)
        scales = rng.choice(NOISE_SCALES, size=(len(poses), 1))
        moved = rng.random((len(poses), len(self.skeleton.joints))) < JOINT_CHANCE
        out = poses + noise * scales * moved[:, self.skeleton.dof_joints]
        explored = round(self.share * len(poses))
        if explored:
            out[-explored:] = self._other_arms(rng, out[-explored:], mismatch)
        return out

    def _other_arms(self, rng: np.random.Generator, poses: Array, mismatch: Callable[[Array], Array]) -> Array:
        """Poses (N, D) with one arm replaced: by the candidate of least silhouette cost, drawn around the pose's own arm or a usual one."""
        out = np.repeat(poses, ARM_CANDIDATES, axis=0)
        for n, pose in enumerate(poses):
            dofs, arms = self.arms[rng.integers(2)]
            usual = arms[rng.integers(len(arms), size=ARM_CANDIDATES)]
            about = np.where(rng.random((ARM_CANDIDATES, 1)) < 0.5, pose[dofs], usual)
            candidates = about + ARM_NOISE * rng.standard_normal((ARM_CANDIDATES, len(dofs)))
            out[n * ARM_CANDIDATES : (n + 1) * ARM_CANDIDATES, dofs] = candidates
        out = self.skeleton.clamp(out)
        return out[np.arange(len(poses)) * ARM_CANDIDATES + mismatch(out).reshape(-1, ARM_CANDIDATES).argmin(1)]
