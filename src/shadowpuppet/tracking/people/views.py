"""The views of a frame set that show one of several people apart from the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.camera.mask import Mask
from shadowpuppet.tracking.people.figures import Figure, drawn
from shadowpuppet.tracking.people.floor import Floor

OVERLAPPED = 0.03
"""Share of a person's figure in a view that may be another's too: otherwise the view does not show them apart."""
COVERED = 0.4
"""Least share of what a view shows of a person that their figure covers: otherwise there is more, as another person."""

View = tuple[Mask | None, ...]


def views_of(floor: Floor, figure: Figure, others: Sequence[Figure], masks: Sequence[Mask | None]) -> View:
    """The silhouettes (H, W) of one person by camera: the connected parts of the mask on which their figure lies. None for a camera that
    does not show them, or shows others or more there too."""
    own, theirs = drawn(floor, figure), [drawn(floor, other) for other in others]
    found = list[Mask | None]()
    for n, mask in enumerate(masks):
        parts = None if mask is None else _parts_at(mask, own[n])
        if parts is not None:
            rest = np.logical_or.reduce([np.zeros_like(own[n]), *(each[n] for each in theirs)])
            shared = np.count_nonzero(parts & _full(rest, parts))
            area, covered = np.count_nonzero(parts), np.count_nonzero(parts & _full(own[n], parts))
            parts = None if shared > OVERLAPPED * area or covered < max(COVERED * area, 1) else parts
        found.append(parts)
    return tuple(found)


def _parts_at(mask: Mask, small: Mask) -> Mask:
    """The connected parts of a mask (H, W) that touch pixels of half the size (H / 2, W / 2)."""
    import cv2

    number, found = cv2.connectedComponents(np.ascontiguousarray(mask).view(np.uint8), connectivity=8)
    labels = np.asarray(found, np.int64)
    chosen = np.zeros(number, bool)
    chosen[np.unique(labels[_full(small, mask)])] = True
    chosen[0] = False
    return chosen[labels]


def _full(small: Mask, mask: Mask) -> Mask:
    """Pixels of half the size (H / 2, W / 2) in the size of a mask (H, W)."""
    return small.repeat(2, 0).repeat(2, 1)[: mask.shape[0], : mask.shape[1]]
