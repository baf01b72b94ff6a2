"""The tracker for several cameras (Ni 2008, V): a particle filter whose proposals come from a motion prior and are refined."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.bits import pack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.colour_codes import ColourCode
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask, half_size
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import BLANK
from shadowpuppet.motion.prior.local_pca import Regions
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.tracking.keypoints.front import CERTAIN
from shadowpuppet.tracking.multiview import arm_postures, body_postures, pose_search
from shadowpuppet.tracking.multiview.arms_in_views import ArmsInViews, Counts
from shadowpuppet.tracking.multiview.keypoint_evidence import KeypointEvidence, keypoint_evidence
from shadowpuppet.tracking.multiview.local_search import LocalSearch
from shadowpuppet.tracking.multiview.observation import BodyInViews, MultiviewObservation, middle_of
from shadowpuppet.tracking.multiview.posture_prior import PosturePrior
from shadowpuppet.tracking.multiview.proposals import Proposals
from shadowpuppet.tracking.multiview.refinement.refiner import Pass, Refine, Refiner
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.multiview.watch.odd_camera import adapted, odd_one, suspects
from shadowpuppet.tracking.particle_filter import Particles, Weigh, better_of, evaluate
from shadowpuppet.tracking.recovery import OVERLAP_DROP, settle, track_or_recover
from shadowpuppet.tracking.resampling import SCHEMES, Indices, Scheme, normalise, with_best
from shadowpuppet.tracking.silhouette_cost import Cost
from shadowpuppet.tracking.status import agreement_of, status_of
from shadowpuppet.tracking.unexplained import Unexplained, look_beside

ARM_COLOURS = 0.1
"""`MultiviewSettings.arm_colours` of few cameras."""
WELL = 0.75
"""Least overlap of body and silhouettes at which colours are learnt."""
MIN_POINTS, MIN_EXTENT = 50, 0.5
"""Smallest number and smallest extent (m) of the surface points of a person."""
FEW_CAMERAS, MANY_CAMERAS = 4, 6
"""Number of cameras up to which all poses go through the fine iterations of Gauss-Newton, as more of them are possible; and from which on
the surface points are precise enough without free space."""
PARTICLES = (40, 24, 16)
"""Default particle numbers with up to `FEW_CAMERAS`, twice as many with two, between, and from `MANY_CAMERAS` on."""
FINALISTS = 8
"""Number of poses, those that cost least after the coarse iterations of Gauss-Newton, that go through the fine ones with more than
`FEW_CAMERAS`."""


class MultiviewState(NamedTuple):
    """The tracker's state after a frame: all that the next frame needs."""

    pose: Array
    """The estimate, of shape (D,)."""
    velocity: Array
    """Change of the estimate since the last frame, of shape (D,)."""
    particles: Particles
    cost: float
    """Cost of the estimate, m^2."""
    overlap: float
    """Intersection over union of the drawn estimate and the silhouettes, mean of all cameras; NaN without silhouettes."""
    status: str
    """`tracked`, `uncertain`, `lost` or `absent`."""
    unexplained: tuple[Unexplained | None, ...] = ()
    """What each camera's silhouettes, at half size, have beside the body; empty if nothing is left out."""
    usual: Array = np.zeros(0)
    """Overlap in each camera's picture as it has been (C,), NaN without a silhouette so far; empty at the beginning."""
    colours: Counts = ()
    """The colours that have been seen on the arms and elsewhere, by camera."""
    regions: Regions | None = None
    """The motion prior's region drawn for each particle (N,); None where it is the one nearest to the pose."""
    against: float = 0.0
    """Log odds of keypoints in the last frames against the way that the body faces."""
    support: float = np.nan
    """Share of the keypoints that lie near the estimate; NaN without keypoints."""

    @property
    def agreement(self) -> float:
        """The measure of a loss."""
        return agreement_of(self.overlap, self.support)


@dataclass(frozen=True, eq=False)
class MultiviewTracker:
    """Ni 2008: poses of a whole body from surface points of its visual hull.

    Causal: a frame's pose uses no later frame. The same generator state and observations give the same poses.
    """

    body: Body
    cameras: tuple[Camera, ...]
    settings: MultiviewSettings = field(default_factory=MultiviewSettings)
    prior: MotionPrior | None = None
    """Motion prior of poses at the film's rate; None: proposals by noise only."""
    library: Array | None = None
    """Initial poses (L, D) of a search, for example the training motion's; None: usual postures only."""
    scheme: Scheme | None = None
    """A resampling scheme of your own, in place of the settings'."""
    looks: int = 0
    """Number of frames after which parts of the silhouettes that the body does not explain are left out; 0: never."""
    carve: Callable[[Sequence[Mask | None]], SurfacePoints] | None = None
    """Surface points of masks (H, W), one per camera: computed again without a camera that contradicts the others; None: all count."""
    rate: float = 30.0
    """Frames/s: keypoints of half a second are wrong together."""

    def step(self, rng: np.random.Generator, state: MultiviewState, points: SurfacePoints, masks: Sequence[Mask | None],
             also: Cost | None = None, codes: Sequence[ColourCode | None] = (),
             keypoints: Sequence[Keypoints | None] = ()) -> MultiviewState:
        """The state after a new frame's surface points, and the masks (H, W) that they were made from, one per camera.

        If no person is visible the pose is held; after a loss the person is searched for (`recover`). `also`: a cost of your own, poses
        (N, D) to m^2 (N,), added to that of the surface. `codes`: the pictures' colours (`colour_codes`), one array per camera, if the arms
        may be found by them. `keypoints`: what a detector found in the pictures, pixels of the cameras' size, one per camera.
        """
        observation = self.observe(state, points, masks, also, codes, keypoints)
        found = self.follow(rng, state, observation)
        found = self._faced(rng, state, found, observation)
        if self.carve is not None:
            found = self._without_odd_one(rng, state, found, observation)
        found = found._replace(unexplained=self.unexplained(state.unexplained, masks, found)) if self.looks else found
        return found._replace(colours=self.learnt(state.colours, codes, masks, found)) if self.arm_colours else found

    def _without_odd_one(self, rng: np.random.Generator, state: MultiviewState, found: MultiviewState,
                         observation: MultiviewObservation) -> MultiviewState:
        """The state `found` in a frame, or that found without the one camera that contradicts the others, if there is one."""
        assert self.carve is not None
        masks, usual = observation.masks, state.usual
        now, states, overlaps = observation.overlaps(found.pose), dict[int, MultiviewState](), dict[int, Array]()
        for n in suspects(usual, now):
            rest = [None if m == n else mask for m, mask in enumerate(masks)]
            without = MultiviewObservation(self.views, self.carve(rest), rest, observation.also, observation.left_out)
            without.keypoints = None if observation.keypoints is None else observation.keypoints.without(n)
            states[n] = self.follow(rng, state, without)
            overlaps[n] = observation.overlaps(states[n].pose)
        odd = odd_one(usual, now, overlaps)
        found, now = (found, now) if odd is None else (states[odd], overlaps[odd])
        return found._replace(usual=adapted(usual, now, odd))

    def follow(self, rng: np.random.Generator, state: MultiviewState, observation: MultiviewObservation) -> MultiviewState:
        """The state after a frame's observation, as `step`, which makes it."""
        return track_or_recover(
            state, is_absent=not self.is_present(observation), recover=self.settings.recover, drop=OVERLAP_DROP,
            hold=lambda state: state._replace(cost=np.nan, overlap=0.0, status="absent", velocity=np.zeros_like(state.pose)),
            cycle=lambda state: self.cycle(rng, state, observation), search=lambda: self.search(rng, observation))  # fmt: skip

    def start(self, rng: np.random.Generator, points: SurfacePoints, masks: Sequence[Mask | None],
              also: Cost | None = None, facing: float | None = None, keypoints: Sequence[Keypoints | None] = ()) -> MultiviewState:
        """A state from one frame's points and masks (H, W), as `search` finds it, or `absent`. Arguments as in `step` and `search`."""
        observation = MultiviewObservation(self.views, points, masks, also)
        observation.keypoints = self.shown(points, masks, keypoints)
        if self.is_present(observation):
            return self.search(rng, observation, facing)
        rest = self.body.skeleton.clamp(np.zeros((1, len(self.body.skeleton.dofs))))
        return MultiviewState(rest[0], 0 * rest[0], Particles(rest, np.zeros(1), np.zeros(1)), np.nan, 0.0, "absent")

    def observe(self, state: MultiviewState, points: SurfacePoints, masks: Sequence[Mask | None],
                also: Cost | None = None, codes: Sequence[ColourCode | None] = (),
                keypoints: Sequence[Keypoints | None] = ()) -> MultiviewObservation:
        """The observation of a frame's masks (H, W) after `state`, without what is left out beside its pose. Arguments as in `step`."""
        also = self._with_arms(also, state, masks, codes)
        beside = [None if each is None or not each.left_out.any() else each.beside(picture.mask(state.pose))
                  for each, picture in zip(state.unexplained, self.views.pictures)]
        out = [None if pixels is None else pack(pixels) for pixels in beside]
        observation = MultiviewObservation(self.views, points, masks, also, out)
        last = None if state.status in BLANK else state.pose
        observation.keypoints = self.shown(points, masks, keypoints, last)
        return observation

    def shown(self, points: SurfacePoints, masks: Sequence[Mask | None],
              keypoints: Sequence[Keypoints | None] = (), last: Array | None = None) -> KeypointEvidence | None:
        """What the keypoints of one frame say of the person, who was in the `last` pose (D,) if it is known; None without any. Arguments as
        in `step`."""
        middle = middle_of(points) if len(points.points) else None
        return keypoint_evidence(self.refiner, self.cameras, self.settings, keypoints, masks, middle, last)

    def _faced(self, rng: np.random.Generator, state: MultiviewState, found: MultiviewState,
               observation: MultiviewObservation) -> MultiviewState:
        """The state `found` in a frame, or one that faces as the keypoints show, once the odds of half a second's frames are certain."""
        seen = observation.keypoints
        odds = 0.0 if seen is None or found.status in BLANK else seen.against(found.pose)
        against = state.against + odds * 2 / self.rate if odds else 0.0
        if against > CERTAIN and seen is not None and seen.front is not None:
            return self.search(rng, observation, seen.front.heading)
        return found._replace(against=against)

    def _with_arms(self, also: Cost | None, state: MultiviewState, masks: Sequence[Mask | None],
                  codes: Sequence[ColourCode | None]) -> Cost | None:
        """A caller's cost with that of what has the arms' colours and that no arm covers. Arguments as in `step`."""
        weight = self.arm_colours
        arms = self.arms_in_views.uncovered(state.colours, codes, masks, state.pose) if weight and state.colours and codes else None
        if arms is None:
            return also
        return lambda poses: weight * arms(poses) + (0 if also is None else also(poses))

    def learnt(self, colours: Counts, codes: Sequence[ColourCode | None], masks: Sequence[Mask | None], state: MultiviewState) -> Counts:
        """The colours seen so far, with those in a new state's frame, of its masks (H, W), if the estimate fits well."""
        if not codes or state.status != "tracked" or state.overlap < WELL:
            return colours
        return self.arms_in_views.learnt(colours, codes, masks, state.pose)

    def unexplained(self, last: Sequence[Unexplained | None], masks: Sequence[Mask | None],
                    state: MultiviewState) -> tuple[Unexplained | None, ...]:
        """What the masks (H, W) have beside the body of a new state, by camera; `last`: the same of the frame before."""
        last = tuple(last) or (None,) * len(masks)
        absent, found = state.status == "absent", list[Unexplained | None]()
        for before, mask, picture in zip(last, masks, self.views.pictures, strict=True):
            small = None if mask is None else half_size(mask)
            drawn = None if small is None else np.zeros_like(small) if absent else picture.mask(state.pose)
            found.append(before if small is None or drawn is None else look_beside(before, small, drawn, self.looks))
        return tuple(found)

    def cycle(self, rng: np.random.Generator, state: MultiviewState, observation: MultiviewObservation) -> MultiviewState:
        """The filter's loop body (V-A), `cycles` times; the steps are numbered as in the paper."""
        s, pose = self.settings, state.pose
        weigh, refine = self.weigh(observation), self.refine(observation, state.pose)
        # Step 1: the last frame's particles (s, x, w). The state s is the region of the motion prior drawn for x before refinement, as in
        # the paper, or (`region` = "nearest") the one in which the refined x lies: `proposals` finds it, and `regions` is None.
        particles, regions = state.particles, state.regions
        for cycle in range(s.cycles or 1):
            # Step 2, selection: draw particles by their weights.
            chosen = self.resample(rng, particles.log_weights, self.number)
            selected = particles.poses[chosen]
            # Step 3, sampling: draw each particle's next state and pose (eqs. 24-28).
            velocity = state.velocity if cycle == 0 else np.zeros_like(pose)  # the motion of a frame counts once
            poses, regions = self.proposals(rng, selected, pose, velocity, observation.mismatch, s.cooling**cycle,
                                            None if regions is None else regions[chosen])
            if observation.keypoints is not None:  # not in the paper: after the last estimate, moved on
                poses[1 : 1 + len(observation.keypoints.proposed)] = observation.keypoints.proposed[: len(poses) - 1]
            # Step 4, refinement: move each pose by forces and moments (eqs. 32-41).
            kept, refined = (slice(None), poses) if refine is None else refine(poses)
            poses, regions = poses[kept], None if regions is None else regions[kept]
            # Step 5, weighting (eqs. 29-31); the estimate is the particle of greatest weight.
            particles = evaluate(refined, weigh)
            if s.local and s.method == "hybrid":  # not in the paper
                particles = self.local_search(rng, better_of(particles, evaluate(poses, weigh)), weigh, self.number)
            pose = particles.best if s.estimate == "best" else normalise(particles.log_weights) @ particles.poses
        return self.judge(pose, pose - state.pose, particles, observation, weigh)._replace(regions=regions)

    def search(self, rng: np.random.Generator, observation: MultiviewObservation, facing: float | None = None) -> MultiviewState:
        """A state from this frame alone: the best of many poses in all directions, or about `facing` (rad), refined. By default about the
        front that keypoints show, if it is certain."""
        front = None if observation.keypoints is None else observation.keypoints.front
        if facing is None and front is not None and front.is_certain:
            facing = front.heading
        weigh = self.weigh(observation)
        found = pose_search.search(rng, self.body, self.refiner, observation, self.library, weigh, self.number, facing)
        still = np.zeros_like(found.best)
        state = self.judge(found.best, still, found, observation, weigh)
        return settle(state, lambda state: self.cycle(rng, state, observation)._replace(velocity=still))

    def weigh(self, observation: MultiviewObservation) -> Weigh:
        """The function from poses (N, D) to costs (N,), m^2, and log weights (N,)."""
        extras = self.extra_costs(observation)

        def weigh(poses: Array) -> tuple[Array, Array]:
            costs = self.refiner.costs(poses, observation.full)  # D of eqs. 30, 31
            for extra in extras:
                costs = costs + extra(poses)
            return costs, -costs / self.settings.sigma_cost**2  # eq. 29

        return weigh

    def extra_costs(self, observation: MultiviewObservation) -> list[Cost]:
        """Costs added to the paper's: silhouettes, posture and arms (off in `ni2008`), and the caller's own."""
        s, extras = self.settings, list[Cost]()
        if s.silhouettes:
            extras.append(lambda poses: s.silhouettes * observation.mismatch(poses))
        if s.posture:
            extras.append(lambda poses: s.posture * self.posture_prior.penalty(poses))
        if s.arms:
            extras.append(lambda poses: s.arms * self.rarity_of_arms(poses))
        if s.limbs:
            extras.append(lambda poses: s.limbs * self.rarity_of_limbs(poses))
            if self.sees_quarters_alike:  # raised toes would explain the silhouettes of feet that point another way
                extras.append(lambda poses: s.limbs * self.posture_prior.rarity_of_feet(poses))
        if observation.keypoints is not None:
            extras.append(observation.keypoints.cost)
        return extras if observation.also is None else [*extras, observation.also]

    def rarity_of_arms(self, poses: Array) -> Array:
        """How rare the postures of both arms are among people, together (N,), of poses (N, D)."""
        return arm_postures.usual_arm_postures().rarity_of_both(self.body.points(poses, names=arm_postures.JOINTS))

    def rarity_of_limbs(self, poses: Array) -> Array:
        """How rare the whole postures of poses (N, D) are among people, (N,)."""
        return body_postures.usual_body_postures().rarity_of(self.body.points(poses, names=body_postures.JOINTS))

    def refine(self, observation: MultiviewObservation, last: Array) -> Refine | None:
        """The function that refines poses (N, D); `last`: the last estimate (D,)."""
        s = self.settings
        if s.method == "particle_filter":
            return None
        if s.refinement == "forces" or s.method == "image_force":
            return lambda poses: (slice(None), self.refiner.forces(poses, observation.full, s.forces))  # eqs. 32-41, on all points
        return self._gauss_newton(observation, last)

    def _gauss_newton(self, observation: MultiviewObservation, last: Array) -> Refine:
        """The default preset's refinement (not in the paper)."""
        s, g = self.settings, self.settings.gauss_newton
        space = observation.space if g.emptiness and len(self.cameras) < MANY_CAMERAS else None
        coarse = Pass(observation.cloud(g.share), g.coarse, g.coarse_tau, space, g.emptiness, *observation.rays)
        fine = Pass(observation.full, g.fine, g.fine_tau, space, g.emptiness, *observation.rays)
        centre, pull = self.posture_prior.quadratic(last, g.pull, s.posture)
        number = FINALISTS if len(self.cameras) > FEW_CAMERAS else self.number

        def refine(poses: Array) -> tuple[Indices, Array]:
            rough, costs = self.refiner.descend(poses, coarse, centre, pull, g.damping)
            # where all go on they keep their order: what is drawn at random later goes by it
            best = costs.argsort(kind="stable")[:number] if number < len(poses) else np.arange(len(poses))
            return best, self.refiner.descend(rough[best], fine, centre, pull, g.damping)[0]

        return refine

    def judge(self, pose: Array, velocity: Array, particles: Particles, observation: MultiviewObservation,
              weigh: Weigh) -> MultiviewState:
        """The state of a pose (D,), with its cost, overlap, support and status."""
        cost, overlap = float(weigh(pose[None])[0][0]), observation.overlap(pose)
        support = np.nan if observation.keypoints is None else observation.keypoints.support(pose)
        return MultiviewState(pose, velocity, particles, cost, overlap, status_of(overlap, support), support=support)

    def is_present(self, observation: MultiviewObservation) -> bool:
        """Whether the surface points are enough, and extended enough, for a person; or, without silhouettes, the keypoints."""
        if observation.by_keypoints and observation.keypoints is not None:
            return observation.keypoints.show_person
        points = observation.surface.points
        return len(points) >= MIN_POINTS and float(np.linalg.norm(np.ptp(points, axis=0))) > MIN_EXTENT

    @cached_property
    def number(self) -> int:
        """Number of particles, N."""
        if self.settings.method == "image_force":
            return 1
        usual = PARTICLES[bisect((FEW_CAMERAS + 1, MANY_CAMERAS), len(self.cameras))]
        return self.settings.particles or (2 * usual if self.sees_quarters_alike else usual)

    @property
    def sees_quarters_alike(self) -> bool:
        """Whether silhouettes hardly tell a body from one turned by a quarter or a half: those of two cameras."""
        return len(self.cameras) == 2

    @cached_property
    def arm_colours(self) -> float:
        """Weight (m^2) of what has the arms' colours and no arm covers."""
        chosen, few = self.settings.arm_colours, len(self.cameras) <= FEW_CAMERAS
        return chosen if chosen is not None else ARM_COLOURS if few else 0.0

    @cached_property
    def views(self) -> BodyInViews:
        """The body in the cameras' pictures."""
        return BodyInViews(self.body, self.cameras)

    @cached_property
    def arms_in_views(self) -> ArmsInViews:
        """Finds the arms by their colours."""
        return ArmsInViews(self.body, self.cameras)

    @cached_property
    def refiner(self) -> Refiner:
        """Costs and refinement of this body's poses."""
        return Refiner(self.body, self.settings.surface)

    @cached_property
    def posture_prior(self) -> PosturePrior:
        """Prior on postures, from the library if there is one."""
        return PosturePrior.of(self.body.skeleton, self.library)

    @cached_property
    def proposals(self) -> Proposals:
        """Draws the poses of step 3."""
        return Proposals(self.body.skeleton, self.settings, self.prior)

    @cached_property
    def local_search(self) -> LocalSearch:
        """Varies the best pose of step 5."""
        return LocalSearch(self.body.skeleton, self.proposals.sigma, self.settings.local)

    @cached_property
    def resample(self) -> Scheme:
        """The resampling scheme of step 2."""
        scheme = SCHEMES[self.settings.resampling] if self.scheme is None else self.scheme
        return with_best(scheme) if self.settings.select_best else scheme
