"""How well poses explain a picture: the silhouette cost of Liu 2011 (eq. 2), for whole arrays of poses."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.geometry import Array
from shadowpuppet.rasterize import Bits, Picture, count, pack


@dataclass(frozen=True, eq=False)
class Observation:
    """A silhouette, and where it says nothing."""

    silhouette: Bits
    ignore: Bits
    """Pixels that do not count, whatever is drawn there. They are set in the silhouette too, so that they never differ."""

    @classmethod
    def of(cls, mask: ArrayLike, ignore: Bits | None = None) -> Observation:
        """From a mask (H, W), and the bits of the pixels that do not count."""
        silhouette = pack(mask)
        if ignore is None:
            ignore = np.zeros_like(silhouette)
        return cls(silhouette | ignore, ignore)

    @property
    def area(self) -> int:
        """Pixels of the silhouette that count."""
        return count(self.silhouette & ~self.ignore)


class Stage:
    """What some DOF move: the joints to recompute, and the quads to draw again over all others."""

    def __init__(self, picture: Picture, dofs: NDArray[np.int64], hidden: Iterable[str] = ()) -> None:
        body, skeleton = picture.body, picture.body.skeleton
        owners = {skeleton.dofs[d].joint for d in dofs}
        moved: list[str] = []
        for joint in skeleton.joints:  # parents come first, so that one pass finds all that hangs on a moved joint
            if joint.name in owners or joint.parent in moved:
                moved.append(joint.name)
        self.picture, self.dofs = picture, dofs
        self.miss = 1.0
        self.joints = np.array([skeleton.joint_index(name) for name in moved], np.int64)
        gone = set(hidden)
        drawn = np.array([part not in gone for part in body.quad_parts])
        moves = np.isin(body.quad_joints, self.joints)
        self.moving = np.flatnonzero(moves & drawn)
        self.still = np.flatnonzero(~moves & drawn)

    def transforms(self, poses: Array, around: Array) -> Array:
        """Joint transforms (N, J, 3, 4) into the camera's frame; joints that the stage does not move stand as in the pose `around` (D,)."""
        base = self.picture.transforms(around[None])
        out = np.repeat(base, len(poses), axis=0)
        self.picture.body.skeleton.forward_some(poses, self.joints, out, self.picture.T_camera_base)
        return out

    def costs(self, observation: Observation, around: Array) -> Callable[[Array], Array]:
        """Eq. 2 as a function of whole poses (N, D) that differ from `around` in this stage's DOF only: pixels (N,)."""
        fixed = self.picture.draw(around, self.still) | observation.ignore
        base = count(fixed ^ observation.silhouette)

        def cost(poses: Array) -> Array:
            added = self.picture.added(self.transforms(poses, around), self.moving, observation.silhouette, fixed)
            return base + added[:, 0] - (1.0 + self.miss) * added[:, 1]

        return cost


def silhouette_costs(picture: Picture, observation: Observation, poses: ArrayLike) -> Array:
    """Eq. 2: pixels (N,) in which the drawn body and the silhouette differ, of whole poses (N, D)."""
    poses = np.ascontiguousarray(poses, float)
    stage = Stage(picture, np.arange(len(picture.body.skeleton.dofs)))
    return stage.costs(observation, poses[0])(poses)
