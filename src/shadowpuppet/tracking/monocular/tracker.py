"""The trackers: what is searched, in which order, by which parts of `particle_filter`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.segments import dofs_of, limbs_of
from shadowpuppet.camera.mask import Mask, check_mask
from shadowpuppet.camera.rasterize import Picture, count
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular import pose_search
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.particle_filter import Particles, diffuse, evaluate, step
from shadowpuppet.tracking.recovery import settle, track_or_recover
from shadowpuppet.tracking.resampling import Scheme
from shadowpuppet.tracking.silhouette_cost import Cost, Observation
from shadowpuppet.tracking.status import ABSENT_AREA, status_of


class State(NamedTuple):
    """What a tracker knows after a frame; all that the next one needs."""

    pose: Array
    """The estimate, of shape (D,)."""
    particles: tuple[Particles, ...]
    """One set a stage; its poses are the values of the stage's DOF."""
    cost: float
    """Eq. 2 of the estimate, pixels."""
    overlap: float
    """Intersection over union of the drawn estimate and the silhouette, legs left out."""
    status: str
    """`tracked`, `uncertain`, `lost` or `absent`."""


@dataclass(frozen=True, eq=False)
class MonocularTracker:
    """Liu 2011: the posture of a body in one camera's silhouettes, by a hierarchical particle filter (Algorithm 2).

    Causal: a frame's pose uses no later frame. The same generator state and masks give the same poses.
    """

    picture: Picture
    settings: MonocularSettings = field(default_factory=MonocularSettings)
    scheme: Scheme | None = None
    """A resampling scheme of your own, in place of the settings'."""

    def step(self, rng: np.random.Generator, state: State, mask: Mask, also: Cost | None = None) -> State:
        """The state after a new mask (H, W). If no person is visible the pose is held; after a loss the person is searched for (`recover`).
        `also`: a cost of your own, poses (N, D) to pixels (N,), added to eq. 2. Raises `TrackingError` for a mask of another size than the
        camera's."""
        mask = check_mask(mask, self.picture.camera.size)
        return track_or_recover(
            state, is_absent=self.is_absent(mask, state.pose), recover=self.settings.recover, hold=self.absent,
            cycle=lambda state: self.cycle(rng, state, mask, also), search=lambda: self.start(rng, mask, also))  # fmt: skip

    def cycle(self, rng: np.random.Generator, state: State, mask: Mask, also: Cost | None = None) -> State:
        """Algorithm 2's loop body on a mask (H, W), `cycles` times: stage by stage resample, diffuse, weigh (Algorithms 3, 4)."""
        pose, particles = state.pose, list(state.particles)
        observation = self.observe(mask, pose, also)
        for cycle in range(self.settings.cycles):
            around = pose  # what a stage does not move, as it was before: the arms do not see each other's news
            for i, stage in enumerate(self.stages):
                weigh = stage.weigh(observation, around, state.pose)
                known = evaluate(particles[i].poses, weigh) if self.settings.rank_by == "new" else particles[i]
                particles[i] = step(rng, known, resample=stage.resample, propose=stage.propose(cycle), weigh=weigh, number=stage.number)
                pose = stage.put(pose, stage.estimate(particles[i]))
                around = pose if stage.moves_torso else around
        return self.judge(pose, particles, observation)

    def start(self, rng: np.random.Generator, mask: Mask, also: Cost | None = None) -> State:
        """A state from one mask (H, W): particles around the best coarse poses (eq. 5), then cycles on this mask; `absent` where nobody is
        there. `also`, and what is raised: as `step`."""
        mask = check_mask(mask, self.picture.camera.size)
        found = pose_search.search(self.picture, mask)
        observation, particles = self.observe(mask, found.pose, also), []
        for stage in self.stages:
            poses = np.repeat(found.pose[None], stage.number, axis=0)
            for limb, tried in found.limbs.items():
                if limb in stage.parts:
                    poses[:, dofs_of(self.picture.body.skeleton, limb)] = tried[np.arange(stage.number) % pose_search.GOOD]
            values = stage.clamp(diffuse(rng, poses[:, stage.dofs], stage.sigma))
            particles.append(evaluate(values, stage.weigh(observation, found.pose, found.pose)))
        state = self.judge(found.pose, particles, observation)
        if self.is_absent(mask, found.pose):
            return self.absent(state)
        return settle(state, lambda state: self.cycle(rng, state, mask, also))

    def observe(self, mask: Mask, pose: Array, also: Cost | None = None) -> Observation:
        """A mask (H, W), less the legs as they stand under `pose` (D,)."""
        return Observation.without_legs(mask, self.picture, pose, also) if self.settings.ignore_legs else Observation.of(mask, also=also)

    def judge(self, pose: Array, particles: list[Particles], observation: Observation) -> State:
        """The state of a pose (D,), with its cost, overlap and status."""
        cost, overlap = observation.cost_and_overlap(self.picture.draw(pose))
        return State(pose, tuple(particles), cost, overlap, status_of(overlap))

    def is_absent(self, mask: Mask, pose: Array) -> bool:
        """Whether a mask (H, W) is too small to be the person last seen in `pose` (D,)."""
        return int(np.count_nonzero(mask)) < max(ABSENT_AREA * count(self.picture.draw(pose)), 1)

    @staticmethod
    def absent(state: State) -> State:
        """The state while nobody is there: the pose waits."""
        return state._replace(cost=np.nan, overlap=0.0, status="absent")

    @cached_property
    def stages(self) -> tuple[FilterStage, ...]:
        """The filter's stages, in order; legs that no stage names, of a body that has some, follow."""
        named, limbs = self.settings.stages, limbs_of(self.picture.body.skeleton)
        legs = [limb for limb in limbs if limb.endswith("leg") and not any(limb in name for name in named)]
        return tuple(FilterStage(self.picture, self.settings, name, self.scheme) for name in (*named, *legs))
