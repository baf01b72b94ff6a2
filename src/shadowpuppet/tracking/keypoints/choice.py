"""Which of the persons that a detector found in each picture is the one that is tracked; never the most confident for being so."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.camera.mask import Mask
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.keypoints.definitions import Landmarks
from shadowpuppet.tracking.keypoints.sights import NEAR, is_inside, sights_of

People = tuple[int | None, ...]
"""Index of the person in each camera's keypoints; None for none."""


def people_in(masks: Sequence[Mask | None], cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None]) -> People:
    """In each camera the person of whose keypoints' confidence most lies in its mask (H, W), less what lies outside; none if all have more
    outside."""
    found = list[int | None]()
    for mask, camera, each in zip(masks, cameras, keypoints):
        if mask is None or each is None or not len(each.person):
            found.append(None)
            continue
        inside = is_inside(camera, each.xy)
        x, y = np.where(inside[..., None], each.xy, 0).round().astype(int).T
        scores = np.where(inside, np.where(mask[y, x].T, each.confidence, -each.confidence), 0).sum(1)
        found.append(int(scores.argmax()) if scores.max() > 0 else None)
    return tuple(found)


def people_at(points: Array, cameras: Sequence[Camera], keypoints: Sequence[Keypoints | None], landmarks: Landmarks) -> People:
    """In each camera the person whose keypoints lie nearest to a body's landmarks (K, 3), on whichever side."""
    middle, number = points.mean(0), max((len(each.person) for each in keypoints if each is not None), default=0)
    if number == 1:
        return tuple(0 if each is not None and len(each.person) else None for each in keypoints)
    scores = np.zeros((number, len(cameras)))
    for person in range(number):
        chosen = [person if each is not None and person < len(each.person) else None for each in keypoints]
        sights = sights_of(cameras, keypoints, chosen, landmarks, middle)
        np.add.at(scores[person], sights.cameras, 1 / (1 + sights.squares_from(points, landmarks) / NEAR**2))
    return tuple(int(each.argmax()) if each.any() else None for each in scores.T) if number else (None,) * len(cameras)
