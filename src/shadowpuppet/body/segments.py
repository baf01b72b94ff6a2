"""Torso, arms and legs of a body: the joints, degrees of freedom and parts of each, and coarse postures of a limb."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.angles import angles_of
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import Dof, Skeleton
from shadowpuppet.body.upper_body import SIDES
from shadowpuppet.geometry import Array, rotation_about


def _both(torso: tuple[str, ...], arm: tuple[str, ...], leg: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    limbs = (("arm", arm), ("leg", leg))
    return {"torso": torso} | {f"{side}_{limb}": tuple(f"{side}_{name}" for name in names) for limb, names in limbs for side in SIDES}


JOINTS = _both(("pelvis", "torso", "chest", "head"), ("shoulder", "elbow"), ("hip", "knee", "ankle"))
"""Joints that a member may have."""
HELD = _both(("left_shoulder", "right_shoulder"), ("elbow", "hand"), ("knee", "ankle"))
"""Points by which each member is held where it was."""
GIVEN = ("root_x",)
"""DOF that one camera's silhouettes do not tell: how far away the person is stays as it was found."""


def members_of(skeleton: Skeleton) -> tuple[str, ...]:
    """The members that a skeleton has."""
    return tuple(name for name, joints in JOINTS.items() if set(joints) & set(skeleton.joint_names))


def limbs_of(skeleton: Skeleton) -> tuple[str, ...]:
    """Arms and legs of a skeleton."""
    return tuple(name for name in members_of(skeleton) if name != "torso")


def dofs_of(skeleton: Skeleton, member: str) -> NDArray[np.int64]:
    """Indices of a member's DOF that are sought in silhouettes."""
    return np.flatnonzero([dof.joint in JOINTS[member] and dof.name not in GIVEN for dof in skeleton.dofs])


def parts_of(body: Body, member: str) -> list[str]:
    """Names of the parts that lie wholly on a member."""
    joints = [i for i, name in enumerate(body.skeleton.joint_names) if name in JOINTS[member]]
    inside = np.flatnonzero(np.isin(body.shapes.joints, joints).all(1))
    return list(dict.fromkeys(body.parts[shape] for shape in inside))


def coarse_limbs(skeleton: Skeleton, limb: str) -> Array:
    """Postures (K, d) of an arm or leg, rad, all over its range, in its own DOF. Made once, read-only."""
    return _coarse(tuple(skeleton.dofs[d] for d in dofs_of(skeleton, limb)))


def steady(skeleton: Skeleton, before: Array, poses: Array, limbs: Iterable[str]) -> Array:
    """Poses (N, D) with some limbs turned in their first joint so that they point as in the pose `before` (D,), as far as limits allow."""
    poses, (low, high) = poses.copy(), skeleton.limits
    for limb in limbs:
        joint = skeleton.joint_index(JOINTS[limb][0])
        parent, dofs = skeleton.tree[0][joint], dofs_of(skeleton, limb)[:3]
        above, T = np.arange(parent + 1), np.empty((len(poses), len(skeleton.joints), 3, 4))
        skeleton.forward_some(poses, above, T, np.eye(4))
        own = skeleton.forward(before[None])[0, joint, :, :3]
        turned = angles_of(np.swapaxes(T[:, parent, :, :3], 1, 2) @ own, [skeleton.dofs[d] for d in dofs])
        poses[:, dofs] = np.clip(turned, low[dofs], high[dofs])
    return poses


@cache
def coarse_arms() -> Array:
    """Arms (K, 4), rad, of upper bodies: abduction, forward, roll, flexion. A straight arm has no roll. Made once, read-only."""
    bent = [(roll, flexion) for roll in (-80, -40, 0, 45, 90) for flexion in (45, 90, 130)]
    arms = np.radians([(*shoulder, *elbow) for shoulder in product((0, 20, 45, 70, 90, 110, 135, 165), (0, 40, 80))
                       for elbow in ((0, 5), *bent)])  # fmt: skip
    arms.setflags(write=False)
    return arms


@cache
def _coarse_legs() -> Array:
    """Legs (K, 4), rad: abduction, forward, twist, flexion of the knee."""
    return np.radians(list(product((-5, 5, 20, 45), (-25, 0, 25, 55, 90), (0, 35), (5, 40, 80, 115))))


@cache
def _coarse(dofs: tuple[Dof, ...]) -> Array:
    if dofs[1].name.endswith("_forward"):
        return coarse_arms()
    library = _coarse_legs() if "hip" in dofs[0].joint else coarse_arms()
    out, side = np.zeros((len(library), len(dofs))), 1 if dofs[0].joint.startswith("left") else -1
    x, y, z = (rotation_about(axis, sign * column) for axis, sign, column in zip(np.eye(3), (side, -1, side), library.T))
    out[:, :3], out[:, 3] = angles_of(x @ y @ z, dofs[:3]), library[:, 3]
    out = np.clip(out, [dof.low for dof in dofs], [dof.high for dof in dofs])
    out.setflags(write=False)
    return out
