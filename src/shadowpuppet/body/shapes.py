"""A body: a skeleton, shapes fixed to its joints (flat quads, hulls of ellipsoids, solid limbs) and named landmarks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.geometry import Array


@dataclass(frozen=True, eq=False)
class Limbs:
    """Tapered elliptic cylinders, each fixed to a joint, that surface points are compared with (Ni 2008, II); cross-sections are
    perpendicular to z."""

    joints: NDArray[np.int64]
    """Joint of each, of shape (S,)."""
    rotations: Array
    """Columns: a limb's axes in its joint's frame, of shape (S, 3, 3); z runs from start to end."""
    starts: Array
    """Centre of the first cross-section, joint's frame, of shape (S, 3), metres."""
    lengths: Array
    """Along the limb's z, of shape (S,), metres."""
    shears: Array
    """Offset of the last cross-section's centre from the first's along the limb's x and y, of shape (S, 2), metres."""
    radii: Array
    """Radii at start and end along the limb's x and y, of shape (S, 2, 2), metres."""
    caps: Array
    """Heights of the ellipsoidal domes at start and end, of shape (S, 2), metres; 0 is flat."""
    parts: tuple[str, ...]
    """Name of each limb."""

    @property
    def arrays(self) -> tuple[Array, ...]:
        """The arrays that depend linearly on a person's sizes: starts, lengths, shears, radii, caps."""
        return self.starts, self.lengths, self.shears, self.radii, self.caps

    @property
    def ends(self) -> Array:
        """Centre of the last cross-section, joint's frame, of shape (S, 3), metres."""
        along = np.concatenate([self.shears, self.lengths[:, None]], 1)
        return self.starts + (self.rotations @ along[:, :, None])[..., 0]


@dataclass(frozen=True, eq=False)
class Quads:
    """Flat convex quads, each fixed to a joint."""

    joints: NDArray[np.int64]
    """Joint of each, of shape (S, 1)."""
    corners: Array
    """In the joint's frame, of shape (S, 4, 3), metres."""

    @property
    def arrays(self) -> tuple[Array, ...]:
        """The arrays that depend linearly on a person's sizes."""
        return (self.corners,)


@dataclass(frozen=True, eq=False)
class Hulls:
    """Convex hulls of a few ellipsoids; every ellipsoid is fixed to a joint."""

    joints: NDArray[np.int64]
    """Joint of each ellipsoid, of shape (S, E)."""
    centres: Array
    """In the joint's frame, of shape (S, E, 3), metres."""
    radii: Array
    """Along the axes of the joint's frame, of shape (S, E, 3), metres."""

    @cached_property
    def numbers(self) -> NDArray[np.int64]:
        """Number of different ellipsoids of each hull (S,): copies of the last one at its end do not count."""
        same = self.joints == self.joints[:, -1:]
        for array in self.arrays:
            same &= (array == array[:, -1:]).all(2)
        return same.shape[1] + 1 - np.cumprod(same[:, ::-1], axis=1).sum(1)

    @property
    def arrays(self) -> tuple[Array, ...]:
        """The arrays that depend linearly on a person's sizes."""
        return self.centres, self.radii


@dataclass(frozen=True, eq=False)
class Body:
    """Shapes fixed to the joints of a skeleton, and named points on it."""

    name: str
    skeleton: Skeleton
    shapes: Quads | Hulls
    """S shapes."""
    parts: tuple[str, ...]
    """Name of the body part of each shape."""
    landmarks: Mapping[str, tuple[str, tuple[float, float, float]]]
    """Points that a motion reports: name to joint and position in its frame, metres."""
    hem: Array | None
    """The two ends of the waist's lower edge, where an upper body ends, in the pelvis' frame, of shape (2, 3), metres; None if it has
    legs."""
    limbs: Limbs | None = None
    """The same body as solids, for comparison with surface points; None if there are none."""

    @cached_property
    def landmark_names(self) -> tuple[str, ...]:
        """Names of the L landmarks."""
        return tuple(self.landmarks)

    def points(self, poses: ArrayLike, root: ArrayLike | None = None, names: Iterable[str] | None = None) -> Array:
        """Landmarks (N, L, 3) of poses (N, D), metres, transformed by `root` (4, 4); all, or those in `names`."""
        joints, places = self._fixed
        chosen = [self.landmark_names.index(name) for name in (self.landmark_names if names is None else names)]
        return self.skeleton.points(poses, joints[chosen], places[chosen], root)

    @cached_property
    def _fixed(self) -> tuple[NDArray[np.int64], Array]:
        """Joints (L,) of the landmarks and their positions in these joints' frames (L, 3), metres."""
        joints = np.array([self.skeleton.joint_index(joint) for joint, _ in self.landmarks.values()], np.int64)
        return joints, np.array([place for _, place in self.landmarks.values()], float).reshape(-1, 3)
