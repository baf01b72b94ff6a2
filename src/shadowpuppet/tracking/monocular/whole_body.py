"""A whole body from the fit of an upper body to one camera: the distance from the soles, and widths that include clothes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.body.models import make_body, whole_from_upper
from shadowpuppet.body.sizes import BoneSizes, CardboxSizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array, inverse, transform
from shadowpuppet.tracking.monocular.pose_search import search_pose
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.whole_distance import whole_distance, whole_poses
from shadowpuppet.tracking.silhouette_cost import Observation

CUT_OFF_ROWS = 2
"""A silhouette that reaches this many last rows of the picture is cut off there."""
DISTANCE_FACTORS = np.arange(0.8, 1.5, 0.01)
"""Distances that are tried, relative to that of the upper body."""
WIDTH_FACTORS = np.arange(0.75, 1.61, 0.05)
"""Factors on widths that are tried."""
WIDEST, REFITS = 3, 2
"""Number of the widest silhouettes in which widths are fitted, and how often they are fitted again in whole poses."""
WIDTH_GROUPS = (
    ("pelvis_width", "waist_width", "chest_width", "trunk_width"),
    ("thigh_width", "knee_width", "calf_width", "ankle_width", "shank_width"),
    ("upper_arm_width", "elbow_width", "forearm_width", "wrist_width"),
)
"""Widths that clothes enlarge together."""
SearchPoses = Callable[[Camera, Sequence[Mask], str, PersonEstimate], Array]
"""Finds poses (K, D) in masks (H, W), with a body's name and the person's estimate."""


def _coarse_poses(camera: Camera, masks: Sequence[Mask], body: str, estimate: PersonEstimate) -> Array:
    """Coarse poses (K, D) in masks (H, W); in place of `whole_poses` where there are many estimates."""
    picture = estimate.picture(camera, body)
    return np.array([search_pose(picture, mask).pose for mask in masks])


def whole_from_estimate(camera: Camera, masks: Sequence[Mask], upper: PersonEstimate, body: str, sizes: BoneSizes | None = None,
                        distance: float | None = None, standing: bool = True) -> PersonEstimate:
    """The whole-body estimate for an upper-body one, with the neck at the same place, from masks (H, W) of a person facing the camera. The
    distance (m), if not given, comes from the soles of a person known to be `standing`, and else from whole poses (`whole_distance`): trunk
    and arms alone determine it worse, as clothes can make them wide. Given sizes are kept."""
    found = upper.sizes
    assert isinstance(found, CardboxSizes)
    whole: BoneSizes = sizes or whole_from_upper(body, found, upper.height)
    made = make_body(body, whole)
    neck = made.points(made.skeleton.pose()[None], names=["neck"])[0, 0, 2]
    estimate = replace(upper, sizes=whole, elevation=upper.elevation + found.torso_height - neck)

    def dressed(there: PersonEstimate, search: SearchPoses = _coarse_poses) -> PersonEstimate:
        return there if sizes is not None else _with_clothes(camera, masks, there, whole, body, search)

    if distance is None and standing:
        estimate = _over_soles(camera, masks, estimate, neck, body, whole)
    elif distance is None:
        factor = whole_distance(camera, masks, body, lambda factor: dressed(_at_distance(estimate, factor, neck)))
        estimate = _at_distance(estimate, factor, neck)
    estimate = dressed(estimate)
    for _ in range(0 if standing else REFITS):  # straight legs in place of bent ones would make them too thin
        estimate = dressed(estimate, whole_poses)
    return estimate


def _over_soles(camera: Camera, masks: Sequence[Mask], estimate: PersonEstimate, neck: float, body: str,
                sizes: BoneSizes) -> PersonEstimate:
    """The estimate at the distance at which a standing person's soles are where the masks (H, W) end, if any ends in the picture."""
    soles = np.array([np.flatnonzero(mask.any(1))[-1] for mask in masks if not mask[-CUT_OFF_ROWS:].any()])
    if not len(soles):
        return estimate
    candidates = [_at_distance(estimate, factor, neck) for factor in DISTANCE_FACTORS]
    rows = np.array([_soles_row(each.picture(camera, body), sizes) for each in candidates])
    return candidates[int(np.argmin(np.abs(rows - np.median(soles))))]


def _at_distance(estimate: PersonEstimate, factor: float, neck: float) -> PersonEstimate:
    """The estimate at `factor` times the distance, with the neck (`neck` metres above the pelvis) at the same place in the picture."""
    return replace(estimate, distance=factor * estimate.distance, elevation=factor * (estimate.elevation + neck) - neck)


def _soles_row(picture: Picture, sizes: BoneSizes) -> float:
    """The picture's row of the soles of the person standing upright."""
    camera, standing = picture.camera, picture.body.skeleton.pose()[None]
    soles = picture.points(standing, ["left_ankle", "right_ankle"])[0] - sizes.ankle_height * picture.T_camera_base[:3, 2]
    return float(camera.project(transform(inverse(camera.T_camera_world), soles))[:, 1].mean())


def _with_clothes(camera: Camera, masks: Sequence[Mask], estimate: PersonEstimate, sizes: BoneSizes, body: str,
                  search: SearchPoses) -> PersonEstimate:
    """The estimate with the widths of least silhouette cost, in poses that `search` finds once; in the widest silhouettes, whose arms are
    off the trunk: it would grow over hanging ones."""
    widest = sorted(masks, key=lambda mask: int(np.ptp(np.flatnonzero(mask.any(0)))))[-WIDEST:]
    poses = search(camera, widest, body, estimate)
    for names in WIDTH_GROUPS:
        widths = {name: getattr(sizes, name) for name in names if name in sizes.names()}
        tried = [sizes.with_values(**{name: factor * width for name, width in widths.items()}) for factor in WIDTH_FACTORS]
        sizes = tried[int(np.argmin([_silhouette_cost(camera, widest, poses, replace(estimate, sizes=each), body) for each in tried]))]
    return replace(estimate, sizes=sizes)


def _silhouette_cost(camera: Camera, masks: Sequence[Mask], poses: Array, estimate: PersonEstimate, body: str) -> float:
    picture = estimate.picture(camera, body)
    return sum(Observation.of(mask).cost_and_overlap(picture.draw(pose))[0] for mask, pose in zip(masks, poses, strict=True))
