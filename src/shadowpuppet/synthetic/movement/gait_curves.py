"""Published joint angles over the gait cycle, as data.

A cycle runs from a foot's contact with the floor (0) to its next (1). Curves are means over people, degrees, every 4 % of the cycle,
interpolated by periodic cubics.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

from shadowpuppet.geometry import Array

STANDING_TILT = 10.0
"""Forward tilt of the pelvis in quiet standing as `WALK` measures it, degrees; here a standing pelvis is upright."""
KNEE_ZERO = 3.0
"""Offset of `WALK`'s knee against overstretching, degrees; zeros of marker sets differ by more than that."""

WALK = {
    "tilt": (11.1, 11.1, 10.8, 10.3, 10.0, 10.1, 10.2, 10.1, 10.1, 10.3, 10.6, 10.9, 10.9, 10.8, 10.6, 10.1, 9.6, 9.5, 9.6, 9.7,
             9.8, 10.1, 10.5, 11.0, 11.3),
    "obliquity": (1.0, 2.0, 3.6, 4.9, 5.2, 4.4, 3.0, 1.5, 0.1, -0.8, -1.1, -1.2, -1.3, -1.9, -3.2, -4.7, -5.7, -5.6, -4.4, -2.9,
                  -1.5, -0.3, 0.3, 0.4, 0.5),
    "rotation": (6.3, 6.6, 5.5, 4.2, 3.9, 4.0, 3.4, 2.0, 0.5, -1.1, -2.6, -4.2, -5.7, -6.5, -6.3, -5.2, -4.4, -4.5, -4.4, -3.4,
                 -1.8, -0.1, 1.6, 3.2, 4.7),
    "hip": (30.5, 30.1, 29.5, 27.3, 22.9, 18.6, 14.3, 9.8, 5.7, 2.2, -1.0, -3.8, -6.0, -7.5, -7.4, -4.2, 2.1, 9.9, 17.6, 23.7,
            27.9, 30.7, 31.9, 31.5, 30.5),
    "knee": (0.1, 5.1, 10.8, 14.7, 13.9, 12.0, 9.7, 7.3, 5.3, 4.0, 3.5, 4.1, 6.4, 10.7, 18.0, 30.0, 44.5, 56.3, 61.9, 60.9, 54.0,
             42.3, 27.4, 11.7, 0.4),
    "ankle": (0.9, -3.1, -4.0, 0.1, 3.1, 5.3, 6.8, 8.1, 9.4, 10.7, 12.2, 13.1, 12.9, 10.6, 4.4, -6.2, -13.0, -10.2, -4.1, 1.4, 5.0,
              6.4, 5.6, 3.1, 1.0),
}  # fmt: skip
"""Walking at a comfortable speed: means of 24 young adults over ground, right leg, of the open data of Fukuchi, Fukuchi & Duarte
(2018, PeerJ 6:e4640, CC BY 4.0), as averaged in the package PhysioGaitNorm. Pelvis: forward tilt, right side up, right side
forward. Hip against the pelvis, knee: flexion; ankle: dorsiflexion."""

RUN = {
    "hip": (25.0, 23.4, 22.5, 21.6, 18.4, 12.9, 6.6, 0.6, -4.4, -7.6, -8.6, -8.1, -6.2, -3.5, 0.0, 5.0, 11.7, 19.3, 26.2, 31.1, 33.8,
            34.3, 32.2, 29.6, 27.5),
    "knee": (10.7, 17.9, 27.9, 35.9, 37.9, 35.5, 30.1, 23.8, 18.5, 15.6, 16.4, 21.5, 31.5, 44.0, 56.8, 68.5, 77.9, 83.0, 82.2, 75.6,
             63.8, 48.3, 31.2, 17.6, 10.1),
    "ankle": (5.3, 3.3, 8.1, 15.0, 20.1, 22.6, 21.5, 16.2, 6.9, -3.6, -12.4, -18.0, -18.0, -14.1, -10.6, -7.0, -3.0, 1.0, 4.2, 6.2,
              7.3, 7.3, 6.0, 6.0, 6.2),
}  # fmt: skip
"""Running on a treadmill: means of four runners of the open data of Fukuchi, Fukuchi & Duarte (2017, PeerJ 5:e3298, CC BY 4.0), as
processed in R. Fukuchi's repository BMC-RIC-running-biomechanics. Zeros are those of standing."""


def curve(values: tuple[float, ...], phase: Array) -> Array:
    """A curve of `WALK` or `RUN`, degrees, at phases (...) of the cycle; integers are contacts."""
    return _spline(values)(np.asarray(phase) % 1.0)


@cache
def _spline(values: tuple[float, ...]) -> Callable[[Array], Array]:
    from scipy.interpolate import CubicSpline

    return CubicSpline(np.linspace(0, 1, len(values) + 1), [*values, values[0]], bc_type="periodic")
