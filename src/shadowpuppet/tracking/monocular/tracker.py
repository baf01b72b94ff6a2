"""The one-camera tracker of Liu 2011: Algorithm 2 over the stages of a hierarchical particle filter."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.segments import dofs_of, limbs_of
from shadowpuppet.body.upper_body import TWIST
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.camera.bits import count, pack
from shadowpuppet.camera.colour_codes import ColourCode
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask, check_mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.arm_colours import WELL, ArmColours, ColourCounts
from shadowpuppet.tracking.keypoints.front import CERTAIN
from shadowpuppet.tracking.monocular import pose_search
from shadowpuppet.tracking.monocular.extended_stage import HEADING, make_stage
from shadowpuppet.tracking.monocular.joints_seen import JointsSeen
from shadowpuppet.tracking.monocular.leg_postures import FLOOR_WEIGHT, floor_below, floor_cost, posture_penalty
from shadowpuppet.tracking.monocular.settings import MonocularSettings, pixel_scale
from shadowpuppet.tracking.monocular.stages import FilterStage
from shadowpuppet.tracking.monocular.standing_place import PLACE, soles_row, standing_place
from shadowpuppet.tracking.particle_filter import Particles, diffuse, evaluate, step
from shadowpuppet.tracking.recovery import settle, track_or_recover
from shadowpuppet.tracking.resampling import Scheme
from shadowpuppet.tracking.silhouette_cost import Cost, Observation
from shadowpuppet.tracking.status import ABSENT_AREA, agreement_of, status_of
from shadowpuppet.tracking.unexplained import Unexplained, look_beside, without

NARROW = 0.08
"""Share of the trunk outside the silhouette above which the person has turned: when they turn quickly it is 0.1 to 0.2, and otherwise, made
people bending, boxing and twisting, below 0.06."""
TRUNK = ("torso", "waist")
SEARCHED_AFTER, GROWN, BETTER = 8, 1.2, 0.95
"""Number of frames after which the pose of a whole body is searched for beside the tracked one, if its misfit has grown by that factor
since the last time: who sits down or squats changes trunk and legs together, which stages of one part each do not follow; a search takes
as long as ten frames. And the ratio of their misfits below which what is found replaces the tracked one: two searches differ by up to
5 %."""


class State(NamedTuple):
    """The tracker's state after a frame: all that the next frame needs."""

    pose: Array
    """The estimate, of shape (D,)."""
    particles: tuple[Particles, ...]
    """One set per stage, in the order of `stages`; its poses hold the stage's DOF only."""
    cost: float
    """Eq. 2 of the estimate, pixels."""
    overlap: float
    """Intersection over union of the drawn estimate and the silhouette, legs left out."""
    status: str
    """`tracked`, `uncertain`, `lost` or `absent`."""
    support: float = np.nan
    """Share of the keypoints that lie near the estimate; NaN without keypoints."""
    against: float = 0.0
    """Log odds of keypoints in the last frames against the way that a whole body faces."""
    unexplained: Unexplained | None = None
    """What the silhouettes have beside the body; None if nothing is left out."""
    mask: Mask | None = None
    """The frame's silhouette (H, W), if the next frame needs it."""
    followed: int = 0
    """Number of frames since the person was last searched for."""
    least: float = np.inf
    """Least misfit of a whole body since then, pixels."""
    colours: ColourCounts | None = None
    """Those of the person's arms and of the rest, as seen so far."""
    observation: Observation | None = None
    """The frame's, which the estimate was judged by."""

    @property
    def agreement(self) -> float:
        """The measure of a loss."""
        return agreement_of(self.overlap, self.support)


@dataclass(frozen=True, eq=False)
class MonocularTracker:
    """Liu 2011: tracks a body in one camera's silhouettes by a hierarchical particle filter (Algorithm 2). Causal: no pose uses a later
    frame. The same generator state and masks give the same poses."""

    picture: Picture
    settings: MonocularSettings = field(default_factory=MonocularSettings)
    scheme: Scheme | None = None
    """A resampling scheme of your own, in place of the settings'."""
    rate: float = 30.0
    """Frames/s."""
    looks: int = 0
    """Number of frames after which parts of the silhouettes that the body does not explain are left out; 0: never."""
    moves: bool = True
    """Whether a whole person's distance is estimated in every frame; else it is that of the floor where the silhouette ends, or the body's
    own."""
    blurred: bool = False
    """Whether the film is blurred by motion. A silhouette then has what a limb covers at any time of the exposure, which is too wide; what
    is covered since this frame only, and so for a part of the exposure, does not count, except in the status."""

    def step(self, rng: np.random.Generator, state: State, mask: Mask, also: Cost | None = None, codes: ColourCode | None = None,
             keypoints: Keypoints | None = None) -> State:
        """The state after a new mask (H, W). If no person is visible the pose is held; after a loss the person is searched for (`recover`).
        `also`: a cost of your own, poses (N, D) to pixels (N,), added to eq. 2; `codes`: the picture's colours (`colour_codes`), if the
        arms may be found by them; `keypoints`: what a detector found in the picture. Raises `TrackingError` for a mask of another size than
        the camera's."""
        mask = check_mask(mask, self.picture.camera.size)
        rest = without(mask, state.unexplained)
        found = track_or_recover(
            state, is_absent=self.is_absent(rest, state.pose), recover=self.settings.recover, hold=self.absent,
            cycle=lambda state: self.cycle(rng, state, mask, also, codes, keypoints),
            search=lambda: self.start(rng, rest, also, keypoints))  # fmt: skip
        found = self.searched_again(rng, found._replace(followed=state.followed + 1, least=state.least), rest, also, keypoints)
        found = self.faced(rng, state, found, rest, also, keypoints)
        if self.looks:
            found = found._replace(unexplained=self.unexplained(state.unexplained, mask, found))
        found = found._replace(colours=self.learnt(state.colours, codes, rest, found))
        return found._replace(mask=mask) if self.blurred else found

    def cycle(self, rng: np.random.Generator, state: State, mask: Mask, also: Cost | None = None, codes: ColourCode | None = None,
              keypoints: Keypoints | None = None) -> State:
        """The loop body of Algorithm 2 on a mask (H, W), `cycles` times: each stage resamples, diffuses and weighs (Algorithms 3, 4)."""
        last, particles = state.pose, list(state.particles)
        estimate, whole = last, self.observe(mask, last, also, state.unexplained)
        whole = replace(whole, keypoints=JointsSeen.of(self.picture, keypoints, last))
        observation = whole if state.mask is None else whole.ignoring(mask & ~state.mask)
        if codes is not None and self.settings.arm_colours:
            arms = self.arm_colours.seen(state.colours, codes, mask, last, observation.ignore)
            whole, observation = replace(whole, arms=arms), replace(observation, arms=arms)
        narrow = self.settings.turned and self.is_narrow(mask, last)
        seen, stands = without(mask, state.unexplained), None
        if self.free:
            stands = standing_place(self.picture, seen, self.floor, self.upright(last), farthest=True)
            observation = replace(observation, soles=soles_row(seen))
        for cycle in range(self.settings.cycles):
            others = estimate  # values of the DOF outside a stage; later stages see the torso's new estimate, but not a limb's
            for i, stage in enumerate(self.stages):
                weigh = stage.weigh(observation, others, last)
                select, propose = stage.selection(particles[i], weigh), stage.propose(cycle, narrow, stands)
                particles[i] = step(rng, particles[i], resample=select, propose=propose, weigh=weigh, number=stage.number)
                estimate = stage.put(estimate, stage.estimate(particles[i]))
                others = estimate if stage.moves_torso else others
        return self.judge(estimate, particles, whole)

    def searched_again(self, rng: np.random.Generator, state: State, mask: Mask, also: Cost | None = None,
                       keypoints: Keypoints | None = None) -> State:
        """A whole body's state, or with `turned`, where its misfit has grown, a better one searched for in the mask (H, W)."""
        legs = any(limb.endswith("leg") for limb in limbs_of(self.picture.body.skeleton))
        if not legs or not self.settings.turned or state.status == "absent":
            return state
        misfit = self.misfit(state)
        if state.followed < SEARCHED_AFTER or misfit < GROWN * state.least:
            return state._replace(least=min(state.least, misfit))
        found = self.start(rng, mask, also, keypoints)
        better = found.status != "absent" and self.misfit(found) < BETTER * misfit
        return found if better else state._replace(followed=0, least=misfit)

    def faced(self, rng: np.random.Generator, state: State, found: State, mask: Mask, also: Cost | None = None,
              keypoints: Keypoints | None = None) -> State:
        """The state `found` in a mask (H, W), or one of the other way, once keypoints of half a second are certain that a whole body faces
        it. `state`: the frame before."""
        against = max(state.against + self.against(found) * 2 / self.rate, 0.0)
        if against <= CERTAIN:
            return found._replace(against=against)
        return self.start(rng, mask, also, keypoints, self.turned(found.pose))

    def against(self, state: State) -> float:
        """Log odds of the keypoints of a state's frame against the way that a whole body faces."""
        seen = None if state.observation is None or HEADING not in self.picture.body.skeleton.dof_names else state.observation.keypoints
        return 0.0 if seen is None or state.status in ("absent", "lost") else seen.against(state.pose)

    def turned(self, pose: Array) -> Array:
        """The upright whole body at the place of a pose (D,), facing the other way."""
        skeleton = self.picture.body.skeleton
        moved = np.isin(skeleton.dof_names, (*GLOBAL_DOFS[:3], HEADING))
        return np.where(moved, pose, 0.0) + np.pi * (np.array(skeleton.dof_names) == HEADING)

    @property
    def free(self) -> bool:
        """Whether each frame's distance is estimated: a whole body's, unless a preset of the paper or `moves` says that it stays."""
        return self.moves and self.settings.turned and PLACE[0] in self.picture.body.skeleton.dof_names

    def upright(self, pose: Array) -> Array:
        """The whole body's upright pose (D,) with the heading of a pose (D,)."""
        turn = self.picture.body.skeleton.dof_names.index(HEADING)
        return np.where(np.arange(len(pose)) == turn, pose, 0.0)

    def misfit(self, state: State) -> float:
        """Cost of a state's estimate with that of its posture and of feet below the floor, pixels."""
        pose, scale, floor = state.pose[None], pixel_scale(self.picture.camera.size), self.floor
        total = state.cost + scale * self.settings.posture_weight * float(posture_penalty(self.picture.body.skeleton, pose)[0])
        return total if floor is None else total + float(floor_cost(self.picture, floor, FLOOR_WEIGHT * scale)(pose)[0])

    def start(self, rng: np.random.Generator, mask: Mask, also: Cost | None = None, keypoints: Keypoints | None = None,
              about: Array | None = None) -> State:
        """A state from one mask (H, W): particles around the best coarse poses (eq. 5), then cycles on this mask; `absent` if no
        person is visible. `about` (D,): where a body is searched for; else the way that it faces is that of the keypoints. Others and
        errors: as in `step`."""
        mask = check_mask(mask, self.picture.camera.size)
        found = self.search(mask) if about is None else pose_search.search_pose(self.picture, mask, about)
        observation, particles = self.observe(mask, found.pose, also), []
        observation = replace(observation, keypoints=JointsSeen.of(self.picture, keypoints, found.pose, mask))
        for stage in self.stages:
            poses = np.repeat(found.pose[None], stage.number, axis=0)
            for limb, tried in found.limbs.items():
                if limb in stage.parts:
                    poses[:, dofs_of(self.picture.body.skeleton, limb)] = tried[np.arange(stage.number) % pose_search.BEST_LIMBS]
            values = stage.clamp(diffuse(rng, poses[:, stage.dofs], stage.sigma))
            particles.append(evaluate(values, stage.weigh(observation, found.pose, found.pose)))
        state = self.judge(found.pose, particles, observation)
        if self.is_absent(mask, found.pose):
            return self.absent(state)
        state = settle(state, lambda state: self.cycle(rng, state, mask, also, keypoints=keypoints))
        if about is not None or self.against(state) <= 0:
            return state
        return min(state, self.start(rng, mask, also, keypoints, self.turned(state.pose)), key=self.against)

    def search(self, mask: Mask) -> pose_search.CoarsePose:
        """The best coarse pose in a mask (H, W); with `turned` of all directions and heights if the upright person fits badly."""
        if not self.settings.turned:
            return pose_search.search_pose(self.picture, mask)
        return pose_search.search_turned(self.picture, mask, self.floor, moves=self.moves or self.floor is not None)

    def observe(self, mask: Mask, pose: Array, also: Cost | None = None, unexplained: Unexplained | None = None) -> Observation:
        """The observation of a mask (H, W) without what is left out beside `pose` (D,); with `ignore_legs` without the region where the
        legs of that pose may be."""
        left_out = None if unexplained is None else unexplained.beside(self.picture.mask(pose))
        if self.settings.ignore_legs:
            return Observation.without_legs(mask, self.picture, pose, also, left_out)
        return Observation.of(mask, left_out, also)

    def unexplained(self, last: Unexplained | None, mask: Mask, state: State) -> Unexplained | None:
        """What a mask (H, W) has beside the body of a new state; `last`: the same of the frame before."""
        if state.status == "absent":
            return look_beside(last, mask, np.zeros_like(mask), self.looks)
        legs = self.picture.legs(state.pose) if self.settings.ignore_legs and self.picture.body.hem is not None else None
        return look_beside(last, mask, self.picture.mask(state.pose), self.looks, legs)

    def learnt(self, colours: ColourCounts | None, codes: ColourCode | None, mask: Mask, state: State) -> ColourCounts | None:
        """The colours seen so far, with those in a new state's frame, of its mask (H, W), if the estimate fits well."""
        fits = state.status != "absent" and state.overlap > WELL
        if codes is None or not self.settings.arm_colours or not fits:
            return colours
        return self.arm_colours.learnt(colours, codes, mask, state.pose)

    def judge(self, pose: Array, particles: list[Particles], observation: Observation) -> State:
        """The state of an estimate (D,), with its cost, overlap, support and status."""
        cost, overlap = observation.cost_and_overlap(self.picture.draw(pose))
        support = np.nan if observation.keypoints is None else observation.keypoints.support(pose)
        return State(pose, tuple(particles), cost, overlap, status_of(overlap, support), support, observation=observation)

    def is_absent(self, mask: Mask, pose: Array) -> bool:
        """Whether a mask (H, W) is too small to be the person last seen in `pose` (D,)."""
        return int(np.count_nonzero(mask)) < max(ABSENT_AREA * count(self.picture.draw(pose)), 1)

    def is_narrow(self, mask: Mask, pose: Array) -> bool:
        """Whether the trunk in a pose (D,) sticks out of a mask (H, W), as it does when the person turns quickly."""
        if not len(self._trunk):
            return False
        trunk = self.picture.draw(pose, self._trunk)
        return count(trunk & ~pack(mask)) > NARROW * count(trunk)

    @cached_property
    def _trunk(self) -> NDArray[np.int64]:
        """Indices of the trunk's shapes; none of a body whose trunk does not twist."""
        if TWIST not in self.picture.body.skeleton.dof_names:
            return np.zeros(0, np.int64)
        return np.flatnonzero([part in TRUNK for part in self.picture.body.parts])

    @staticmethod
    def absent(state: State) -> State:
        """The state while no person is visible: the pose is held."""
        return state._replace(cost=np.nan, overlap=0.0, status="absent")

    @cached_property
    def arm_colours(self) -> ArmColours:
        """Finds the arms by their colours."""
        return ArmColours(self.picture)

    @cached_property
    def floor(self) -> float | None:
        """Height of the floor that a whole body stands on, in its frame, metres; None if it is not known (`floor_below`)."""
        return floor_below(self.picture)

    @cached_property
    def stages(self) -> tuple[FilterStage, ...]:
        """The filter's stages, in order; a whole body's legs that are not among them are added at the end."""
        named, limbs = self.settings.stages, limbs_of(self.picture.body.skeleton)
        legs = [limb for limb in limbs if limb.endswith("leg") and not any(limb in name for name in named)]
        return tuple(make_stage(self.picture, self.settings, name, self.scheme, self.floor, self.free) for name in (*named, *legs))
