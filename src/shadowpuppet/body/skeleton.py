"""A jointed skeleton: a tree of joints, named degrees of freedom with limits, forward kinematics of many poses at once."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError, choices
from shadowpuppet.geometry import Array

BONES = (
    ("pelvis", "neck"), ("neck", "head"),
    ("neck", "left_shoulder"), ("left_shoulder", "left_elbow"), ("left_elbow", "left_wrist"), ("left_wrist", "left_hand"),
    ("neck", "right_shoulder"), ("right_shoulder", "right_elbow"), ("right_elbow", "right_wrist"), ("right_wrist", "right_hand"),
    ("pelvis", "left_hip"), ("left_hip", "left_knee"), ("left_knee", "left_ankle"),
    ("pelvis", "right_hip"), ("right_hip", "right_knee"), ("right_knee", "right_ankle"),
    ("left_ankle", "left_heel"), ("left_ankle", "left_toe"), ("right_ankle", "right_heel"), ("right_ankle", "right_toe"),
)
"""Pairs of joints with a bone between them."""


AXES = {"x": (0, 1.0), "y": (1, 1.0), "z": (2, 1.0), "-x": (0, -1.0), "-y": (1, -1.0), "-z": (2, -1.0)}
SIDES = ("left", "right")


def other_side(names: Sequence[str]) -> list[int]:
    """For each name, of a degree of freedom, a joint or a limb, the index of its counterpart on the other side of the body; its own index
    in the middle."""
    other = dict(zip(SIDES, SIDES[::-1]))
    there = [name.partition("_") for name in names]
    return [names.index(f"{other[side]}_{rest}") if side in other else n for n, (side, _, rest) in enumerate(there)]


@dataclass(frozen=True)
class Joint:
    """A joint of the tree; its frame has its parent's axes when all its angles are zero."""

    name: str
    parent: str | None
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Place in the parent's frame, metres."""


@dataclass(frozen=True)
class Dof:
    """A degree of freedom: a rotation about or a translation along an axis of its joint's frame, or a component of a rotation vector.
    The components x, y, z of a rotation vector follow each other; no posture within a full turn is singular."""

    name: str
    joint: str
    axis: Literal["x", "y", "z", "-x", "-y", "-z"]
    low: float = -np.inf
    """Limits, radians or metres."""
    high: float = np.inf
    kind: Literal["rotation", "translation", "vector"] = "rotation"
    rest: float = 0.0
    """The usual value."""
    spread: tuple[float, float] = (np.inf, np.inf)
    """Usual deviations below and above `rest`, the scales of a heavy-tailed distribution."""


BOUND = 9.0
"""Bound of a squared deviation from a usual value: it lets a clearly visible unusual posture win, while the term still decides where the
image says little."""


def bounded(deviations: Array) -> Array:
    """The squares of deviations (...), in units of their spread, each below `BOUND`."""
    squared = deviations**2
    return squared / (1 + squared / BOUND)


@dataclass(frozen=True)
class Coupling:
    """A shift of a joint, in its parent's frame, proportional to a DOF (a "mimic joint")."""

    joint: str
    dof: str
    shift: tuple[float, float, float]
    """Metres per radian (or metre) of the DOF."""


@dataclass(frozen=True)
class Skeleton:
    """Joints, parents before children, and degrees of freedom, grouped by joint in the order in which they act. A joint's transform is
    its parent's, times its offset and couplings, times its DOF one after another. A pose is an array (D,) in the order of `dofs`;
    functions take arrays of poses (N, D)."""

    joints: tuple[Joint, ...]
    dofs: tuple[Dof, ...]
    couplings: tuple[Coupling, ...] = ()

    def __post_init__(self) -> None:
        for what, named in (("joint", self.joints), ("degree of freedom", self.dofs)):
            names = [each.name for each in named]
            if twice := [name for name in names if names.count(name) > 1]:
                raise ShadowPuppetError(f"{what} {twice[0]!r}: found {names.count(twice[0])} of this name, expected one")
        earlier: set[str] = set()
        for joint in self.joints:
            if joint.parent is not None and joint.parent not in earlier:
                raise ShadowPuppetError(f"joint {joint.name!r}: its parent {joint.parent!r} must stand before it")
            earlier.add(joint.name)
        order = [self.joint_index(dof.joint) for dof in self.dofs]
        if order != sorted(order):
            raise ShadowPuppetError("degrees of freedom must be grouped by joint, in the joints' order")
        self._check_vectors()

    def _check_vectors(self) -> None:
        vectors = [d for d, dof in enumerate(self.dofs) if dof.kind == "vector"]
        for n, d in enumerate(vectors):
            first = vectors[n - n % 3]
            three = self.dofs[first : first + 3]
            if [dof.axis for dof in three if dof.kind == "vector" and dof.joint == three[0].joint] != ["x", "y", "z"]:
                raise ShadowPuppetError(f"degree of freedom {self.dofs[d].name!r}: a rotation vector has three components in a row, of one "
                                        "joint, along x, y, z")

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, J of them."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def dof_names(self) -> tuple[str, ...]:
        """Names of the degrees of freedom, D of them."""
        return tuple(dof.name for dof in self.dofs)

    @cached_property
    def dof_joints(self) -> NDArray[np.int64]:
        """Index of each DOF's joint, (D,)."""
        return np.array([self.joint_index(dof.joint) for dof in self.dofs], np.int64)

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """Lower and upper limits of the DOF, two arrays (D,)."""
        return np.array([dof.low for dof in self.dofs]), np.array([dof.high for dof in self.dofs])

    @cached_property
    def offsets(self) -> Array:
        """Position of every joint in its parent's frame, of shape (1, J, 3), metres."""
        return np.array([[joint.offset for joint in self.joints]], float)

    @cached_property
    def tree(self) -> tuple:
        """The skeleton as arrays for kernels: parents (J,), first DOF of each joint (J + 1,), axis, sign and kind of each DOF (D,),
        joint and DOF of each coupling (C, 2) and its shift (C, 3), and the indices of all joints (J,)."""
        from shadowpuppet.body.forward_kinematics import DOF_KINDS  # late, as below: naming a body does not load Numba

        parents = np.array([-1 if j.parent is None else self.joint_index(j.parent) for j in self.joints])
        first = np.searchsorted(self.dof_joints, np.arange(len(self.joints) + 1))
        axes = np.array([AXES[dof.axis][0] for dof in self.dofs], np.int64)
        signs = np.array([AXES[dof.axis][1] for dof in self.dofs], float)
        kinds = np.array([DOF_KINDS[dof.kind] for dof in self.dofs], np.int64)
        pairs = [(self.joint_index(c.joint), self.dof_indices([c.dof])[0]) for c in self.couplings]
        shifts = np.array([c.shift for c in self.couplings], float).reshape(-1, 3)
        return parents, first, axes, signs, kinds, np.array(pairs, np.int64).reshape(-1, 2), shifts, np.arange(len(self.joints))

    def joint_index(self, name: str) -> int:
        """Index of a joint. Raises `ShadowPuppetError` with the names that exist."""
        for i, joint in enumerate(self.joints):
            if joint.name == name:
                return i
        raise ShadowPuppetError(f"unknown joint {name!r}; there are: {choices(j.name for j in self.joints)}")

    def dof_indices(self, names: Iterable[str]) -> NDArray[np.int64]:
        """Indices of DOF by name. Raises `ShadowPuppetError` with the names that exist."""
        names = tuple(names)
        unknown = [name for name in names if name not in self.dof_names]
        if unknown:
            raise ShadowPuppetError(f"unknown degree of freedom {unknown[0]!r}; there are: {choices(self.dof_names)}")
        return np.array([self.dof_names.index(name) for name in names], np.int64)

    @cached_property
    def rest_and_spread(self) -> tuple[Array, Array, Array]:
        """Rest of every DOF, and its spread below and above, three arrays (D,)."""
        return (np.array([dof.rest for dof in self.dofs]), *np.array([dof.spread for dof in self.dofs]).T)

    def posture_penalty(self, poses: ArrayLike) -> Array:
        """Penalty (N,) of unusual poses (N, D): the sum of their `deviations`."""
        return self.deviations(poses).sum(1)

    def deviations(self, poses: ArrayLike) -> Array:
        """Squared deviations (N, D) of poses (N, D) from rest in units of the spread, each `bounded`."""
        rest, below, above = self.rest_and_spread
        off = np.asarray(poses, float) - rest
        return bounded(off / np.where(off < 0, below, above))

    def pose(self, **angles: float) -> Array:
        """A pose (D,) from named values; the others are zero."""
        pose = np.zeros(len(self.dofs))
        pose[self.dof_indices(angles)] = list(angles.values())
        return pose

    def clamp(self, poses: ArrayLike) -> Array:
        """Poses (N, D) clipped to the limits."""
        return np.clip(np.asarray(poses, float), *self.limits)

    def checked(self, poses: ArrayLike) -> Array:
        """Poses (N, D) as a contiguous array. Raises `ShadowPuppetError` for another shape."""
        poses = np.ascontiguousarray(poses, float)
        if poses.ndim != 2 or poses.shape[1] != len(self.dofs):
            raise ShadowPuppetError(f"poses have shape {poses.shape}, expected (N, {len(self.dofs)})")
        return poses

    def forward(self, poses: ArrayLike, root: ArrayLike | None = None) -> Array:
        """Forward kinematics: transforms (N, J, 3, 4) of all joints of poses (N, D); `root` (4, 4) is the root's parent frame."""
        poses = self.checked(poses)
        out = np.empty((len(poses), len(self.joints), 3, 4))
        self.forward_some(poses, np.arange(len(self.joints)), out, np.eye(4) if root is None else np.asarray(root, float))
        return out

    def forward_some(self, poses: Array, joints: NDArray[np.int64], transforms: Array, root: Array, offsets: Array | None = None) -> None:
        """Recompute in place only `joints` (parents first) of `transforms` (N, J, 3, 4); the others are used as they are. `offsets` (N,
        J, 3): the joints' offsets of each pose, for people of different sizes."""
        from shadowpuppet.body.forward_kinematics import place_all

        offsets = self.offsets if offsets is None else offsets
        poses = self.checked(poses)
        place_all(poses, joints, self.tree, offsets, np.ascontiguousarray(root[:3]), transforms, *self._buffers(len(poses)))

    def points(self, poses: ArrayLike, joints: NDArray[np.int64], places: Array, root: ArrayLike | None = None) -> Array:
        """Points (N, P, 3), metres, of poses (N, D), at `places` (P, 3) in the frames of `joints` (P,); `root` as in `forward`."""
        from shadowpuppet.body.forward_kinematics import place_points

        poses, root = self.checked(poses), np.eye(4) if root is None else np.asarray(root, float)
        out = np.empty((len(poses), len(joints), 3))
        place_points(poses, self.tree, self.offsets, np.ascontiguousarray(root[:3]), joints, np.ascontiguousarray(places, float), out,
                     *self._buffers(len(poses)))
        return out

    def _buffers(self, number: int) -> tuple[Array, Array]:
        """Memory for the kernels: joints (J, 3, 4, B) of a block of poses, and intermediate values (6, B)."""
        from shadowpuppet.jit import BLOCK

        size = min(BLOCK, max(number, 1))
        return np.zeros((len(self.joints), 3, 4, size)), np.empty((6, size))
