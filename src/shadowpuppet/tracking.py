"""The trackers: what is searched, in which order, by which parts of `particle_filter`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet import first_pose, postures
from shadowpuppet.body import Body
from shadowpuppet.camera import Camera
from shadowpuppet.evidence import Evidence, Stage
from shadowpuppet.geometry import Array
from shadowpuppet.hierarchy import FilterStage
from shadowpuppet.likelihood import Observation
from shadowpuppet.masks import Mask, check_mask
from shadowpuppet.members import dofs_of, limbs_of
from shadowpuppet.motion_prior import MotionPrior
from shadowpuppet.particle_filter import Particles, Refine, Weigh, diffuse, evaluate, step
from shadowpuppet.proposals import Proposals
from shadowpuppet.rasterize import Picture, count
from shadowpuppet.refinement import Pass, Refiner
from shadowpuppet.resampling import Scheme, make_scheme, normalise
from shadowpuppet.settings import MonocularSettings, MultiviewSettings
from shadowpuppet.usual import Usual
from shadowpuppet.visual_hull import SurfacePoints

ABSENT, LOST, UNCERTAIN = 0.2, 0.5, 0.7
"""A silhouette under this share of the drawn body's area is nobody; an overlap (intersection over union) under these is lost or
uncertain. A cardbox that fits overlaps by 0.8 to 0.9."""
FEW, SMALLEST = 50, 0.5
"""Surface points, and their extent (m), from which on somebody may be there."""
MANY, FEWER, ENOUGH = 40, 16, 6
"""Particles with few cameras, with many, and how many are that."""
SUDDEN = 0.2
"""An overlap that is less than the last one by this is as good as lost: limbs that are drawn to somebody who is elsewhere may overlap."""
SETTLED = 10
"""Cycles on the first frame, after the search."""
SETTLE = 10
"""Frames' worth of cycles on the first mask, after the search."""


def _status(overlap: float) -> str:
    """What an overlap says of an estimate."""
    return "lost" if overlap < LOST else "uncertain" if overlap < UNCERTAIN else "tracked"


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

    def step(self, rng: np.random.Generator, state: State, mask: NDArray[np.bool_]) -> State:
        """A new mask (H, W). Someone who is not there is waited for; who was lost, or comes back, is searched for afresh
        (`recover`).

        Raises `TrackingError` for a mask that has not the camera's size.
        """
        mask = check_mask(mask, self.picture.camera.size)
        if self.is_absent(mask, state.pose):
            return self.absent(state)
        recover = self.settings.recover
        if state.status == "absent" and recover:
            return self.start(rng, mask)
        after = self.cycle(rng, state, mask)
        if after.status == "lost" and recover:
            found = self.start(rng, mask)
            return found if found.overlap > after.overlap else after
        return after

    def cycle(self, rng: np.random.Generator, state: State, mask: NDArray[np.bool_]) -> State:
        """Algorithm 2's loop body, `cycles` times: stage by stage resample, diffuse and weigh (Algorithms 3, 4); keep the best."""
        pose, particles = state.pose, list(state.particles)
        observation = self.observe(mask, pose)
        for cycle in range(self.settings.cycles):
            around = pose  # what a stage does not move, as it was before: the arms do not see each other's news
            for i, stage in enumerate(self.stages):
                weigh = stage.weigh(observation, around, state.pose)
                known = evaluate(particles[i].poses, weigh) if self.settings.rank_by == "new" else particles[i]
                particles[i] = step(rng, known, resample=stage.resample, propose=stage.propose(cycle), weigh=weigh, number=stage.number)
                pose = stage.put(pose, stage.estimate(particles[i]))
                around = pose if stage.moves_torso else around
        return self.judge(pose, particles, observation)

    def start(self, rng: np.random.Generator, mask: NDArray[np.bool_]) -> State:
        """A state from one mask (H, W): particles around the best coarse poses (eq. 5), then some cycles on this mask.

        Where nobody is there the state is `absent`. Raises `TrackingError` for a mask that has not the camera's size.
        """
        mask = check_mask(mask, self.picture.camera.size)
        found = first_pose.search(self.picture, mask)
        observation, particles = self.observe(mask, found.pose), []
        for stage in self.stages:
            poses = np.repeat(found.pose[None], stage.number, axis=0)
            for limb, tried in found.limbs.items():
                if limb in stage.parts:
                    poses[:, dofs_of(self.picture.body.skeleton, limb)] = tried[np.arange(stage.number) % first_pose.GOOD]
            values = stage.clamp(diffuse(rng, poses[:, stage.dofs], stage.sigma))
            particles.append(evaluate(values, stage.weigh(observation, found.pose, found.pose)))
        state = self.judge(found.pose, particles, observation)
        if self.is_absent(mask, found.pose):
            return self.absent(state)
        for _ in range(SETTLE):
            state = self.cycle(rng, state, mask)
        return state

    def observe(self, mask: NDArray[np.bool_], pose: Array) -> Observation:
        """A mask (H, W), less the legs as they stand under `pose` (D,)."""
        return Observation.without_legs(mask, self.picture, pose) if self.settings.ignore_legs else Observation.of(mask)

    def judge(self, pose: Array, particles: list[Particles], observation: Observation) -> State:
        """The state with its cost, overlap and status."""
        cost, overlap = observation.cost_and_overlap(self.picture.draw(pose))
        return State(pose, tuple(particles), cost, overlap, _status(overlap))

    def is_absent(self, mask: NDArray[np.bool_], pose: Array) -> bool:
        """Whether a mask (H, W) is too small to be the person last seen in `pose` (D,)."""
        return int(np.count_nonzero(mask)) < max(ABSENT * count(self.picture.draw(pose)), 1)

    @staticmethod
    def absent(state: State) -> State:
        """The state while nobody is there: the pose waits."""
        return state._replace(cost=np.nan, overlap=0.0, status="absent")

    @cached_property
    def stages(self) -> tuple[FilterStage, ...]:
        """The filter's stages, in order; legs that no stage names, of a body that has some, follow."""
        named, limbs = self.settings.stages, limbs_of(self.picture.body.skeleton)
        legs = [limb for limb in limbs if limb.endswith("leg") and not any(limb in name for name in named)]
        return tuple(FilterStage(self.picture, self.settings, name) for name in (*named, *legs))


class MultiviewState(NamedTuple):
    """What a tracker of several cameras knows after a frame; all that the next one needs."""

    pose: Array
    """The estimate, of shape (D,)."""
    velocity: Array
    """How it moved since the last frame, of shape (D,)."""
    particles: Particles
    cost: float
    """Of the estimate, m^2."""
    overlap: float
    """Intersection over union of the drawn estimate and the silhouettes, the mean of all cameras."""
    status: str
    """`tracked`, `uncertain`, `lost` or `absent`."""


@dataclass(frozen=True, eq=False)
class MultiviewTracker:
    """Ni 2008: the posture of a whole body from surface points of its visual hull, by a particle filter whose proposals come from a motion
    prior and are refined (V). Causal, and repeatable, as `MonocularTracker`."""

    body: Body
    cameras: tuple[Camera, ...]
    settings: MultiviewSettings = field(default_factory=MultiviewSettings)
    prior: MotionPrior | None = None
    """Of poses at the film's rate; None: Gaussian proposals only."""
    library: Array | None = None
    """Poses (L, D) that the person may begin in, such as those of the training motion; None: a few usual ones."""

    def step(self, rng: np.random.Generator, state: MultiviewState, points: SurfacePoints, masks: Sequence[Mask | None]) -> MultiviewState:
        """A new frame's surface points, and the masks (H, W) that they come from. Who was lost, jumps, or comes
        back, is searched for afresh (`recover`)."""
        evidence = Evidence(self.stage, points, masks)
        if not self.is_present(evidence):
            return state._replace(cost=np.nan, overlap=0.0, status="absent", velocity=np.zeros_like(state.pose))
        recover = self.settings.recover
        if state.status == "absent" and recover:
            return self.search(rng, evidence)
        after = self.cycle(rng, state, evidence)
        if recover and (after.status == "lost" or after.overlap < state.overlap - SUDDEN):
            found = self.search(rng, evidence)
            return found if found.overlap > after.overlap else after
        return after

    def start(self, rng: np.random.Generator, points: SurfacePoints, masks: Sequence[Mask | None]) -> MultiviewState:
        """A state from one frame: the best of many poses in all directions, refined. `absent` where nobody is there."""
        evidence = Evidence(self.stage, points, masks)
        if not self.is_present(evidence):
            rest = self.body.skeleton.clamp(np.zeros((1, len(self.body.skeleton.dofs))))
            return MultiviewState(rest[0], 0 * rest[0], Particles(rest, np.zeros(1), np.zeros(1)), np.nan, 0.0, "absent")
        return self.search(rng, evidence)

    def cycle(self, rng: np.random.Generator, state: MultiviewState, evidence: Evidence) -> MultiviewState:
        """The loop body of V-A: select by weight, propose, refine, weigh."""
        s, particles, pose = self.settings, state.particles, state.pose
        weigh, refine = self.weigh(evidence), self.refine(evidence, state.pose)
        for cycle in range(s.cycles):
            propose = partial(self.proposals, last=pose, velocity=state.velocity, unlike=evidence.differing, scale=s.cooling**cycle)
            particles = step(rng, particles, resample=self.resample, weigh=weigh, refine=refine, number=self.number, propose=propose)
            weights = normalise(particles.log_weights)
            pose = particles.best if s.estimate == "best" else weights @ particles.poses
        return self.judge(pose, pose - state.pose, particles, evidence, weigh)

    def search(self, rng: np.random.Generator, evidence: Evidence) -> MultiviewState:
        """A state from nothing but this frame."""
        weigh = self.weigh(evidence)
        found = postures.search(rng, self.body, self.refiner, evidence, self.library, weigh, self.number)
        state = self.judge(found.best, np.zeros_like(found.best), found, evidence, weigh)
        for _ in range(SETTLED):
            state = self.cycle(rng, state._replace(velocity=np.zeros_like(state.pose)), evidence)
        return state._replace(velocity=np.zeros_like(state.pose))

    def weigh(self, evidence: Evidence) -> Weigh:
        """Costs (N,), m^2, and log weights (eq. 29) of poses (N, D)."""
        s = self.settings

        def weigh(poses: Array) -> tuple[Array, Array]:
            costs = self.refiner.costs(poses, evidence.full)
            if s.silhouettes:
                costs = costs + s.silhouettes * evidence.differing(poses)
            if s.posture:
                costs = costs + s.posture * self.usual.strain(poses)
            return costs, -costs / s.sigma_cost**2

        return weigh

    def refine(self, evidence: Evidence, last: Array) -> Refine | None:
        """What makes poses (N, D) better; they are pulled a little to the last pose (D,)."""
        s, g = self.settings, self.settings.gauss_newton
        if s.method == "particle_filter":
            return None
        if s.refinement == "forces" or s.method == "image_force":
            some, half = evidence.cloud(g.share), s.forces.iterations // 2  # far from the goal, some of the points are enough
            coarse, fine = (replace(s.forces, iterations=n) for n in (half, s.forces.iterations - half))
            return lambda poses: self.refiner.forces(self.refiner.forces(poses, some, coarse), evidence.full, fine)
        # many cameras' surface tells enough, and costs more time already
        space = evidence.space if g.emptiness and len(self.cameras) < ENOUGH else None
        coarse = Pass(evidence.cloud(g.share), g.coarse, g.coarse_tau, space, g.emptiness)
        fine = Pass(evidence.full, g.fine, g.fine_tau, space, g.emptiness)
        centre, pull = self.usual.held(last, g.pull, s.posture)
        return lambda poses: self.refiner.gauss_newton(poses, (coarse, fine), centre, pull, g.damping)

    def judge(self, pose: Array, velocity: Array, particles: Particles, evidence: Evidence, weigh: Weigh) -> MultiviewState:
        """The state with its cost, overlap and status."""
        overlap = evidence.overlap(pose)
        return MultiviewState(pose, velocity, particles, float(weigh(pose[None])[0][0]), overlap, _status(overlap))

    def is_present(self, evidence: Evidence) -> bool:
        """Whether there is enough of a person: points on a hull of a size that a person has."""
        points = evidence.surface.points
        return len(points) >= FEW and float(np.linalg.norm(np.ptp(points, axis=0))) > SMALLEST

    @cached_property
    def number(self) -> int:
        """Particles."""
        if self.settings.method == "image_force":
            return 1
        return self.settings.particles or (MANY if len(self.cameras) < ENOUGH else FEWER)

    @cached_property
    def stage(self) -> Stage:
        """The body among the cameras."""
        return Stage(self.body, self.cameras)

    @cached_property
    def refiner(self) -> Refiner:
        """The body's half of refinement."""
        return Refiner(self.body, self.settings.surface)

    @cached_property
    def usual(self) -> Usual:
        """What postures are usual."""
        return Usual.of(self.body.skeleton, self.library)

    @cached_property
    def proposals(self) -> Proposals:
        """Where poses may be next."""
        return Proposals(self.body.skeleton, self.settings, self.prior)

    @cached_property
    def resample(self) -> Scheme:
        """How particles are selected."""
        return make_scheme(self.settings.resampling, 0.0)
