"""Keypoints: landmarks of persons that a detector found in a picture, by the names that all detectors' landmarks have here."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import TrackingError
from shadowpuppet.geometry import Array

MIDDLE = ("nose", "neck", "head_top", "mid_hip")
SIDED = ("eye", "ear", "shoulder", "elbow", "wrist", "index", "pinky", "hip", "knee", "ankle", "heel", "big_toe", "small_toe")
"""Landmarks that both sides have; `index` and `pinky` are the knuckles at the fingers' base."""
LANDMARKS = (*MIDDLE, *(f"{side}_{part}" for part in SIDED for side in ("left", "right")))
"""All landmarks."""


@dataclass(frozen=True, eq=False)
class Keypoints:
    """What a detector found in one frame of one camera: P persons (P may be 0), K landmarks. Raises `TrackingError` for other shapes."""

    names: tuple[str, ...]
    """Landmarks, some of `LANDMARKS`; K."""
    xy: Array
    """Pixels of the whole film, their centres at whole numbers, of shape (P, K, 2); NaN where a landmark is missing."""
    confidence: Array
    """From 0, where a landmark is missing, to 1, of shape (P, K)."""
    person: NDArray[np.int64]
    """The file's numbers of the persons, of shape (P,); -1 where unknown. They are the detector's own, and hints at most."""
    detector: str
    """Detector and model, such as `HALPE_26`: the same landmark lies elsewhere on the body for another one."""

    def __post_init__(self) -> None:
        """Check the shapes."""
        expected = (len(self.person), len(self.names))
        if self.confidence.shape != expected or self.xy.shape != (*expected, 2):
            raise TrackingError(f"keypoints: found shapes {self.xy.shape} and {self.confidence.shape}, expected {(*expected, 2)} and "
                                f"{expected}, persons and landmarks")

    def scaled(self, size: tuple[int, int], to: tuple[int, int]) -> Keypoints:
        """The same in pictures of another size than the film's (width, height)."""
        return replace(self, xy=(self.xy + 0.5) * np.divide(to, size) - 0.5)

    def only(self, person: int | None) -> Keypoints:
        """The same with the person of an index alone; None: with none."""
        chosen = slice(0, 0) if person is None else slice(person, person + 1)
        return replace(self, xy=self.xy[chosen], confidence=self.confidence[chosen], person=self.person[chosen])

    def without(self, persons: Iterable[int]) -> Keypoints:
        """The same, in which nothing is known of the persons of some indices."""
        confidence = self.confidence.copy()
        confidence[list(persons)] = 0
        return replace(self, confidence=confidence)


def cameras_with_persons(keypoints: Iterable[Keypoints | None]) -> int:
    """Number of cameras in which a detector found a person; `keypoints`: of one moment, one per camera."""
    return sum(each is not None and len(each.person) > 0 for each in keypoints)
