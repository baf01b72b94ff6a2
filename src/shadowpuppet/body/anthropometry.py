"""Published body proportions as fractions of the stature, and the prior on a person's sizes that follows from them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shadowpuppet.body.sizes import CardboxSizes
from shadowpuppet.geometry import Array

AVERAGE_HEIGHT = 1.70
"""Stature (m) if neither height nor distance is known: the mean adult of ANSUR II (Gordon et al. 2014), women and men."""
SOLE = 0.025
"""Height of shoes, included in a given height, metres."""

PROPORTIONS: Mapping[str, tuple[float, float]] = {
    "head_width": (0.095, 0.06), "head_height": (0.143, 0.06), "neck_gap": (0.022, 0.80),
    "shoulder_width": (0.215, 0.15), "torso_bottom_width": (0.184, 0.25), "torso_height": (0.236, 0.10),
    "waist_width": (0.210, 0.20), "waist_height": (0.123, 0.20),
    "head_depth": (0.114, 0.06), "torso_top_depth": (0.120, 0.40), "torso_bottom_depth": (0.155, 0.30), "waist_depth": (0.150, 0.30),
    "upper_arm_length": (0.1605, 0.05), "upper_arm_width": (0.068, 0.30), "forearm_length": (0.254, 0.05),
    "elbow_width": (0.070, 0.30), "hand_width": (0.030, 0.50), "shoulder_inset": (0.007, 4.0),
}  # fmt: skip
"""The 18 sizes as fractions of the stature, and their relative standard deviations among adults.

Arms by de Leva (1996, table 4; means of women and men), heights along the trunk and the hand's length by Drillis & Contini (1966) as
given by Winter (2009, fig. 4.1), breadths and depths rounded from ANSUR II (Gordon et al. 2014); limbs' widths are girths over pi.
Breadths and depths of trunk and limbs vary together from slim to stout: they are left loose, so that together they do not outvote the
lengths, which determine the person's distance."""
SHOULDER_SHARE = (0.103, 0.06)
"""Half the distance between the shoulder joints: half the biacromial breadth of ANSUR II less some 2 cm to the humerus' centre."""
TRUNK_SHARE = (0.518, 0.03)
"""From the crotch to the crown: one less ANSUR II's crotch height, the least variable fraction of all upright measures."""


BONE_SHARES: Mapping[str, tuple[float, float]] = {
    "hip_distance": (0.108, 0.012), "hip_drop": (0.005, 0.008), "hip_forward": (0.0, 0.008),
    "neck_length": (0.072, 0.012), "head_forward": (0.020, 0.010), "head_height": (0.084, 0.006),
    "shoulder_distance": (0.203, 0.012), "shoulder_drop": (0.045, 0.012), "shoulder_forward": (0.010, 0.008),
    "upper_arm_length": (0.1602, 0.008), "forearm_length": (0.1534, 0.008), "hand_point": (0.019, 0.004), "hand_length": (0.090, 0.015),
    "thigh_length": (0.245, 0.010), "shank_length": (0.246, 0.010), "ankle_height": (0.042, 0.006),
}  # fmt: skip
"""Sizes that all whole bodies have, as fractions of the stature, and their standard deviations (also as fractions).

Arms by de Leva (1996, table 4; means of women and men), legs and heights along the trunk by Drillis & Contini (1966) as given by Winter
(2009, fig. 4.1); shoulder joints as `SHOULDER_SHARE`; hip joints and forward offsets from CMU's mocap skeletons."""
CYLINDER_SHARES: Mapping[str, tuple[float, float]] = {
    **BONE_SHARES,
    "trunk_height": (0.308, 0.012), "trunk_width": (0.185, 0.020), "trunk_depth": (0.130, 0.020), "head_width": (0.092, 0.006),
    "upper_arm_width": (0.052, 0.008), "forearm_width": (0.042, 0.006), "thigh_width": (0.090, 0.010), "shank_width": (0.058, 0.007),
}  # fmt: skip
"""Sizes of `cylinders`; each width is about the mean of those along the part in `ANATOMICAL_SHARES`."""
ANATOMICAL_SHARES: Mapping[str, tuple[float, float]] = {
    **BONE_SHARES,
    "lumbar_height": (0.152, 0.012), "thorax_height": (0.156, 0.012), "foot_length": (0.153, 0.006), "toe_out": (0.018, 0.012),
    "pelvis_width": (0.196, 0.015), "pelvis_depth": (0.143, 0.015), "waist_width": (0.180, 0.018), "waist_depth": (0.135, 0.018),
    "chest_width": (0.168, 0.014), "chest_depth": (0.145, 0.014), "shoulder_thickness": (0.062, 0.008), "neck_width": (0.0685, 0.006),
    "head_width": (0.0893, 0.004), "head_depth": (0.115, 0.005), "upper_arm_width": (0.0593, 0.007), "elbow_width": (0.0480, 0.005),
    "forearm_width": (0.0500, 0.005), "wrist_width": (0.0312, 0.003), "hand_width": (0.0496, 0.004), "thigh_width": (0.1130, 0.010),
    "knee_width": (0.0690, 0.006), "calf_width": (0.0700, 0.006), "ankle_width": (0.0419, 0.004), "foot_width": (0.0577, 0.004),
}  # fmt: skip
"""Sizes of `anatomical`; breadths, depths, girths over pi and the foot rounded from ANSUR II (Gordon et al. 2014)."""


def stature_of(lengths: Mapping[str, float]) -> float:
    """Maximum-likelihood stature (m, no shoes) for bone lengths (m) named as in `BONE_SHARES`, at least one."""
    known = [(length, *BONE_SHARES[name]) for name, length in lengths.items() if name in BONE_SHARES]
    return sum(length * share / deviation**2 for length, share, deviation in known) / sum((s / deviation) ** 2 for _, s, deviation in known)


def sizes_from_height(height: float) -> CardboxSizes:
    """The average person's 18 sizes for a height (m, shoes on)."""
    stature = height - SOLE
    return CardboxSizes(**{name: share * stature for name, (share, _) in PROPORTIONS.items()})


@dataclass(frozen=True)
class SizePrior:
    """Prior on the 18 sizes: published proportions of the stature."""

    height: float
    """Metres, shoes on."""

    @cached_property
    def mean(self) -> Array:
        """Expected sizes (18,), metres."""
        return sizes_from_height(self.height).to_array()

    def penalty(self, sizes: Array) -> Array:
        """Squared deviations of sizes (N, 18) from the proportions in units of their variances, summed (N,)."""
        spread = np.array([PROPORTIONS[name][1] for name in CardboxSizes.names()])
        stature, of = self.height - SOLE, {name: i for i, name in enumerate(CardboxSizes.names())}
        joint = sizes[:, of["shoulder_width"]] / 2 - sizes[:, of["shoulder_inset"]]
        trunk = sizes[:, [of["head_height"], of["neck_gap"], of["torso_height"], of["waist_height"]]].sum(1)
        total = (((sizes / self.mean - 1) / spread) ** 2).sum(1)
        for value, (share, deviation) in ((joint, SHOULDER_SHARE), (trunk, TRUNK_SHARE)):
            total += ((value / (share * stature) - 1) / deviation) ** 2
        return total
