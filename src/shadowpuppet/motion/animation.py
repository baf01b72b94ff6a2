"""A moving skeleton as in animation files: constant offsets, and each joint's rotation relative to its parent."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import JointTable

Y_UP = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
"""From our world (Z up) to the world of files with Y up: (x, z, -y), which Blender and OpenSim undo. X stays."""
SAME_PLACE = 1e-9
"""Largest distance (m) of two positions that count as equal."""


@dataclass(frozen=True, eq=False)
class Animation:
    """Joints, parents before children, over time. The world is in metres, Z up. The joints' own axes at rest are those of animation
    files: a person stands along Y and looks along Z. Raises `ShadowPuppetError` for wrong shapes."""

    names: tuple[str, ...]
    """Names of the J joints."""
    parents: tuple[int, ...]
    """Index of each joint's parent; -1 for the root, which is the first joint and the only one."""
    offsets: Array
    """Position at rest in the parent's axes, of shape (J, 3), metres; zero for the root."""
    ends: Mapping[int, tuple[float, float, float]]
    """Ends of bones that have no joint: a joint's index, and the position in its axes, metres."""
    times: Array
    """Seconds, of shape (T,)."""
    rotations: Array
    """Relative to the parent, the root's to the world, of shape (T, J, 3, 3); not a number in unknown frames."""
    shifts: Array
    """Position in the parent's axes, the root's in the world, of shape (T, J, 3), metres; mostly equal to the offset."""

    def __post_init__(self) -> None:
        """Check."""
        T, J = len(self.times), len(self.names)
        shapes = {"offsets": (J, 3), "times": (T,), "rotations": (T, J, 3, 3), "shifts": (T, J, 3)}
        for name, shape in shapes.items():
            if getattr(self, name).shape != shape:
                raise ShadowPuppetError(f"{name}: found shape {getattr(self, name).shape}, expected {shape}")
        roots = [j for j, parent in enumerate(self.parents) if parent < 0]
        if roots != [0] or len(self.parents) != J or any(parent >= j for j, parent in enumerate(self.parents)):
            raise ShadowPuppetError(f"parents: found {self.parents} of {J} joints, expected -1 for the first, earlier ones for others")

    @cached_property
    def known(self) -> NDArray[np.bool_]:
        """Frames (T,) in which every joint is known."""
        T = len(self.times)
        return np.asarray(np.isfinite(self.rotations).reshape(T, -1).all(1) & np.isfinite(self.shifts).reshape(T, -1).all(1))

    @cached_property
    def moving(self) -> tuple[int, ...]:
        """Indices of the joints, except the root, whose position relative to the parent changes."""
        strays = np.abs(self.shifts[self.known] - self.offsets).max((0, 2), initial=0.0)
        return tuple(j for j in range(1, len(self.names)) if strays[j] > SAME_PLACE)

    def world(self) -> tuple[Array, Array]:
        """Positions (T, J, 3), metres, and rotations (T, J, 3, 3) of the joints in the world."""
        places, turns = self.shifts.copy(), self.rotations.copy()
        for j, parent in enumerate(self.parents):
            if parent >= 0:
                places[:, j] = places[:, parent] + (turns[:, parent] @ self.shifts[:, j, :, None])[..., 0]
                turns[:, j] = turns[:, parent] @ self.rotations[:, j]
        return places, turns

    @property
    def table(self) -> JointTable:
        """Positions of the joints."""
        return JointTable(self.times, self.names, self.world()[0])

    @cached_property
    def rest(self) -> Array:
        """Positions of the joints at rest, the root at the origin, of shape (J, 3), metres."""
        return rest_positions(self.offsets, self.parents)

    def at(self, times: ArrayLike) -> Animation:
        """The animation at other times (K,): interpolated along the shortest rotation between known frames, held before and after them.
        Raises `ShadowPuppetError` if no frame is known."""
        times, frames = np.asarray(times, float), np.flatnonzero(self.known)
        if not len(frames):
            raise ShadowPuppetError("found no frame in which the whole skeleton is known, expected one at least")
        there = self.times[frames]
        after = np.clip(np.searchsorted(there, times), 0, len(there) - 1)
        before = np.where(there[after] > times, np.maximum(after - 1, 0), after)
        span = there[after] - there[before]
        share = np.where(span > 0, (times - there[before]) / np.where(span > 0, span, 1), 0.0)
        a, b = frames[before], frames[after]
        shifts = self.shifts[a] + share.clip(0, 1)[:, None, None] * (self.shifts[b] - self.shifts[a])
        return replace(self, times=times, rotations=_between(self.rotations[a], self.rotations[b], share.clip(0, 1)), shifts=shifts)


def rest_positions(offsets: Array, parents: Sequence[int]) -> Array:
    """Positions (J, 3) of joints at rest: their offsets (J, 3) from the parents, summed along the tree."""
    places = offsets.copy()
    for j, parent in enumerate(parents):
        if parent >= 0:
            places[j] += places[parent]
    return places


def _between(a: Array, b: Array, share: Array) -> Array:
    """Rotations (T, J, 3, 3) at a share (T,) of the way from a to b."""
    from scipy.spatial.transform import Rotation

    out, way = a.copy(), np.flatnonzero(share > 0)
    if len(way):
        step = Rotation.from_matrix((np.swapaxes(a[way], 2, 3) @ b[way]).reshape(-1, 3, 3)).as_rotvec()
        part = Rotation.from_rotvec(step * np.repeat(share[way], a.shape[1])[:, None]).as_matrix()
        out[way] = a[way] @ part.reshape(-1, *a.shape[1:])
    return out
