"""Standard deviations of joints as a sum of variances, each in proportion to a length that a frame shows."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources

import numpy as np

from shadowpuppet.geometry import Array
from shadowpuppet.tracking.doubt.limbs import GROUPS, group_of

TABLE = "factors.toml"
"""The factors, as `benchmarks/calibrate_doubt.py` writes them."""
LIKE = {"hip": "shoulder", "knee": "elbow", "ankle": "hand"}
"""Groups of the arms whose factors the legs' have where none are calibrated: one camera is calibrated on upper bodies."""
Components = Mapping[str, Array]
"""Lengths (L, 3), metres, by name: of each joint along each of three axes."""


@dataclass(frozen=True, eq=False)
class VarianceModel:
    """The variance of a joint along an axis is the sum over components of (factor x length)^2.

    The factors are the same for all recordings and people. They are chosen so that +-1.645 standard deviations hold 90 % of the errors on
    made recordings, clean and spoiled, at the least mean interval score (Gneiting and Raftery 2007).
    """

    names: tuple[str, ...]
    """Names of the F components."""
    groups: tuple[str, ...]
    """Groups of joints, G of them."""
    factors: Array
    """Of shape (G, 3, F), no unit."""
    limits: Mapping[str, float]
    """Of each kind of limb, `trunk`, `arm` or `leg`: deviation of a joint, all axes together (m), above which it is doubtful."""

    def sd(self, joints: Sequence[str], components: Components) -> Array:
        """Standard deviations (L, 3), metres, of joints along the components' axes."""
        rows = [self.groups.index(group_of(joint)) for joint in joints]
        lengths = np.stack([components[name] for name in self.names], axis=2)
        return np.sqrt(((self.factors[rows] * lengths) ** 2).sum(2))


@cache
def variance_model(kind: str) -> VarianceModel:
    """The calibrated model of `monocular` or `multiview` tracking."""
    table = tomllib.loads(resources.files("shadowpuppet.tracking.doubt").joinpath(TABLE).read_text("utf-8"))[kind]
    own = [table[group if group in table else LIKE[group]] for group in GROUPS]
    factors = np.array([[group[axis] for axis in "xyz"] for group in own], float)
    return VarianceModel(tuple(table["components"]), tuple(GROUPS), factors, {"leg": table["limits"]["arm"], **table["limits"]})


def turned(sd: Array, R: Array) -> Array:
    """Standard deviations (L, 3) along other axes: `R` (3, 3) takes vectors to the new axes from those of `sd`."""
    return np.sqrt(sd**2 @ (R**2).T)
