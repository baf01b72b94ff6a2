"""Eq. 2 by OpenCV: the same polygons of the same poses, ready-made, at whole pixels."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.evaluation.bench.mono_cases import Case
from shadowpuppet.geometry import Array

Polygons = list[list[NDArray[np.int32]]]
"""For each pose, polygons (K, 2) with whole corners."""


def whole_polygons(case: Case) -> Polygons:
    """What the case draws for every pose."""
    corners, counts = case.picture.polygons(case.picture.transforms(case.poses), case.partial.moving)
    return [[np.rint(c[:m]).astype(np.int32) for c, m in zip(*pair) if m] for pair in zip(corners, counts)]


class OpenCV:
    """`fillConvexPoly`, `bitwise_xor` and `countNonZero`, with everything ready beforehand but the drawing."""

    def __init__(self, case: Case) -> None:
        """Polygons, masks and buffers are made here and not timed."""
        self.polygons, self.mask, self.fixed = whole_polygons(case), case.mask.astype(np.uint8), case.fixed.astype(np.uint8)
        self.empty = not self.fixed.any()
        self.drawn, self.differs = np.empty_like(self.fixed), np.empty_like(self.fixed)

    def run(self) -> Array:
        """Costs (N,), pixels."""
        import cv2

        out = np.empty(len(self.polygons))
        for n, shapes in enumerate(self.polygons):
            if self.empty:
                self.drawn.fill(0)
            else:
                np.copyto(self.drawn, self.fixed)
            for shape in shapes:
                cv2.fillConvexPoly(self.drawn, shape, 1)
            cv2.bitwise_xor(self.drawn, self.mask, self.differs)
            out[n] = cv2.countNonZero(self.differs)
        return out


@contextmanager
def one_thread() -> Iterator[None]:
    """OpenCV works in one thread here."""
    import cv2

    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    try:
        yield
    finally:
        cv2.setNumThreads(threads)
