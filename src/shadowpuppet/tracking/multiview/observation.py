"""The observation of one frame by several cameras: surface points and silhouettes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, grown, may_be_person
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.refinement.correspondence import Cloud, make_cloud
from shadowpuppet.tracking.multiview.refinement.free_space import FreeSpace, free_space, reach, spheres_in
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints
from shadowpuppet.tracking.silhouette_cost import Cost, Observation, silhouette_costs

MARGIN = 0.01
"""Distance (m) by which a limb is outside a silhouette, beyond its pixels' errors."""


class BodyInViews:
    """A body to be drawn in the cameras' pictures, at half their size."""

    def __init__(self, body: Body, cameras: Sequence[Camera]) -> None:
        """`cameras`: calibrated, with known poses in the world."""
        assert body.limbs is not None
        self.body, self.limbs = body, body.limbs
        self.pictures = tuple(Picture(body, _half_size(camera), camera.T_camera_world) for camera in cameras)


class MultiviewObservation:
    """One frame: surface points, and the masks (H, W) that they were made from, one per camera, None for a camera without one."""

    def __init__(self, views: BodyInViews, surface: SurfacePoints, masks: Sequence[Mask | None], also: Cost | None = None,
                 left_out: Sequence[Mask | None] = ()) -> None:
        """Everything is computed on first use. `also`: a cost of your own (m^2), added to that of the surface. `left_out`: pixels of the
        views' pictures that are no evidence, one mask per camera or none; surface points there are left out."""
        self.views, self.masks, self.also = views, masks, also
        self.left_out = tuple(left_out) or (None,) * len(masks)
        self.surface = _without(surface, views, self.left_out)

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
    def seen(self) -> tuple[int, ...]:
        """Indices of the cameras that see a person."""
        return tuple(n for n, mask in enumerate(self.masks) if mask is not None and may_be_person(mask))

    @cached_property
    def people(self) -> tuple[tuple[Picture, Mask], ...]:
        """Each picture in which a person is visible, and its mask at half size."""
        return tuple((self.views.pictures[n], half_size(self.masks[n])) for n in self.seen)

    @cached_property
    def silhouettes(self) -> tuple[tuple[Picture, Observation], ...]:
        """The same pictures, with their masks as observations of the silhouette cost."""
        return tuple((picture, Observation.of(mask, self.left_out[n])) for n, (picture, mask) in zip(self.seen, self.people))

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

    def outside(self, pose: Array) -> float:
        """Share of the spheres along the limbs of a pose (D,) that reach out of two silhouettes or more; of one alone a limb may be hidden
        by furniture."""
        if len(self.people) < 2:
            return 0.0
        spheres, T = spheres_in(self.views.limbs), self.views.body.skeleton.forward(pose[None])[0]
        return float((np.sort(reach(T, spheres, self.space), axis=0)[-2] > MARGIN).mean())

    def overlaps(self, pose: Array) -> Array:
        """Intersection over union of a drawn pose (D,) and the silhouette of each camera, (C,); NaN where no person is visible."""
        found = np.full(len(self.masks), np.nan)
        for n, (picture, observation) in zip(self.seen, self.silhouettes):
            found[n] = observation.cost_and_overlap(picture.draw(pose))[1]
        return found

    def overlap(self, pose: Array) -> float:
        """Intersection over union of a drawn pose (D,) and the silhouettes, mean of all pictures; 0 without silhouettes."""
        overlaps = self.overlaps(pose)[list(self.seen)]
        return float(np.mean(overlaps)) if len(overlaps) else 0.0


def half_size(mask: Mask | None) -> Mask:
    """Every second pixel of every second row of a mask (H, W)."""
    assert mask is not None
    return np.ascontiguousarray(mask[::2, ::2])


def _without(surface: SurfacePoints, views: BodyInViews, left_out: Sequence[Mask | None]) -> SurfacePoints:
    """The surface points but those on contours of pixels (H, W) that are left out."""
    kept = np.ones(len(surface.points), bool)
    for n, (picture, mask) in enumerate(zip(views.pictures, left_out)):
        own = np.flatnonzero(surface.cameras == n)
        if mask is not None and len(own):
            pixels = np.rint(np.nan_to_num(picture.camera.project(surface.points[own])).clip(-1, 1e6)).astype(int)
            x, y = pixels.clip(0, np.array(mask.shape[::-1]) - 1).T  # points lie on contours, at most a pixel outside
            kept[own] = ~grown(mask, 1)[y, x]
    points, normals, weights, cameras = surface
    return surface if kept.all() else SurfacePoints(points[kept], normals[kept], weights[kept], cameras[kept])


def _half_size(camera: Camera) -> Camera:
    """The camera of pictures that keep every second pixel of every second row."""
    width, height = camera.size
    return replace(camera, size=((width + 1) // 2, (height + 1) // 2), matrix=np.diag([0.5, 0.5, 1.0]) @ camera.matrix)
