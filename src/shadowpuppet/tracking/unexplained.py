"""Parts of the silhouettes that the fitted body leaves unexplained for some time: furniture, shadows, other people.

What is silhouette at the same pixels, picture after picture, and lies beside the drawn body is no part of the person: the tracker would have
moved a limb there. After `looks` pictures it no longer counts as evidence, neither for the person nor for their absence. It counts again
near the body, and as soon as it is no silhouette any more: a limb that was lost, and left out, is taken back when it moves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask

REACH = 0.07
"""Distance beside the drawn body that clothes, hair and small errors explain, over the square root of the body's area (some 5 cm)."""
THICK = 0.05
"""Least width of an unexplained part, over the same."""
LARGE = 0.03
"""Least area of an unexplained part, over the drawn body's."""
INSIDE = 0.85
"""Least share of the drawn body inside the silhouette: otherwise the body is misplaced, and says nothing of what lies beside it."""
FORGET = 5
"""An unexplained part is taken back so many times as fast as it was left out, once it is no silhouette any more."""
MOST_LOOKS = 250
"""Greatest number of pictures that is counted."""


class Unexplained(NamedTuple):
    """What one camera's silhouettes have beside the body."""

    counts: NDArray[np.uint8]
    """Number of pictures, at most `looks`, in which each pixel was silhouette and unexplained, of shape (H, W)."""
    left_out: Mask
    """Pixels (H, W) that are left out of the evidence, unless the body is near."""

    def beside(self, drawn: Mask) -> Mask | None:
        """Pixels (H, W) that are left out while the body is `drawn` (H, W); None if there are none."""
        if not self.left_out.any():
            return None
        out = self.left_out & ~near(drawn)
        return out if out.any() else None


def near(drawn: Mask) -> Mask:
    """Pixels (H, W) of a drawn body (H, W), and beside it."""
    import cv2

    radius = max(1, round(REACH * np.count_nonzero(drawn) ** 0.5))
    return np.asarray(cv2.dilate(drawn.view(np.uint8), np.ones((2 * radius + 1,) * 2, np.uint8)), np.uint8).view(np.bool_)


def look_beside(last: Unexplained | None, silhouette: Mask, drawn: Mask, looks: int, ignored: Mask | None = None) -> Unexplained:
    """The unexplained parts after another picture's silhouette (H, W) and the body drawn in its estimated pose (H, W).

    `looks`: number of pictures after which a part is left out; `ignored`: pixels (H, W) of which the body says nothing.
    """
    looks = min(max(looks, 1), MOST_LOOKS)
    counts, left_out = (np.zeros(silhouette.shape, np.uint8), np.zeros(silhouette.shape, bool)) if last is None else last
    area = int(np.count_nonzero(drawn))
    counts = np.where(silhouette, counts, np.maximum(counts, FORGET) - FORGET).astype(np.uint8)
    if area and np.count_nonzero(drawn & silhouette) >= INSIDE * area:
        explained = near(drawn) if ignored is None else near(drawn) | ignored
        beside = _thick(silhouette & ~explained, area)
        counts = np.where(beside, np.minimum(counts, looks - 1) + 1, counts)
        counts[explained & silhouette & ~left_out] = 0
    left_out = (left_out & (counts > 0)) | (counts >= looks)
    return Unexplained(counts, _large(left_out, area) if left_out.any() else left_out)


def _thick(beside: Mask, area: int) -> Mask:
    """The parts of a mask (H, W) that are no narrow rims."""
    import cv2

    size = max(2, round(THICK * area**0.5))
    return np.asarray(cv2.morphologyEx(beside.view(np.uint8), cv2.MORPH_OPEN, np.ones((size, size), np.uint8)), np.uint8).view(np.bool_)


def _large(parts: Mask, area: int) -> Mask:
    """The connected parts of a mask (H, W) that are large enough beside a body of `area` pixels."""
    import cv2

    _, labels, boxes, _ = cv2.connectedComponentsWithStats(parts.view(np.uint8), connectivity=8)
    large = boxes[:, cv2.CC_STAT_AREA] >= max(LARGE * area, 1)
    large[0] = False
    return large[labels]


def looks_in(seconds: float, rate: float) -> int:
    """Number of pictures in a time, at `rate` pictures/s; at least 1 unless the time is 0."""
    return max(1, round(seconds * rate)) if seconds else 0


def settled(unexplained: Unexplained | None, looks: int) -> Unexplained | None:
    """What is left out now, as it is after `looks` pictures; None if nothing is."""
    if unexplained is None or not unexplained.left_out.any() or not looks:
        return None
    return Unexplained((min(looks, MOST_LOOKS) * unexplained.left_out).astype(np.uint8), unexplained.left_out)


def without(mask: Mask, unexplained: Unexplained | None) -> Mask:
    """A mask (H, W) without what is left out."""
    return mask if unexplained is None or not unexplained.left_out.any() else mask & ~unexplained.left_out


def any_left_out(unexplained: Sequence[Unexplained | None]) -> bool:
    """Whether something is left out of any camera's silhouettes."""
    return any(each is not None and bool(each.left_out.any()) for each in unexplained)
