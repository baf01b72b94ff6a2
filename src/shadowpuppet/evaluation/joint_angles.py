"""Errors of joint angles: against the poses of the run's body that fit the truth's joints best."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.motion import JointTable, Motion
from shadowpuppet.motion.synchronization import match

UNTOLD = ("head", "_ankle")
"""Joints of whose turns the places of joints tell little or nothing."""


def angle_errors(motion: Motion, truth: JointTable, start: int = 0) -> dict[str, float]:
    """By what angle each joint of a whole body is turned otherwise than in the poses that fit the truth best: root mean square, degrees,
    by joint, and of `all`.

    One angle a joint, of the whole turn between the two; how a straight limb is turned about itself, which joints do not show, is in it.
    Heads and ankles are left out, of whose turns the places of joints tell little or nothing; so are frames without a pose. Raises
    `ShadowPuppetError` for another body, or joints that are no whole person's.
    """
    return turn_errors(*compared_poses(motion, truth, start))


def compared_poses(motion: Motion, truth: JointTable, start: int = 0) -> tuple[Skeleton, Array, Array]:
    """The skeleton that fits the truth, and the run's and the truth's poses (N, D) of the frames in which both are known.

    Frames belong together that are nearest in time, within half a step of the truth. Raises `ShadowPuppetError`.
    """
    fitted = fit_poses(truth, motion.body_name, source="truth")
    index, matched = match(motion.times, truth.times[start:])
    ours, theirs = motion.poses[index], fitted.poses[start:]
    known = matched & np.isfinite(ours).all(1) & np.isfinite(theirs).all(1)
    if not known.any():
        raise ShadowPuppetError("angles: found no frame in which both the run and the truth have all joints")
    return fitted.body.skeleton, ours[known], theirs[known]


def turn_errors(skeleton: Skeleton, ours: Array, theirs: Array) -> dict[str, float]:
    """Angles between the turns of each joint in poses (N, D); see `angle_errors`."""
    turns = [_own_turns(skeleton, poses) for poses in (ours, theirs)]
    told = [j for j, joint in enumerate(skeleton.joints) if not joint.name.endswith(UNTOLD)]
    cosine = (np.einsum("njab,njab->nj", *turns)[:, told] - 1) / 2
    squares = np.degrees(np.arccos(np.clip(cosine, -1, 1))) ** 2
    by_joint = dict(zip((skeleton.joints[j].name for j in told), np.sqrt(squares.mean(0)).tolist(), strict=True))
    return by_joint | {"all": float(np.sqrt(squares.mean()))}


def dof_errors(skeleton: Skeleton, ours: Array, theirs: Array) -> dict[str, dict[str, float]]:
    """Errors of each angle of poses (N, D), degrees, the short way round (`wrapped`), as Ni 2008 shows them (Fig. 7): signed mean, mean
    size, root mean square. Shifts, components of rotation vectors, which are no angles of their own, heads and ankles are left out."""
    found = {}
    for d, dof in enumerate(skeleton.dofs):
        if dof.kind == "rotation" and not dof.joint.endswith(UNTOLD):
            off = np.degrees(wrapped(ours[:, d] - theirs[:, d]))
            found[dof.name] = {"bias": float(off.mean()), "mean": float(np.abs(off).mean()), "rmse": float(np.sqrt((off**2).mean()))}
    return found


def wrapped(angles: Array) -> Array:
    """Angles, radians, as the same ones from -pi up to, but not, pi."""
    return (np.asarray(angles, float) + np.pi) % (2 * np.pi) - np.pi


def _own_turns(skeleton: Skeleton, poses: Array) -> Array:
    """Rotations (N, J, 3, 3) of joints against those that they hang on."""
    world = skeleton.forward(poses)[..., :3]
    above = [skeleton.joint_index(joint.parent) if joint.parent else None for joint in skeleton.joints]
    return np.stack([world[:, j] if k is None else world[:, k].swapaxes(1, 2) @ world[:, j] for j, k in enumerate(above)], axis=1)
