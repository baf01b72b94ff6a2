"""What is timed with several cameras: a made person in a ring of them, their silhouettes, and surface points of these."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import cycle

import numpy as np

from shadowpuppet.anthropometry import whole_sizes_from_height
from shadowpuppet.body import Body
from shadowpuppet.camera import Camera
from shadowpuppet.closest import Cloud, make_cloud
from shadowpuppet.geometry import Array
from shadowpuppet.masks import Mask
from shadowpuppet.rasterize import Picture
from shadowpuppet.refinement import Refiner
from shadowpuppet.settings import ForceSettings
from shadowpuppet.synthetic import Ring
from shadowpuppet.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.whole_body import anatomical
from shadowpuppet.whole_sizes import AnatomicalSizes

HEIGHT = 1.75
"""Of the person, metres."""
SIZE = (640, 480)
"""HumanEva's pictures, pixels."""
SPREAD = 0.05
"""Deviation of the poses that are timed from the person's, rad and m."""
WAYS = ({"left_shoulder_y": -0.5, "right_shoulder_y": 0.5, "left_hip_y": 0.4, "right_hip_y": -0.4, "left_knee_flexion": 0.3},
        {"left_shoulder_y": 0.5, "right_shoulder_y": -0.5, "left_hip_y": -0.4, "right_hip_y": 0.4, "right_knee_flexion": 0.3})
"""The ends of the motion that is followed: a stride, about."""


@dataclass(frozen=True, eq=False)
class Around:
    """A person of 1.75 m in a ring of cameras 4.5 m away."""

    cameras: int = 7
    points: int = 2000
    """Surface points, about."""
    particles: int = 40
    size: tuple[int, int] = SIZE

    @cached_property
    def body(self) -> Body:
        """The person's."""
        return anatomical(whole_sizes_from_height(AnatomicalSizes, HEIGHT))

    @cached_property
    def views(self) -> list[Camera]:
        """The cameras."""
        ring = Ring(count=self.cameras, radius=4.5, jitter=0.5, size=self.size, distortion=(-0.09, 0.05, 0.0, 0.0))
        return [view.camera() for view in ring.views(HEIGHT)]

    def pose(self, share: float) -> Array:
        """A pose (D,) between the ends of the motion: 0 to 1."""
        skeleton = self.body.skeleton
        start, end = (skeleton.pose(root_z=0.94 * HEIGHT / 1.75, **way) for way in WAYS)
        return (1 - share) * start + share * end

    def masks(self, pose: Array) -> list[Mask]:
        """What the cameras see of it."""
        return [Picture(self.body, camera, camera.T_camera_world).mask(pose) for camera in self.views]

    @cached_property
    def hull(self) -> VisualHull:
        """Of these cameras, with the usual settings."""
        return VisualHull(self.views)

    @cached_property
    def seen(self) -> list[Mask]:
        """Silhouettes of the pose that is timed."""
        return self.masks(self.pose(0.3))

    @cached_property
    def surface(self) -> SurfacePoints:
        """As many of the hull's points as there are to be, evenly taken; points there are too few of are taken again."""
        found = self.hull.points(self.seen)
        chosen = np.linspace(0, len(found.points), self.points, endpoint=False).astype(int)
        return SurfacePoints(found.points[chosen], found.normals[chosen], found.weights[chosen], found.cameras[chosen])

    @cached_property
    def cloud(self) -> Cloud:
        """The same for the kernels."""
        return make_cloud(self.surface.points, self.surface.normals, self.surface.weights)

    @cached_property
    def poses(self) -> Array:
        """Those that are timed, of shape (N, D)."""
        rng = np.random.default_rng(0)
        pose = self.pose(0.3)
        return self.body.skeleton.clamp(pose + SPREAD * rng.standard_normal((self.particles, len(pose))))

    @cached_property
    def refiner(self) -> Refiner:
        """The kernels on this body."""
        return Refiner(self.body)

    def run_hull(self) -> SurfacePoints:
        """Silhouettes to points."""
        return self.hull.points(self.seen)

    def run_forces(self, iterations: int) -> Array:
        """All poses after so many iterations of simulated force."""
        return self.refiner.forces(self.poses, self.cloud, ForceSettings(iterations=iterations))

    def run_gauss_newton(self, iterations: int) -> Array:
        """All poses after so many of Gauss-Newton."""
        held = np.full(self.poses.shape[1], 1e-6)
        return self.refiner.gauss_newton(self.poses, ((self.cloud, iterations, self.refiner.settings.tau),), self.poses, held)

    def frames(self, count: int = 20) -> Iterator[list[Mask]]:
        """Silhouettes of the motion, to and fro without end; they are drawn before the first is given."""
        there = [self.masks(self.pose(share)) for share in np.linspace(0, 1, count)]
        return cycle(there + there[::-1])
