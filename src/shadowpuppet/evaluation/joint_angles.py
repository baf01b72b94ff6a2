"""Errors of joint angles, against the poses of the run's body that fit the truth's joints best."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.evaluation.error_metrics import angle_errors
from shadowpuppet.geometry import Array, wrapped
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


def turn_errors(skeleton: Skeleton, ours: Array, theirs: Array, aligned: bool = False) -> dict[str, float]:
    """Root mean square angle between the rotations of each joint in poses (N, D), degrees, and of `all`.

    One angle a joint, of the whole rotation; it includes the twist of a straight limb, which joints do not show. Heads and ankles are left
    out. `aligned`: after the constant turns of both bones' frames that bring run and truth nearest to each other, which are a matter of
    how frames are defined, in the manner of REFRAME.
    """
    kept = [j for j, joint in enumerate(skeleton.joints) if not joint.name.endswith(UNOBSERVABLE)]
    turns = [_local_rotations(skeleton, poses)[:, kept] for poses in (ours, theirs)]
    if aligned:
        turns[0] = np.stack([frame_aligned(a, b) for a, b in zip(*(each.swapaxes(0, 1) for each in turns))], axis=1)
    cosine = (np.einsum("njab,njab->nj", *turns) - 1) / 2
    squares = np.degrees(np.arccos(np.clip(cosine, -1, 1))) ** 2
    by_joint = dict(zip((skeleton.joints[j].name for j in kept), np.sqrt(squares.mean(0)).tolist(), strict=True))
    return by_joint | {"all": float(np.sqrt(squares.mean()))}


def dof_errors(skeleton: Skeleton, ours: Array, theirs: Array) -> dict[str, dict[str, float]]:
    """Errors of each angle of poses (N, D), degrees, wrapped, as in Fig. 7 of Ni 2008: mean, mean absolute value, RMS; `aligned`: RMS
    without the mean.

    Translations, components of rotation vectors, heads and ankles are left out.
    """
    found = {}
    for d, dof in enumerate(skeleton.dofs):
        if dof.kind == "rotation" and not dof.joint.endswith(UNOBSERVABLE):
            found[dof.name] = angle_errors(np.degrees(wrapped(ours[:, d] - theirs[:, d])))
    return found


def frame_aligned(ours: Array, theirs: Array) -> Array:
    """Rotations (N, 3, 3) between two constant ones that bring them nearest to others (N, 3, 3); the two are found in turn, 50 times."""
    above, below = np.eye(3), np.eye(3)
    for _ in range(50):
        below = _nearest_rotation((ours.swapaxes(1, 2) @ above.T @ theirs).sum(0))
        above = _nearest_rotation((theirs @ (ours @ below).swapaxes(1, 2)).sum(0))
    return above @ ours @ below


def _nearest_rotation(matrix: Array) -> Array:
    """The rotation (3, 3) nearest to a sum of rotations."""
    u, _, vt = np.linalg.svd(matrix)
    return u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt


def _local_rotations(skeleton: Skeleton, poses: Array) -> Array:
    """Rotations (N, J, 3, 3) of joints relative to their parents."""
    world = skeleton.forward(poses)[..., :3]
    above = [skeleton.joint_index(joint.parent) if joint.parent else None for joint in skeleton.joints]
    return np.stack([world[:, j] if k is None else world[:, k].swapaxes(1, 2) @ world[:, j] for j, k in enumerate(above)], axis=1)
