"""A film tracked forward and backward by one camera's tracker, and the two motions blended.

Where the silhouettes allow several poses, a tracker stays with what it came from. Backward it comes from the other side, so that the two
passes err differently: the one whose body fits the silhouettes better over a moment is the likelier.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.upper_body import TWIST
from shadowpuppet.geometry import Array
from shadowpuppet.motion.motion import Motion
from shadowpuppet.tracking.smoothing.facing import NEAR
from shadowpuppet.tracking.smoothing.projection import Points

MOMENT = 0.6
"""Time (s) over which the costs of the two passes are averaged: those of single frames differ by chance."""
TEMPERATURE = 30.0
"""For this much less cost (pixels at 320 x 240) a pass weighs e times as much as the other."""
PROFILE = 0.5
"""Time (s) before and after a profile in which the forward pass alone counts: in profile the passes may be each other's mirror image, and
what is between them is neither."""


def backward_share(times: Array, forward: Array, backward: Array, near: NDArray[np.bool_], scale: float = 1.0) -> Array:
    """Weight (T,), 0 to 1, of the backward pass in each frame; the forward pass has the rest.

    Args:
        times: of the frames (T,), seconds.
        forward: costs (T,) of the forward pass, pixels; not a number where it has no pose.
        backward: those of the backward pass, likewise.
        near: frames (T,) in which one of them has the person near a profile.
        scale: `pixel_scale` of the picture.
    """
    ahead, back = np.isfinite(forward), np.isfinite(backward)
    both = ahead & back
    apart, number = (np.concatenate([[0.0], np.cumsum(values)]) for values in (np.where(both, forward - backward, 0.0), both))
    first, last = _around(times, MOMENT / 2)
    mean = (apart[last] - apart[first]) / np.maximum(number[last] - number[first], 1)
    share = 1 / (1 + np.exp(np.clip(-mean / (TEMPERATURE * scale), -50, 50)))
    profiles = np.concatenate([[0], np.cumsum(near)])
    first, last = _around(times, PROFILE)
    share = np.where(profiles[last] > profiles[first], 0.0, share)
    return np.where(both, share, np.where(back, 1.0, 0.0))


def near_profile(dof_names: tuple[str, ...], poses: Array) -> NDArray[np.bool_]:
    """Frames (T,) in which poses (T, D) of an upper body are twisted about a profile."""
    if TWIST not in dof_names:
        return np.zeros(len(poses), bool)
    return np.abs(np.nan_to_num(poses[:, dof_names.index(TWIST)])) > NEAR


def blended(forward: Motion, backward: Motion, points: Points, scale: float = 1.0) -> tuple[Motion, Array]:
    """Two motions of the same frames as one, and the weight (T,) of the backward one.

    Poses are means by weight, with the joints that follow from them (`points`: poses to the motion's joints, metres, world); deviations
    are those of a mixture, so that they grow where the two differ. Statuses are those of the one that weighs more.
    """
    near = near_profile(forward.dof_names, forward.poses) | near_profile(backward.dof_names, backward.poses)
    ahead, back = (np.where(motion.known, motion.cost, np.nan) for motion in (forward, backward))
    share = backward_share(forward.times, ahead, back, near, scale)
    mostly = share > 0.5
    poses, joints = _mixed(share, forward.poses, backward.poses), np.where(mostly[:, None, None], backward.joints, forward.joints)
    mixed = (share > 0) & (share < 1)
    joints[mixed] = points(poses[mixed])
    pose_sd = mixed_deviations(share, (forward.poses, backward.poses), (forward.pose_sd, backward.pose_sd), poses)
    joint_sd = mixed_deviations(share, (forward.joints, backward.joints), (forward.joint_sd, backward.joint_sd), joints)
    return replace(
        forward, poses=poses, joints=joints, pose_sd=pose_sd, joint_sd=joint_sd, cost=_mixed(share, forward.cost, backward.cost),
        overlap=_mixed(share, forward.overlap, backward.overlap), status=np.where(mostly, backward.status, forward.status),
        limb_status=np.where(mostly[:, None], backward.limb_status, forward.limb_status)), share  # fmt: skip


def _around(times: Array, reach: float) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """The first frames (T,) at most `reach` (s) before each, and those after the last at most as much later."""
    return np.searchsorted(times, times - reach - 1e-6), np.searchsorted(times, times + reach + 1e-6)


def _mixed(share: Array, forward: Array, backward: Array) -> Array:
    """Means by weight (T, ...); where one has all of the weight, its value, though the other is unknown."""
    share = share.reshape(-1, *(1,) * (forward.ndim - 1))
    return np.where(share == 0, forward, np.where(share == 1, backward, (1 - share) * forward + share * backward))


def mixed_deviations(share: Array, values: tuple[Array, Array], sds: tuple[Array, Array], mean: Array) -> Array:
    """Deviations (T, ...) of a mixture of two values (T, ...) with their deviations, about `mean` (T, ...)."""
    forward, backward = (sd**2 + (value - mean) ** 2 for value, sd in zip(values, sds))
    return np.sqrt(_mixed(share, forward, backward))
