"""Ni 2008, section V: the tracker of several cameras."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.tracking.multiview import pose_search
from shadowpuppet.tracking.multiview.observation import BodyInViews, MultiviewObservation
from shadowpuppet.tracking.multiview.posture_prior import PosturePrior
from shadowpuppet.tracking.multiview.proposals import Proposals
from shadowpuppet.tracking.multiview.refinement.refiner import Pass, Refiner
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.particle_filter import Particles, Refine, Weigh, step
from shadowpuppet.tracking.resampling import Scheme, make_scheme, normalise, with_best
from shadowpuppet.tracking.silhouette_cost import Cost
from shadowpuppet.tracking.status import SETTLE_CYCLES, status_of

MIN_POINTS, MIN_EXTENT = 50, 0.5
"""Surface points, and their extent (m), from which on somebody may be there."""
PARTICLES_FEW_CAMERAS, PARTICLES_MANY_CAMERAS, MANY_CAMERAS = 40, 16, 6
"""Particles with few cameras, with many, and how many are that."""
OVERLAP_DROP = 0.2
"""An overlap that is less than the last one by this is as good as lost: limbs that are drawn to somebody who is elsewhere may overlap."""


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
    scheme: Scheme | None = None
    """A resampling scheme of your own, in place of the settings'."""

    def step(self, rng: np.random.Generator, state: MultiviewState, points: SurfacePoints, masks: Sequence[Mask | None],
             also: Cost | None = None) -> MultiviewState:
        """A new frame's surface points, and the masks (H, W) that they come from. Who was lost, jumps, or comes back, is searched for
        afresh (`recover`). `also`: a cost of your own, poses (N, D) to m^2 (N,), which is added to that of the surface."""
        observation = MultiviewObservation(self.views, points, masks, also)
        if not self.is_present(observation):
            return state._replace(cost=np.nan, overlap=0.0, status="absent", velocity=np.zeros_like(state.pose))
        recover = self.settings.recover
        if state.status == "absent" and recover:
            return self.search(rng, observation)
        after = self.cycle(rng, state, observation)
        if recover and (after.status == "lost" or after.overlap < state.overlap - OVERLAP_DROP):
            found = self.search(rng, observation)
            return found if found.overlap > after.overlap else after
        return after

    def start(self, rng: np.random.Generator, points: SurfacePoints, masks: Sequence[Mask | None],
              also: Cost | None = None) -> MultiviewState:
        """A state from one frame's points and masks (H, W): the best of many poses in all directions, refined; or `absent`."""
        observation = MultiviewObservation(self.views, points, masks, also)
        if not self.is_present(observation):
            rest = self.body.skeleton.clamp(np.zeros((1, len(self.body.skeleton.dofs))))
            return MultiviewState(rest[0], 0 * rest[0], Particles(rest, np.zeros(1), np.zeros(1)), np.nan, 0.0, "absent")
        return self.search(rng, observation)

    def cycle(self, rng: np.random.Generator, state: MultiviewState, observation: MultiviewObservation) -> MultiviewState:
        """The loop body of V-A: select by weight, propose, refine, weigh."""
        s, particles, pose = self.settings, state.particles, state.pose
        weigh, refine = self.weigh(observation), self.refine(observation, state.pose)
        for cycle in range(s.cycles):
            propose = partial(self.proposals, last=pose, velocity=state.velocity, unlike=observation.differing, scale=s.cooling**cycle)
            particles = step(rng, particles, resample=self.resample, weigh=weigh, refine=refine, number=self.number, propose=propose)
            weights = normalise(particles.log_weights)
            pose = particles.best if s.estimate == "best" else weights @ particles.poses
        return self.judge(pose, pose - state.pose, particles, observation, weigh)

    def search(self, rng: np.random.Generator, observation: MultiviewObservation) -> MultiviewState:
        """A state from nothing but this frame."""
        weigh = self.weigh(observation)
        found = pose_search.search(rng, self.body, self.refiner, observation, self.library, weigh, self.number)
        state = self.judge(found.best, np.zeros_like(found.best), found, observation, weigh)
        for _ in range(SETTLE_CYCLES):
            state = self.cycle(rng, state._replace(velocity=np.zeros_like(state.pose)), observation)
        return state._replace(velocity=np.zeros_like(state.pose))

    def weigh(self, observation: MultiviewObservation) -> Weigh:
        """Costs (N,), m^2, and log weights (eq. 29) of poses (N, D)."""
        s = self.settings

        def weigh(poses: Array) -> tuple[Array, Array]:
            costs = self.refiner.costs(poses, observation.full)
            if s.silhouettes:
                costs = costs + s.silhouettes * observation.differing(poses)
            if s.posture:
                costs = costs + s.posture * self.posture_prior.penalty(poses)
            if observation.also is not None:
                costs = costs + observation.also(poses)
            return costs, -costs / s.sigma_cost**2

        return weigh

    def refine(self, observation: MultiviewObservation, last: Array) -> Refine | None:
        """What makes poses (N, D) better; they are pulled a little to the last pose (D,)."""
        s, g = self.settings, self.settings.gauss_newton
        if s.method == "particle_filter":
            return None
        if s.refinement == "forces" or s.method == "image_force":
            some, half = observation.cloud(g.share), s.forces.iterations // 2  # far from the goal, some of the points are enough
            coarse, fine = (replace(s.forces, iterations=n) for n in (half, s.forces.iterations - half))
            return lambda poses: self.refiner.forces(self.refiner.forces(poses, some, coarse), observation.full, fine)
        # many cameras' surface tells enough, and costs more time already
        space = observation.space if g.emptiness and len(self.cameras) < MANY_CAMERAS else None
        coarse = Pass(observation.cloud(g.share), g.coarse, g.coarse_tau, space, g.emptiness)
        fine = Pass(observation.full, g.fine, g.fine_tau, space, g.emptiness)
        centre, pull = self.posture_prior.quadratic(last, g.pull, s.posture)
        return lambda poses: self.refiner.gauss_newton(poses, (coarse, fine), centre, pull, g.damping)

    def judge(self, pose: Array, velocity: Array, particles: Particles, observation: MultiviewObservation, weigh: Weigh) -> MultiviewState:
        """The state of a pose (D,), with its cost, overlap and status."""
        overlap = observation.overlap(pose)
        return MultiviewState(pose, velocity, particles, float(weigh(pose[None])[0][0]), overlap, status_of(overlap))

    def is_present(self, observation: MultiviewObservation) -> bool:
        """Whether there is enough of a person: points on a hull of a size that a person has."""
        points = observation.surface.points
        return len(points) >= MIN_POINTS and float(np.linalg.norm(np.ptp(points, axis=0))) > MIN_EXTENT

    @cached_property
    def number(self) -> int:
        """Particles."""
        if self.settings.method == "image_force":
            return 1
        return self.settings.particles or (PARTICLES_FEW_CAMERAS if len(self.cameras) < MANY_CAMERAS else PARTICLES_MANY_CAMERAS)

    @cached_property
    def stage(self) -> BodyInViews:
        """The body among the cameras."""
        return BodyInViews(self.body, self.cameras)

    @cached_property
    def refiner(self) -> Refiner:
        """The body's half of refinement."""
        return Refiner(self.body, self.settings.surface)

    @cached_property
    def usual(self) -> PosturePrior:
        """What postures are usual."""
        return PosturePrior.of(self.body.skeleton, self.library)

    @cached_property
    def proposals(self) -> Proposals:
        """Where poses may be next."""
        return Proposals(self.body.skeleton, self.settings, self.prior)

    @cached_property
    def resample(self) -> Scheme:
        """How particles are selected."""
        return make_scheme(self.settings.resampling, 0.0) if self.scheme is None else with_best(self.scheme)
