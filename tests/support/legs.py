"""A whole body over a floor before a level camera, and its legs bent."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from people import camera

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.geometry import Array, rigid

LEVEL = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])
HEIGHT = 1.7
HIPS = 0.53 * HEIGHT
"""About their height while standing, metres."""


def over_floor(name: str, high: float = 1.2, hips: float = HIPS) -> Picture:
    """A level camera `high` metres over the floor, before a body whose hips are `hips` metres over it."""
    cam = replace(camera((200, 240), focal=1.0), T_camera_world=rigid(LEVEL, LEVEL @ [0.0, 0.0, -high]), oriented=True)
    body = make_body(name, average_sizes(name, HEIGHT))
    base = place(cam, 2.5, 0.0)
    down = Picture(body, cam, base).points_world(body.skeleton.pose()[None], ["left_hip"])[0, 0, 2]
    return Picture(body, cam, place(cam, 2.5, hips - down), down - hips - high)


def wide(view: Picture) -> Picture:
    """The same body before a camera that sees people who are near, too."""
    matrix = view.camera.matrix.copy()
    matrix[[0, 1], [0, 1]] *= 0.55
    return replace(view, camera=replace(view.camera, matrix=matrix))


def bent(skeleton: Skeleton, hip: float, knee: float, ankle: float = 0.0) -> Array:
    """A pose (D,) with both hips and knees flexed, and ankles if there are any, degrees."""
    flexes, sign = ("hip_y", -1) if "left_hip_y" in skeleton.dof_names else ("hip_flexion", 1)
    flexed = {flexes: sign * hip, "knee_flexion": knee, "ankle_flexion": ankle}
    return skeleton.pose(**{f"{side}_{dof}": np.radians(value) for side in ("left", "right") for dof, value in flexed.items()
                            if f"{side}_{dof}" in skeleton.dof_names})  # fmt: skip
