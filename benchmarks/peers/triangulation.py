"""Landmarks of MediaPipe Pose as our joints in the world: of one camera turned, of several triangulated and smoothed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.metrics import LIMB_JOINTS
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.tracking.keypoints.triangulation import triangulated
from shadowpuppet.tracking.smoothing.butterworth import filtered

LANDMARKS = dict(zip(LIMB_JOINTS, (11, 12, 13, 14, 15, 16, 23, 24, 25, 26, 27, 28)))
"""MediaPipe's number of each joint; its left is the person's."""
SEEN = 0.5
"""Least visibility of a landmark that is used, the middle of its range."""
LONGEST_GAP = 0.5
"""Seconds over which an unknown joint is interpolated, as in our own runs."""
CUTOFF = 6.0
"""Cut-off of the smoothing, Hz."""


def one_camera(camera: Camera, times: Array, world: Array) -> JointTable:
    """MediaPipe's own metres (T, 33, 3), which are about the hips along the camera's axes, turned into the world."""
    return JointTable(times, LIMB_JOINTS, world[:, list(LANDMARKS.values())] @ camera.T_camera_world[:3, :3])


def several_cameras(cameras: Sequence[Camera], times: Array, pixels: Array, visibility: Array) -> JointTable:
    """Joints of C cameras' landmarks, pixels (C, T, 33, 2) and visibility (C, T, 33): triangulated, short gaps filled, smoothed."""
    chosen = list(LANDMARKS.values())
    seen = (visibility[..., chosen] >= SEEN) & np.isfinite(pixels[..., chosen, 0])
    points = triangulated(cameras, pixels[:, :, chosen], np.where(seen, visibility[..., chosen], 0.0))
    step = float(np.median(np.diff(times)))
    smooth = filtered(times, points, min(CUTOFF, 0.4 / step))  # below half the frame rate
    for joint, unknown in enumerate(np.isnan(points[..., 0]).T):
        for begin, end in true_runs(unknown):
            if (end - begin) * step > LONGEST_GAP:
                smooth[begin:end, joint] = np.nan
    return JointTable(times, LIMB_JOINTS, smooth)
