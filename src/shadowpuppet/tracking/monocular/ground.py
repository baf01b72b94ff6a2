"""The floor before one camera, of a calibration, or as a person of known stature shows it.

The soles and the crown of an upright person tell their distance, and so how far below the camera they stand; a walk tells the camera's
tilt, too: only at the right one is the floor level.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture, place
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.size_search import Ground, PersonEstimate
from shadowpuppet.tracking.monocular.standing_place import PLACE, lowest, standing_place

TILTS = np.radians(np.arange(-30, 30.1, 1.0))
"""Downward tilts of a camera that are tried, rad."""
USUAL_TILT = np.radians(5.0)
"""Standard deviation of a camera's tilt, rad."""
SCATTER, OUTLIER = 0.04, 2.0
"""Standard deviation of the height of the camera over an upright person's soles, relative: gait, hair, shoes and pixels; and the number of
these from which on a silhouette is no upright person's."""
CROUCHED = 2.0
"""How much more probable a silhouette is that shows the person lower than upright, as one who sits or squats, than taller, with a hand
above the head."""
FEWEST = 3
"""Least number of silhouettes that show the floor."""


def calibrated_ground(camera: Camera) -> Ground | None:
    """The floor of the camera's calibration, the world's zero; None without one."""
    return Ground(camera.T_camera_world[:3, 2], float(camera.centre[2])) if camera.oriented else None


def shown_ground(camera: Camera, masks: Sequence[Mask], estimate: PersonEstimate, body: str) -> Ground | None:
    """The floor on which a person of an estimated size stands in masks (H, W), upright in a third of them at least; None if too few show
    them from crown to soles. The vertical is that of the calibration, if there is one.

    Of all tilts and heights of the camera it is those that most masks agree with: a standing person's stature tells the distance, and so
    how far below the camera the soles are, which is the same everywhere on the floor."""
    tilts = np.zeros(1) if camera.oriented else TILTS
    view, best, least = estimate.picture(camera, body), None, np.inf
    soles = lowest(view)
    for tilt in tilts:
        up = camera.T_camera_world[:3, 2] if camera.oriented else np.array([0.0, -np.cos(tilt), -np.sin(tilt)])
        there = moved_to(camera, estimate, Ground(up, 0.0))
        heights = -there.elevation - soles - _raised(replace(view, T_camera_base=place(camera, there.distance, there.elevation, up)), masks)
        eyes = heights[heights > 0]
        if len(heights) < FEWEST or not len(eyes):
            continue
        off = np.log(np.maximum(heights, 1e-3) / eyes[:, None]) / SCATTER
        costs = np.minimum(np.where(off > 0, off, -CROUCHED * off), np.where(off > 0, OUTLIER, CROUCHED * OUTLIER)).sum(1)
        cost = float(costs.min()) + (tilt / USUAL_TILT) ** 2 / 2
        if cost < least:
            best, least = Ground(up, float(eyes[costs.argmin()])), cost
    return best


def _raised(picture: Picture, masks: Sequence[Mask]) -> Array:
    """How far (K,) a person is raised who stands upright in masks (H, W), metres; none of masks that do not show both ends."""
    (up,), upright = picture.body.skeleton.dof_indices(PLACE[2:]), np.zeros(len(picture.body.skeleton.dofs))
    poses = [standing_place(picture, mask, None, upright) for mask in masks]
    return np.array([pose[up] for pose in poses if pose is not None])


def moved_to(camera: Camera, estimate: PersonEstimate, ground: Ground) -> PersonEstimate:
    """The estimate at the same place before the camera, with another floor."""
    at = place(camera, estimate.distance, estimate.elevation, None if estimate.ground is None else estimate.ground.up)[:3, 3]
    elevation = float(at @ ground.up)
    return replace(estimate, distance=float(np.linalg.norm(at - elevation * ground.up)), elevation=elevation, ground=ground)
