"""A stage of the hierarchical particle filter of Liu 2011 (IV-B): the DOF that it estimates, their proposals, costs and weights."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.segments import dofs_of, keep_limb_directions, limbs_of, parts_of, segments_of
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.settings import MonocularSettings, pixel_scale
from shadowpuppet.tracking.monocular.standing_place import PLACE
from shadowpuppet.tracking.particle_filter import Particles, Propose, Weigh, diffuse
from shadowpuppet.tracking.resampling import Indices, Scheme, make_scheme, with_best
from shadowpuppet.tracking.silhouette_cost import Cost, Observation, PartialCost


class FilterStage:
    """One stage: its particles are values (N, d) of its own DOF; all other DOF are as last estimated."""

    def __init__(self, picture: Picture, settings: MonocularSettings, name: str, scheme: Scheme | None = None, moves: bool = True) -> None:
        """`name`: parts joined by +; `scheme`: in place of the settings' resampling; `moves`: whether a whole body's distance is estimated.
        Raises `SettingsError` for an unknown part."""
        self.picture, self.settings = picture, settings
        self.parts = tuple(dict.fromkeys(part.strip() for part in name.split("+")))
        skeleton = picture.body.skeleton
        unknown = [part for part in self.parts if part not in segments_of(skeleton)]
        if unknown:
            raise SettingsError(f"stages: unknown part {unknown[0]!r} in {name!r}; there are: {choices(segments_of(skeleton))}")
        part_of = {d: part for part in self.parts for d in dofs_of(skeleton, part).tolist() if moves or skeleton.dofs[d].name != PLACE[0]}
        self.dofs = np.array(sorted(part_of), np.int64)
        self.other_legs = [limb for limb in limbs_of(skeleton) if limb.endswith("leg") and limb not in self.parts]
        self.moves_torso = "torso" in self.parts
        self.moves_arms = any(part.endswith("arm") for part in self.parts)
        hide = self.parts == ("torso",) and settings.torso_arms == "hidden"
        arms = [part for arm in ("left_arm", "right_arm") for part in parts_of(picture.body, arm)]
        self.partial = PartialCost(picture, self.dofs, arms if hide else ())
        hidden = {skeleton.dofs[d].joint for arm in ("left_arm", "right_arm") if hide for d in dofs_of(skeleton, arm)}
        self.hidden_joints = tuple(sorted(hidden))
        self._partials = dict[tuple[str, ...], PartialCost]()  # of some of the arms' parts alone

        table = {part: settings.torso if part == "torso" else settings.arm for part in self.parts}  # columns of Table I
        self.number = sum(part.particles for part in table.values())
        self.resample = make_scheme(settings.resampling, table[self.parts[0]].survival) if scheme is None else with_best(scheme)
        self.deep = np.array([skeleton.dofs[d].name == PLACE[0] for d in self.dofs])
        self.rotates = np.array([skeleton.dofs[d].kind != "translation" for d in self.dofs])
        self.sigma = np.array([table[part_of[d]].sigma_rotation if rotates else table[part_of[d]].sigma_translation
                               for d, rotates in zip(self.dofs.tolist(), self.rotates, strict=True)])
        self.scale = pixel_scale(picture.camera.size)
        self.sigma_cost = table[self.parts[0]].sigma_cost * self.scale

    def clamp(self, values: Array) -> Array:
        """Values (N, d) clipped to the joint limits if `limits` is set."""
        low, high = self.picture.body.skeleton.limits
        return np.clip(values, low[self.dofs], high[self.dofs]) if self.settings.limits else values

    def put(self, pose: Array, values: Array) -> Array:
        """The pose (D,), or poses (N, D), with this stage's values (d,) or (N, d). Legs keep their directions when the torso turns."""
        poses = np.repeat(pose[None], len(values) if values.ndim == 2 else 1, axis=0)
        poses[:, self.dofs] = values
        if self.moves_torso and self.other_legs:
            poses = keep_limb_directions(self.picture.body.skeleton, pose, poses, self.other_legs)
        return poses if values.ndim == 2 else poses[0]

    def propose(self, cycle: int, narrow: bool = False, stands: Array | None = None) -> Propose:
        """Gaussian noise on every particle but the first (Algorithms 3 and 4), multiplied by `cooling` for every further cycle. `narrow`:
        whether the silhouette is too narrow for the trunk as it was, which only the extended stage uses; `stands`: a whole body's upright
        pose (D,) where the silhouette ends: without it the distance stays."""
        sigma = self.noise(stands) * self.settings.cooling**cycle
        return lambda rng, values: self.clamp(diffuse(rng, values, sigma))

    def noise(self, stands: Array | None) -> Array:
        """Standard deviations (d,) of the noise; none of the distance where the silhouette does not show it. `stands`: as in `propose`."""
        return np.where(self.deep & (stands is None), 0.0, self.sigma)

    def selection(self, particles: Particles, weigh: Weigh) -> Scheme:
        """The resampling of last frame's particles (Algorithms 3 and 4), by what `rank_by` reads eq. 8 to mean. `weigh`: in this frame."""
        if self.settings.rank_by == "last":
            return self.resample
        again = weigh(particles.poses)[1]
        if self.settings.rank_by == "new":
            return lambda rng, _, number: self.resample(rng, again, number)
        copies_of_best = self.settings.resampling == "deterministic"

        def select(rng: np.random.Generator, log_weights: Array, number: int) -> Indices:
            ancestors = self.resample(rng, log_weights, number)
            best = ancestors == ancestors[0] if copies_of_best else np.arange(number) == 0
            return np.where(best, again.argmax(), ancestors)

        return select

    def weigh(self, observation: Observation, others: Array, last: Array) -> Weigh:
        """The function from values (N, d) to costs (N,) and log weights (N,).

        Args:
            others: the pose (D,) that all other DOF are taken from.
            last: the last frame's estimate (D,), for `extra_costs`.
        """
        silhouette = self.partial.costs(observation, others)
        extras = self.arm_costs(observation, others) + self.extra_costs(observation, last)

        def weigh(values: Array) -> tuple[Array, Array]:
            poses = self.put(others, values)
            costs = silhouette(poses)  # eq. 2
            for extra in extras:
                costs = costs + extra(poses)
            return costs, -(costs**2) / (2 * self.sigma_cost**2)  # eq. 6

        return weigh

    def extra_costs(self, observation: Observation, last: Array) -> list[Cost]:
        """Costs added to eq. 2: the caller's own, if there is one."""
        return [] if observation.also is None else [observation.also]

    def arm_costs(self, observation: Observation, others: Array) -> list[Cost]:
        """Eq. 2 of those parts of the arms that are seen by themselves, if any are, with all that does not vary as in `others` (D,)."""
        seen = observation.arms
        if seen is None or not self.moves_arms:
            return []
        if seen.parts not in self._partials:
            self._partials[seen.parts] = PartialCost(self.picture, self.dofs, set(self.picture.body.parts) - set(seen.parts))
        return [self._partials[seen.parts].costs(seen.observation, others)]

    def estimate(self, particles: Particles) -> Array:
        """The stage's estimate: values (d,) of the particle of least cost."""
        return particles.best
