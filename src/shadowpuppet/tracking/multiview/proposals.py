"""Where poses of a whole body may be a frame later: the state transition of Ni 2008 (V-A), and plain dynamics beside it."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.tracking.multiview.posture_prior import usual_arms
from shadowpuppet.tracking.multiview.settings import MultiviewSettings

REACH = (0.3, 1.0, 2.0)
"""What the noise of a defensive proposal is multiplied by, one of these each."""
EXPLORED, TRIED = 0.4, 16
"""Noise about an arm that is tried, its own or a usual one (rad), and of how many the one is taken that is most like the silhouettes."""
MOVED = 0.3
"""Chance of each joint to be moved by it: a limb that was lost is found again while all else stays."""


class Proposals:
    """The choices of proposal. Raises `ShadowPuppetError` where the prior is of another body."""

    def __init__(self, skeleton: Skeleton, settings: MultiviewSettings, prior: MotionPrior | None = None) -> None:
        """`prior`: of poses at the film's rate."""
        self.skeleton, self.settings, self.prior = skeleton, settings, prior
        sigma = [settings.sigma_heading if dof.name == "root_heading" else settings.sigma_translation if dof.kind == "translation"
                 else settings.sigma_rotation for dof in skeleton.dofs]  # fmt: skip
        self.sigma = np.array(sigma)
        self.owners = np.array([skeleton.joint_index(dof.joint) for dof in skeleton.dofs])
        self.root = skeleton.dof_indices(GLOBAL_DOFS)
        self.arms = [(skeleton.dof_indices(arm), np.stack(list(arm.values()), 1)) for arm in (usual_arms(skeleton, side)
                     for side in ("left", "right"))]  # fmt: skip
        self.modelled = np.zeros(0, np.int64)
        if prior is not None:
            unknown = sorted(set(prior.names) - set(skeleton.dof_names))
            if unknown or not prior.names:
                raise ShadowPuppetError(f"prior: found {unknown[0] if unknown else 'no'} names of degrees of freedom, expected some of "
                                        f"{', '.join(skeleton.dof_names)}: it is of another body")
            self.modelled = skeleton.dof_indices(prior.names)

    def __call__(self, rng: np.random.Generator, poses: Array, last: Array, velocity: Array, unlike: Callable[[Array], Array],
                 scale: float = 1.0) -> Array:
        """Poses (N, D) to new ones: a share by plain dynamics, the others by the prior, where there is one.

        The first of the plain ones is `last` (D,) itself, moved on by its `velocity` (D,), of which only place and heading count. `unlike`:
        how much poses (M, D) differ from the silhouettes (M,), by which arms that are tried are chosen.
        """
        plain = round(self.settings.defensive * len(poses)) if self.prior is not None else len(poses)
        out = poses.copy()
        out[:, self.root] += self.settings.velocity * velocity[self.root]
        out[:plain] = self._diffused(rng, out[:plain], unlike, scale)
        if plain:
            out[0] = last
            out[0, self.root] += self.settings.velocity * velocity[self.root]
        if self.prior is not None and plain < len(poses):
            out[plain:, self.modelled] = self.prior.propose(rng, out[plain:][:, self.modelled], keep=self.settings.keep).poses
            walk = np.setdiff1d(self.root, self.modelled)
            out[plain:, walk] += scale * self.sigma[walk] * rng.standard_normal((len(poses) - plain, len(walk)))
        return self.skeleton.clamp(out)

    def _diffused(self, rng: np.random.Generator, poses: Array, unlike: Callable[[Array], Array], scale: float) -> Array:
        """Gaussian noise on all DOF (Table II's particle filter), or, where poses are refined afterwards, on some joints, near and far;
        some poses get another arm."""
        noise = scale * self.sigma * rng.standard_normal(poses.shape)
        if self.settings.method == "particle_filter":
            return poses + noise
        explored = round(self.settings.explore * len(poses))
        far = rng.choice(REACH, size=(len(poses), 1))
        moved = rng.random((len(poses), len(self.skeleton.joints))) < MOVED
        out = poses + noise * far * moved[:, self.owners]
        if explored:
            out[-explored:] = self._other_arms(rng, out[-explored:], unlike)
        return out

    def _other_arms(self, rng: np.random.Generator, poses: Array, unlike: Callable[[Array], Array]) -> Array:
        """Poses (N, D) with another arm each: of some near its own and near usual ones, the most like what is seen."""
        out = np.repeat(poses, TRIED, axis=0)
        for n, pose in enumerate(poses):
            dofs, arms = self.arms[rng.integers(2)]
            usual = arms[rng.integers(len(arms), size=TRIED)]
            about = np.where(rng.random((TRIED, 1)) < 0.5, pose[dofs], usual)
            out[n * TRIED : (n + 1) * TRIED, dofs] = about + EXPLORED * rng.standard_normal((TRIED, len(dofs)))
        out = self.skeleton.clamp(out)
        return out[np.arange(len(poses)) * TRIED + unlike(out).reshape(-1, TRIED).argmin(1)]
