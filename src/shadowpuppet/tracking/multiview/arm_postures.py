"""How usual the postures of both arms are among people (not in Ni 2008): it chooses between places of an arm that silhouettes do not tell
apart, as a hand behind the hip and the same before the trunk.

An arm's posture is the directions of its upper arm and forearm in the trunk's frame, so that it is the same for all bodies. Its density is
a mixture of normal distributions, fitted to motion capture of other people by `benchmarks/fit_arm_postures.py`, and a share of a uniform
one, for postures that are not in that data.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources

import numpy as np

from shadowpuppet.geometry import Array, unit

TABLE = "arm_postures.toml"
"""The mixture, as `benchmarks/fit_arm_postures.py` writes it."""
JOINTS = ("pelvis", "neck", *(f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist")))
"""Joints that arm directions are computed from."""
UNKNOWN = 0.1
"""Share of the uniform distribution."""
THICKNESS = 0.12
"""Standard deviation of directions' lengths that the uniform distribution is given: as the least one of the mixture's."""
MIRRORED = np.array([-1.0, 1, 1, -1, 1, 1])


def arm_directions(joints: Array) -> Array:
    """Directions of upper arm and forearm (..., 2, 6) of both arms, from `JOINTS` (..., 8, 3), world: to the right, forward, and up in the
    trunk's frame. A left arm is mirrored: both are right ones."""
    pelvis, neck, *arms = np.moveaxis(joints, -2, 0)
    up = unit(neck - pelvis)
    across = arms[3] - arms[0]
    right = unit(across - (across * up).sum(-1, keepdims=True) * up)
    frame = np.stack([right, np.cross(up, right), up], -2)
    found = []
    for shoulder, elbow, wrist in (arms[:3], arms[3:]):
        bones = np.stack([unit(elbow - shoulder), unit(wrist - elbow)], -2)
        found.append(np.einsum("...ij,...bj->...bi", frame, bones).reshape(*bones.shape[:-2], 6))
    return np.stack([found[0] * MIRRORED, found[1]], -2)


@dataclass(frozen=True, eq=False)
class ArmPostures:
    """Density of an arm's directions: K components."""

    weights: Array
    """Of shape (K,); their sum is about 1."""
    means: Array
    """Of shape (K, 6)."""
    covariances: Array
    """Of shape (K, 6, 6)."""

    def rarity(self, directions: Array) -> Array:
        """How rare directions (N, 6) are, (N,): minus the log density, less that of the most usual of the components' means; at least 0."""
        return np.maximum(-self.log_density(directions) + self._greatest, 0)

    def log_density(self, directions: Array) -> Array:
        """Log density (N,) of directions (N, 6)."""
        off, (precisions, scales) = directions[:, None] - self.means, self._constants
        normal = -0.5 * (np.einsum("nki,kij,nkj->nk", off, precisions, off, optimize=True) + scales) + np.log(self.weights * (1 - UNKNOWN))
        uniform = np.log(UNKNOWN) - 2 * np.log(4 * np.pi) - np.log(2 * np.pi * THICKNESS**2)  # on two spheres of some thickness
        return np.logaddexp(np.logaddexp.reduce(normal, axis=1), uniform)

    @cached_property
    def _constants(self) -> tuple[Array, Array]:
        """Inverse covariances (K, 6, 6), and the log determinants of 2 pi times the covariances (K,)."""
        log_determinants = np.asarray(np.linalg.slogdet(self.covariances)[1], float)
        return np.asarray(np.linalg.inv(self.covariances), float), log_determinants + 6 * np.log(2 * np.pi)

    @cached_property
    def _greatest(self) -> float:
        """Log density at the most usual of the components' means."""
        return float(self.log_density(self.means).max())


@cache
def usual_arm_postures() -> ArmPostures:
    """The mixture of `TABLE`."""
    table = tomllib.loads(resources.files("shadowpuppet.tracking.multiview").joinpath(TABLE).read_text("utf-8"))
    parts = table["components"]
    return ArmPostures(*(np.array([part[name] for part in parts], float) for name in ("weight", "mean", "covariance")))
