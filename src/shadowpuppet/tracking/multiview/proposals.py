"""Poses proposed for the next frame: by the motion prior (Ni 2008, V-A, step 3), and by noise without a prior or if the settings say so."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.prior.local_pca import Regions
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.tracking.multiview.exploration import Exploration
from shadowpuppet.tracking.multiview.settings import MultiviewSettings


class Proposals:
    """Draws poses of a skeleton for the next frame. Raises `ShadowPuppetError` for a motion prior of another body."""

    def __init__(self, skeleton: Skeleton, settings: MultiviewSettings, prior: MotionPrior | None = None) -> None:
        """`prior`: motion prior at the film's frame rate."""
        self.skeleton, self.settings, self.prior = skeleton, settings, prior
        sigma = [settings.sigma_heading if dof.name == "root_heading" else settings.sigma_translation if dof.kind == "translation"
                 else settings.sigma_rotation for dof in skeleton.dofs]  # fmt: skip
        self.sigma = np.array(sigma)
        self.root = skeleton.dof_indices(GLOBAL_DOFS)
        self.modelled = np.zeros(0, np.int64)
        if prior is not None:
            unknown = sorted(set(prior.names) - set(skeleton.dof_names))
            if unknown or not prior.names:
                raise ShadowPuppetError(f"prior: found {unknown[0] if unknown else 'no'} names of degrees of freedom, expected some of "
                                        f"{', '.join(skeleton.dof_names)}: it is of another body")
            self.modelled = skeleton.dof_indices(prior.names)
        by_prior_alone = prior is not None and settings.defensive == 0  # as in the paper
        explores = settings.method != "particle_filter" and not by_prior_alone
        self.exploration = Exploration(skeleton, self.sigma, settings.explore) if explores else None

    def __call__(self, rng: np.random.Generator, selected: Array, last: Array, velocity: Array, mismatch: Callable[[Array], Array],
                 scale: float = 1.0, regions: Regions | None = None) -> tuple[Array, Regions | None]:
        """Poses (N, D) for the next frame, from the `selected` particles' poses (N, D), and the regions (N,) that were drawn for them.

        Args:
            last: the last estimate (D,), which is the first proposal by noise.
            velocity: the estimate's change (D,) in the last frame.
            mismatch: silhouette cost (M,) of poses (M, D), for `Exploration`.
            scale: factor of all noise except the prior's own.
            regions: the selected particles' states s (N,); None: the regions nearest to their poses, and None is returned for the new ones
                unless the settings carry what is drawn.
        """
        number, out = len(selected), self._moved_on(selected, velocity)
        noisy = number if self.prior is None else round(self.settings.defensive * number)
        if noisy:  # none in the paper
            out[:noisy] = self.by_noise(rng, out[:noisy], mismatch, scale)
            out[0] = self._moved_on(last[None], velocity)[0]
        drawn = None
        if noisy < number:
            out[noisy:], drawn = self.by_prior(rng, out[noisy:], None if regions is None else regions[noisy:], scale)
        if drawn is not None and self.settings.region == "drawn":
            assert self.prior is not None
            drawn = np.concatenate([self.prior.encode(out[:noisy, self.modelled]).regions, drawn])
            return self.skeleton.clamp(out), drawn
        return self.skeleton.clamp(out), None

    def by_prior(self, rng: np.random.Generator, poses: Array, regions: Regions | None, scale: float = 1.0) -> tuple[Array, Regions]:
        """Poses (N, D) by the motion prior (eqs. 24-28), and the regions (N,) drawn for them, from `regions` (N,), or from those nearest to
        the poses. What the prior does not model of the root moves by a Gaussian walk."""
        assert self.prior is not None
        out, walk, modelled = poses.copy(), np.setdiff1d(self.root, self.modelled), poses[:, self.modelled]
        found = self.prior.propose(rng, modelled, regions, keep=self.settings.keep)
        out[:, self.modelled] = found.poses
        out[:, walk] += scale * self.sigma[walk] * rng.standard_normal((len(poses), len(walk)))
        return out, found.regions

    def by_noise(self, rng: np.random.Generator, poses: Array, mismatch: Callable[[Array], Array], scale: float = 1.0) -> Array:
        """Poses (N, D) with Gaussian noise: on all DOF (Table II's particle filter), or as `Exploration` does where poses are refined."""
        if self.exploration is None:
            return poses + scale * self.sigma * rng.standard_normal(poses.shape)
        return self.exploration(rng, poses, mismatch, scale)

    def _moved_on(self, poses: Array, velocity: Array) -> Array:
        """Poses (N, D) with position and heading advanced by the settings' share of `velocity` (D,)."""
        out = poses.copy()
        out[:, self.root] += (self.settings.velocity or 0.0) * velocity[self.root]
        return out
