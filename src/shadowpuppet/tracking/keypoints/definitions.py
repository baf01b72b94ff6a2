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
from shadowpuppet.body.skeleton import other_side
from shadowpuppet.camera.keypoints import MIDDLE
from shadowpuppet.geometry import Array

ARMS, LEGS = range(2)
"""Limbs that a detector exchanges, the left for the right."""


class Definition(NamedTuple):
    """A landmark of a detector: one that both sides have, or in the middle."""

    landmark: str
    """The body's own, without its side, which lies at the same place but for `offset`."""
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
    "ear": Definition("head", ARMS, 0.02, (0.0, 0.075, 0.0)), "nose": Definition("head", ARMS, 0.02, (0.1, 0.0, 0.0)),
}  # fmt: skip
"""By a landmark's name without its side. What lies in flesh, the hips, or on the sole of our bodies and above it in pictures, is less
certain; ears and nose lie half a head's width and depth beside its middle."""


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
    known = {f"{prefix}{name}": (each, own, (1, -1 if prefix == "right_" else 1, 1)) for name, each in DEFINITIONS.items()
             for prefix in (("",) if name in MIDDLE else ("left_", "right_"))
             for own in (f"{prefix}{each.landmark}", each.landmark) if own in body.landmarks}  # fmt: skip
    placed = [_placed(body, own, np.multiply(each.offset, mirror)) for each, own, mirror in known.values()]
    joints, places = np.array([joint for joint, _ in placed], np.int64), np.array([place for _, place in placed], float).reshape(-1, 3)
    limbs, deviations = np.array([each.limbs for each, *_ in known.values()], np.int64), [each.deviation for each, *_ in known.values()]
    return Landmarks(tuple(known), joints, places, np.array(other_side(list(known)), np.int64), limbs, np.array(deviations, float))


def _placed(body: Body, landmark: str, offset: Array) -> tuple[int, Array]:
    """Index of the joint whose frame is the segment above a landmark of the body, and the landmark's place there, moved by an offset."""
    skeleton, (name, place) = body.skeleton, body.landmarks[landmark]
    joint = skeleton.joint_index(name)
    parent = skeleton.joints[joint].parent
    if any(place) or parent is None:
        return joint, np.array(place) + offset
    return skeleton.joint_index(parent), skeleton.offsets[0, joint] + offset
