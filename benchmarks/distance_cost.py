"""The one-camera tracker with another silhouette cost, for `ablations.py`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from shadowpuppet.camera.bits import unpack
from shadowpuppet.geometry import Array
from shadowpuppet.pipeline.track import track_recording
from shadowpuppet.tracking.monocular import stages
from shadowpuppet.tracking.silhouette_cost import Observation, PartialCost


class DistanceCost(PartialCost):
    """In place of eq. 2: a pixel that differs counts by how far it lies from the silhouette's outline."""

    def costs(self, observation: Observation, around: Array) -> Callable[[Array], Array]:
        """As `PartialCost.costs`, pose by pose."""
        width, drawn = self.picture.camera.size[0], np.concatenate([self.still, self.moving])
        seen, skipped = unpack(observation.silhouette, width), unpack(observation.ignore, width)
        weights = (_distances(seen) + _distances(~seen)) * ~skipped
        return lambda poses: np.array([weights[unpack(self.picture.draw(pose, drawn), width) ^ seen].sum() for pose in poses])


def by_distance(recording: str, folder: Path, *more: Any) -> None:
    """`track_recording` with `DistanceCost`."""
    with patch.object(stages, "PartialCost", DistanceCost):
        track_recording(recording, folder, *more)


def _distances(mask: NDArray[np.bool_]) -> Array:
    """Of every pixel of a mask (H, W) from the nearest that is not; 0 elsewhere."""
    return np.asarray(distance_transform_edt(mask), float)
