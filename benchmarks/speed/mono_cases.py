"""Cases that are timed with one camera: eq. 2 of poses around a person's, and a tracker on precomputed masks."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import cycle

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.anthropometry import sizes_from_height
from shadowpuppet.body.models import make_body
from shadowpuppet.camera.bits import unpack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.settings import make_settings
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.silhouette_cost import Observation, PartialCost

SIZE = (320, 240)
"""Pictures of Liu 2011, pixels."""
SPREAD = 0.1
"""Standard deviation of the timed poses around the person's, rad."""


def make_picture(body: str, size: tuple[int, int] = SIZE) -> Picture:
    """A person of 1.75 m, 2.5 m in front of a camera with a field of view of 60 degrees."""
    camera = Camera.from_fov(size, np.radians(60))
    return Picture(make_body(body, sizes_from_height(1.75)), camera, place(camera, 2.5, -0.1))


@dataclass(frozen=True, eq=False)
class MonoCase:
    """Costs of many poses: of the whole body, or of one arm over the rest."""

    body: str = "cardbox"
    stage: str = "full"
    """`full` or `arm`."""
    size: tuple[int, int] = SIZE
    particles: int = 200

    @cached_property
    def picture(self) -> Picture:
        """The body in the camera's picture."""
        return make_picture(self.body, self.size)

    @cached_property
    def dofs(self) -> NDArray[np.int64]:
        """DOF that vary: all, or the left arm's."""
        names = self.picture.body.skeleton.dof_names
        return np.flatnonzero([self.stage == "full" or name.startswith("left_") for name in names])

    @cached_property
    def pose(self) -> Array:
        """The person's pose (D,): arms out, one of them bent."""
        return self.picture.body.skeleton.pose(left_shoulder_abduction=1.2, left_elbow_flexion=1.0, right_shoulder_abduction=0.9)

    @cached_property
    def poses(self) -> Array:
        """The poses that are timed (N, D)."""
        poses = np.repeat(self.pose[None], self.particles, axis=0)
        poses[:, self.dofs] += SPREAD * np.random.default_rng(0).standard_normal((self.particles, len(self.dofs)))
        return poses

    @cached_property
    def mask(self) -> NDArray[np.bool_]:
        """The silhouette (H, W), of a pose near the person's."""
        return self.picture.mask(0.9 * self.pose)

    @cached_property
    def partial(self) -> PartialCost:
        """The moving and the still shapes."""
        return PartialCost(self.picture, self.dofs)

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """The still shapes, drawn once for all poses (H, W)."""
        return unpack(self.picture.draw(self.pose, self.partial.still), self.size[0])

    @cached_property
    def costs(self) -> Callable[[Array], Array]:
        """Eq. 2 of whole poses (N, D), pixels (N,): kinematics, projection, drawing, counting."""
        return self.partial.costs(Observation.of(self.mask), self.pose)

    def run(self) -> Array:
        """Costs of all poses (N,), as the filter computes them."""
        return self.costs(self.poses)


class MonoFollower:
    """A tracker on precomputed masks of a motion that runs forward and backward without end."""

    def __init__(self, preset: str, frames: int = 20) -> None:
        """`preset`: the tracker's settings; `frames`: of the motion from one end to the other."""
        settings = make_settings(preset)
        picture = make_picture(settings.body)
        ends = ({"left_shoulder_abduction": 0.8, "right_shoulder_abduction": 1.0},
                {"left_shoulder_abduction": 1.8, "right_shoulder_abduction": 0.5, "left_elbow_flexion": 1.2, "torso_bend": 0.2})
        start, end = (picture.body.skeleton.pose(**angles) for angles in ends)
        there = [picture.mask(pose) for pose in np.linspace(start, end, frames)]
        self.masks: Iterator[NDArray[np.bool_]] = cycle(there + there[::-1])
        self.tracker, self.rng = MonocularTracker(picture, settings), np.random.default_rng(0)
        self.state = self.tracker.start(self.rng, next(self.masks))

    def run(self, frames: int = 10) -> None:
        """Track some more frames."""
        for _ in range(frames):
            self.state = self.tracker.step(self.rng, self.state, next(self.masks))
