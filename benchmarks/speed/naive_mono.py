"""A naive version of Liu 2011's filter in NumPy and Python: pose by pose and card by card, without the kernels but with their costs.

For bodies of quads that lie wholly in front of a pinhole camera.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.skeleton import AXES, Skeleton
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array, rigid, rotation_about
from shadowpuppet.tracking.monocular.settings import MonocularSettings
from shadowpuppet.tracking.monocular.stages import FilterStage

Mask = NDArray[np.bool_]


def joint_transforms(skeleton: Skeleton, pose: Array, root: Array) -> dict[str, Array]:
    """Transforms (4, 4) of all joints: the parent's, times the offset, times one matrix for each DOF."""
    out: dict[str, Array] = {}
    for joint in skeleton.joints:
        T = (root if joint.parent is None else out[joint.parent]) @ rigid(np.eye(3), joint.offset)
        for dof, value in zip(skeleton.dofs, pose):
            if dof.joint == joint.name:
                index, sign = AXES[dof.axis]
                axis = sign * np.eye(3)[index]
                turn = dof.kind == "rotation"
                T = T @ (rigid(rotation_about(axis, value), np.zeros(3)) if turn else rigid(np.eye(3), axis * value))
        out[joint.name] = T
    return out


def fill(drawn: Mask, corners: Array) -> None:
    """Set the pixels of a convex polygon (K, 2) in a mask (H, W): those within its box that lie on one side of all its edges."""
    height, width = drawn.shape
    x0, y0 = np.maximum(np.floor(corners.min(0)), 0).astype(int)
    x1, y1 = np.minimum(np.ceil(corners.max(0)), (width - 1, height - 1)).astype(int)
    y, x = np.mgrid[y0 : y1 + 1, x0 : x1 + 1]
    ahead, behind = np.ones(x.shape, bool), np.ones(x.shape, bool)
    for a, b in zip(corners, np.roll(corners, -1, axis=0)):
        side = (b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])
        ahead &= side > 0
        behind &= side < 0
    drawn[y0 : y1 + 1, x0 : x1 + 1] |= ahead | behind


def cost(picture: Picture, pose: Array, shapes: NDArray[np.int64], mask: Mask) -> int:
    """Eq. 2 of one pose (D,), pixels: its cards are placed, projected and drawn, and pixels that differ from the mask (H, W) counted."""
    body, matrix = picture.body, picture.camera.matrix
    joints = joint_transforms(body.skeleton, pose, picture.T_camera_base)
    drawn = np.zeros_like(mask)
    for shape in shapes:
        T = joints[body.skeleton.joint_names[body.shapes.joints[shape, 0]]]
        points = (T[:3, :3] @ body.shapes.arrays[0][shape].T).T + T[:3, 3]
        pixels = (matrix @ points.T).T
        fill(drawn, pixels[:, :2] / pixels[:, 2:])
    return int(np.count_nonzero(drawn ^ mask))


def frame(rng: np.random.Generator, picture: Picture, settings: MonocularSettings, pose: Array, mask: Mask, particles: int) -> Array:
    """The pose (D,) after one frame of Liu 2011's filter, with `particles` in every stage."""
    for name in settings.stages:
        stage = FilterStage(picture, settings, name)
        shapes = np.concatenate([stage.partial.moving, stage.partial.still])
        best, least = pose, np.inf
        for n in range(particles):
            values = pose.copy()
            if n:
                values[stage.dofs] += stage.sigma * rng.standard_normal(len(stage.dofs))
            differs = cost(picture, values, shapes, mask)
            if differs < least:
                best, least = values, differs
        pose = best
    return pose
