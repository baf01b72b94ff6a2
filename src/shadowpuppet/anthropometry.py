"""What is known of a person's sizes before they are seen: published body proportions, as fractions of the stature."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.sizes import CardboxSizes

AVERAGE_HEIGHT = 1.70
"""Stature (m) taken where neither height nor distance is known: the mean adult of ANSUR II (Gordon et al. 2014), women and men."""
SOLE = 0.025
"""What shoes add to the height that is given, metres."""

PROPORTIONS: Mapping[str, tuple[float, float]] = {
    "head_width": (0.095, 0.06), "head_height": (0.143, 0.06), "neck_gap": (0.022, 0.80),
    "shoulder_width": (0.215, 0.15), "torso_bottom_width": (0.184, 0.25), "torso_height": (0.236, 0.10),
    "waist_width": (0.210, 0.20), "waist_height": (0.123, 0.20),
    "head_depth": (0.114, 0.06), "torso_top_depth": (0.120, 0.40), "torso_bottom_depth": (0.155, 0.30), "waist_depth": (0.150, 0.30),
    "upper_arm_length": (0.1605, 0.05), "upper_arm_width": (0.068, 0.30), "forearm_length": (0.254, 0.05),
    "elbow_width": (0.070, 0.30), "hand_width": (0.030, 0.50), "shoulder_inset": (0.007, 4.0),
}  # fmt: skip
"""Every size as a fraction of the stature, and its relative standard deviation among adults.

Arms by de Leva (1996, table 4; means of women and men), heights along the trunk and the hand's length by Drillis & Contini (1966) as
given by Winter (2009, fig. 4.1), breadths and depths rounded from ANSUR II (Gordon et al. 2014); limbs' widths are girths over pi.
Breadths and depths of trunk and limbs vary together from slim to stout: they are left loose, so that many of them do not outvote the
lengths, which tell how far away the person stands.
"""
SHOULDER_JOINT = (0.103, 0.06)
"""Half the distance of the shoulders' joints: half the biacromial breadth of ANSUR II less some 2 cm to the humerus' centre."""
TRUNK = (0.518, 0.03)
"""From the crotch to the crown: one less ANSUR II's crotch height. Of all upright measures the steadiest fraction of stature."""

def sizes_from_height(height: float) -> CardboxSizes:
    """Sizes of the average person of a height (m, shoes on)."""
    stature = height - SOLE
    return CardboxSizes(**{name: share * stature for name, (share, _) in PROPORTIONS.items()})


@dataclass(frozen=True)
class SizePrior:
    """What is known of a person's sizes before they are seen: proportions of the stature."""

    height: float
    """Metres, shoes on."""

    @cached_property
    def mean(self) -> Array:
        """Expected sizes (18,), metres."""
        return sizes_from_height(self.height).to_array()

    def penalty(self, sizes: Array) -> Array:
        """Squared deviations (N,) of sizes (N, 18), summed, in units of their variances."""
        spread = np.array([PROPORTIONS[name][1] for name in CardboxSizes.names()])
        stature, of = self.height - SOLE, {name: i for i, name in enumerate(CardboxSizes.names())}
        joint = sizes[:, of["shoulder_width"]] / 2 - sizes[:, of["shoulder_inset"]]
        trunk = sizes[:, [of["head_height"], of["neck_gap"], of["torso_height"], of["waist_height"]]].sum(1)
        total = (((sizes / self.mean - 1) / spread) ** 2).sum(1)
        for value, (share, deviation) in ((joint, SHOULDER_JOINT), (trunk, TRUNK)):
            total += ((value / (share * stature) - 1) / deviation) ** 2
        return total
