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
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.ground import calibrated_ground, moved_to, shown_ground
from shadowpuppet.tracking.monocular.pose_search import search_pose
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.size_search import PersonEstimate
from shadowpuppet.tracking.monocular.standing_place import PLACE, lowest, standing_place
from shadowpuppet.tracking.monocular.tracker import MonocularTracker
from shadowpuppet.tracking.silhouette_cost import Observation

AGREE = 0.25
"""Greatest difference, as a logarithm, of the distances by the floor, in the moment of the nearest, and by the upper body: else the world's
zero is no floor, or the person never stands."""
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
    """Coarse poses (K, D) in masks (H, W); in place of `_whole_poses` where there are many estimates."""
    picture = estimate.picture(camera, body)
    return np.array([search_pose(picture, mask).pose for mask in masks])


def _whole_poses(camera: Camera, masks: Sequence[Mask], body: str, estimate: PersonEstimate) -> Array:
    """Whole poses (K, D) searched for in masks (H, W), each by itself."""
    tracker = MonocularTracker(estimate.picture(camera, body), MonocularSettings(body=body), moves=False)
    return np.array([tracker.start(np.random.default_rng(k), mask).pose for k, mask in enumerate(masks)])


def whole_from_estimate(camera: Camera, masks: Sequence[Mask], upper: PersonEstimate, body: str, sizes: BoneSizes | None = None,
                        distance: float | None = None, standing: bool = True) -> PersonEstimate:
    """The whole-body estimate for an upper-body one, with the neck at the same place, from masks (H, W) of a person facing the camera. The
    distance (m), if not given, comes from the floor, or from the stature of a person known to be `standing`, or else is the upper body's.
    Given sizes are kept."""
    found = upper.sizes
    assert isinstance(found, CardboxSizes)
    whole: BoneSizes = sizes or whole_from_upper(body, found, upper.height)
    made = make_body(body, whole)
    neck = made.points(made.skeleton.pose()[None], names=["neck"])[0, 0, 2]
    estimate = replace(upper, sizes=whole, elevation=upper.elevation + found.torso_height - neck, ground=calibrated_ground(camera))

    def dressed(there: PersonEstimate, search: SearchPoses = _coarse_poses) -> PersonEstimate:
        return there if sizes is not None else _with_clothes(camera, masks, there, whole, body, search)

    if distance is None:
        stands = _on_ground(camera, masks, estimate, body)
        if stands is None and standing:
            stands = _standing(estimate, estimate.picture(camera, body), masks)
        estimate = stands or estimate
    estimate = dressed(estimate)
    for _ in range(0 if standing else REFITS):  # straight legs in place of bent ones would make them too thin
        estimate = dressed(estimate, _whole_poses)
    return estimate


def _on_ground(camera: Camera, masks: Sequence[Mask], estimate: PersonEstimate, body: str) -> PersonEstimate | None:
    """The estimate upright where the masks (H, W) end on the floor: the calibration's, if that is where the upper body is or the floor that
    the person shows; or else the latter, unless the upper body is nearer, as of a person who never stands."""
    known, shown = estimate.ground, shown_ground(camera, masks, estimate, body)
    same = known is not None and shown is not None and abs(np.log(shown.eye / known.eye)) <= AGREE
    for ground in (known, shown):
        if ground is not None:
            there = moved_to(camera, estimate, ground)
            picture = there.picture(camera, body)
            places = _places(picture, masks)
            off = np.log(np.maximum(there.distance - places[:, 0], 1e-3) / there.distance)
            if len(off) and (same or (off.min() <= AGREE and (ground is shown or off.max() >= -AGREE))):
                return _at_median(there, picture, places)
    return None


def _standing(estimate: PersonEstimate, picture: Picture, masks: Sequence[Mask]) -> PersonEstimate | None:
    """The estimate, seen as in a picture, at the median of its places in masks (H, W); None if they show none."""
    places = _places(picture, masks)
    return _at_median(estimate, picture, places) if len(places) else None


def _at_median(estimate: PersonEstimate, picture: Picture, places: Array) -> PersonEstimate:
    """The estimate, seen as in a picture, at the median of some places (K, 3), standing on the floor if that is known."""
    ahead, _, raised = np.median(places, axis=0).tolist()
    raised = raised if picture.floor is None else picture.floor - lowest(picture)  # a seated person is lower
    return replace(estimate, distance=estimate.distance - ahead, elevation=estimate.elevation + raised)


def _places(picture: Picture, masks: Sequence[Mask]) -> Array:
    """The places (K, 3) at which the person, upright, on the floor if it is known, fits those of some masks (H, W) that show one."""
    dofs, upright = picture.body.skeleton.dof_indices(PLACE), np.zeros(len(picture.body.skeleton.dofs))
    found = [pose[dofs] for mask in masks if (pose := standing_place(picture, mask, picture.floor, upright)) is not None]
    return np.array(found).reshape(-1, len(PLACE))


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
