"""What several cameras say about a pose at one time: surface points to lie on, and silhouettes to be drawn over."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.refinement.correspondence import Cloud, make_cloud
from shadowpuppet.tracking.multiview.refinement.free_space import FreeSpace, free_space
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.silhouette_cost import Cost, Observation, silhouette_costs


class BodyInViews:
    """A body among cameras: what is needed to draw it in their pictures, at half their size."""

    def __init__(self, body: Body, cameras: Sequence[Camera]) -> None:
        """`cameras`: calibrated, with their places in the world."""
        self.body = body
        self.pictures = tuple(Picture(body, _half_size(camera), camera.T_camera_world) for camera in cameras)


class MultiviewObservation:
    """One frame: surface points, and the masks (H, W) that they were made from, None for a camera without any."""

    def __init__(self, stage: BodyInViews, surface: SurfacePoints, masks: Sequence[Mask | None], also: Cost | None = None) -> None:
        """Nothing is computed until it is asked for. `also`: a cost of your own (m^2), which is added to that of the surface."""
        self.views, self.surface, self.masks, self.also = stage, surface, masks, also

    def cloud(self, share: int = 1) -> Cloud:
        """Every `share`-th of the surface points."""
        s = self.surface
        return make_cloud(s.points[::share], s.normals[::share], s.weights[::share], self._origin)

    @cached_property
    def full(self) -> Cloud:
        """All of the surface points."""
        return self.cloud()

    @cached_property
    def _origin(self) -> Array:
        return self.surface.points.mean(0) if len(self.surface.points) else np.zeros(3)

    @cached_property
    def people(self) -> tuple[tuple[Picture, Mask], ...]:
        """The silhouettes of people, thinned, and the pictures to be drawn in their place."""
        return tuple((picture, mask[::2, ::2]) for picture, mask in zip(self.views.pictures, self.masks, strict=True)
                     if mask is not None and may_be_person(mask))

    @cached_property
    def seen(self) -> tuple[tuple[Picture, Observation], ...]:
        """The same for drawing over them."""
        return tuple((picture, Observation.of(mask)) for picture, mask in self.people)

    @cached_property
    def space(self) -> FreeSpace:
        """What the silhouettes rule out."""
        return free_space([(picture.camera, mask) for picture, mask in self.people])

    @cached_property
    def area(self) -> int:
        """Pixels of all silhouettes."""
        return sum(observation.area for _, observation in self.seen)

    def differing(self, poses: Array) -> Array:
        """Pixels in which drawn bodies (N, D) and silhouettes differ, as a share of the silhouettes', of shape (N,) (Liu 2011, eq. 2)."""
        differing = [silhouette_costs(picture, observation, poses) for picture, observation in self.seen]
        return sum(differing, np.zeros(len(poses))) / max(self.area, 1)

    def overlap(self, pose: Array) -> float:
        """Intersection over union of a drawn pose (D,) and the silhouettes, the mean of all pictures; 0 where there are none."""
        overlaps = [observation.cost_and_overlap(picture.draw(pose))[1] for picture, observation in self.seen]
        return float(np.mean(overlaps)) if overlaps else 0.0


def _half_size(camera: Camera) -> Camera:
    """The camera of which the pictures are every second pixel of every second row."""
    width, height = camera.size
    return replace(camera, size=((width + 1) // 2, (height + 1) // 2), matrix=np.diag([0.5, 0.5, 1.0]) @ camera.matrix)
