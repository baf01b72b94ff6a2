"""Particles of a frame. A run does not store them, so its filter runs again on that frame, from the pose of the frame before."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array, align
from shadowpuppet.motion.motion import Motion
from shadowpuppet.pipeline.options import Options
from shadowpuppet.tracking.monocular.tracker import MonocularTracker, State
from shadowpuppet.tracking.multiview.observation import MultiviewObservation
from shadowpuppet.tracking.multiview.surface.visual_hull import VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewState, MultiviewTracker
from shadowpuppet.tracking.particle_filter import diffuse, evaluate, gathered
from shadowpuppet.tracking.resampling import normalise
from shadowpuppet.viewer.scene.figures import bones_of
from shadowpuppet.viewer.scene.scene import ParticleCloud, SceneCamera

SEED = 0
"""Seed, so that the particles of a frame are the same every time."""


class ParticleRerun:
    """`rerun(time)`: particles of the frame nearest to a time (s); None if it has no silhouette, or it or the one before has no pose.

    The run's filter runs again with the same settings, from the run's pose a frame before; with several cameras by plain dynamics,
    without a motion prior.
    """

    def __init__(self, body: Body, motion: Motion, options: Options, cameras: Sequence[SceneCamera]) -> None:
        """`motion`: the run's, of this body. Raises `ShadowPuppetError` if no frame is known."""
        self.body, self.motion, self.options = body, motion, options
        self.cameras = [each for each in cameras if each.images is not None]
        self.names = [name for name in motion.joint_names if name in body.landmark_names]
        self.bones = bones_of(self.names)
        self.root = self._root()

    def __call__(self, time: float) -> ParticleCloud | None:
        """See the class."""
        n = int(np.abs(self.motion.times - time).argmin())
        before = self.motion.poses[max(n - 1, 0)]
        if not (np.isfinite(before).all() and np.isfinite(self.motion.poses[n]).all()):
            return None
        rng = np.random.default_rng(SEED + n)
        found = self._one(rng, float(self.motion.times[n]), before) if len(self.cameras) == 1 else self._several(
            rng, float(self.motion.times[n]), before)  # fmt: skip
        return None if found is None else self._cloud(*found)

    def _one(self, rng: np.random.Generator, time: float, before: Array) -> tuple[Array, Array] | None:
        """Poses (N, D) and weights (N,) of all stages, one camera."""
        mask = self.cameras[0].images.mask(time) if self.cameras[0].images else None
        if mask is None or not mask.any():
            return None
        tracker = self._tracker
        observation = tracker.observe(mask, before)
        start = []
        for stage in tracker.stages:
            values = stage.clamp(diffuse(rng, np.repeat(before[None, stage.dofs], stage.number, axis=0), stage.sigma))
            start.append(evaluate(values, stage.weigh(observation, before, before)))
        state = tracker.cycle(rng, State(before, tuple(start), np.nan, 0.0, "tracked"), mask)
        poses = [stage.put(state.pose, found.poses)
                 for stage, found in zip(tracker.stages, state.particles)]  # fmt: skip
        weights = [normalise(found.log_weights) for found in state.particles]
        return np.concatenate(poses), np.concatenate([weight / weight.max() for weight in weights])

    def _several(self, rng: np.random.Generator, time: float, before: Array) -> tuple[Array, Array] | None:
        tracker, masks = self._rig_tracker, [each.images.mask(time) if each.images else None for each in self.cameras]
        observation = MultiviewObservation(tracker.views, self._hull.points(masks), masks)
        if not tracker.is_present(observation):
            return None
        start = MultiviewState(before, np.zeros_like(before), gathered(before, tracker.number), np.nan, 1.0, "tracked")
        found = tracker.cycle(rng, start, observation).particles
        weights = normalise(found.log_weights)
        return found.poses, weights / weights.max()

    def _cloud(self, poses: Array, weights: Array) -> ParticleCloud:
        places = self.body.points(poses, self.root, self.names)
        lines = np.stack([places[:, [a for a, _ in self.bones]], places[:, [b for _, b in self.bones]]], 2)
        return ParticleCloud(lines, weights)

    @cached_property
    def _tracker(self) -> MonocularTracker:
        camera = self.cameras[0].camera
        floor = -float(self.root[2, 3]) if camera.oriented else None
        return MonocularTracker(Picture(self.body, camera, camera.T_camera_world @ self.root, floor), self.options.tracker)

    @cached_property
    def _rig_tracker(self) -> MultiviewTracker:
        return MultiviewTracker(self.body, tuple(each.camera for each in self.cameras), self.options.multiview)

    @cached_property
    def _hull(self) -> VisualHull:
        return VisualHull([each.camera for each in self.cameras], self.options.multiview.hull)

    def _root(self) -> Array:
        """Transform (4, 4) from the body's frame to the world."""
        known = self.motion.known
        if not known.any():
            raise ShadowPuppetError("found no frame with a pose, expected one at least")
        columns = [self.motion.joint_names.index(name) for name in self.names]
        ours = self.body.points(self.motion.poses[known], names=self.names)
        return align(ours.reshape(-1, 3), self.motion.joints[known][:, columns].reshape(-1, 3)).matrix
