"""Poses of a flat board before a camera: both that fit one view (IPPE, Collins and Bartoli 2014)."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from shadowpuppet.calibration.boards.board import Board
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import Array, rigid

AMBIGUOUS = 3.0
"""Both poses are kept if the worse one's error is at most this many times the better one's."""
MIN_ERROR = 0.3
"""Error, pixels, that a pose is assumed to have at least, so that the ratio of two good ones says nothing."""


class Pose(NamedTuple):
    """A pose of the board that fits a view."""

    T: Array
    """Board to camera, of shape (4, 4), metres."""
    error: float
    """Root mean square of its reprojection error, pixels."""


def board_poses(camera: Camera, board: Board, view: View) -> list[Pose]:
    """The poses of the board that fit a view, the best first; two if the view cannot tell them apart, none if there is none."""
    import cv2

    rays = camera.rays(view.pixels)
    points = board.points[view.ids]
    middle = points.mean(0)
    if not np.isfinite(rays).all():
        return []
    flat = np.ascontiguousarray(rays[:, :2] / rays[:, 2:])
    try:
        count, turns, shifts, _ = cv2.solvePnPGeneric(points - middle, flat, np.eye(3), None, flags=cv2.SOLVEPNP_IPPE)
    except cv2.error:
        return []
    poses = []
    for n in range(count):
        R = np.asarray(cv2.Rodrigues(np.asarray(turns[n], float))[0], float)
        T = rigid(R, np.asarray(shifts[n], float).ravel() - R @ middle)
        error = pose_error(camera, board, view, T) if np.isfinite(T).all() else np.nan
        if np.isfinite(error):
            poses.append(Pose(T, error))
    poses.sort(key=lambda pose: pose.error)
    return [pose for pose in poses if pose.error <= AMBIGUOUS * max(poses[0].error, MIN_ERROR)]


def pose_error(camera: Camera, board: Board, view: View, T: Array) -> float:
    """Root mean square (pixels) of a view's reprojection error with a pose of the board (4, 4) before the camera; NaN behind it."""
    from dataclasses import replace

    off = replace(camera, T_camera_world=T).project(board.points[view.ids]) - view.pixels
    return float(np.sqrt((off**2).sum(1).mean()))
