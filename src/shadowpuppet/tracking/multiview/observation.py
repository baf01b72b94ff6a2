"""The observation of one frame by several cameras: surface points and silhouettes."""

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
    """A body to be drawn in the cameras' pictures, at half their size."""

    def __init__(self, body: Body, cameras: Sequence[Camera]) -> None:
        """`cameras`: calibrated, with known poses in the world."""
        self.body = body
        self.pictures = tuple(Picture(body, _half_size(camera), camera.T_camera_world) for camera in cameras)


class MultiviewObservation:
    """One frame: surface points, and the masks (H, W) that they were made from, one per camera, None for a camera without one."""

    def __init__(self, views: BodyInViews, surface: SurfacePoints, masks: Sequence[Mask | None], also: Cost | None = None) -> None:
        """Everything is computed on first use. `also`: a cost of your own (m^2), added to that of the surface."""
        self.views, self.surface, self.masks, self.also = views, surface, masks, also

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
        """Each picture in which a person is visible, and its mask at half size."""
        return tuple((picture, mask[::2, ::2]) for picture, mask in zip(self.views.pictures, self.masks, strict=True)
                     if mask is not None and may_be_person(mask))

    @cached_property
    def silhouettes(self) -> tuple[tuple[Picture, Observation], ...]:
        """The same pictures, with their masks as observations of the silhouette cost."""
        return tuple((picture, Observation.of(mask)) for picture, mask in self.people)

    @cached_property
    def space(self) -> FreeSpace:
        """Distances to the silhouettes' outlines, for the silhouette constraint."""
        return free_space([(picture.camera, mask) for picture, mask in self.people])

    @cached_property
    def area(self) -> int:
        """Pixels of all silhouettes together."""
        return sum(observation.area for _, observation in self.silhouettes)

    def mismatch(self, poses: Array) -> Array:
        """Pixels in which drawn poses (N, D) and silhouettes differ (Liu 2011, eq. 2), as shares (N,) of the silhouettes' area."""
        differing = [silhouette_costs(picture, observation, poses) for picture, observation in self.silhouettes]
        return sum(differing, np.zeros(len(poses))) / max(self.area, 1)

    def overlap(self, pose: Array) -> float:
        """Intersection over union of a drawn pose (D,) and the silhouettes, mean of all pictures; 0 without silhouettes."""
        overlaps = [observation.cost_and_overlap(picture.draw(pose))[1] for picture, observation in self.silhouettes]
        return float(np.mean(overlaps)) if overlaps else 0.0


def _half_size(camera: Camera) -> Camera:
    """The camera of pictures that keep every second pixel of every second row."""
    width, height = camera.size
    return replace(camera, size=((width + 1) // 2, (height + 1) // 2), matrix=np.diag([0.5, 0.5, 1.0]) @ camera.matrix)
