"""A jointed skeleton: a tree of joints, named degrees of freedom with limits, forward kinematics of many poses at once."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.errors import ShadowPuppetError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.kernels import BLOCK, kernel, part

AXES = {"x": (0, 1.0), "y": (1, 1.0), "z": (2, 1.0), "-x": (0, -1.0), "-y": (1, -1.0), "-z": (2, -1.0)}


@dataclass(frozen=True)
class Joint:
    """A joint of the tree; its frame has its parent's axes when all its angles are zero."""

    name: str
    parent: str | None
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Place in the parent's frame, metres."""


@dataclass(frozen=True)
class Dof:
    """One degree of freedom: a rotation about, or a shift along, an axis of its joint's frame."""

    name: str
    joint: str
    axis: Literal["x", "y", "z", "-x", "-y", "-z"]
    low: float = -np.inf
    """Limits, radians or metres."""
    high: float = np.inf
    kind: Literal["rotation", "translation"] = "rotation"
    rest: float = 0.0
    """Its usual value."""
    spread: tuple[float, float] = (np.inf, np.inf)
    """How far from it is still usual, below and above: deviations of a distribution with heavy tails."""


@dataclass(frozen=True)
class Coupling:
    """A shift of a joint, in its parent's frame, that follows a DOF (a "mimic joint")."""

    joint: str
    dof: str
    shift: tuple[float, float, float]
    """Metres for each radian (or metre) of the DOF."""


@dataclass(frozen=True)
class Skeleton:
    """Joints, parents before children, and degrees of freedom, grouped by joint in the order in which they act.

    The transform of a joint is its parent's, times its offset and couplings, times its DOF one after another.
    A pose is an array (D,) in the order of `dofs`; functions take arrays of poses (N, D).
    """

    joints: tuple[Joint, ...]
    dofs: tuple[Dof, ...]
    couplings: tuple[Coupling, ...] = ()

    def __post_init__(self) -> None:
        for what, named in (("joint", self.joints), ("degree of freedom", self.dofs)):
            names = [each.name for each in named]
            if twice := [name for name in names if names.count(name) > 1]:
                raise ShadowPuppetError(f"{what} {twice[0]!r}: found {names.count(twice[0])} of this name, expected one")
        seen: set[str] = set()
        for joint in self.joints:
            if joint.parent is not None and joint.parent not in seen:
                raise ShadowPuppetError(f"joint {joint.name!r}: its parent {joint.parent!r} must stand before it")
            seen.add(joint.name)
        order = [self.joint_index(dof.joint) for dof in self.dofs]
        if order != sorted(order):
            raise ShadowPuppetError("degrees of freedom must be grouped by joint, in the joints' order")

    @cached_property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, J of them."""
        return tuple(joint.name for joint in self.joints)

    @cached_property
    def dof_names(self) -> tuple[str, ...]:
        """Names of the degrees of freedom, D of them."""
        return tuple(dof.name for dof in self.dofs)

    @cached_property
    def limits(self) -> tuple[Array, Array]:
        """Least and greatest value of every DOF, two arrays (D,)."""
        return np.array([dof.low for dof in self.dofs]), np.array([dof.high for dof in self.dofs])

    @cached_property
    def offsets(self) -> Array:
        """Place of every joint in its parent's frame, of shape (1, J, 3), metres."""
        return np.array([[joint.offset for joint in self.joints]], float)

    @cached_property
    def tree(self) -> tuple:
        """What kernels need: parents (J,), first DOF of each joint (J + 1,), axis, sign and kind of each DOF (D,), and of each coupling
        joint and DOF (C, 2) and shift (C, 3)."""
        parents = np.array([-1 if j.parent is None else self.joint_index(j.parent) for j in self.joints])
        owners = np.array([self.joint_index(dof.joint) for dof in self.dofs], np.int64)
        first = np.searchsorted(owners, np.arange(len(self.joints) + 1))
        axes = np.array([AXES[dof.axis][0] for dof in self.dofs], np.int64)
        signs = np.array([AXES[dof.axis][1] for dof in self.dofs], float)
        turns = np.array([dof.kind == "rotation" for dof in self.dofs], bool)
        pairs = [(self.joint_index(c.joint), self.dof_indices([c.dof])[0]) for c in self.couplings]
        shifts = np.array([c.shift for c in self.couplings], float).reshape(-1, 3)
        return parents, first, axes, signs, turns, np.array(pairs, np.int64).reshape(-1, 2), shifts

    def joint_index(self, name: str) -> int:
        """Index of a joint. Raises `ShadowPuppetError` with the names there are."""
        for i, joint in enumerate(self.joints):
            if joint.name == name:
                return i
        raise ShadowPuppetError(f"unknown joint {name!r}; there are: {choices(j.name for j in self.joints)}")

    def dof_indices(self, names: Iterable[str]) -> NDArray[np.int64]:
        """Indices of DOF by name. Raises `ShadowPuppetError` with the names there are."""
        names = tuple(names)
        unknown = [name for name in names if name not in self.dof_names]
        if unknown:
            raise ShadowPuppetError(f"unknown degree of freedom {unknown[0]!r}; there are: {choices(self.dof_names)}")
        return np.array([self.dof_names.index(name) for name in names], np.int64)

    @cached_property
    def _usual(self) -> tuple[Array, Array, Array]:
        return (np.array([dof.rest for dof in self.dofs]), *np.array([dof.spread for dof in self.dofs]).T)

    def strain(self, poses: ArrayLike) -> Array:
        """How unusual poses (N, D) are: squared deviations from rest, summed (N,); each DOF adds at most 9, three deviations' worth.

        The bound leaves a posture that is plainly seen alone, and still decides where the picture says little.
        """
        rest, below, above = self._usual
        off = np.asarray(poses, float) - rest
        squared = (off / np.where(off < 0, below, above)) ** 2
        return (squared / (1 + squared / 9)).sum(1)

    def pose(self, **angles: float) -> Array:
        """One pose (D,) from named values, zero elsewhere."""
        pose = np.zeros(len(self.dofs))
        pose[self.dof_indices(angles)] = list(angles.values())
        return pose

    def clamp(self, poses: ArrayLike) -> Array:
        """Poses (N, D) with every DOF within its limits."""
        return np.clip(np.asarray(poses, float), *self.limits)

    def forward(self, poses: ArrayLike, root: ArrayLike | None = None) -> Array:
        """Forward kinematics: transforms (N, J, 3, 4) of every joint, of poses (N, D), with the root's parent frame at `root` (4, 4)."""
        poses = np.ascontiguousarray(poses, float)
        if poses.ndim != 2 or poses.shape[1] != len(self.dofs):
            raise ShadowPuppetError(f"poses have shape {poses.shape}, expected (N, {len(self.dofs)})")
        out = np.empty((len(poses), len(self.joints), 3, 4))
        self.forward_some(poses, np.arange(len(self.joints)), out, np.eye(4) if root is None else np.asarray(root, float))
        return out

    def forward_some(self, poses: Array, joints: NDArray[np.int64], transforms: Array, root: Array, offsets: Array | None = None) -> None:
        """Recompute, in place, only `joints` (parents first) of `transforms` (N, J, 3, 4); the others are taken as they stand.

        `offsets` (N, J, 3) gives every pose a skeleton of its own measures.
        """
        offsets = self.offsets if offsets is None else offsets
        size = min(BLOCK, max(len(poses), 1))
        _forward(np.ascontiguousarray(poses, float), joints, self.tree, offsets, np.ascontiguousarray(root[:3]), transforms,
                 np.zeros((len(self.joints), 3, 4, size)), np.empty((6, size)))

    def points(self, poses: ArrayLike, joints: NDArray[np.int64], places: Array, root: ArrayLike | None = None) -> Array:
        """Points (N, P, 3), metres, fixed to `joints` (P,) at `places` (P, 3) in their frames, of poses (N, D); `root` as in `forward`."""
        poses = np.ascontiguousarray(poses, float)
        out, size = np.empty((len(poses), len(joints), 3)), min(BLOCK, max(len(poses), 1))
        _points(poses, self.tree, self.offsets, np.ascontiguousarray((np.eye(4) if root is None else np.asarray(root, float))[:3]), joints,
                np.ascontiguousarray(places, float), out, np.zeros((len(self.joints), 3, 4, size)), np.empty((6, size)))  # fmt: skip
        return out


# Coefficients of fdlibm's kernels (Sun Microsystems 1993): sine and cosine within pi / 4, and pi / 2 in three parts.
_SINE = (-1.66666666666666324348e-01, 8.33333333332248946124e-03, -1.98412698298579493134e-04,
         2.75573137070700676789e-06, -2.50507602534068634195e-08, 1.58969099521155010221e-10)  # fmt: skip
_COSINE = (4.16666666666666019037e-02, -1.38888888888741095749e-03, 2.48015872894767294178e-05,
           -2.75573143513906633035e-07, 2.08757232129817482790e-09, -1.13596475577881948265e-11)  # fmt: skip
_QUARTER = (1.57079632673412561417, 6.07710050630396597660e-11, 2.02226624879595063154e-21)


@part
def sines(angles, sine, cosine):  # pragma: no cover
    """Sine and cosine (B,) of angles (B,), right to the last bit or two for angles under 1e5 rad; the C library's do not vectorise."""
    s0, s1, s2, s3, s4, s5 = _SINE
    c0, c1, c2, c3, c4, c5 = _COSINE
    for n in range(angles.size):
        turns = np.floor(angles[n] * (2 / np.pi) + 0.5)
        x = ((angles[n] - turns * _QUARTER[0]) - turns * _QUARTER[1]) - turns * _QUARTER[2]
        z = x * x
        s = x + x * z * (s0 + z * (s1 + z * (s2 + z * (s3 + z * (s4 + z * s5)))))
        c = 1 - 0.5 * z + z * z * (c0 + z * (c1 + z * (c2 + z * (c3 + z * (c4 + z * c5)))))
        quarter = turns - 4 * np.floor(0.25 * turns)
        odd = (quarter == 1) | (quarter == 3)
        up, along = (c, s) if odd else (s, c)
        sine[n] = -up if quarter >= 2 else up
        cosine[n] = -along if (quarter == 1) | (quarter == 2) else along


@part
def _begin_joint(poses, begin, j, tree, offsets, root, T, offset):  # pragma: no cover
    """The transforms (3, 4, B) of joint `j` before its DOF: its parent's, shifted by its offset (3, B), which follows its couplings."""
    parent, coupled, shifts = tree[0][j], tree[5], tree[6]
    own, last = T[j], poses.shape[0] - 1
    for r in range(3):
        for n in range(T.shape[3]):
            offset[r, n] = offsets[0, j, r]
        if offsets.shape[0] > 1:
            for n in range(T.shape[3]):
                offset[r, n] = offsets[min(begin + n, last), j, r]
    for k in range(coupled.shape[0]):
        if coupled[k, 0] == j:
            for n in range(T.shape[3]):
                value = poses[min(begin + n, last), coupled[k, 1]]
                for r in range(3):
                    offset[r, n] += value * shifts[k, r]
    for r in range(3):
        for c in range(4):
            for n in range(T.shape[3]):
                own[r, c, n] = root[r, c] if parent < 0 else T[parent, r, c, n]
        x, y, z, place = own[r, 0], own[r, 1], own[r, 2], own[r, 3]
        for n in range(T.shape[3]):
            place[n] += x[n] * offset[0, n] + y[n] * offset[1, n] + z[n] * offset[2, n]


@kernel
def place_joints(poses, begin, joints, tree, offsets, root, T, work):  # pragma: no cover
    """Transforms of `joints` in a block T (J, 3, 4, B), of the B poses from `begin` on (the last again where they end).

    Each is the parent's transform, its offset, its DOF; a rotation about an axis mixes the other two columns. `work`: (6, B).
    """
    first, axes, signs, turns = tree[1], tree[2], tree[3], tree[4]
    value, sine, cosine = work[3], work[4], work[5]
    for j in joints:
        _begin_joint(poses, begin, j, tree, offsets, root, T, work)
        for d in range(first[j], first[j + 1]):
            for n in range(value.size):
                value[n] = signs[d] * poses[min(begin + n, poses.shape[0] - 1), d]
            if turns[d]:
                sines(value, sine, cosine)
                _turn(T[j], (axes[d] + 1) % 3, (axes[d] + 2) % 3, sine, cosine)
            else:
                for r in range(3):
                    along, place = T[j, r, axes[d]], T[j, r, 3]
                    for n in range(value.size):
                        place[n] += along[n] * value[n]


@part
def _turn(T, a, b, sine, cosine):  # pragma: no cover
    """Columns a and b of transforms (3, 4, B) turned by angles (B,)."""
    for r in range(3):
        u, v = T[r, a], T[r, b]
        for n in range(sine.size):
            x, y = u[n], v[n]
            u[n], v[n] = cosine[n] * x + sine[n] * y, cosine[n] * y - sine[n] * x


@part
def load_joints(transforms, begin, T):  # pragma: no cover
    """Transforms (N, J, 3, 4) from `begin` on, as far as there are any, into a block (J, 3, 4, B)."""
    for n in range(min(T.shape[3], transforms.shape[0] - begin)):
        for j in range(T.shape[0]):
            for r in range(3):
                for c in range(4):
                    T[j, r, c, n] = transforms[begin + n, j, r, c]


@kernel
def _forward(poses, joints, tree, offsets, root, out, T, work):  # pragma: no cover
    """Transforms of `joints` into `out` (N, J, 3, 4), which holds those of the others. Room: T (J, 3, 4, B), work (6, B)."""
    for begin in range(0, poses.shape[0], T.shape[3]):
        load_joints(out, begin, T)
        place_joints(poses, begin, joints, tree, offsets, root, T, work)
        for n in range(min(T.shape[3], poses.shape[0] - begin)):
            for j in joints:
                for r in range(3):
                    for c in range(4):
                        out[begin + n, j, r, c] = T[j, r, c, n]


@kernel
def _points(poses, tree, offsets, root, joints, places, out, T, work):  # pragma: no cover
    """Points (N, P, 3) at `places` (P, 3) in the frames of `joints` (P,). Room: T (J, 3, 4, B), work (6, B)."""
    for begin in range(0, poses.shape[0], T.shape[3]):
        place_joints(poses, begin, range(T.shape[0]), tree, offsets, root, T, work)
        for i in range(joints.size):
            x, y, z = places[i, 0], places[i, 1], places[i, 2]
            for r in range(3):
                row = T[joints[i], r]
                for n in range(min(T.shape[3], poses.shape[0] - begin)):
                    out[begin + n, i, r] = row[0, n] * x + row[1, n] * y + row[2, n] * z + row[3, n]
