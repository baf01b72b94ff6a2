"""Torso, arms and legs of a body: their joints, degrees of freedom and parts, and coarse postures of a limb."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from itertools import product

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.angles import rotation_angles
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import SIDES, Dof, Skeleton
from shadowpuppet.geometry import Array, rotation_about


def _both(torso: tuple[str, ...], arm: tuple[str, ...], leg: tuple[str, ...]) -> dict[str, tuple[str, ...]]:
    limbs = (("arm", arm), ("leg", leg))
    return {"torso": torso} | {f"{side}_{limb}": tuple(f"{side}_{name}" for name in names) for limb, names in limbs for side in SIDES}


SEGMENT_JOINTS = _both(("pelvis", "torso", "chest", "head"), ("shoulder", "elbow"), ("hip", "knee", "ankle"))
"""Joints that each segment may have."""
PULLED_POINTS = _both(("left_shoulder", "right_shoulder"), ("elbow", "hand"), ("knee", "ankle"))
"""Landmarks by which the motion cost pulls each segment to its last position."""


def segments_of(skeleton: Skeleton) -> tuple[str, ...]:
    """The segments that a skeleton has: torso, arms, legs."""
    return tuple(name for name, joints in SEGMENT_JOINTS.items() if set(joints) & set(skeleton.joint_names))


def limbs_of(skeleton: Skeleton) -> tuple[str, ...]:
    """Arms and legs of a skeleton."""
    return tuple(name for name in segments_of(skeleton) if name != "torso")


def dofs_of(skeleton: Skeleton, segment: str) -> NDArray[np.int64]:
    """Indices of a segment's DOF."""
    return np.flatnonzero([dof.joint in SEGMENT_JOINTS[segment] for dof in skeleton.dofs])


def parts_of(body: Body, segment: str) -> list[str]:
    """Names of the body parts that lie wholly on a segment."""
    joints = [i for i, name in enumerate(body.skeleton.joint_names) if name in SEGMENT_JOINTS[segment]]
    inside = np.flatnonzero(np.isin(body.shapes.joints, joints).all(1))
    return list(dict.fromkeys(body.parts[shape] for shape in inside))


def coarse_limbs(skeleton: Skeleton, limb: str) -> Array:
    """Coarse postures (K, d) of an arm or leg over its whole range, rad, in its own DOF. Cached, read-only."""
    return _coarse(tuple(skeleton.dofs[d] for d in dofs_of(skeleton, limb)))


def keep_limb_directions(skeleton: Skeleton, before: Array, poses: Array, limbs: Iterable[str]) -> Array:
    """Poses (N, D) with some limbs turned in their first joint to their directions in the pose `before` (D,), within limits."""
    poses, (low, high) = poses.copy(), skeleton.limits
    for limb in limbs:
        joint = skeleton.joint_index(SEGMENT_JOINTS[limb][0])
        parent, dofs = skeleton.tree[0][joint], dofs_of(skeleton, limb)[:3]
        above, T = np.arange(parent + 1), np.empty((len(poses), len(skeleton.joints), 3, 4))
        skeleton.forward_some(poses, above, T, np.eye(4))
        own = skeleton.forward(before[None])[0, joint, :, :3]
        turned = rotation_angles(np.swapaxes(T[:, parent, :, :3], 1, 2) @ own, [skeleton.dofs[d] for d in dofs])
        poses[:, dofs] = np.clip(turned, low[dofs], high[dofs])
    return poses


@cache
def coarse_arms() -> Array:
    """Coarse arms (K, 4) of upper bodies, rad: abduction, forward, roll, flexion. A straight arm has no roll. Cached, read-only."""
    bent = [(roll, flexion) for roll in (-80, -40, 0, 45, 90) for flexion in (45, 90, 130)]
    arms = np.radians([(*shoulder, *elbow) for shoulder in product((0, 20, 45, 70, 90, 110, 135, 165), (0, 40, 80))
                       for elbow in ((0, 5), *bent)])  # fmt: skip
    arms.setflags(write=False)
    return arms


def leg_postures(skeleton: Skeleton, leg: str, flexed: Array) -> Array:
    """Values (K, d) of a leg's own DOF, rad, for flexions (K, 3) of hip, knee and ankle; the ankle's is positive with the toes down."""
    return _own(tuple(skeleton.dofs[d] for d in dofs_of(skeleton, leg)), np.insert(flexed, [0, 1], 0.0, axis=1))


@cache
def _coarse_legs() -> Array:
    """Coarse legs (K, 5), rad: abduction, forward, twist, flexion of the knee, and of the ankle, whose toes point down where the shank may
    lie on the floor."""
    legs = product((-5, 5, 20, 45), (-25, 0, 25, 55, 90), (0, 35), (5, 40, 80, 115), (0, 55))
    return np.radians([leg for leg in legs if not leg[4] or (leg[1] <= 0 and leg[3] >= 80)])


@cache
def _coarse(dofs: tuple[Dof, ...]) -> Array:
    if dofs[1].name.endswith("_forward"):
        return coarse_arms()
    out = _own(dofs, _coarse_legs() if "hip" in dofs[0].joint else coarse_arms())
    out.setflags(write=False)
    return out


def _own(dofs: tuple[Dof, ...], library: Array) -> Array:
    """Values (K, d) of a limb's own DOF for abduction, forward, twist, flexion and, of a leg, the ankle's flexion: (K, 4) or (K, 5)."""
    out, side = np.zeros((len(library), len(dofs))), 1 if dofs[0].joint.startswith("left") else -1
    x, y, z = (rotation_about(axis, sign * column) for axis, sign, column in zip(np.eye(3), (side, -1, side), library.T))
    out[:, :3], out[:, 3] = rotation_angles(x @ y @ z, dofs[:3]), library[:, 3]
    out[:, 4:5] = library[:, 4:5]
    return np.clip(out, [dof.low for dof in dofs], [dof.high for dof in dofs])
