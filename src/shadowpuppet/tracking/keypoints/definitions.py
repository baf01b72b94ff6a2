"""Where on a body a detector's landmarks lie: the joint that carries each, the place in its frame, and how far off that may be.

A detector's shoulder is no anatomist's: it lies some centimetres beside the joint, whatever the pose. So a landmark is a place in the
frame of the segment that it moves with, as a shoulder does with the chest, and the doubt about that place is part of its scale.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array

ARMS, LEGS = range(2)
"""Limbs that a detector exchanges, the left for the right."""


class Definition(NamedTuple):
    """A landmark that both sides have."""

    landmark: str
    """The body's own, which lies at the same place but for `offset`."""
    limbs: int
    """`ARMS` or `LEGS`."""
    deviation: float
    """Standard deviation (m) of the offset between people and detectors."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Of the left side, metres, along the axes of the segment that carries it; the right side mirrors it."""


DEFINITIONS = {
    "shoulder": Definition("shoulder", ARMS, 0.015), "elbow": Definition("elbow", ARMS, 0.015), "wrist": Definition("wrist", ARMS, 0.015),
    "hip": Definition("hip", LEGS, 0.03), "knee": Definition("knee", LEGS, 0.015), "ankle": Definition("ankle", LEGS, 0.015),
    "heel": Definition("heel", LEGS, 0.03), "big_toe": Definition("toe", LEGS, 0.03),
}  # fmt: skip
"""By a landmark's name without its side. What lies in flesh, the hips, or on the sole of our bodies and above it in pictures, is less
certain."""


class Landmarks(NamedTuple):
    """The K landmarks of a body."""

    names: tuple[str, ...]
    """As `Keypoints.names` has them."""
    joints: NDArray[np.int64]
    """Joint that carries each, of shape (K,)."""
    places: Array
    """In that joint's frame, metres, of shape (K, 3)."""
    mirrored: NDArray[np.int64]
    """Index of the other side's, of shape (K,)."""
    limbs: NDArray[np.int64]
    """`ARMS` or `LEGS`, of shape (K,)."""
    deviations: Array
    """Metres, of shape (K,)."""

    @property
    def arrays(self) -> tuple[NDArray[np.int64], Array, NDArray[np.int64], NDArray[np.int64]]:
        """Joints, places, mirrored and limbs, as kernels take them."""
        return self.joints, self.places, self.mirrored, self.limbs


NO_LANDMARKS = Landmarks((), np.zeros(0, np.int64), np.zeros((0, 3)), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0))
"""Of a body whose keypoints do not matter."""


@lru_cache(64)
def landmarks_of(body: Body) -> Landmarks:
    """The landmarks of a whole body that its own are the places of."""
    known = {name: each for name, each in DEFINITIONS.items() if f"left_{each.landmark}" in body.landmarks}
    names = tuple(f"{side}_{name}" for name in known for side in SIDES)
    placed = [_placed(body, f"{side}_{each.landmark}", np.array(each.offset) * (1, 1 if side == "left" else -1, 1))
              for each in known.values() for side in SIDES]
    joints, places = np.array([joint for joint, _ in placed], np.int64), np.array([place for _, place in placed], float).reshape(-1, 3)
    limbs, deviations = (np.array([each[n] for each in known.values()]).repeat(2) for n in (1, 2))
    return Landmarks(names, joints, places, np.arange(len(names)) ^ 1, limbs.astype(np.int64), deviations.astype(float))


def _placed(body: Body, landmark: str, offset: Array) -> tuple[int, Array]:
    """Index of the joint whose frame is the segment above a landmark of the body, and the landmark's place there, moved by an offset."""
    skeleton, (name, place) = body.skeleton, body.landmarks[landmark]
    joint = skeleton.joint_index(name)
    parent = skeleton.joints[joint].parent
    if any(place) or parent is None:
        return joint, np.array(place) + offset
    return skeleton.joint_index(parent), skeleton.offsets[0, joint] + offset
