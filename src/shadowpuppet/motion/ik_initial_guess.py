"""Initial poses for inverse kinematics: from joints to frames of the segments, from frames to angles.

A limb's frame follows from two directions: its own, and that of the segment below, which bends about one axis only.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.angles import angles_over_time
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.geometry import Array, rotation_about, shortest_rotation, unit
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.plausibility import leftward, midpoint, positions_of
from shadowpuppet.motion.synchronization import nearest

STRAIGHT = 0.15
"""Sine of a bend below which a limb's twist is carried over rather than measured."""
UNTWIST_RATE = 0.05
"""Rate per frame at which a straight limb's twist returns to none."""
CHEST_BEND = 0.2
"""Initial bend of the chest, rad."""


def initial_poses(body: Body, table: JointTable) -> Array:
    """Poses (T, D) near the joints of a table, on the smoothest branch within the limits. Unknown frames take their nearest known one's."""
    skeleton, frames = body.skeleton, _frames(body, table)
    poses = np.repeat(np.array([[dof.rest for dof in skeleton.dofs]]), len(table.times), axis=0)
    pelvis = positions_of(table, "pelvis") if "pelvis" in table.names else midpoint(table, "hip")
    poses[:, skeleton.dof_indices(["root_x", "root_y", "root_z"])] = _filled(pelvis)
    for joint in skeleton.joints:
        dofs = [d for d, dof in enumerate(skeleton.dofs) if dof.joint == joint.name and dof.kind != "translation"]
        if len(dofs) == 3 and joint.name in frames and _known(frames[joint.name]).any():
            parent = np.eye(3) if joint.parent is None else frames[joint.parent]
            relative = np.swapaxes(_filled(parent * np.ones((len(poses), 3, 3))), 1, 2) @ _filled(frames[joint.name])
            poses[:, dofs] = angles_over_time(relative, [skeleton.dofs[d] for d in dofs])
    for side in SIDES:
        for names in (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle")):
            a, b, c = (positions_of(table, f"{side}_{name}") for name in names)
            bend = np.arccos(np.clip((unit(b - a) * unit(c - b)).sum(1), -1, 1))
            if np.isfinite(bend).any():
                poses[:, skeleton.dof_indices([f"{side}_{names[1]}_flexion"])[0]] = _filled(bend)
    return skeleton.clamp(poses)


def _frames(body: Body, table: JointTable) -> dict[str, Array]:
    """Frames (T, 3, 3) of segments in the world: columns forward, left and up of a person standing in the zero pose."""
    up = midpoint(table, "shoulder") - midpoint(table, "hip")
    shoulders = unit(positions_of(table, "left_shoulder") - positions_of(table, "right_shoulder"))
    frames = {"pelvis": _upright(leftward(table), up), "chest": _upright(shoulders, up)}
    trunk = "pelvis"
    if "chest" in body.skeleton.joint_names:  # a trunk that is short for its bones bends forward, not backward
        trunk, frames["pelvis"] = "chest", frames["pelvis"] @ rotation_about([0, 1, 0], -CHEST_BEND)
    if {"neck", "head"} <= set(table.names):
        frames["head"] = _swing(frames[trunk], unit(positions_of(table, "head") - positions_of(table, "neck")), up=1)
    for side in SIDES:
        for names, parent, sign in ((("shoulder", "elbow", "wrist"), trunk, 1), (("hip", "knee", "ankle"), "pelvis", -1)):
            a, b, c = (positions_of(table, f"{side}_{name}") for name in names)
            start = a if np.isfinite(a).any() else midpoint(table, names[0])
            frames[f"{side}_{names[0]}"] = _limb(frames[parent], unit(b - start), sign * unit(c - b))
    return frames


def _upright(left: Array, up: Array) -> Array:
    """Frames (T, 3, 3) with y along `left` (T, 3) and z as near to `up` as possible."""
    x = unit(np.cross(left, up))
    return np.stack([x, left, np.cross(x, left)], 2)


def _swing(parent: Array, along: Array, up: int) -> Array:
    """Parents' frames (T, 3, 3) rotated the shortest way so that z (`up` 1), or -z (-1), points along unit vectors (T, 3)."""
    return shortest_rotation(up * parent[:, :, 2], along, 1e-3) @ parent


def _limb(parent: Array, along: Array, bend: Array) -> Array:
    """Frames (T, 3, 3) of limbs along unit vectors (T, 3) whose lower segments, along `bend` (T, 3), bend toward +x. A straight limb's
    frame follows the last frame without twist, and slowly returns to the shortest rotation from hanging, which jumps where a limb points
    straight up."""
    bend = np.where(np.isfinite(bend), bend, 0)
    leftward = bend - (bend * along).sum(1)[:, None] * along
    calm = _swing(parent, along, up=-1)[:, :, 0] * (1 - (parent[:, :, 2] * along).sum(1)).clip(0, 1)[:, None]
    x, local = np.empty_like(along), np.array([1.0, 0, 0])
    for t in range(len(x)):
        kept = parent[t] @ local
        toward = leftward[t] + STRAIGHT**2 / (STRAIGHT + np.linalg.norm(leftward[t])) * (kept + UNTWIST_RATE * calm[t])
        toward = toward - (toward @ along[t]) * along[t]
        x[t] = toward / max(np.linalg.norm(toward), 1e-9)
        if np.isfinite(x[t]).all():
            local = parent[t].T @ x[t]
    return np.stack([x, np.cross(-along, x), -along], 2)


def _filled(values: Array) -> Array:
    """Values (T, ...) with incomplete frames replaced by the nearest complete one."""
    known = np.flatnonzero(_known(values))
    if not len(known):
        return np.broadcast_to(np.eye(3), values.shape) if values.shape[1:] == (3, 3) else np.zeros_like(values)
    return values[known[nearest(known, np.arange(len(values)))]]


def _known(values: Array) -> NDArray[np.bool_]:
    """Whether all of a frame's values (T, ...) are known, of shape (T,)."""
    return np.asarray(np.isfinite(values).reshape(len(values), -1).all(1))
