"""Extensions of a stage of Liu 2011 in the default preset: further costs, further candidates, and the mean as estimate.

All are off in the preset `liu2011`, which has plain `FilterStage`s.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.segments import PULLED_POINTS, coarse_limbs
from shadowpuppet.body.upper_body import TWIST
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.leg_postures import posture_penalty, soles_cost, standing_costs
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.particle_filter import Particles, Propose
from shadowpuppet.tracking.resampling import Scheme, normalise
from shadowpuppet.tracking.silhouette_cost import Cost, Observation

HEADING = "root_heading"
"""The DOF that turns a whole body about the vertical, explored about where it was: no direction is more usual than another."""
TORSO_SPREAD, LIMB_SPREAD = 0.3, 0.2
"""Standard deviations (rad) of explored candidates: the torso's angles about upright, a limb's about a coarse posture."""
TURNED_SHARE = 0.5
"""Share of the torso's explored candidates that are turned anywhere, in a silhouette too narrow for the trunk as it was."""
MEAN_TEMPERATURE = 50.0
"""For the mean estimate: a particle's weight falls to 1/e for this much more cost (pixels at 320 x 240)."""
NAT = MEAN_TEMPERATURE / 4
"""Cost of a nat of the keypoints' surprise (pixels at 320 x 240). An upper body is as near with half or four times as much; a whole one
leans toward the camera then, to explain that its proportions are a few per cent off."""
WIDE = 5.0
"""Standard deviation of the places of explored candidates, over the noise of a frame."""
MOVED_SHARE = 2 / 3
"""Share of a whole torso's explored candidates that are moved as a whole: half of them to where the silhouette ends, half nearer or
farther."""


def make_stage(picture: Picture, settings: MonocularSettings, name: str, scheme: Scheme | None = None, floor: float | None = None,
               moves: bool = True) -> FilterStage:
    """The paper's stage, or the extended one if the settings use any extension. `floor`: its height in the
    body's frame, metres, if it is known. Other arguments and errors: as for `FilterStage`."""
    extended = settings.explore or settings.motion_weight or settings.posture_weight or settings.estimate != "best"
    return ExtendedStage(picture, settings, name, scheme, floor, moves) if extended else FilterStage(picture, settings, name, scheme, moves)


class ExtendedStage(FilterStage):
    """A stage with exploration, a pull to usual postures, a pull to the last frame, and a mean estimate, as set in the settings."""

    def __init__(self, picture: Picture, settings: MonocularSettings, name: str, scheme: Scheme | None = None, floor: float | None = None,
                 moves: bool = True) -> None:
        """Arguments and errors as for `make_stage`."""
        super().__init__(picture, settings, name, scheme, moves)
        legs = any(part.endswith("leg") for part in self.parts)
        self.moves_feet = (legs or self.moves_torso) and "left_toe" in picture.body.landmark_names
        self.floor = floor if settings.posture_weight and legs else None
        self.turns = np.array([picture.body.skeleton.dofs[d].name == HEADING for d in self.dofs])

    def propose(self, cycle: int, narrow: bool = False, stands: Array | None = None) -> Propose:
        """The paper's noise; in the first cycle of a stage of one part also `explore` candidates."""
        noise, number = super().propose(cycle, stands=stands), self.settings.explore
        if cycle or len(self.parts) > 1 or not number:
            return noise
        return lambda rng, values: np.concatenate([noise(rng, values), self.clamp(self.explore(rng, values[0], number, narrow, stands))])

    def explore(self, rng: np.random.Generator, best: Array, number: int, narrow: bool = False, stands: Array | None = None) -> Array:
        """Values (number, d) from the part's whole range, which the noise of one frame cannot reach from `best` (d,). Others: as in
        `propose`."""
        if self.moves_torso:
            spread = np.where(self.rotates, TORSO_SPREAD, WIDE * self.noise(stands))
            values = np.where(self.rotates & ~self.turns, 0.0, best) + rng.standard_normal((number, len(best))) * spread
            if narrow:
                self._turn(rng, values[: round(TURNED_SHARE * number)], best)
            if stands is not None:
                self._move(rng, values[: round(MOVED_SHARE * number)], best, stands)
            return values
        limbs = coarse_limbs(self.picture.body.skeleton, self.parts[0])
        return limbs[rng.integers(len(limbs), size=number)] + LIMB_SPREAD * rng.standard_normal((number, len(best)))

    def _move(self, rng: np.random.Generator, values: Array, best: Array, stands: Array) -> None:
        """Fill values (N, d) with the torso as in `best` (d,), but at the place of the pose `stands` (D,), or nearer or farther."""
        there, noise = len(values) // 2, rng.standard_normal(values.shape) * self.sigma
        values[:] = best
        values[:there] += noise[:there] + np.where(self.rotates, 0.0, stands[self.dofs] - best)
        values[there:] += np.where(self.rotates, 0.0, np.where(self.deep, WIDE, 1.0) * noise[there:])

    def _turn(self, rng: np.random.Generator, values: Array, best: Array) -> None:
        """Fill values (N, d) with the torso as in `best` (d,), but turned anywhere to its side: the other side looks the same, and the mean
        of both would not be turned."""
        skeleton = self.picture.body.skeleton
        (twist,) = np.flatnonzero(self.dofs == skeleton.dof_names.index(TWIST))
        end = skeleton.limits[int(best[twist] > 0)][self.dofs[twist]]
        values[:] = best + rng.standard_normal(values.shape) * self.sigma
        values[:, twist] = rng.uniform(min(end, 0), max(end, 0), len(values))

    def extra_costs(self, observation: Observation, last: Array) -> list[Cost]:
        """The pulls to usual postures and to the last frame's estimate (D,), and the caller's own cost."""
        posture, motion = self.settings.posture_weight * self.scale, self.settings.motion_weight * self.scale
        costs: list[Cost] = [lambda poses: posture * posture_penalty(self.picture.body.skeleton, poses)] if posture else []
        costs += [] if self.floor is None else standing_costs(self.picture, self.floor)
        if observation.soles is not None and self.moves_feet:
            costs += [soles_cost(self.picture, observation.soles, MEAN_TEMPERATURE / 2)]  # the row errs by a pixel
        costs += [self._motion_cost(motion, last)] if motion else []
        if (keypoints := observation.keypoints) is not None:
            costs += [lambda poses: NAT * self.scale * keypoints.surprises(poses, self.hidden_joints)]
        return costs + super().extra_costs(observation, last)

    def _motion_cost(self, weight: float, last: Array) -> Cost:
        """A pull of the stage's shoulders, elbows, hands, knees and ankles to their positions in `last` (D,); bounded far away."""
        names = [name for part in self.parts for name in PULLED_POINTS[part]]
        before, reach = self.picture.points(last[None], names), self.settings.motion_reach

        def cost(poses: Array) -> Array:
            squared = ((self.picture.points(poses, names) - before) ** 2).sum(2)
            return weight * (squared / (1 + squared / reach**2)).sum(1)

        return cost

    def estimate(self, particles: Particles) -> Array:
        """Values (d,): the mean weighed by cost, or the particle of least cost."""
        if self.settings.estimate == "best":
            return super().estimate(particles)
        return normalise(-particles.costs / (MEAN_TEMPERATURE * self.scale)) @ particles.poses
