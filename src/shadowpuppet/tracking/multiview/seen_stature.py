"""The height that one frame's silhouettes ask for in the calibration's world, whatever the world's scale, and however the person sits or
stands: a body of average proportions is fitted with free stature and girth."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.anthropometry import AVERAGE_HEIGHT
from shadowpuppet.body.models import MODELS, average_sizes, make_body
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import Sizes
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.bundle_adjustment import solve_bundle
from shadowpuppet.tracking.multiview.height_estimation import extents
from shadowpuppet.tracking.multiview.observation import MultiviewObservation
from shadowpuppet.tracking.multiview.settings import HullSettings, MultiviewSettings
from shadowpuppet.tracking.multiview.size_estimation import (
    CLOTHES,
    EMPTINESS_SHARE,
    GIRTH_DEVIATION,
    SIZE_PULL,
    widened,
)
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull
from shadowpuppet.tracking.multiview.tracker import MultiviewTracker
from shadowpuppet.tracking.status import status_of

EXTENT = 1.6
"""Longest extent, metres, to which a hull is brought first: between a sitting person's and that of one who reaches up."""
TURNS = 3
"""Number of fits, each in a world in which the person is of average height by the one before: costs and priors are made for that size."""
ANY = 1e3
"""A length, metres, that no hull has."""
LOOSE = 0.5
"""Standard deviation of the relative stature: hardly any."""


@dataclass(frozen=True)
class Build(Sizes):
    """Two sizes, relative to the average person's, from which all others follow."""

    stature: float
    girth: float
    """Factor on widths and depths, besides the stature."""


class SeenStature(NamedTuple):
    """What one frame's silhouettes ask for."""

    height: float
    """Of the person in the calibration's metres."""
    overlap: float
    """Mean intersection over union of the fitted body and the silhouettes."""


def hull_points(cameras: Sequence[Camera], masks: Sequence[Mask | None], settings: HullSettings) -> Array:
    """Surface points (P, 3), metres, of the hull of masks (H, W), as `person_points`; none of too few. The settings' lengths are for a
    person: all of the hull tells the size first."""
    points, factor = np.zeros((0, 3)), 1.0
    for hull in (replace(settings, longest=ANY), settings):
        points = person_points([scaled(camera, factor) for camera in cameras], masks, hull).points / factor
        if not (longest := float(extents(points)[0])):
            return np.zeros((0, 3))
        factor = EXTENT / longest
    return points


def person_points(cameras: Sequence[Camera], masks: Sequence[Mask | None], settings: HullSettings) -> SurfacePoints:
    """Surface points of masks (H, W) that all show the whole of one person: a point beside one of the pictures is none of the person's."""
    found = VisualHull(cameras, settings).points(masks)
    inside = np.ones(len(found.points), bool)
    for camera, mask in zip(cameras, masks):
        if mask is not None:
            pixels = camera.project(found.points)
            inside &= (pixels >= 0).all(1) & (pixels <= np.array(camera.size) - 1).all(1)  # NaN is not inside
    return found.picked(inside)


def scaled(camera: Camera, factor: float) -> Camera:
    """The camera in a world whose lengths are multiplied."""
    T = camera.T_camera_world.copy()
    T[:3, 3] *= factor
    return replace(camera, T_camera_world=T)


def seen_stature(rng: np.random.Generator, cameras: Sequence[Camera], masks: Sequence[Mask | None],
                 settings: MultiviewSettings) -> SeenStature | None:
    """The height that masks (H, W) of one moment, by camera, that show the whole person ask for; None if no body fits them. It grows with
    the cameras' world in proportion: nothing else depends on the world's scale."""
    longest = extents(hull_points(cameras, masks, settings.hull))[0]
    if not longest:
        return None
    plain, make = replace(settings, method="hybrid", refinement="gauss_newton"), _maker(settings.body)
    factor, usual, pose = EXTENT / float(longest), Build(1.0, CLOTHES), None
    height = overlap = 0.0
    for _ in range(TURNS):
        world = tuple(scaled(camera, factor) for camera in cameras)
        points, tracker = person_points(world, masks, settings.hull), MultiviewTracker(make(usual), world, plain)
        if pose is None:
            state = tracker.start(rng, points, masks)
            if state.status == "absent":
                return None
            pose = state.pose
        seen = MultiviewObservation(tracker.views, points, masks)
        centre, pull = tracker.posture_prior.quadratic(pose, SIZE_PULL, settings.posture)
        bundle = solve_bundle(make, usual, np.array([LOOSE, GIRTH_DEVIATION]), pose[None], [seen.full], settings.surface, pull=pull[None],
                              centre=centre[None], worth=MODELS[settings.body].independent_points, spaces=[seen.space],
                              emptiness=EMPTINESS_SHARE * settings.gauss_newton.emptiness)
        grown, pose = bundle.sizes.stature, bundle.poses[0].copy()
        height, overlap = grown * AVERAGE_HEIGHT / factor, seen.overlap(pose)
        pose[tracker.body.skeleton.dof_indices(GLOBAL_DOFS[:3])] /= grown
        factor /= grown
    return None if status_of(overlap) == "lost" else SeenStature(height, overlap)


def _maker(name: str) -> Callable[[Build], Body]:
    """The function that makes a body, by name, of a build."""
    average = average_sizes(name, AVERAGE_HEIGHT)

    def make(build: Build) -> Body:
        return make_body(name, type(average).from_array(build.stature * widened(average, build.girth).to_array()))

    return make
