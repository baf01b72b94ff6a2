"""The trackers: what is searched, in which order, by which parts of `particle_filter`."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.camera import Camera
from shadowpuppet.errors import SettingsError, choices
from shadowpuppet.geometry import Array, rigid
from shadowpuppet.likelihood import Observation, Stage
from shadowpuppet.particle_filter import Particles, diffuse, evaluate, step
from shadowpuppet.rasterize import Picture, draw_polygon, pack, unpack
from shadowpuppet.resampling import Scheme, make_scheme, normalise
from shadowpuppet.settings import MonocularSettings, PartSettings

PARTS = {"torso": "torso_", "left_arm": "left_", "right_arm": "right_"}
"""Parts that a stage can name, and how their DOF's names begin."""


REST = {
    "torso_y": (0.0, 10.0, 10.0), "torso_twist": (0.0, 0.4, 0.4), "torso_bow": (0.0, 0.1, 0.3), "torso_bend": (0.0, 0.3, 0.3),
    "abduction": (0.8, 2.0, 2.0), "forward": (0.2, 0.2, 0.7), "roll": (0.0, 1.0, 1.0), "flexion": (0.0, 1.2, 1.2),
}


class State(NamedTuple):
    """What a tracker knows between two frames."""

    pose: Array
    """The estimate, of shape (D,)."""
    particles: tuple[Particles, ...]
    """One set a stage."""


@dataclass(frozen=True, eq=False)
class MonocularTracker:
    """Liu 2011: the posture of an upper body in one camera's silhouettes, by a hierarchical particle filter (Algorithm 2)."""

    picture: Picture
    settings: MonocularSettings = field(default_factory=MonocularSettings)

    def step(self, rng: np.random.Generator, state: State, mask: ArrayLike) -> State:
        """One frame: `cycles` times, stage by stage, resample and diffuse the particles, and weigh them in the new mask (H, W)."""
        settings, particles = self.settings, list(state.particles)
        pose = before = state.pose
        observation = self.observe(mask, pose)
        for cycle in range(settings.cycles):
            for i, stage in enumerate(self.stages):
                weigh = stage.weigh(observation, before, state.pose)
                known = evaluate(particles[i].poses, weigh) if settings.rank_by == "new" else particles[i]
                particles[i] = step(rng, known, resample=stage.resample, propose=stage.propose(cycle, pose), weigh=weigh, number=stage.number)
                pose = stage.put(pose, stage.estimate(particles[i]))
                if stage.moves_torso:  # the arms see each other as they were before both their stages
                    before = pose
            before = pose
        return State(pose, tuple(particles))

    def observe(self, mask: ArrayLike, pose: Array) -> Observation:
        """A mask (H, W), less the legs as they stand under `pose`."""
        mask = np.asarray(mask, bool)
        return Observation.of(mask, pack(mask & self.picture.legs(pose)) if self.settings.ignore_legs else None)

    def start(self, rng: np.random.Generator, mask: ArrayLike, cycles: int = 12) -> State:
        """The first frame's state, from no pose at all: coarse poses are tried, and the best ones become the first particles (eq. 5)."""
        skeleton = self.picture.body.skeleton
        pose = np.zeros(len(skeleton.dofs))
        particles: list[Particles] = []
        search = [_Stage(self, part, 1) for part in PARTS]
        torso = Stage(self.picture, search[0].dofs, hidden=[p for p in self.picture.body.quad_parts if "arm" in p])
        candidates = np.zeros((81, len(skeleton.dofs)))
        candidates[:, skeleton.dof_indices(["torso_y"])[0]] = np.linspace(-1.2, 1.2, 81)
        observation = self.observe(mask, pose)
        pose = candidates[np.argmin(torso.costs(observation, pose)(candidates))]
        observation = self.observe(mask, pose)
        library = coarse_arms()
        best: dict[str, Array] = {"torso": np.zeros(4)}
        for part in ("left_arm", "right_arm", "left_arm"):
            stage = search[list(PARTS).index(part)]
            other = "left" if part.startswith("right") else "right"
            hidden = [] if other + "_arm" in best else [f"{other}_upper_arm", f"{other}_forearm"]
            poses = np.repeat(pose[None], len(library), axis=0)
            poses[:, stage.dofs] = library
            costs = Stage(self.picture, stage.dofs, hidden).costs(observation, pose)(poses)
            best[part] = library[np.argsort(costs, kind="stable")]
            pose = stage.put(pose, best[part][0])
        for stage in self.stages:
            values = np.repeat(pose[None, stage.dofs], stage.number, axis=0)
            for part in stage.parts:
                if part != "torso":
                    columns = np.isin(stage.dofs, search[list(PARTS).index(part)].dofs)
                    values[:, columns] = best[part][np.arange(stage.number) % 40]
            values = stage.clamp(diffuse(rng, values, stage.sigma))
            particles.append(evaluate(values, stage.weigh(observation, pose, pose)))
        state = State(pose, tuple(particles))
        for _ in range(cycles):
            state = self.step(rng, state, mask)
        return state

    @cached_property
    def stages(self) -> tuple[_Stage, ...]:
        """The filter's stages, in order."""
        return tuple(_Stage(self, name, i) for i, name in enumerate(self.settings.stages))


def coarse_arms() -> Array:
    """Arm poses (K, 4) to start a search from: abduction, forward, roll, flexion."""
    degrees = [(a, f, r, e)
               for a in (0, 20, 45, 70, 90, 110, 135, 165) for f in (0, 40, 80)
               for r, e in [(0, 5), *((r, e) for r in (-80, -40, 0, 45, 90) for e in (45, 90, 130))]]
    return np.radians(np.array(degrees, float))


class _Stage(Stage):
    """A stage of the filter: some parts' DOF, how they are drawn and how they are weighed."""

    def __init__(self, tracker: MonocularTracker, name: str, index: int) -> None:
        skeleton, settings = tracker.picture.body.skeleton, tracker.settings
        self.parts = tuple(part.strip() for part in name.split("+"))
        unknown = [part for part in self.parts if part not in PARTS]
        if unknown:
            raise SettingsError(f"stages: unknown part {unknown[0]!r} in {name!r}; there are: {choices(PARTS)}")
        owner = {dof: part for part in self.parts for dof in skeleton.dof_names if dof.startswith(PARTS[part])}
        names = [dof for dof in skeleton.dof_names if dof in owner]
        self.moves_torso = "torso" in self.parts
        arms = [p for p in tracker.picture.body.quad_parts if "arm" in p]
        super().__init__(tracker.picture, skeleton.dof_indices(names),
                         arms if self.parts == ("torso",) and settings.torso_arms == "hidden" else ())
        part_settings = [settings.torso if part == "torso" else settings.arm for part in self.parts]
        self.settings = settings
        self.miss = settings.miss
        self.number = sum(p.particles for p in part_settings)
        self.resample: Scheme = make_scheme(settings.resampling, part_settings[0].survival)
        width, height = tracker.picture.camera.size
        self.sigma_cost = part_settings[0].sigma_cost * width * height / (320 * 240)
        self.sigma = np.array([self._noise(skeleton.dofs[d].kind, settings.torso if owner[skeleton.dofs[d].name] == "torso" else settings.arm)
                               for d in self.dofs])
        self.low, self.high = (limit[self.dofs] for limit in skeleton.limits)
        rest = [next(v for k, v in REST.items() if skeleton.dofs[d].name.endswith(k)) for d in self.dofs]
        self.rest, self.below, self.above = np.array(rest).T
        self.spread = self.above
        self.shoulders = [skeleton.joint_index(f"{side}_shoulder") for side in ("left", "right") if f"{side}_arm" in self.parts]

    @staticmethod
    def _noise(kind: str, part: PartSettings) -> float:
        return part.sigma_rotation if kind == "rotation" else part.sigma_translation

    def clamp(self, values: Array) -> Array:
        return np.clip(values, self.low, self.high) if self.settings.limits else values

    def put(self, pose: Array, values: Array) -> Array:
        """The pose (D,) with this stage's DOF set."""
        pose = pose.copy()
        pose[self.dofs] = values
        return pose

    def propose(self, cycle: int, pose):
        sigma = self.sigma * self.settings.cooling**cycle
        if len(self.parts) > 1:
            def propose(rng, values):
                values = values.copy()
                values[0] = pose[self.dofs]
                moved = diffuse(rng, values, sigma * self.settings.flat_noise)
                keep = rng.random(values.shape) > 0.3
                return self.clamp(np.where(keep, values, moved))
            return propose
        if self.parts == ("torso",) and not cycle and self.settings.explore:
            def propose(rng, values):
                drawn = np.repeat(values[:1], self.settings.explore, 0)
                drawn[:, 0] += rng.standard_normal(len(drawn)) * 0.1
                drawn[:, 1:] = self.rest[1:] + rng.standard_normal((len(drawn), 3)) * self.spread[1:]
                return self.clamp(np.concatenate([diffuse(rng, values, sigma), drawn]))
            return propose
        if cycle or not self.settings.explore or len(self.parts) > 1 or self.moves_torso:
            return lambda rng, values: self.clamp(diffuse(rng, values, sigma))
        library = coarse_arms()

        def propose(rng, values):
            drawn = library[rng.integers(len(library), size=self.settings.explore)]
            drawn = drawn + rng.standard_normal(drawn.shape) * 0.2
            return self.clamp(np.concatenate([diffuse(rng, values, sigma), drawn]))

        return propose

    def weigh(self, observation: Observation, around: Array, last: Array):
        """Costs (N,) and log weights (eq. 6) of this stage's values (N, d), all other DOF as in `around`."""
        cost = self.costs(observation, around)
        depth = self._depths(self.transforms(last[None], last)) if self.settings.depth_weight else None
        where = self._places(self.transforms(last[None], last)) if self.settings.motion_weight else None

        def weigh(values: Array) -> tuple[Array, Array]:
            poses = np.repeat(around[None], len(values), axis=0)
            poses[:, self.dofs] = values
            costs = cost(poses)
            if depth is not None:
                off = self._depths(self.transforms(poses, around)) - self.settings.depth_keep * depth
                costs = costs + self.settings.depth_weight * (off**2).sum(1)
            if where is not None:
                off = self._places(self.transforms(poses, around)) - where
                costs = costs + self.settings.motion_weight * (off**2).sum((1, 2))
                if self.settings.jump:
                    costs = costs + self.settings.jump * (np.maximum(np.sqrt((off**2).sum(2)) - self.settings.reach, 0) ** 2).sum(1)
            if self.settings.posture_weight:
                off = values - self.rest
                costs = costs + self.settings.posture_weight * ((off / np.where(off < 0, self.below, self.above)) ** 2).sum(1)
            return costs, -(costs**2) / (2 * self.sigma_cost**2)

        return weigh

    def _places(self, transforms):
        out = []
        if self.moves_torso:
            shoulders = [self.picture.body.skeleton.joint_index(f"{side}_shoulder") for side in ("left", "right")]
            out += [transforms[:, s, :, 3] for s in shoulders]
        for s in self.shoulders:
            reach = np.array([0, 0, self.picture.body.landmarks["left_hand"][1][2]])
            out += [transforms[:, s + 1, :, 3], transforms[:, s + 1, :, 3] + transforms[:, s + 1, :, :3] @ reach]
        return np.stack(out, 1)

    def _depths(self, transforms: Array) -> Array:
        """Depth of elbows and hands behind their shoulders (N, 2 an arm), metres."""
        out = []
        for s in self.shoulders:
            reach = np.array([0, 0, self.picture.body.landmarks["left_hand"][1][2]])
            shoulder, elbow = transforms[:, s, 2, 3], transforms[:, s + 1, 2, 3]
            out += [elbow - shoulder, elbow + transforms[:, s + 1, 2, :3] @ reach - shoulder]
        return np.stack(out, 1) if out else np.zeros((len(transforms), 0))

    def estimate(self, particles: Particles) -> Array:
        if self.settings.estimate == "best":
            return particles.best
        weights = normalise(-(particles.costs - particles.costs.min()) / self.settings.temperature)
        return weights @ particles.poses
