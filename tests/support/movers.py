"""Joints of synthetic whole-body motions with known poses."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.motion.motion import JointTable

SWINGS = {"left_hip_y": (-30, 0), "right_hip_y": (-30, np.pi), "left_knee_flexion": (25, 1), "right_knee_flexion": (25, 1 + np.pi),
          "left_shoulder_y": (25, np.pi), "right_shoulder_y": (25, 0), "left_elbow_flexion": (20, 2),
          "right_elbow_flexion": (20, 2 + np.pi), "chest_z": (8, 0.5), "root_tilt": (3, 0)}
"""Half ranges in degrees, and phases."""


def walk(frames: int, rate: float = 60.0, height: float = 1.75, turn: float = 0.0, start: float = 0.0) -> tuple[JointTable, np.ndarray]:
    """Joints of a gait with one cycle per second, and its poses (T, D) of the anatomical body."""
    body = make_body("anatomical", average_sizes("anatomical", height))
    times, names = start + np.arange(frames) / rate, body.skeleton.dof_names
    poses = np.zeros((frames, len(names)))
    for name, (half, phase) in SWINGS.items():
        poses[:, names.index(name)] = np.radians(half) * np.sin(2 * np.pi * times + phase) + np.radians(half if "flexion" in name else 0)
    poses[:, names.index("root_x")], poses[:, names.index("root_z")] = 1.2 * times, 0.95
    poses[:, names.index("root_heading")] = turn
    return JointTable(times, body.landmark_names, body.points(poses)), poses
