"""A person's height from the lengths of limbs between triangulated keypoints."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.body.anthropometry import SOLE, stature_of
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.keypoints.candidates import triangulated_landmarks
from shadowpuppet.tracking.keypoints.choice import person_between
from shadowpuppet.tracking.keypoints.definitions import Landmarks
from shadowpuppet.tracking.keypoints.sights import sights_of

BONES = {"thigh_length": ("hip", "knee"), "shank_length": ("knee", "ankle"), "upper_arm_length": ("shoulder", "elbow"),
         "forearm_length": ("elbow", "wrist")}  # fmt: skip
"""The landmarks at the ends of bones."""


def height_by_bones(cameras: Sequence[Camera], frames: Sequence[Sequence[Keypoints | None]], landmarks: Landmarks) -> float | None:
    """Height (m), shoes on, of the person that a few frames' keypoints, by camera, show; from medians of the bones' lengths over frames and
    sides. None if no bone is seen by two cameras."""
    every = list[Array]()
    for keypoints in frames:
        people, middle = person_between(cameras, keypoints, landmarks)
        every.append(triangulated_landmarks(sights_of(cameras, keypoints, people, landmarks, middle), landmarks))
    return height_between(every, landmarks)


def height_between(frames: Sequence[Array], landmarks: Landmarks) -> float | None:
    """The same of the landmarks' places (K, 3) in a few frames."""
    lengths = {bone: list[float]() for bone in BONES}
    for places in frames:
        for bone, ends in BONES.items():
            for side in SIDES:
                above, below = (places[landmarks.names.index(f"{side}_{end}")] for end in ends)
                lengths[bone].append(float(np.linalg.norm(above - below)))
    known = {bone: float(np.nanmedian(each)) for bone, each in lengths.items() if np.isfinite(each).any()}
    return stature_of(known) + SOLE if known else None
