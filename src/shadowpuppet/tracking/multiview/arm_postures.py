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
from shadowpuppet.jit import device, kernel

TABLE = "arm_postures.toml"
"""The mixture, as `benchmarks/fit_arm_postures.py` writes it."""
JOINTS = ("pelvis", "neck", *(f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist")))
"""Joints that arm directions are computed from."""
UNKNOWN = 0.1
"""Share of the uniform distribution."""
THICKNESS = 0.12
"""Standard deviation of directions' lengths that the uniform distribution is given: as the least one of the mixture's."""
UNIFORM = float(np.log(UNKNOWN) - 2 * np.log(4 * np.pi) - np.log(2 * np.pi * THICKNESS**2))
"""Log density of the uniform distribution's share, on two spheres of some thickness."""
MIRRORED = np.array([-1.0, 1, 1, -1, 1, 1])


def arm_directions(joints: Array) -> Array:
    """Directions of upper arm and forearm (..., 2, 6) of both arms, from `JOINTS` (..., 8, 3), world: to the right, forward, and up in the
    trunk's frame. A left arm is mirrored: both are right ones."""
    pelvis, neck, *arms = np.moveaxis(joints, -2, 0)
    frame = trunk_frame(pelvis, neck, arms[0], arms[3])
    found = []
    for shoulder, elbow, wrist in (arms[:3], arms[3:]):
        bones = np.stack([unit(elbow - shoulder), unit(wrist - elbow)], -2)
        found.append(np.einsum("...ij,...bj->...bi", frame, bones).reshape(*bones.shape[:-2], 6))
    return np.stack([found[0] * MIRRORED, found[1]], -2)


def trunk_frame(pelvis: Array, neck: Array, left_shoulder: Array, right_shoulder: Array) -> Array:
    """Axes (..., 3, 3) of the trunk, to the right, forward and up, as rows, world, from joints (..., 3)."""
    up = unit(neck - pelvis)
    across = right_shoulder - left_shoulder
    right = unit(across - (across * up).sum(-1, keepdims=True) * up)
    return np.stack([right, np.cross(up, right), up], -2)


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
        return np.logaddexp(np.logaddexp.reduce(normal, axis=1), UNIFORM)

    def rarity_of_both(self, joints: Array) -> Array:
        """How rare both arms' postures are together (N,), from `JOINTS` (N, 8, 3): `rarity` of `arm_directions`, summed, by a kernel."""
        out = np.empty(len(joints))
        precisions, scales = self._constants
        offsets = np.log(self.weights * (1 - UNKNOWN)) - 0.5 * scales
        _rarities(joints, self.means, precisions, offsets, UNIFORM, self._greatest, out)
        return out

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


@kernel
def _rarities(joints, means, precisions, offsets, uniform, greatest, out):  # pragma: no cover
    """Fill `out` (N,) as `ArmPostures.rarity_of_both`; `offsets` (K,): each component's log density at its mean."""
    for n in range(joints.shape[0]):
        at = joints[n]
        rx, ry, rz, fx, fy, fz, ux, uy, uz = trunk_axes(at[0], at[1], at[2], at[5])
        out[n] = 0.0
        for side in range(2):
            j, mirrored = 2 + 3 * side, 2.0 * side - 1.0
            x, y, z = direction(at[j], at[j + 1])
            a, b, c = mirrored * (rx * x + ry * y + rz * z), fx * x + fy * y + fz * z, ux * x + uy * y + uz * z
            x, y, z = direction(at[j + 1], at[j + 2])
            d, e, f = mirrored * (rx * x + ry * y + rz * z), fx * x + fy * y + fz * z, ux * x + uy * y + uz * z
            density = uniform
            for k in range(means.shape[0]):
                P, m = precisions[k], means[k]
                p, q, r, s, t, u = a - m[0], b - m[1], c - m[2], d - m[3], e - m[4], f - m[5]
                away = (p * (P[0, 0] * p + 2 * (P[0, 1] * q + P[0, 2] * r + P[0, 3] * s + P[0, 4] * t + P[0, 5] * u))
                        + q * (P[1, 1] * q + 2 * (P[1, 2] * r + P[1, 3] * s + P[1, 4] * t + P[1, 5] * u))
                        + r * (P[2, 2] * r + 2 * (P[2, 3] * s + P[2, 4] * t + P[2, 5] * u))
                        + s * (P[3, 3] * s + 2 * (P[3, 4] * t + P[3, 5] * u))
                        + t * (P[4, 4] * t + 2 * P[4, 5] * u) + u * P[5, 5] * u)  # fmt: skip
                density = log_added(density, offsets[k] - 0.5 * away)
            out[n] += max(greatest - density, 0.0)


@device
def log_added(first, second):  # pragma: no cover
    """Logarithm of the sum of two numbers, from their logarithms."""
    high, low = max(first, second), min(first, second)
    return high + np.log1p(np.exp(low - high))


@device
def trunk_axes(pelvis, neck, left_shoulder, right_shoulder):  # pragma: no cover
    """The rows of `trunk_frame` (3, 3), one after another, from joints (3,)."""
    ux, uy, uz = direction(pelvis, neck)
    ax, ay, az = right_shoulder[0] - left_shoulder[0], right_shoulder[1] - left_shoulder[1], right_shoulder[2] - left_shoulder[2]
    along = ax * ux + ay * uy + az * uz
    rx, ry, rz = _unit(ax - along * ux, ay - along * uy, az - along * uz)
    return rx, ry, rz, uy * rz - uz * ry, uz * rx - ux * rz, ux * ry - uy * rx, ux, uy, uz


@device
def direction(start, end):  # pragma: no cover
    """Unit vector from one place (3,) to another."""
    return _unit(end[0] - start[0], end[1] - start[1], end[2] - start[2])


@device
def _unit(x, y, z):  # pragma: no cover
    """A vector of length 1 that way."""
    length = max(np.sqrt(x * x + y * y + z * z), 1e-12)
    return x / length, y / length, z / length
