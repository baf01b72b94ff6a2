"""Eq. 2 by OpenCV: the same polygons of the same poses, made beforehand, with corners at whole pixels."""

from __future__ import annotations

import numpy as np

from shadowpuppet.geometry import Array

from .mono_cases import MonoCase


class OpenCV:
    """Costs by `fillConvexPoly`, `bitwise_xor` and `countNonZero`; polygons, masks and buffers are made beforehand and not timed."""

    def __init__(self, case: MonoCase) -> None:
        """Prepare everything but the drawing."""
        corners, counts = case.picture.polygons(case.picture.transforms(case.poses), case.partial.moving)
        self.polygons = [[np.rint(c[:m]).astype(np.int32) for c, m in zip(*pair) if m] for pair in zip(corners, counts)]
        self.mask, self.fixed = case.mask.astype(np.uint8), case.fixed.astype(np.uint8)
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
