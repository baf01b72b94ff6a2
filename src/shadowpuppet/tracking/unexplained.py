"""Parts of the silhouettes that the fitted body leaves unexplained for some time: furniture, shadows, other people.

What is silhouette at the same pixels, picture after picture, and lies beside the drawn body is no part of the person, if the silhouette
has grown by it: a limb that the tracker lost adds no area. After `looks` pictures it no longer counts as evidence, neither for the person
nor for their absence. It counts again near the body, and once it is no silhouette any more.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.camera.mask import Mask, grown, may_be_person

REACH = 0.07
"""Distance beside the drawn body that clothes, hair and small errors explain, over the square root of the body's area (some 5 cm)."""
THICK = 0.05
"""Least width of an unexplained part, over the same."""
LARGE = 0.03
"""Least area of an unexplained part, over the drawn body's."""
INSIDE = 0.85
"""Least share of the drawn body inside the silhouette: otherwise the body is misplaced, and says nothing of what lies beside it."""
MORE = 0.25
"""Least growth of the silhouette's area, in areas of the drawn body, by which something came beside the person: a limb that the body
misses adds less."""
FORGET = 5
"""Speed at which a part that is no silhouette any more is taken back, over that at which it was left out."""
MOST_LOOKS = 250
"""Greatest number of pictures that is counted."""


class Unexplained(NamedTuple):
    """What one camera's silhouettes have beside the body."""

    counts: NDArray[np.uint8]
    """Number of pictures, at most `looks`, in which each pixel was silhouette and unexplained, of shape (H, W)."""
    stays: Mask
    """Pixels (H, W) that have been unexplained for `looks` pictures."""
    left_out: Mask
    """The large parts of them, if they came while the body was tracked: left out of the evidence, unless the body is near."""
    ratio: float = 1.0
    """Area of the silhouette over that of the drawn body, smoothed over time."""
    least: float = np.inf
    """The least of it so far."""
    seen: int = 0
    """Number of pictures with a body that lies in the silhouette."""

    def beside(self, drawn: Mask) -> Mask | None:
        """Pixels (H, W) that are left out while the body is `drawn` (H, W); None if there are none."""
        out = self.left_out & ~near(drawn)
        return out if out.any() else None


def margin_of(area: int) -> int:
    """Width (pixels) of what counts as near a drawn body of an area (pixels)."""
    return max(1, round(REACH * area**0.5))


def near(drawn: Mask) -> Mask:
    """Pixels (H, W) of a drawn body (H, W), and beside it."""
    return grown(drawn, margin_of(int(np.count_nonzero(drawn))))


def look_beside(last: Unexplained | None, silhouette: Mask, drawn: Mask, looks: int, ignored: Mask | None = None) -> Unexplained:
    """The unexplained parts after another picture's silhouette (H, W) and the body drawn in its estimated pose (H, W).

    `looks`: number of pictures after which a part is left out; `ignored`: pixels (H, W) of which the body says nothing. Nothing is drawn
    while the person is absent: what is no silhouette any more is then forgotten, too.
    """
    looks = min(max(looks, 1), MOST_LOOKS)
    nothing = np.zeros(silhouette.shape, bool)
    last = last or Unexplained(nothing.astype(np.uint8), nothing, nothing)
    if silhouette.any() and not may_be_person(silhouette):
        return last  # nearly all of the picture: the light went out
    area = int(np.count_nonzero(drawn))
    counts = np.where(silhouette, last.counts, np.maximum(last.counts, FORGET) - FORGET).astype(np.uint8)
    ratio, least, seen = last.ratio, last.least, last.seen
    if area and np.count_nonzero(drawn & silhouette) >= INSIDE * area:
        explained = near(drawn) if ignored is None else near(drawn) | ignored
        beside = _thick(silhouette & ~explained, area)
        counts = np.where(beside, np.minimum(counts, looks - 1) + 1, counts)
        counts[explained & silhouette & ~last.left_out] = 0
        now = np.count_nonzero(silhouette if ignored is None else silhouette & ~ignored) / area
        ratio, seen = ratio + (now - ratio) / min(seen + 1, looks), seen + 1
        least = min(least, ratio) if seen >= looks else least
    stays = (last.stays & (counts > 0)) | (counts >= looks)
    came = ratio >= least + MORE and stays.any()
    return Unexplained(counts, stays, _large(stays, area) if came else nothing, ratio, least, seen)


def _thick(beside: Mask, area: int) -> Mask:
    """The parts of a mask (H, W) that are no narrow rims."""
    import cv2

    size = max(2, round(THICK * area**0.5))
    square = np.ones((size, size), np.uint8)  # its size may be even: the opposite anchors keep the parts where they are
    thick = cv2.dilate(cv2.erode(beside.view(np.uint8), square, anchor=(0, 0)), square, anchor=(size - 1, size - 1))
    return np.asarray(thick, np.uint8).view(np.bool_)


def _large(parts: Mask, area: int) -> Mask:
    """The connected parts of a mask (H, W) that are large enough beside a body of `area` pixels."""
    import cv2

    x, y, width, height = cv2.boundingRect(parts.view(np.uint8))
    window, out = (slice(y, y + height), slice(x, x + width)), np.zeros_like(parts)
    _, found, boxes, _ = cv2.connectedComponentsWithStats(np.ascontiguousarray(parts[window]).view(np.uint8), connectivity=8)
    large = boxes[:, cv2.CC_STAT_AREA] >= max(LARGE * area, 1)
    large[0] = False
    out[window] = large[np.asarray(found, np.intp)]
    return out


def looks_in(seconds: float, rate: float) -> int:
    """Number of pictures in a time, at `rate` pictures/s; at least 1 unless the time is 0."""
    return max(1, round(seconds * rate)) if seconds else 0


def left_out(unexplained: Unexplained | None) -> Mask | None:
    """Pixels (H, W) that are left out; None if there are none."""
    return None if unexplained is None or not unexplained.left_out.any() else unexplained.left_out


def without(mask: Mask, unexplained: Unexplained | None) -> Mask:
    """A mask (H, W) without what is left out."""
    return mask if unexplained is None or not unexplained.left_out.any() else mask & ~unexplained.left_out
