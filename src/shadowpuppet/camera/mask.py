"""Masks (silhouettes): their type, and checks of their size and plausibility."""

from __future__ import annotations

from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.camera.colour_codes import ColourCode
from shadowpuppet.camera.keypoints import Keypoints
from shadowpuppet.errors import TrackingError

Mask = NDArray[np.bool_]
"""A silhouette, of shape (H, W)."""
NEARLY_ALL = 0.8
"""Share of the picture above which a silhouette is implausible."""
Window = tuple[slice, slice]
"""Rows and columns of a picture."""
Value = TypeVar("Value", bound=np.generic)


class Seen(NamedTuple):
    """What the cameras show of the person in a frame set: all the evidence that tracking has. By camera; None for one without a frame."""

    masks: tuple[Mask | None, ...]
    """Silhouettes (H, W)."""
    shadows: tuple[Mask | None, ...] = ()
    """Pixels (H / 2, W / 2) that were taken for shadow; empty: not known."""
    codes: tuple[ColourCode | None, ...] = ()
    """Coarse colours (`camera.colour_codes`) in the light of the empty scene; empty: not known."""
    keypoints: tuple[Keypoints | None, ...] = ()
    """What a detector found, in pixels of these pictures; empty: without one."""


def check_mask(mask: ArrayLike, size: tuple[int, int], what: str = "mask") -> Mask:
    """A mask (H, W) as booleans. Raises `TrackingError` if it is not of the camera's size (width, height)."""
    found = np.shape(mask)
    if found != size[::-1]:
        raise TrackingError(f"{what}: found shape {found}, expected {size[::-1]}, the camera's rows and columns")
    return np.asarray(mask, bool)


def may_be_person(mask: Mask) -> bool:
    """Whether a mask is neither empty nor nearly all of the picture."""
    return bool(0 < np.count_nonzero(mask) < NEARLY_ALL * mask.size)


def bounding_window(mask: Mask | NDArray[np.uint8], margin: int) -> Window:
    """Bounding box of the set pixels of a mask (H, W), with a margin (pixels)."""
    import cv2

    x, y, width, height = cv2.boundingRect(mask.view(np.uint8))
    return slice(max(y - margin, 0), y + height + margin), slice(max(x - margin, 0), x + width + margin)


def half_size(pixels: NDArray[Value]) -> NDArray[Value]:
    """A copy of every second pixel of every second row of a mask or picture (H, W, ...)."""
    return np.array(pixels[::2, ::2], order="C")


def grown(mask: Mask, by: int) -> Mask:
    """A mask (H, W) grown by a number of pixels to all sides, corners included; shrunk if it is negative."""
    import cv2

    window, square, out = bounding_window(mask, abs(by)), np.ones((2 * abs(by) + 1,) * 2, np.uint8), np.zeros_like(mask)
    found = (cv2.dilate if by > 0 else cv2.erode)(np.ascontiguousarray(mask[window]).view(np.uint8), square)
    out[window] = np.asarray(found, np.uint8).view(np.bool_)
    return out
