"""Standard deviations of joints as a sum of variances, each in proportion to a length that a frame shows."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache
from importlib import resources
from typing import NamedTuple

import numpy as np

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.doubt.limbs import GROUPS, group_of

TABLE = "factors.toml"
"""The factors, as `benchmarks/calibrate_doubt.py` writes them."""
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
    dofs: Mapping[str, float] = field(default_factory=dict[str, float])
    """Factors of the deviations of degrees of freedom, by name without side; 1 of those that are not named."""
    modes: ModeWeights | None = None
    """How probable an arm's other places are; None with several cameras."""

    def sd(self, joints: Sequence[str], components: Components) -> Array:
        """Standard deviations (L, 3), metres, of joints along the components' axes."""
        rows = [self.groups.index(group_of(joint)) for joint in joints]
        lengths = np.stack([components[name] for name in self.names], axis=2)
        return np.sqrt(((self.factors[rows] * lengths) ** 2).sum(2))

    def dof_factors(self, names: Sequence[str]) -> Array:
        """Factors (D,) of the deviations of degrees of freedom."""
        return np.array([self.dofs.get(without_side(name), 1.0) for name in names])


class ModeWeights(NamedTuple):
    """How probable the other places of an arm are."""

    temperature: float
    """Cost (pixels at 320 x 240) for which a place is less probable by the factor e: neighbouring pixels err together."""
    odds: float
    """How much more probable the estimate is than the only other place if that costs the same."""
    growth: float
    """Exponent of the number of other places in the odds: the estimate was chosen from more."""

    def shares(self, more: Array) -> Array:
        """Probabilities (K,) of K other places that cost `more` (K,) pixels than the estimate; the rest is the estimate's."""
        likely = np.exp(-np.clip(more / self.temperature, -10, 30))
        return likely / (self.odds * len(more) ** self.growth + likely.sum()) if len(more) else likely


def without_side(name: str) -> str:
    """A degree of freedom's name without left or right."""
    side, _, rest = name.partition("_")
    return rest if side in SIDES else name


def kind_before_one(body: Body, *, keypoints: bool = False) -> str:
    """The calibrated model of a body before one camera, with silhouettes alone or with `keypoints` beside them."""
    upper, whole = ("both_one", "both_whole") if keypoints else ("monocular", "monocular_whole")
    return whole if body.hem is None else upper


@cache
def variance_model(kind: str) -> VarianceModel:
    """A calibrated model: one that `kind_before_one` or `doubt.multiview.kind_of` names."""
    table = tomllib.loads(resources.files("shadowpuppet.tracking.doubt").joinpath(TABLE).read_text("utf-8"))[kind]
    groups = tuple(group for group in GROUPS if group in table)
    factors = np.array([[table[group][axis] for axis in "xyz"] for group in groups], float)
    return VarianceModel(tuple(table["components"]), groups, factors, table["limits"],
                         table.get("dofs", {}), ModeWeights(**table["modes"]) if "modes" in table else None)


def turned(sd: Array, R: Array) -> Array:
    """Standard deviations (L, 3) along other axes: `R` (3, 3) takes vectors to the new axes from those of `sd`."""
    return np.sqrt(sd**2 @ (R**2).T)
