"""Angles over the gait cycle of healthy adults, for comparison with a run's.

24 young adults (21 to 37 years) at a comfortable speed over ground, right leg: the open data of Fukuchi, Fukuchi & Duarte (2018, PeerJ
6:e4640, doi:10.6084/m9.figshare.5722711, CC BY 4.0), means and standard deviations between people as in the package PhysioGaitNorm.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.evaluation.movement.angles import PERCENT
from shadowpuppet.geometry import Array
from shadowpuppet.synthetic.movement.gait_curves import STANDING_TILT, WALK, curve

PHASES = PERCENT / 100
"""Of the gait cycle."""


class Normal(NamedTuple):
    """An angle of normal walking at each percent of the gait cycle, degrees, with our signs and zeros, each of shape (101,)."""

    mean: Array
    sd: Array
    """Between people."""


class _Source(NamedTuple):
    mean: tuple[float, ...]
    sd: tuple[float, ...]
    zero: float = 0.0
    """Taken off; the mean over the cycle if not a number."""
    left: float = 1.0
    right: float = 1.0
    """Sign in the cycle of each foot: the pelvis' angles are the body's, those of the source the right leg's."""


ADDUCTION = (-1.2, 0.2, 2.6, 5.2, 6.3, 6.1, 5.4, 4.6, 3.7, 3.0, 2.7, 2.4, 1.7, 0.3, -1.8, -4.2, -6.2, -6.2, -4.5, -2.7, -1.4, -0.6,
             -0.5, -0.6, -1.0)  # fmt: skip
ROTATION = (-1.5, -0.7, 0.5, 0.4, 0.1, -1.0, -1.9, -2.4, -2.8, -3.4, -3.7, -4.1, -4.6, -5.5, -6.0, -5.7, -5.0, -4.2, -3.4, -2.3, -1.1,
            -0.2, -0.2, -1.1, -1.8)  # fmt: skip
SOURCES = {
    "pelvis tilt": _Source(WALK["tilt"], (4.9, 5.0, 5.4, 5.5, 5.6, 5.5, 5.4, 5.2, 5.1, 5.1, 5.1, 5.0, 5.0, 5.0, 5.1, 5.2, 5.2, 5.2, 5.1,
                                          4.9, 4.8, 4.8, 4.8, 4.7, 4.6), STANDING_TILT),
    "pelvis list": _Source(WALK["obliquity"], (1.8, 1.9, 1.8, 1.9, 1.9, 1.7, 1.7, 1.6, 1.6, 1.7, 1.8, 1.9, 2.0, 2.1, 2.1, 2.3, 2.5, 2.5,
                                               2.4, 2.3, 2.1, 1.8, 1.7, 1.6, 1.7), right=-1),
    "pelvis rotation": _Source(WALK["rotation"], (2.9, 2.7, 2.3, 2.1, 1.9, 1.7, 1.8, 1.9, 2.1, 2.2, 2.5, 2.9, 3.1, 2.9, 2.5, 2.4, 2.4,
                                                  2.4, 2.2, 2.1, 2.2, 2.4, 2.6, 2.8, 2.9), np.nan, left=-1),
    "hip flexion": _Source(WALK["hip"], (6.3, 6.6, 7.1, 7.2, 7.1, 7.1, 6.9, 6.7, 6.6, 6.8, 6.9, 6.7, 6.7, 6.8, 7.0, 7.3, 7.2, 7.0, 6.6,
                                         6.2, 6.0, 5.9, 5.8, 5.7, 5.6), STANDING_TILT),
    "hip adduction": _Source(ADDUCTION, (3.3, 3.0, 2.9, 3.0, 3.1, 2.9, 2.7, 2.5, 2.4, 2.4, 2.4, 2.5, 2.7, 2.9, 3.1, 3.2, 3.2, 3.0, 2.8,
                                         2.7, 2.8, 2.9, 3.1, 3.2, 3.2)),
    "hip rotation": _Source(ROTATION, (5.4, 4.9, 4.6, 4.6, 4.4, 4.5, 4.5, 4.5, 4.6, 4.5, 4.5, 4.6, 4.6, 4.5, 4.5, 4.6, 4.5, 4.2, 4.2, 4.6,
                                       4.7, 4.8, 5.1, 5.3, 5.5)),
    "knee angle": _Source(WALK["knee"], (3.9, 4.0, 4.9, 5.2, 5.0, 4.9, 4.7, 4.5, 4.2, 4.2, 4.4, 4.5, 4.7, 5.0, 5.9, 6.8, 6.2, 4.5, 3.7,
                                         4.5, 6.0, 7.3, 7.3, 5.5, 3.7)),
    "ankle angle": _Source(WALK["ankle"], (2.7, 2.7, 3.1, 3.3, 3.3, 3.1, 2.9, 2.9, 2.9, 3.1, 3.2, 3.4, 3.5, 4.0, 5.0, 5.2, 5.5, 7.4, 7.0,
                                           5.5, 4.2, 3.1, 2.1, 2.1, 2.6)),
}  # fmt: skip
"""By the name of the angle (`movement.angles`), every 4 % of the cycle. With our zeros a standing pelvis is upright, so that the source's
`STANDING_TILT` is taken off its tilt and the hip's flexion; of the pelvis' rotation only what alternates is compared."""


def normal_walking(angle: str, side: str) -> Normal | None:
    """The angle in the cycle of the foot of a side; None for one that the source does not have."""
    source = SOURCES.get(angle)
    if source is None:
        return None
    mean, sign = curve(source.mean, PHASES), source.left if side == "left" else source.right
    zero = mean[:-1].mean() if np.isnan(source.zero) else source.zero
    return Normal(sign * (mean - zero), curve(source.sd, PHASES))
