"""How usual a posture of the whole body is among people (not in Ni 2008): it chooses between postures that few cameras do not tell apart.

A posture is the directions of upper arms, forearms, thighs and shanks in the trunk's frame, and that of the world's up: the same for all
bodies, places and headings. Its density is a mixture of normal distributions, fitted to motion capture of other people by
`benchmarks/fit_body_postures.py`; each component counts as it is and mirrored, so a mirrored person's posture is as usual. Below a floor
all postures are equally rare: what that data does not contain is not forbidden.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from importlib import resources

import numpy as np

from shadowpuppet.geometry import Array, unit
from shadowpuppet.jit import device, kernel
from shadowpuppet.tracking.multiview.arm_postures import direction, log_added, trunk_axes, trunk_frame

TABLE = "body_postures.npz"
"""The mixture, as `benchmarks/fit_body_postures.py` writes it."""
LIMBS = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))
JOINTS = ("pelvis", "neck", *(f"{side}_{joint}" for side in ("left", "right") for limb in LIMBS for joint in limb))
"""Joints that directions are computed from: trunk, left arm, left leg, right arm, right leg."""
D = 27
"""Numbers that describe a posture: two directions for each of four limbs, and up."""
FLOOR = 25.0
"""Log density of the rarest postures below that of the components' means, their median."""
NEGLIGIBLE = 30.0
"""A component whose log density is less than the sum's by this is left out: e^-30 of it."""


def body_directions(joints: Array) -> Array:
    """Directions (..., 27) from `JOINTS` (..., 14, 3), world: of left upper arm, forearm, thigh and shank, the right ones, and the world's
    up; each to the right, forward and up in the trunk's frame."""
    at = np.moveaxis(joints, -2, 0)
    frame = trunk_frame(at[0], at[1], at[2], at[8])
    bones = [unit(at[j + 1] - at[j]) for first in (2, 5, 8, 11) for j in (first, first + 1)]
    directions = np.stack([*bones, np.broadcast_to([0.0, 0.0, 1.0], at[0].shape)], -2)
    return np.einsum("...ij,...bj->...bi", frame, directions).reshape(*directions.shape[:-2], D)


def mirrored(directions: Array) -> Array:
    """Directions (..., 27) of the mirrored person."""
    left, right, up = directions[..., :12], directions[..., 12:24], directions[..., 24:]
    return np.concatenate([right, left, up], -1) * np.tile([-1.0, 1, 1], D // 3)


@dataclass(frozen=True, eq=False)
class BodyPostures:
    """Density of directions: K components, each as it is and mirrored."""

    weights: Array
    """Of shape (K,); their sum is about 1."""
    means: Array
    """Of shape (K, 27)."""
    covariances: Array
    """Of shape (K, 27, 27)."""

    def rarity(self, directions: Array) -> Array:
        """How rare directions (N, 27) are, (N,): minus the log density, plus the median of the components' means'; at most `FLOOR`."""
        return self._usual - np.logaddexp(self.log_density(directions), self._usual - FLOOR)

    def log_density(self, directions: Array) -> Array:
        """Log density (N,) of directions (N, 27)."""
        both = np.logaddexp(self.log_parts(directions), self.log_parts(mirrored(directions)))
        return np.logaddexp.reduce(both, axis=1)

    def log_parts(self, directions: Array) -> Array:
        """Log density (N, K) of directions (N, 27) under each component, half of its weight included."""
        factors, offsets = self._constants
        off = directions[:, None] - self.means
        return offsets - 0.5 * (np.einsum("kij,nkj->nki", factors, off, optimize=True) ** 2).sum(-1)

    def rarity_of(self, joints: Array) -> Array:
        """`rarity` (N,) of `body_directions` of `JOINTS` (N, 14, 3), by a kernel."""
        out = np.empty(len(joints))
        factors, offsets = self._constants
        _rarities(joints, self.means, factors, offsets, self._usual, np.empty((2, D)), out)
        return out

    @cached_property
    def _constants(self) -> tuple[Array, Array]:
        """Inverse Cholesky factors (K, 27, 27) of the covariances, and log densities (K,) at the means, half of the weight included."""
        lower = np.linalg.cholesky(self.covariances)
        half_determinants = np.log(np.diagonal(lower, axis1=1, axis2=2)).sum(1)
        return np.asarray(np.tril(np.linalg.inv(lower)), float), np.log(self.weights / 2) - half_determinants - 0.5 * D * np.log(2 * np.pi)

    @cached_property
    def _usual(self) -> float:
        """Log density at the components' means, their median."""
        return float(np.median(self.log_density(self.means)))


@cache
def usual_body_postures() -> BodyPostures:
    """The mixture of `TABLE`."""
    with resources.files("shadowpuppet.tracking.multiview").joinpath(TABLE).open("rb") as file, np.load(file, allow_pickle=False) as table:
        lower = np.zeros((len(table["weights"]), D, D))
        lower[:, *np.tril_indices(D)] = table["factors"]
        return BodyPostures(table["weights"].astype(float), table["means"].astype(float), lower @ lower.swapaxes(1, 2))


@kernel
def _rarities(joints, means, factors, offsets, usual, work, out):  # pragma: no cover
    """Fill `out` (N,) as `BodyPostures.rarity_of`; `work` (2, 27): room for a pose's directions, as they are and mirrored."""
    for n in range(joints.shape[0]):
        _fill_directions(joints[n], work)
        density = usual - FLOOR
        for k in range(means.shape[0]):
            for which in range(2):
                density = log_added(density, _log_part(work[which], means[k], factors[k], offsets[k], density - NEGLIGIBLE))
        out[n] = usual - density


@kernel
def _fill_directions(at, out):  # pragma: no cover
    """Fill `out` (2, 27) with `body_directions` of `JOINTS` (14, 3), and with the mirrored ones."""
    rx, ry, rz, fx, fy, fz, ux, uy, uz = trunk_axes(at[0], at[1], at[2], at[8])
    for bone in range(D // 3):
        if bone < 8:
            start = 2 + 3 * (bone // 2) + bone % 2
            x, y, z = direction(at[start], at[start + 1])
            other = (bone + 4) % 8  # the other side's
        else:
            x, y, z, other = 0.0, 0.0, 1.0, bone
        right, forward, up = rx * x + ry * y + rz * z, fx * x + fy * y + fz * z, ux * x + uy * y + uz * z
        out[0, 3 * bone], out[0, 3 * bone + 1], out[0, 3 * bone + 2] = right, forward, up
        out[1, 3 * other], out[1, 3 * other + 1], out[1, 3 * other + 2] = -right, forward, up


@device
def _log_part(at, mean, factor, offset, least):  # pragma: no cover
    """Log density of a component at directions (27,); where it is below `least`, any value below."""
    density = offset
    for i in range(at.shape[0]):
        if density < least:
            break
        sum_ = 0.0
        for j in range(i + 1):
            sum_ += factor[i, j] * (at[j] - mean[j])
        density -= 0.5 * sum_ * sum_
    return density
