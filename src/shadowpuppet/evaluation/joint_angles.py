"""Errors of joint angles, against the poses of the run's body that fit the truth's joints best."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.motion.synchronization import match

UNOBSERVABLE = ("head", "_ankle")
"""Endings of the names of joints whose rotation is not determined by the joints' positions."""


def compared_poses(motion: Motion, truth: JointTable, start: int = 0) -> tuple[Skeleton, Array, Array]:
    """The skeleton, and the run's and the truth's poses (N, D) of the frames in which both are known.

    Frames are matched by time, within half a step of the truth. Raises `ShadowPuppetError` for another body, or joints that are not those
    of a whole person.
    """
    fitted = fit_poses(truth, motion.body_name, source="truth")
    index, matched = match(motion.times, truth.times[start:])
    ours, theirs = motion.poses[index], fitted.poses[start:]
    known = matched & np.isfinite(ours).all(1) & np.isfinite(theirs).all(1)
    if not known.any():
        raise ShadowPuppetError("angles: found no frame in which both the run and the truth have all joints")
    return fitted.body.skeleton, ours[known], theirs[known]


def turn_errors(skeleton: Skeleton, ours: Array, theirs: Array) -> dict[str, float]:
    """Root mean square angle between the rotations of each joint in poses (N, D), degrees, and of `all`.

    One angle a joint, of the whole rotation; it includes the twist of a straight limb, which joints do not show. Heads and ankles are left
    out.
    """
    turns = [_local_rotations(skeleton, poses) for poses in (ours, theirs)]
    kept = [j for j, joint in enumerate(skeleton.joints) if not joint.name.endswith(UNOBSERVABLE)]
    cosine = (np.einsum("njab,njab->nj", *turns)[:, kept] - 1) / 2
    squares = np.degrees(np.arccos(np.clip(cosine, -1, 1))) ** 2
    by_joint = dict(zip((skeleton.joints[j].name for j in kept), np.sqrt(squares.mean(0)).tolist(), strict=True))
    return by_joint | {"all": float(np.sqrt(squares.mean()))}


def dof_errors(skeleton: Skeleton, ours: Array, theirs: Array) -> dict[str, dict[str, float]]:
    """Errors of each angle of poses (N, D), degrees, wrapped, as in Fig. 7 of Ni 2008: mean, mean absolute value, RMS.

    Translations, components of rotation vectors, heads and ankles are left out.
    """
    found = {}
    for d, dof in enumerate(skeleton.dofs):
        if dof.kind == "rotation" and not dof.joint.endswith(UNOBSERVABLE):
            off = np.degrees(wrapped(ours[:, d] - theirs[:, d]))
            found[dof.name] = {"bias": float(off.mean()), "mean": float(np.abs(off).mean()), "rmse": float(np.sqrt((off**2).mean()))}
    return found


def wrapped(angles: Array) -> Array:
    """Angles, radians, wrapped to [-pi, pi)."""
    return (np.asarray(angles, float) + np.pi) % (2 * np.pi) - np.pi


def _local_rotations(skeleton: Skeleton, poses: Array) -> Array:
    """Rotations (N, J, 3, 3) of joints relative to their parents."""
    world = skeleton.forward(poses)[..., :3]
    above = [skeleton.joint_index(joint.parent) if joint.parent else None for joint in skeleton.joints]
    return np.stack([world[:, j] if k is None else world[:, k].swapaxes(1, 2) @ world[:, j] for j, k in enumerate(above)], axis=1)
