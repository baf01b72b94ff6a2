"""Motions of bodies with stated deviations, and their smoothers."""

from __future__ import annotations

import numpy as np
from runs import body_of, root_of

from shadowpuppet.motion.motion import Motion
from shadowpuppet.tracking.smoothing.smoothing import MotionSmoother

RATE = 30.0


def smoother(name: str, **settings) -> MotionSmoother:
    body = body_of(name)
    return MotionSmoother(body.skeleton, lambda poses: body.points(poses, root_of(body)), **settings)


def motion_of(name: str, poses: np.ndarray, lost=(), sd: float = 0.03) -> Motion:
    body, T = body_of(name), len(poses)
    gone = np.isin(np.arange(T), lost)
    blank = np.where(gone, np.nan, 1.0)
    joints = body.points(poses, root_of(body))
    return Motion(body_name=name, dof_names=body.skeleton.dof_names, joint_names=body.landmark_names, times=np.arange(T) / RATE,
                  poses=poses * blank[:, None], pose_sd=np.full(poses.shape, 2 * sd) * blank[:, None], joints=joints * blank[:, None, None],
                  joint_sd=np.full(joints.shape, sd) * blank[:, None, None], cost=np.full(T, 5.0), overlap=np.full(T, 0.9),
                  status=np.where(gone, "lost", "tracked"))  # fmt: skip
