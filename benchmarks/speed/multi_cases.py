"""Cases that are timed with several cameras: a person in a ring of cameras, the silhouettes, and surface points from these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import cycle

import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.prior.motion_prior import MotionPrior
from shadowpuppet.motion.prior.training import RATE, train_prior
from shadowpuppet.synthetic import Ring
from shadowpuppet.tracking.multiview.refinement.correspondence import Cloud, make_cloud
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner
from shadowpuppet.tracking.multiview.settings import ForceSettings, MultiviewSettings
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker

HEIGHT = 1.75
"""Stature, metres."""
SIZE = (640, 480)
"""Pictures of HumanEva, pixels."""
SPREAD = 0.05
"""Standard deviation of the timed poses around the person's, rad and m."""
STRIDE = ({"left_shoulder_y": -0.5, "right_shoulder_y": 0.5, "left_hip_y": 0.4, "right_hip_y": -0.4, "left_knee_flexion": 0.3},
          {"left_shoulder_y": 0.5, "right_shoulder_y": -0.5, "left_hip_y": -0.4, "right_hip_y": 0.4, "right_knee_flexion": 0.3})
"""Both ends of the motion that is followed."""


@dataclass(frozen=True, eq=False)
class MultiCase:
    """A person of 1.75 m in a ring of cameras 4.5 m away."""

    cameras: int = 7
    points: int = 2000
    """Surface points."""
    particles: int = 40
    size: tuple[int, int] = SIZE

    @cached_property
    def body(self) -> Body:
        """The person's body."""
        return make_body("anatomical", average_sizes("anatomical", HEIGHT))

    @cached_property
    def views(self) -> list[Camera]:
        """The cameras."""
        ring = Ring(count=self.cameras, radius=4.5, jitter=0.5, size=self.size, distortion=(-0.09, 0.05, 0.0, 0.0))
        return [view.camera() for view in ring.views(HEIGHT)]

    def pose(self, share: float) -> Array:
        """A pose (D,) between the ends of the motion: 0 to 1."""
        skeleton = self.body.skeleton
        start, end = (skeleton.pose(root_z=0.94 * HEIGHT / 1.75, **way) for way in STRIDE)
        return (1 - share) * start + share * end

    def masks(self, pose: Array) -> list[Mask]:
        """Silhouettes of a pose in all cameras."""
        return [Picture(self.body, camera, camera.T_camera_world).mask(pose) for camera in self.views]

    @cached_property
    def hull(self) -> VisualHull:
        """The visual hull of these cameras, with the default settings."""
        return VisualHull(self.views)

    @cached_property
    def silhouettes(self) -> list[Mask]:
        """Silhouettes of the person's pose."""
        return self.masks(self.pose(0.3))

    @cached_property
    def surface(self) -> SurfacePoints:
        """`points` of the hull's points, evenly sampled; if there are fewer, some are taken more than once."""
        found = self.hull.points(self.silhouettes)
        chosen = np.linspace(0, len(found.points), self.points, endpoint=False).astype(int)
        return SurfacePoints(found.points[chosen], found.normals[chosen], found.weights[chosen], found.cameras[chosen])

    @cached_property
    def cloud(self) -> Cloud:
        """The surface points as the kernels take them."""
        return make_cloud(self.surface.points, self.surface.normals, self.surface.weights)

    @cached_property
    def poses(self) -> Array:
        """The poses that are timed (N, D)."""
        rng = np.random.default_rng(0)
        pose = self.pose(0.3)
        return self.body.skeleton.clamp(pose + SPREAD * rng.standard_normal((self.particles, len(pose))))

    @cached_property
    def refiner(self) -> Refiner:
        """The refinement kernels on this body."""
        return Refiner(self.body)

    def run_hull(self) -> SurfacePoints:
        """Silhouettes to surface points."""
        return self.hull.points(self.silhouettes)

    def run_forces(self, iterations: int) -> Array:
        """All poses after a number of iterations of simulated forces, balanced or not."""
        return self.refiner.forces(self.poses, self.cloud, ForceSettings(iterations=iterations, balance=0.0))

    def run_gauss_newton(self, iterations: int) -> Array:
        """All poses after some iterations of Gauss-Newton."""
        held = np.full(self.poses.shape[1], 1e-6)
        return self.refiner.gauss_newton(self.poses, ((self.cloud, iterations, self.refiner.settings.tau),), self.poses, held)

    def motion(self, count: int = 20) -> Array:
        """Poses (count, D) from one end of the motion to the other."""
        return np.array([self.pose(share) for share in np.linspace(0, 1, count)])

    def prior(self, body: str) -> MotionPrior:
        """A prior learnt from the motion, for a body by name."""
        poses = self.motion(100)
        joints = JointTable(np.arange(len(poses)) / RATE, self.body.landmark_names, self.body.points(poses))
        return train_prior(np.random.default_rng(0), {"the motion": joints}, body=body, rate=RATE).prior

    def frames(self, count: int = 20) -> Iterator[list[Mask]]:
        """Silhouettes of the motion, forward and backward without end; all are drawn before the first is returned."""
        there = [self.masks(pose) for pose in self.motion(count)]
        return cycle(there + there[::-1])


class MultiFollower:
    """A tracker with hull, proposals, refinement and weights, on precomputed masks of a motion that runs forward and backward without end;
    its prior is learnt from the same motion."""

    def __init__(self, case: MultiCase, settings: MultiviewSettings, count: int = 20) -> None:
        """Learn the prior, and search for the first pose."""
        self.rng, self.frames, self.hull = np.random.default_rng(0), case.frames(count), VisualHull(case.views, settings.hull)
        body = make_body(settings.body, average_sizes(settings.body, HEIGHT))
        self.tracker = MultiviewTracker(body, tuple(case.views), settings, case.prior(settings.body))
        first = next(self.frames)
        self.state = self.tracker.start(self.rng, self.hull.points(first), first)

    def run(self, frames: int = 5) -> None:
        """Track some more frames."""
        for _ in range(frames):
            masks = next(self.frames)
            self.state = self.tracker.step(self.rng, self.state, self.hull.points(masks), masks)
