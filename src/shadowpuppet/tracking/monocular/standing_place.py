"""Where a whole person is, by the first and last row of their silhouette: a walk changes the place faster than a filter's noise does.

The soles are in the last row. On a floor of known height that tells the distance, and then the first row the height of the crown, of a
seated person, too. Without one, a standing person's stature tells the distance.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.shapes import Hulls
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.silhouette_cost import Soles

CUT_OFF_ROWS = 2
"""A silhouette that reaches this many first or last rows of the picture is cut off there."""
ROUNDS = 4
"""Number of corrections of the distance: the toes are before the pelvis, in the picture by how much depends on the distance."""
PLACE = ("root_x", "root_y", "root_z")
"""The DOF of a whole body's place."""


def soles_row(mask: Mask) -> Soles | None:
    """Where the soles of a person with a mask (H, W) are; None if it is empty."""
    if not mask.any():
        return None
    return Soles(float(np.flatnonzero(mask.any(1))[-1]) + 0.5, bool(mask[-CUT_OFF_ROWS:].any()))


def standing_place(picture: Picture, mask: Mask, floor: float | None, upright: Array, farthest: bool = False) -> Array | None:
    """An upright pose (D,) moved so that its soles are in the last row of a mask (H, W), and its crown in the first or, on a floor, at most
    there; None where the mask does not show that, and for an upper body. `floor`: its height in the body's frame, metres, if it is
    known; `farthest`: whether a mask whose soles are cut off will do: the person is there, or nearer.

    Where the crown is lower than that of a person who stands there, the pose is lowered, its straight legs below the floor.
    """
    skeleton = picture.body.skeleton
    end = soles_row(mask)
    if PLACE[0] not in skeleton.dof_names or end is None or (end.cut and not farthest):
        return None
    place, pose = skeleton.dof_indices(PLACE), upright.copy()
    pose[place] = 0.0
    outline, cut = _outline(picture, pose), bool(mask[:CUT_OFF_ROWS].any())
    eye, (top, bottom), aside = _rays(picture, mask)

    def slopes(far: float, raised: float) -> tuple[float, float]:
        """Those of the rays to the pose's crown and soles, at a level distance and raised."""
        rise = outline[:, 2] + raised - eye[2]
        slope = rise / np.linalg.norm(outline[:, :2] + far * aside, axis=1)
        return float(slope.max()), float(slope.min())

    if floor is None:
        if cut or top <= bottom:
            return None
        far, raised = float(np.ptp(outline[:, 2])) / (top - bottom), 0.0
        for _ in range(ROUNDS):
            raised += (bottom - slopes(far, raised)[1]) * far
            crown, soles = slopes(far, raised)
            far *= (crown - soles) / (top - bottom)
    else:
        raised, below = floor - float(outline[:, 2].min()), floor - eye[2]
        if bottom >= 0 or below >= 0:
            return None
        far = below / bottom
        for _ in range(ROUNDS):
            far += below / bottom - below / slopes(far, raised)[1]
        if not cut:
            raised += min((top - slopes(far, raised)[0]) * far, 0.0)
    pose[place] = (*(eye[:2] + far * aside), raised)
    return pose


def lowest(picture: Picture) -> float:
    """Height (m) of the soles of the upright body in its frame."""
    return float(_outline(picture, np.zeros(len(picture.body.skeleton.dofs)))[:, 2].min())


def _outline(picture: Picture, pose: Array) -> Array:
    """The outermost points (K, 3) of a pose (D,) in the frame of the body's base, metres: the ends of its ellipsoids' axes."""
    body = picture.body
    assert isinstance(body.shapes, Hulls)
    T = body.skeleton.forward(pose[None])[0][body.shapes.joints.ravel()]
    ends = np.concatenate([np.eye(3), -np.eye(3)])
    points = body.shapes.centres.reshape(-1, 1, 3) + body.shapes.radii.reshape(-1, 1, 3) * ends
    return (np.einsum("kij,kej->kei", T[:, :, :3], points) + T[:, None, :, 3]).reshape(-1, 3)


def _rays(picture: Picture, mask: Mask) -> tuple[Array, Array, Array]:
    """In the frame of the body's base: the camera's place (3,), the slopes (2,) of the rays to the first and last row of a mask (H, W),
    rise over level distance, and the level direction (2,) of its middle column."""
    rows = np.flatnonzero(mask.any(1))[[0, -1]] + np.array([-0.5, 0.5])
    column = float(np.median(np.nonzero(mask)[1]))
    R, t = picture.T_camera_base[:3, :3], picture.T_camera_base[:3, 3]
    rays = np.array([picture.camera.rays(np.array([column, row], float)) for row in rows]) @ R
    level = rays[:, :2].sum(0)
    return -t @ R, rays[:, 2] / np.linalg.norm(rays[:, :2], axis=1), level / np.linalg.norm(level)
