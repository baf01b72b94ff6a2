"""Reads transforms.json of nerfstudio and instant-ngp: a camera for each frame, named after its picture, or the picture's folder.

`transform_matrix` takes the camera to the world; its axes are OpenGL's: y up, z backward. Pixel centres are at halves, here at whole
numbers. Lengths are in a unit of their own.
"""

from __future__ import annotations

from pathlib import PurePosixPath
from typing import Any

import numpy as np

from shadowpuppet.errors import CalibrationError, shown
from shadowpuppet.geometry import Array, inverse
from shadowpuppet.io.calibration.draft import Draft, Drafts
from shadowpuppet.io.calibration.keys import LENS_KEYS, is_fisheye, unknown_keys

LENS = ("k1", "k2", "k3", "k4", "p1", "p2")
USED = ("frames", "file_path", "transform_matrix", "fl_x", "fl_y", "cx", "cy", "w", "h", "camera_angle_x", "camera_angle_y", *LENS)
IGNORED = ("aabb_scale", "applied_scale", "applied_transform", "auto_scale_poses_override", "colmap_im_id", "depth_file_path", "id",
           "integer_depth_scale", "mask_path", "offset", "orientation_override", "ply_file_path", "scale", "sharpness", "test_filenames",
           "train_filenames", "val_filenames")
"""Keys that say how those programs show the scene, not where the cameras of this file are."""
OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""From OpenCV's axes to OpenGL's."""


def is_transforms(values: Any) -> bool:
    """Whether a JSON file's content is a transforms.json."""
    frames = values.get("frames") if isinstance(values, dict) else None
    return isinstance(frames, list) and bool(frames) and all(isinstance(frame, dict) and "transform_matrix" in frame for frame in frames)


def read_transforms(values: dict[str, Any]) -> Drafts:
    """Cameras of the frames. Raises `CalibrationError` with frame and field."""
    known = (*USED, *IGNORED, LENS_KEYS)
    unused = list(unknown_keys("", values, known))
    for n, frame in enumerate(values["frames"]):
        unused += unknown_keys(f"frame {n}: ", frame, known)
    poses = [_pose(f"frame {n}: ", frame) for n, frame in enumerate(values["frames"])]
    drafts: dict[str, Draft] = {}
    for n, (name, frame) in enumerate(zip(_names(values["frames"], poses), values["frames"])):
        drafts.setdefault(name, _draft(f"frame {n}: ", name, {**values, **frame}, poses[n]))
    note = "lengths of a transforms.json are in a unit of its own: multiply by the person's true height over the height in `check`"
    return Drafts(tuple(drafts.values()), None, (note,), tuple(unused))


def _names(frames: list[dict[str, Any]], poses: list[Array]) -> list[str]:
    """The pictures' folders if each holds pictures of one pose, and there are several; else the pictures' names without ending."""
    paths = [PurePosixPath(str(frame.get("file_path", f"cam{n + 1}")).replace("\\", "/")) for n, frame in enumerate(frames)]
    folders = [path.parent.name for path in paths]
    first = dict(zip(reversed(folders), reversed(poses)))
    same = all(np.allclose(first[folder], pose) for folder, pose in zip(folders, poses))
    return folders if len(first) > 1 and all(folders) and same else [path.stem for path in paths]


def _pose(where: str, frame: dict[str, Any]) -> Array:
    """World to camera (4, 4)."""
    try:
        T = np.array(frame["transform_matrix"], float)
    except (TypeError, ValueError, OverflowError):
        T = np.zeros(0)
    if T.shape not in ((3, 4), (4, 4)) or not np.isfinite(T).all():
        raise CalibrationError(f"{where}transform_matrix: found {shown(frame['transform_matrix'])[:80]}, expected 4 x 4 finite numbers")
    T = np.vstack([T[:3], [0, 0, 0, 1]])
    if not np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-3):
        raise CalibrationError(f"{where}transform_matrix: found {np.round(T[:3, :3], 4).tolist()}, expected a rotation")
    return inverse(T @ OPENGL)


def _draft(where: str, name: str, table: dict[str, Any], T: Array) -> Draft:
    def number(key: str, without: float | None = None) -> float:
        value = table.get(key, without)
        if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) < 1e9:
            raise CalibrationError(f"{where}{key}: found {'nothing' if value is None else shown(value)[:80]}, expected a finite number")
        return float(value)

    w, h = number("w"), number("h")
    if "fl_x" in table:
        fx = number("fl_x")
        fy = number("fl_y", fx)
    else:
        fx = _focal(where, w, number("camera_angle_x"))
        fy = _focal(where, h, number("camera_angle_y")) if "camera_angle_y" in table else fx
    matrix = np.array([[fx, 0, number("cx", w / 2) - 0.5], [0, fy, number("cy", h / 2) - 0.5], [0, 0, 1]])
    lens, fisheye = {key: number(key, 0.0) for key in LENS}, is_fisheye(where, table)
    for key in ("p1", "p2") if fisheye else ("k4",):
        if lens[key]:
            raise CalibrationError(f"{where}{key}: found {lens[key]:g}, expected 0: OpenCV's {'fisheye' if fisheye else 'lens'} has no "
                                   "such coefficient")
    order = ("k1", "k2", "k3", "k4") if fisheye else ("k1", "k2", "p1", "p2", "k3")
    return Draft(name, matrix, [lens[key] for key in order], T, (w, h), fisheye, where=where)


def _focal(where: str, side: float, angle: float) -> float:
    if not 0 < angle < np.pi:
        raise CalibrationError(f"{where}camera_angle: found {angle:g}, expected radians between 0 and pi")
    return side / 2 / float(np.tan(angle / 2))
