"""Which way a person in profile faces: the head, with face and chin, lies before the neck.

A body model whose front and back are alike draws the same whichever way it faces in profile, so that its silhouette says nothing.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.camera.mask import Mask

ABOVE, BELOW = 0.1, 0.4
"""Rows in which the neck is sought, as shares of the silhouette's height."""
NARROW = 0.85
"""Width of the neck over the head's, above which there is no neck to be seen: an arm is before it, or beside the head."""
FEWEST = 4
"""Rows of a head, below which its place is not measured."""


def head_lean(mask: Mask) -> float:
    """How far the middle of the head lies to the image's right of the neck, over the head's height, in a silhouette (H, W) whose largest
    part is the person; NaN if no neck is to be seen."""
    person = _largest(mask)
    rows = np.flatnonzero(person.any(1))
    if not len(rows):
        return np.nan
    width, height = person.sum(1), rows[-1] - rows[0] + 1
    first, last = rows[0] + round(ABOVE * height), rows[0] + round(BELOW * height)
    if first - rows[0] < FEWEST or last <= first:
        return np.nan
    neck = first + int(width[first:last].argmin())
    head = slice(rows[0], neck)
    if not 0 < width[neck] <= NARROW * width[head].max():
        return np.nan
    columns = np.arange(mask.shape[1])
    middle = (person[head] @ columns).sum() / width[head].sum()
    return float((middle - person[neck] @ columns / width[neck]) / (neck - rows[0]))


def _largest(mask: Mask) -> Mask:
    """The largest connected part of a mask (H, W)."""
    import cv2

    number, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    return mask if number < 3 else np.asarray(labels == 1 + stats[1:, cv2.CC_STAT_AREA].argmax())
