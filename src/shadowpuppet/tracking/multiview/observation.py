"""The observation of one frame by several cameras: surface points and silhouettes."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.camera.bits import Bits, is_set, pack
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, half_size, may_be_person
from shadowpuppet.camera.projection import make_lens, pixel_nearest
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.threads import shared_out
from shadowpuppet.tracking.keypoints.sights import NO_SIGHTS, Sights
from shadowpuppet.tracking.multiview.keypoint_evidence import KeypointEvidence
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
        self.pictures = tuple(Picture(body, camera.thinned(2), camera.T_camera_world) for camera in cameras)


class Halves(NamedTuple):
    """A frame's masks at half size, by camera; None for a camera without one."""

    masks: tuple[Mask | None, ...]
    """Every second pixel of every second row, (H / 2, W / 2)."""
    bits: tuple[Bits | None, ...]
    """The same as bits."""

    @classmethod
    def of(cls, masks: Sequence[Mask | None]) -> Halves:
        """Of masks (H, W)."""
        small = tuple(None if mask is None else half_size(mask) for mask in masks)
        return cls(small, tuple(None if mask is None else pack(mask) for mask in small))


class MultiviewObservation:
    """One frame: surface points, and the masks (H, W) that they were made from, one per camera, None for a camera without one."""

    def __init__(self, views: BodyInViews, surface: SurfacePoints, masks: Sequence[Mask | None], also: Cost | None = None,
                 left_out: Sequence[Bits | None] = (), halves: Halves | None = None) -> None:
        """Everything is computed on first use. `also`: a cost of your own (m^2), added to that of the surface. `left_out`: pixels of the
        views' pictures that are no evidence, bits for each camera or none; surface points there are left out. `halves`: the masks at half
        size, if known."""
        self.views, self.masks, self.also = views, masks, also
        self.left_out = tuple(left_out) or (None,) * len(masks)
        self._known_halves = halves
        self.keypoints: KeypointEvidence | None = None
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
        return middle_of(self.surface) if self.keypoints is None or len(self.surface.points) else self.keypoints.middle

    @property
    def rays(self) -> tuple[Sights, float]:
        """Rays to the person's landmarks, none without keypoints; and what a nat of their surprise costs, m^2."""
        return (NO_SIGHTS, 0.0) if self.keypoints is None else self.keypoints.rays(self.by_keypoints)

    @cached_property
    def seen(self) -> tuple[int, ...]:
        """Indices of the cameras that see a person."""
        return tuple(n for n, mask in enumerate(self.masks) if mask is not None and may_be_person(mask))

    @property
    def by_keypoints(self) -> bool:
        """Whether keypoints alone are evidence, as no camera has a silhouette."""
        return self.keypoints is not None and all(mask is None for mask in self.masks)

    @cached_property
    def halves(self) -> Halves:
        """The masks at half size."""
        return Halves.of(self.masks) if self._known_halves is None else self._known_halves

    @cached_property
    def people(self) -> tuple[tuple[Picture, Mask], ...]:
        """Each picture in which a person is visible, and its mask at half size."""
        found = [(self.views.pictures[n], self.halves.masks[n]) for n in self.seen]
        return tuple((picture, mask) for picture, mask in found if mask is not None)

    @cached_property
    def silhouettes(self) -> tuple[tuple[Picture, Observation], ...]:
        """The same pictures, with their masks as observations of the silhouette cost."""
        found = [(self.views.pictures[n], self.halves.bits[n], self.left_out[n]) for n in self.seen]
        return tuple((picture, Observation.of_bits(bits, ignored)) for picture, bits, ignored in found if bits is not None)

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
        differing = np.empty((len(self.silhouettes), len(poses)))

        def work(n: int) -> None:
            picture, observation = self.silhouettes[n]
            differing[n] = silhouette_costs(picture, observation, poses)

        shared_out(work, range(len(differing)))
        return differing.sum(0) / max(self.area, 1)

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
        """Intersection over union of a drawn pose (D,) and the silhouettes, mean of all pictures; 0 if no person is
        visible in them, and NaN if keypoints alone are evidence."""
        if self.by_keypoints:
            return np.nan
        overlaps = self.overlaps(pose)[list(self.seen)]
        return float(np.mean(overlaps)) if len(overlaps) else 0.0


def middle_of(surface: SurfacePoints) -> Array:
    """Mean (3,) of surface points, world; the origin without any."""
    return surface.points.mean(0) if len(surface.points) else np.zeros(3)


def _without(surface: SurfacePoints, views: BodyInViews, left_out: Sequence[Bits | None]) -> SurfacePoints:
    """The surface points but those on contours of pixels (H, W) that are left out."""
    kept = np.ones(len(surface.points), bool)
    for n, (picture, out) in enumerate(zip(views.pictures, left_out)):
        if out is not None:
            camera = picture.camera
            _leave_out(surface.points, surface.cameras, n, camera.T_camera_world, make_lens(camera), out, camera.size[0], kept)
    return surface if kept.all() else surface.picked(kept)


@kernel
def _leave_out(points, cameras, camera, T, lens, out, width, kept):  # pragma: no cover
    """Clear `kept` (P,) of points (P, 3) on a camera's contours that are in pixels (C, H) to leave out, or next to them. Points lie on
    contours, at most a pixel outside the picture."""
    height = out.shape[1]
    for p in range(points.shape[0]):
        if cameras[p] != camera:
            continue
        column, row = pixel_nearest(T, lens, points[p, 0], points[p, 1], points[p, 2])
        column, row = min(max(column, 0), width - 1), min(max(row, 0), height - 1)
        for x in range(max(column - 1, 0), min(column + 2, width)):
            for y in range(max(row - 1, 0), min(row + 2, height)):
                if is_set(out, x, y):
                    kept[p] = False
