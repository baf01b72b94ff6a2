"""The stages of the hierarchical filter: which DOF each one draws, how, and how it weighs them (Liu 2011, IV-B)."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.segments import PULLED_POINTS, coarse_limbs, dofs_of, keep_limb_directions, limbs_of, parts_of, segments_of
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.settings import MonocularSettings, pixel_scale
from shadowpuppet.tracking.particle_filter import Particles, Propose, Weigh, diffuse
from shadowpuppet.tracking.resampling import Scheme, make_scheme, normalise, with_best
from shadowpuppet.tracking.silhouette_cost import Observation, PartialCost

WANDER, AROUND = 0.3, 0.2
"""Where a stage explores: deviation of the torso's angles from upright, and of a limb's from a coarse one, rad."""
TEMPERATURE = 50.0
"""For the mean estimate: a particle worse by so many pixels (at 320 x 240) weighs 1/e."""


class FilterStage:
    """One stage: its particles are the values (N, d) of its DOF; all other DOF are as estimated."""

    def __init__(self, picture: Picture, settings: MonocularSettings, name: str, scheme: Scheme | None = None) -> None:
        """`name`: parts joined by +; `scheme`: in place of the settings' resampling. Raises `SettingsError` for an unknown part."""
        self.picture, self.settings = picture, settings
        self.parts = tuple(dict.fromkeys(part.strip() for part in name.split("+")))
        skeleton = picture.body.skeleton
        unknown = [part for part in self.parts if part not in segments_of(skeleton)]
        if unknown:
            raise SettingsError(f"stages: unknown part {unknown[0]!r} in {name!r}; there are: {choices(segments_of(skeleton))}")
        owner = {d: part for part in self.parts for d in dofs_of(skeleton, part).tolist()}
        self.dofs = np.array(sorted(owner), np.int64)
        self.legs = [limb for limb in limbs_of(skeleton) if limb.endswith("leg") and limb not in self.parts]
        self.moves_torso = "torso" in self.parts
        hide = self.parts == ("torso",) and settings.torso_arms == "hidden"
        arms = [part for arm in ("left_arm", "right_arm") for part in parts_of(picture.body, arm)]
        self.partial = PartialCost(picture, self.dofs, arms if hide else ())

        of = {part: settings.torso if part == "torso" else settings.arm for part in self.parts}
        self.number = sum(part.particles for part in of.values())
        self.resample = make_scheme(settings.resampling, of[self.parts[0]].survival) if scheme is None else with_best(scheme)
        self.turns = np.array([skeleton.dofs[d].kind != "translation" for d in self.dofs])
        self.sigma = np.array([of[owner[d]].sigma_rotation if turn else of[owner[d]].sigma_translation
                               for d, turn in zip(self.dofs.tolist(), self.turns, strict=True)])
        self.scale = pixel_scale(picture.camera.size)
        self.sigma_cost = of[self.parts[0]].sigma_cost * self.scale
        self.held = [name for part in self.parts for name in PULLED_POINTS[part]]

    def clamp(self, values: Array) -> Array:
        """Values (N, d) within the joint limits, if these are kept."""
        low, high = self.picture.body.skeleton.limits
        return np.clip(values, low[self.dofs], high[self.dofs]) if self.settings.limits else values

    def put(self, pose: Array, values: Array) -> Array:
        """The pose (D,), or poses (N, D), with this stage's values (d,) or (N, d) in it; legs do not turn with the torso."""
        poses = np.repeat(pose[None], len(values) if values.ndim == 2 else 1, axis=0)
        poses[:, self.dofs] = values
        if self.moves_torso and self.legs:
            poses = keep_limb_directions(self.picture.body.skeleton, pose, poses, self.legs)
        return poses if values.ndim == 2 else poses[0]

    def propose(self, cycle: int) -> Propose:
        """Gaussian noise (Algorithms 3, 4), less of it in every cycle; in the first, poses from afar are tried beside."""
        sigma = self.sigma * self.settings.cooling**cycle
        explored = self.settings.explore if cycle == 0 and len(self.parts) == 1 else 0

        def propose(rng: np.random.Generator, values: Array) -> Array:
            drawn = diffuse(rng, values, sigma)
            return self.clamp(np.concatenate([drawn, self.explore(rng, values[0], explored)]) if explored else drawn)

        return propose

    def explore(self, rng: np.random.Generator, best: Array, number: int) -> Array:
        """Values (number, d) from all over: what the noise of one frame cannot reach from `best` (d,)."""
        if self.moves_torso:
            spread = np.where(self.turns, WANDER, 5 * self.settings.torso.sigma_translation)
            return np.where(self.turns, 0.0, best) + rng.standard_normal((number, len(best))) * spread
        limbs = coarse_limbs(self.picture.body.skeleton, self.parts[0])
        return limbs[rng.integers(len(limbs), size=number)] + AROUND * rng.standard_normal((number, len(best)))

    def weigh(self, observation: Observation, around: Array, last: Array) -> Weigh:
        """Costs (N,) and log weights (eq. 6) of values (N, d), all other DOF as in `around` (D,).

        Beside eq. 2 a pose pays, in the default preset, for being unusual and for being far from the last frame's, `last` (D,); and what
        the observation has beside its silhouette.
        """
        settings, silhouette = self.settings, self.partial.costs(observation, around)
        before = self._places(last[None]) if settings.motion_weight else None

        def weigh(values: Array) -> tuple[Array, Array]:
            poses = self.put(around, values)
            costs = silhouette(poses)
            if settings.posture_weight:
                costs = costs + settings.posture_weight * self.scale * self.picture.body.skeleton.strain(poses)
            if before is not None:
                moved = ((self._places(poses) - before) ** 2).sum(2)
                costs = costs + settings.motion_weight * self.scale * (moved / (1 + moved / settings.motion_reach**2)).sum(1)
            if observation.also is not None:
                costs = costs + observation.also(poses)
            return costs, -(costs**2) / (2 * self.sigma_cost**2)

        return weigh

    def estimate(self, particles: Particles) -> Array:
        """Values (d,): the particle of least cost, or the mean weighed by cost."""
        if self.settings.estimate == "best":
            return particles.best
        return normalise(-particles.costs / (TEMPERATURE * self.scale)) @ particles.poses

    def _places(self, poses: Array) -> Array:
        """Where the points (N, P, 3) are that the motion's pull holds, metres."""
        return self.picture.points(poses, self.held)
