"""Surface points of the visual hull: silhouettes of several calibrated cameras to points in space with outward normals (Ni 2008, III).

The viewing ray of a contour pixel touches the person somewhere on its viewing edge: the part of the ray inside the other cameras'
silhouettes (Matusik et al. 2000, "Image-based visual hulls").
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask, check_mask, may_be_person
from shadowpuppet.camera.projection import make_lens
from shadowpuppet.errors import CalibrationError, TrackingError
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.tracking.multiview.settings import HullSettings
from shadowpuppet.tracking.multiview.surface.contours import trace_contours
from shadowpuppet.tracking.multiview.surface.viewing_edges import bounding_circles, contour_length, cut_rays, spaced_vertices, straighten

GRID_PITCH = 4
"""Pitch (pixels) of the grid on which lens distortion is undone exactly; linear between."""
MAX_RETURN_ERROR = 0.05
"""Largest error (pixels) of a pixel's ray when projected back; with a larger one the pixel is outside the distortion model's range."""
MAX_RADIUS = 20.0
"""Largest radius of rays on the plane z = 1: 87 degrees off the axis."""


class SurfacePoints(NamedTuple):
    """Points on the visual hull, in the order of the cameras and of their contours."""

    points: Array
    """World coordinates, of shape (P, 3), metres."""
    normals: Array
    """Unit normals, outward, world, of shape (P, 3)."""
    weights: Array
    """1 / (1 + (length / falloff)^2) of each point's viewing edge, of shape (P,)."""
    cameras: NDArray[np.int64]
    """Index of the camera on whose contour each point lies, of shape (P,)."""

    def picked(self, which: NDArray[np.bool_]) -> SurfacePoints:
        """Some of the points, (P,) true or false."""
        return SurfacePoints(self.points[which], self.normals[which], self.weights[which], self.cameras[which])


NO_SURFACE = SurfacePoints(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0, np.int64))
"""Where nothing is seen."""


class _View(NamedTuple):
    """Arrays of a camera for the kernels."""

    rays: Array
    """Points on the plane z = 1 of a grid of pixels from (-0.5, -0.5) to (W - 0.5, H - 0.5), of shape (R, C, 2)."""
    seen: Mask | None
    """Pixels (H, W) where the distortion model holds; None: everywhere."""
    lens: Array
    """fx, fy, cx, cy, width, height, whether a fisheye, radius up to which the model holds, distortion (8), of shape (16,)."""


class _Silhouette(NamedTuple):
    """A silhouette's contours on the plane z = 1."""

    lines: Array
    """Vertices of closed polygons one after the other, the first of each repeated at its end, of shape (N, 2)."""
    ends: NDArray[np.int64]
    """Where each polygon starts, and N at the end."""
    outward: Array
    """Outward normals of the viewing planes (camera's frame), of shape (N, 3); 0 where no ray starts."""
    chunks: Array
    """Bounding circles of runs of sides: centre and radius, of shape (3, C)."""
    spans: NDArray[np.int64]
    """First side of each run and its end, of shape (C, 2)."""


class _Carving(NamedTuple):
    """What `cut_rays` cuts rays with, in the order of its arguments, which it explains."""

    relative: Array
    lines: Array
    spans: NDArray[np.int64]
    circles: Array
    bounds: NDArray[np.int64]
    lenses: Array


class VisualHull:
    """The visual hull of calibrated cameras; `points` computes surface points from their silhouettes.

    Raises `CalibrationError` for fewer than two cameras, or for one without a pose in the world.
    """

    def __init__(self, cameras: Iterable[Camera], settings: HullSettings | None = None, company: bool = False) -> None:
        """Undo the lens distortion on a grid, once. `company`: several people are seen, so that nearly every ray has long edges far away,
        within another's silhouette, which do not count when a camera may be overruled (`tolerated`)."""
        self.cameras = tuple(cameras)
        self.settings = settings or HullSettings()
        self._longest_counted = self.settings.longest if company else np.inf
        if len(self.cameras) < 2:
            raise CalibrationError(f"a visual hull: found {len(self.cameras)} cameras, expected two or more")
        for camera in self.cameras:
            if not camera.oriented:
                raise CalibrationError(f"camera {camera.name!r}: found only a field of view, expected also where it stands in the world")
        self._views = [_view(camera) for camera in self.cameras]
        self._T = np.stack([camera.T_camera_world for camera in self.cameras])

    def points(self, masks: Sequence[ArrayLike | None]) -> SurfacePoints:
        """Surface points of one frame's masks (H, W), one per camera, in their order.

        A mask that is None, empty, or nearly the whole picture is ignored; nothing is carved outside a picture. With fewer than two masks
        left there are no points. Raises `TrackingError` for a wrong number of masks, or for a size other than the camera's.
        """
        people = self.people(masks)
        if len(people) < 2:
            return NO_SURFACE
        silhouettes = [_silhouette(mask, self._views[n]) for n, mask in people.items()]
        return self._sampled(*self._edges(silhouettes, np.array(list(people))))

    def people(self, masks: Sequence[ArrayLike | None]) -> dict[int, Mask]:
        """Masks (H, W) that may be a person's, by the camera's index. Raises `TrackingError` as `points` does."""
        if len(masks) != len(self.cameras):
            raise TrackingError(f"silhouettes: found {len(masks)}, expected {len(self.cameras)}, one a camera (None where there is none)")
        given = {n: check_mask(mask, camera.size, f"camera {camera.name!r}: mask")
                 for n, (mask, camera) in enumerate(zip(masks, self.cameras)) if mask is not None}
        return {n: mask for n, mask in given.items() if may_be_person(mask)}

    def _edges(self, silhouettes: list[_Silhouette], which: NDArray[np.int64]) -> tuple[NDArray[np.int64], Array, Array, Array]:
        """Viewing edges: camera (E,), ray (E, 3) with z = 1, normal (E, 3), both in the camera's frame, and depths (E, 2)."""
        step = sum(contour_length(s.lines, s.outward) for s in silhouettes) / self.settings.rays
        taken = [spaced_vertices(s.lines, s.outward, step) for s in silhouettes]
        camera = np.repeat(np.arange(len(which)), [len(t) for t in taken])
        rays = np.concatenate([s.lines[t] for s, t in zip(silhouettes, taken)])
        rays = np.concatenate([rays, np.ones((len(rays), 1))], 1)
        outward = np.concatenate([s.outward[t] for s, t in zip(silhouettes, taken)])
        ray, depths = cut_rays(camera, rays, *self._carving(silhouettes, which), self.settings.tolerated, self._longest_counted)
        return which[camera[ray]], rays[ray], outward[ray], depths

    def _carving(self, silhouettes: list[_Silhouette], which: NDArray[np.int64]) -> _Carving:
        """The silhouettes of cameras `which` (V,) as `cut_rays` takes them."""
        firsts = np.cumsum([0, *(len(s.lines) for s in silhouettes)])
        T = self._T[which]
        return _Carving(
            relative=T[None] @ inverse(T)[:, None],  # [i, j]: from camera i to j
            lines=np.ascontiguousarray(np.concatenate([s.lines for s in silhouettes]).T),
            spans=np.concatenate([s.spans + first for s, first in zip(silhouettes, firsts)]),
            circles=np.concatenate([s.chunks for s in silhouettes], 1),
            bounds=np.cumsum([0, *(len(s.spans) for s in silhouettes)]),
            lenses=np.stack([self._views[n].lens for n in which]),
        )  # fmt: skip

    def _sampled(self, camera: NDArray[np.int64], rays: Array, outward: Array, depths: Array) -> SurfacePoints:
        """Points along viewing edges of the cameras."""
        lengths = np.linalg.norm(rays, axis=1) * (depths[:, 1] - depths[:, 0])
        kept = np.flatnonzero(lengths <= self.settings.longest)
        count = np.maximum(np.ceil(lengths[kept] / self.settings.pitch), 1).astype(np.int64)
        edge = np.repeat(kept, count)
        place = (np.arange(len(edge)) - np.repeat(np.cumsum(count) - count, count) + 0.5) / np.repeat(count, count)
        depth = depths[edge, 0] + place * (depths[edge, 1] - depths[edge, 0])
        back, which = inverse(self._T), camera[edge]
        R = back[which, :3, :3]
        points = np.einsum("pij,pj->pi", R, rays[edge] * depth[:, None]) + back[which, :3, 3]
        weights = 1 / (1 + (lengths[edge] / self.settings.falloff) ** 2)
        return SurfacePoints(points, np.einsum("pij,pj->pi", R, outward[edge]), weights, which)


def _view(camera: Camera) -> _View:
    """The arrays of a camera, which are computed once for each lens."""
    return _view_through(camera.size, tuple(camera.matrix.ravel().tolist()), tuple(camera.distortion.tolist()), camera.fisheye)


@lru_cache
def _view_through(size: tuple[int, int], matrix: tuple[float, ...], distortion: tuple[float, ...], fisheye: bool) -> _View:
    camera = Camera("lens", size, np.reshape(matrix, (3, 3)), np.array(distortion), fisheye=fisheye)
    (width, height), lens = camera.size, make_lens(camera)
    x, y = (np.linspace(-0.5, side - 0.5, -(-side // GRID_PITCH) + 1) for side in (width, height))
    pixels = np.stack(np.meshgrid(x, y), -1)
    rays = camera.rays(pixels)
    back = camera.project(rays)
    good = (np.abs(back - pixels).max(-1) < MAX_RETURN_ERROR) & (np.linalg.norm(rays[..., :2], axis=-1) < min(camera.reach, MAX_RADIUS))
    numbers = [*np.diag(camera.matrix)[:2], *camera.matrix[:2, 2], width, height, camera.fisheye, min(lens[-1], MAX_RADIUS)]
    flat = np.where(good[..., None], rays[..., :2], 0.0)
    return _View(flat, None if good.all() else _seen(good, camera.size), np.pad(np.array([*numbers, *camera.distortion]), (0, 8))[:16])


def _seen(good: NDArray[np.bool_], size: tuple[int, int]) -> Mask:
    """Mask (H, W) of the pixels in grid cells where all corners, and the corners' neighbours, are good."""
    wide = np.pad(good, 1, mode="edge")
    firm = np.lib.stride_tricks.sliding_window_view(wide, (4, 4)).all((2, 3))
    columns, rows = (((np.arange(side) + 0.5) / side * cells).astype(int) for side, cells in zip(size, firm.shape[::-1]))
    return np.asarray(firm)[rows[:, None], columns]


def _silhouette(mask: Mask, view: _View) -> _Silhouette:
    """A mask's contours on the plane z = 1."""
    contours = trace_contours(mask, view.seen)
    lines, outward, ends = straighten(*contours, view.rays, view.lens[4], view.lens[5])
    return _Silhouette(lines, ends, outward, *bounding_circles(lines, ends))
