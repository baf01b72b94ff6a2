"""A head that never moves: it is taken for scene, unless a head is missing above the shoulders.

Who stands and moves only the arms sways by less than a pixel; the trunk is enclosed by what the arms pass over, the head is not.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.silhouette.recovery.legs import largest_part
from shadowpuppet.silhouette.recovery.movement import Mask

UPPER, SHOULDERS = 0.4, 0.6
"""Share of the trunk's height in which it is widest at the shoulders, and share of that width from which on a row belongs to them: the head
is narrower."""
WIDTH, HEIGHT = 0.38, 0.55
"""Width of a head, and height of crown over shoulders, over the width of the trunk at the shoulders (ANSUR II; Gordon et al. 2014)."""
STANDS = 0.4
"""Least area of the trunk over that of the person in most frames: of one who walks less is covered always."""
MISSING, OFTEN = 0.35, 0.5
"""Share of a head's pixels that are the person's in a share `OFTEN` of the frames, below which there is none."""


def missing_head(covered: Mask, passing: Mask) -> Mask | None:
    """The pixels (H, W) where a head must be above a trunk that has none; None if there is one, or none is in the picture.

    covered: pixels (H, W) taken for covered in all frames, whose largest part is the trunk; passing: pixels (N, H, W) that something passes
    over in each frame.
    """
    import cv2

    trunk, person = largest_part(covered), passing | covered
    if trunk is None or np.count_nonzero(trunk) < STANDS * np.median(person.sum(axis=(1, 2))):
        return None
    widths = trunk.sum(axis=1)
    rows = np.flatnonzero(widths)
    width = int(widths[rows[0] : rows[0] + max(1, round(UPPER * len(rows)))].max())
    shoulder = int(np.argmax(widths >= SHOULDERS * width))
    middle = float(np.flatnonzero(trunk[shoulder : shoulder + max(1, width // 4)].any(axis=0)).mean())
    half = HEIGHT * width / 2
    head = np.zeros(covered.shape, np.uint8)
    cv2.ellipse(head, (round(middle), round(shoulder - half)), (round(WIDTH * width / 2), round(half)), 0, 0, 360, 1, -1)
    found = head > 0
    if shoulder < half or not found.any():
        return None
    return None if (person.mean(axis=0) >= OFTEN)[found].mean() >= MISSING else found
