"""The silhouette cost of Liu 2011 (eq. 2), for whole arrays of poses."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.camera.bits import Bits, count, pack
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array

Cost = Callable[[Array], Array]
"""Function from poses (N, D) to costs (N,)."""


class Landmarked(Protocol):
    """Keypoints of one person in a picture."""

    def surprises(self, poses: Array, without: Sequence[str] = ()) -> Array:
        """Surprise (N,), nats, of the keypoints given poses (N, D); `without`: joints whose landmarks do not count."""
        ...

    def against(self, pose: Array) -> float:
        """Log odds that the person faces the other way than in a pose (D,)."""
        ...

    def missed(self, pose: Array) -> dict[str, float]:
        """Of each limb that has landmarks the share of them that no keypoint shows near a pose (D,)."""
        ...

    def support(self, pose: Array) -> float:
        """Share of the keypoints near a pose (D,)."""
        ...


class Soles(NamedTuple):
    """Where a silhouette shows a person's soles."""

    row: float
    """Of the picture, pixels."""
    cut: bool
    """Whether the picture ends there: the soles are there or lower."""


@dataclass(frozen=True, eq=False)
class Observation:
    """A silhouette, its ignored pixels, and an additional cost."""

    silhouette: Bits
    ignore: Bits
    """Pixels that do not count. They are set in the silhouette and in drawn poses, so that they never differ."""
    also: Cost | None = None
    """A cost of your own, in pixels, added to eq. 2 wherever poses are weighed."""
    arms: PartObservation | None = None
    """What shows some parts of the arms alone, if anything does."""

    soles: Soles | None = None
    """A whole person's soles; None if they do not count."""
    keypoints: Landmarked | None = None
    """A detector's joints."""

    @classmethod
    def of(cls, mask: ArrayLike, ignore: ArrayLike | None = None, also: Cost | None = None) -> Observation:
        """The observation of a mask (H, W), with a mask (H, W) of the ignored pixels."""
        return cls.of_bits(pack(mask), None if ignore is None else pack(ignore), also)

    @classmethod
    def of_bits(cls, silhouette: Bits, ignore: Bits | None = None, also: Cost | None = None) -> Observation:
        """The same of bits (C, H)."""
        skipped = np.zeros_like(silhouette) if ignore is None else ignore
        return cls(silhouette | skipped, skipped, also)

    @classmethod
    def without_legs(cls, mask: ArrayLike, picture: Picture, pose: Array, also: Cost | None = None,
                     ignore: ArrayLike | None = None) -> Observation:
        """The observation of a mask (H, W); its pixels in the region where the legs of `pose` (D,) may be are ignored, and those of
        `ignore` (H, W).

        An upper body ends at the waist. Empty pixels there still count, so that the waist does not grow over them.
        """
        seen = cls.of(mask, ignore, also)
        return cls(seen.silhouette, seen.ignore | (seen.silhouette & picture.leg_bits(pose)), also)

    def ignoring(self, pixels: ArrayLike) -> Observation:
        """The observation in which the pixels (H, W) do not count either."""
        skipped = pack(pixels)
        return replace(self, silhouette=self.silhouette | skipped, ignore=self.ignore | skipped)

    @cached_property
    def area(self) -> int:
        """Pixels of the silhouette that count."""
        return count(self.silhouette & ~self.ignore)

    def cost_and_overlap(self, drawn: Bits) -> tuple[float, float]:
        """Pixels that differ from a drawn silhouette (eq. 2), and intersection over union with it."""
        drawn, seen = drawn & ~self.ignore, self.silhouette & ~self.ignore
        return float(count(drawn ^ seen)), count(drawn & seen) / max(count(drawn | seen), 1)


class PartObservation(NamedTuple):
    """The silhouette of some of the body's parts alone."""

    observation: Observation
    parts: tuple[str, ...]
    """Names of the parts."""


class PartialCost:
    """Eq. 2 for poses that differ in some DOF only: the parts that these move are drawn over the others, which are drawn once."""

    def __init__(self, picture: Picture, dofs: NDArray[np.int64], hidden: Iterable[str] = ()) -> None:
        """`dofs`: indices of the DOF that vary; `hidden`: names of parts that are not drawn."""
        body, skeleton, hidden = picture.body, picture.body.skeleton, set(hidden)
        names = {skeleton.dofs[d].name for d in dofs}
        owners = {dof.joint for dof in skeleton.dofs if dof.name in names}
        owners |= {coupling.joint for coupling in skeleton.couplings if coupling.dof in names}
        moved: set[str] = set()
        for joint in skeleton.joints:  # parents come first: one pass finds all descendants
            if joint.name in owners or joint.parent in moved:
                moved.add(joint.name)
        self.picture, self.dofs = picture, dofs
        self.joints = np.array([i for i, name in enumerate(skeleton.joint_names) if name in moved], np.int64)
        drawn = np.array([part not in hidden for part in body.parts])
        moves = np.isin(body.shapes.joints, self.joints).any(1)
        self.moving, self.still = np.flatnonzero(moves & drawn), np.flatnonzero(~moves & drawn)

    def costs(self, observation: Observation, around: Array) -> Cost:
        """Eq. 2, pixels (N,), as a function of whole poses (N, D) that equal `around` (D,) in all DOF that do not vary."""
        fixed = self.picture.draw(around, self.still) | observation.ignore
        base = count(fixed ^ observation.silhouette)

        def cost(poses: Array) -> Array:
            return base + self.picture.added(poses, self.moving, observation.silhouette, fixed, self.joints).astype(float)

        return cost


def silhouette_costs(picture: Picture, observation: Observation, poses: ArrayLike) -> Array:
    """Eq. 2 for whole poses (N, D): pixels (N,) in which the drawn body and the silhouette differ."""
    added = picture.added(np.ascontiguousarray(poses, float), picture.every, observation.silhouette, observation.ignore)
    return observation.area + added.astype(float)
