"""Local principal subspaces: regions of the space of poses, each with a centre and the few directions in which poses vary there.

The local model of VQPCA (Kambhatla & Leen 1997; Ni 2008, IV). Its density has one variance in all but the leading directions (Tipping &
Bishop 1999), because the covariance of a region with fewer poses than values in a pose is singular.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array

Regions = NDArray[np.int64]
TOLERANCE = 1e-6
"""Largest rounding error of what a prior's arrays hold: of inner products of basis vectors, and of sums of probabilities."""


@dataclass(frozen=True, eq=False)
class Subspaces:
    """M regions of poses of D numbers, each with a subspace of m dimensions. Raises `ShadowPuppetError` for invalid arrays."""

    centres: Array
    """r_i, of shape (M, D), in the poses' own units."""
    bases: Array
    """P_i: leading eigenvectors of each region's covariance as columns, of shape (M, D, m)."""
    variances: Array
    """Lambda_i: variance along each, greatest first, of shape (M, m)."""
    noise: Array
    """Variance in every other direction, of shape (M,)."""

    def __post_init__(self) -> None:
        """Check."""
        for name in ("centres", "bases", "variances", "noise"):
            object.__setattr__(self, name, np.asarray(getattr(self, name), float))
        if self.bases.ndim != 3 or 0 in self.bases.shape or self.bases.shape[2] > self.bases.shape[1]:
            raise ShadowPuppetError(f"bases: found shape {self.bases.shape}, expected (regions, numbers of a pose, dimensions), as many "
                                    "dimensions as a pose has numbers at most")
        M, D, m = self.bases.shape
        for name, shape in {"centres": (M, D), "bases": (M, D, m), "variances": (M, m), "noise": (M,)}.items():
            values = getattr(self, name)
            if values.shape != shape:
                raise ShadowPuppetError(f"{name}: found shape {values.shape}, expected {shape}")
            if not np.isfinite(values).all():
                raise ShadowPuppetError(f"{name}: found a number that is not finite, expected finite ones")
        for name in ("variances", "noise"):
            if getattr(self, name).min() <= 0:
                raise ShadowPuppetError(f"{name}: found {getattr(self, name).min()}, expected variances, which are more than zero")
        if np.abs(self.bases.transpose(0, 2, 1) @ self.bases - np.eye(m)).max() > TOLERANCE:
            raise ShadowPuppetError("bases: found vectors that are not orthonormal, expected an orthonormal basis of each region")

    def __len__(self) -> int:
        """Number of regions, M."""
        return len(self.centres)

    @property
    def width(self) -> int:
        """Number of values in a pose, D."""
        return self.bases.shape[1]

    @property
    def dimensions(self) -> int:
        """Dimensions of each subspace, m."""
        return self.bases.shape[2]

    @cached_property
    def _flat(self) -> tuple[Array, Array, Array, Array]:
        """For all regions at once: mean of the centres (D,), centres from there (M, D), bases (D, M m), the centres' coordinates (M m,)."""
        middle = self.centres.mean(0)  # offsets keep the distances precise for poses far from zero
        centres, flat = self.centres - middle, np.ascontiguousarray(self.bases.transpose(1, 0, 2)).reshape(self.width, -1)
        return middle, centres, flat, np.einsum("id,idk->ik", centres, self.bases).ravel()

    def coordinates(self, poses: Array) -> Array:
        """Coordinates (N, M, m) of poses (N, D) in every region's subspace, from its centre (eq. 18)."""
        middle, _, flat, origin = self._flat
        return ((poses - middle) @ flat - origin).reshape(len(poses), len(self), self.dimensions)

    def project(self, poses: Array, regions: Regions) -> Array:
        """Coordinates (N, m) of poses (N, D), each in one region's subspace (eqs. 18, 25, 27)."""
        return np.matmul((poses - self.centres[regions])[:, None], self.bases[regions])[:, 0]

    def reconstruct(self, coordinates: Array, regions: Regions) -> Array:
        """Poses (N, D) of coordinates (N, m), each in one region's subspace (eqs. 19, 26, 28)."""
        return self.centres[regions] + np.matmul(self.bases[regions], coordinates[:, :, None])[:, :, 0]

    def distances(self, poses: Array) -> Array:
        """Squared distances (N, M) of poses (N, D) from every subspace (eqs. 9, 10)."""
        return self._distances(poses, self.coordinates(poses))

    def nearest(self, poses: Array) -> tuple[Regions, Array]:
        """The nearest region (N,) of poses (N, D) and their coordinates (N, m) in it (eqs. 8, 18)."""
        coordinates = self.coordinates(poses)
        regions = self._distances(poses, coordinates).argmin(1)
        return regions, coordinates[np.arange(len(poses)), regions]

    def log_densities(self, poses: Array) -> Array:
        """Log densities (N, M) of poses (N, D) in every region: log b_j(x)."""
        coordinates = self.coordinates(poses)
        beside = self.width - self.dimensions
        spread = np.log(self.variances).sum(1) + beside * np.log(self.noise) + self.width * np.log(2 * np.pi)
        along = np.einsum("nik,nik,ik->ni", coordinates, coordinates, 1 / self.variances)
        return -0.5 * (along + self._distances(poses, coordinates) / self.noise * (beside > 0) + spread)

    def _distances(self, poses: Array, coordinates: Array) -> Array:
        """Squared distances (N, M) from every subspace: by Pythagoras, from the distances to the centres."""
        middle, centres, _, _ = self._flat
        offsets = poses - middle
        to_centres = (offsets**2).sum(1)[:, None] - 2 * offsets @ centres.T + (centres**2).sum(1)
        return np.maximum(to_centres - np.einsum("nik,nik->ni", coordinates, coordinates), 0)


def principal_subspaces(poses: Array, partition: Regions, regions: int, dimensions: int, floor: float) -> Subspaces:
    """Subspaces of poses (T, D) under a partition (T,) into `regions`, none empty (eqs. 12-14), with variances of at least `floor`."""
    width = poses.shape[1]
    centres, spread = np.empty((regions, width)), np.empty((regions, width, width))
    order, ends = np.argsort(partition, kind="stable"), np.cumsum(np.bincount(partition, minlength=regions))
    for i, members in enumerate(np.split(order, ends[:-1])):
        centres[i] = poses[members].mean(0)
        offsets = poses[members] - centres[i]
        spread[i] = offsets.T @ offsets / len(members)
    values, vectors = np.linalg.eigh(spread)
    bases, values = vectors[:, :, ::-1][:, :, :dimensions], values[:, ::-1]
    rest = values[:, dimensions:].mean(1) if dimensions < width else np.zeros(regions)
    return Subspaces(centres, bases * _signs(bases), np.maximum(values[:, :dimensions], floor), np.maximum(rest, floor))


def _signs(bases: Array) -> Array:
    """Signs (M, 1, m) that make the largest entry of each basis vector positive: an eigenvector's sign is arbitrary."""
    greatest = np.abs(bases).argmax(1, keepdims=True)
    return np.where(np.take_along_axis(bases, greatest, 1) < 0, -1.0, 1.0)
