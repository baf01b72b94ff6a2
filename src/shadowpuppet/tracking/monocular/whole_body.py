"""A whole person before one camera, from what their upper body told: where they stand, and how stout they are in their clothes."""

from __future__ import annotations

from collections.abc import Sequence
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
from shadowpuppet.tracking.silhouette_cost import Observation

CUT_OFF_ROWS = 2
"""A person whose silhouette reaches the picture's last rows is cut off there."""
DISTANCE_FACTORS = np.arange(0.8, 1.5, 0.01)
"""Distances that are tried, over that at which the upper body alone was found."""
WIDTH_FACTORS = np.arange(0.75, 1.61, 0.05)
"""Factors on widths that are tried."""
WIDTH_GROUPS = (
    ("pelvis_width", "waist_width", "chest_width", "trunk_width"),
    ("thigh_width", "knee_width", "calf_width", "ankle_width", "shank_width"),
    ("upper_arm_width", "elbow_width", "forearm_width", "wrist_width"),
)
"""Widths that clothes make larger together."""


def whole_from_estimate(camera: Camera, masks: Sequence[Mask], upper: PersonEstimate, body: str, sizes: BoneSizes | None = None,
                 distance: float | None = None) -> PersonEstimate:
    """A whole body in place of an upper one, its neck where that has it, in masks (H, W) of someone who faces the camera.

    Where the soles are seen, they tell the distance (m), if it is not given: trunk and arms alone told it worse, and clothes can make
    them wide. Sizes that are given are kept.
    """
    found = upper.sizes
    assert isinstance(found, CardboxSizes)
    whole: BoneSizes = sizes or whole_from_upper(body, found, upper.height)
    made = make_body(body, whole)
    neck = made.points(made.skeleton.pose()[None], names=["neck"])[0, 0, 2]
    guess = replace(upper, sizes=whole, elevation=upper.elevation + found.torso_height - neck)
    soles = [np.flatnonzero(mask.any(1))[-1] for mask in masks if not mask[-CUT_OFF_ROWS:].any()]
    if distance is None and soles:
        farther = [_moved(guess, factor, neck) for factor in DISTANCE_FACTORS]
        guess = farther[int(np.argmin([abs(_soles(each.picture(camera, body), whole) - np.median(soles)) for each in farther]))]
    return guess if sizes is not None else _dressed(camera, masks, guess, whole, body)


def _moved(guess: PersonEstimate, factor: float, neck: float) -> PersonEstimate:
    """Someone of the same sizes so much farther away, whose neck, so high over the pelvis (m), looks as high."""
    return replace(guess, distance=factor * guess.distance, elevation=factor * (guess.elevation + neck) - neck)


def _soles(picture: Picture, sizes: BoneSizes) -> float:
    """The picture's row of the soles of who stands upright."""
    camera, standing = picture.camera, picture.body.skeleton.pose()[None]
    soles = picture.points(standing, ["left_ankle", "right_ankle"])[0] - sizes.ankle_height * picture.T_camera_base[:3, 2]
    return float(camera.project(transform(inverse(camera.T_camera_world), soles))[:, 1].mean())


def _dressed(camera: Camera, masks: Sequence[Mask], guess: PersonEstimate, sizes: BoneSizes, body: str) -> PersonEstimate:
    """The guess with widths that cover the masks best, in poses that are found once."""
    some = [masks[0], masks[-1]]
    poses = [search_pose(guess.picture(camera, body), mask).pose for mask in some]
    for names in WIDTH_GROUPS:
        widths = {name: getattr(sizes, name) for name in names if name in sizes.names()}
        tried = [sizes.with_values(**{name: factor * width for name, width in widths.items()}) for factor in WIDTH_FACTORS]
        sizes = tried[int(np.argmin([_cost(camera, some, poses, replace(guess, sizes=each), body) for each in tried]))]
    return replace(guess, sizes=sizes)


def _cost(camera: Camera, masks: Sequence[Mask], poses: Sequence[Array], guess: PersonEstimate, body: str) -> float:
    picture = guess.picture(camera, body)
    return sum(Observation.of(mask).cost_and_overlap(picture.draw(pose))[0] for mask, pose in zip(masks, poses, strict=True))
