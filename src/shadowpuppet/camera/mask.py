"""What a mask must be before it is worked with: of the camera's size, and a person's."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import TrackingError

Mask = NDArray[np.bool_]
"""A silhouette, of shape (H, W)."""
NEARLY_ALL = 0.8
"""Share of the picture from which on a silhouette is no person's."""


def check_mask(mask: ArrayLike, size: tuple[int, int], what: str = "mask") -> Mask:
    """A mask (H, W) as true and false. Raises `TrackingError` where it has not the size (width, height) of the camera's pictures."""
    found = np.shape(mask)
    if found != size[::-1]:
        raise TrackingError(f"{what}: found shape {found}, expected {size[::-1]}, the camera's rows and columns")
    return np.asarray(mask, bool)


def may_be_person(mask: Mask) -> bool:
    """Whether a mask is neither empty nor nearly all of the picture."""
    return bool(0 < np.count_nonzero(mask) < NEARLY_ALL * mask.size)
