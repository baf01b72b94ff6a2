"""A pose from one silhouette, without an earlier pose: coarse postures are tried, one body part after the other."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.segments import coarse_limbs, dofs_of, limbs_of, parts_of
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.monocular.standing_place import PLACE, standing_place
from shadowpuppet.tracking.silhouette_cost import Observation, PartialCost, silhouette_costs
from shadowpuppet.tracking.status import UNCERTAIN_OVERLAP

BEST_LIMBS = 40
"""Number of a limb's best coarse postures that a filter's first particles start from."""
SIDEWAYS_DOFS = ("torso_y", "root_y")
"""The DOF that moves a body sideways."""
PLACES = 161
"""Positions across the picture's width that are tried, an odd number."""
TURNED_DOFS = ("torso_twist", "root_heading")
"""The DOF that turns a body about the vertical."""
TURNS = np.radians([0, 50, -50, 90, -90])
"""Directions that are tried if the person who faces the camera does not fit. A person seen from behind has the same silhouette."""
LOWERED = (0.0, 0.12, 0.3)
"""Heights of the hands above the crown that are tried for a body that can be lowered, metres."""


class CoarsePose(NamedTuple):
    """Result of `search_pose`."""

    pose: Array
    """The best pose, of shape (D,)."""
    cost: float
    """Its cost, pixels."""
    limbs: dict[str, Array]
    """For each arm and leg all postures tried, (K, d), the best first."""
    overlap: float
    """Intersection over union of the drawn pose and the mask, legs left out."""


def search_pose(picture: Picture, mask: NDArray[np.bool_], start: Array | None = None) -> CoarsePose:
    """The upright pose, facing the camera, with the coarse limbs of least cost (eq. 2) in a mask (H, W); legs do not count for an upper
    body. The torso is moved sideways without arms; then one arm is tried alone, the other with the first, and the first once more; then the
    legs of a whole body, which are straight until then. `start` (D,), in place of zero, has the other DOF: height, direction."""
    skeleton = picture.body.skeleton
    arms, legs = ([limb for limb in limbs_of(skeleton) if limb.endswith(kind)] for kind in ("arm", "leg"))
    hidden = {arm: parts_of(picture.body, arm) for arm in arms}
    sideways, poses = _sideways(picture, np.zeros(len(skeleton.dofs)) if start is None else start)
    torso, centred = PartialCost(picture, sideways, hidden=sum(hidden.values(), [])), poses[PLACES // 2]
    pose = poses[np.argmin(torso.costs(Observation.without_legs(mask, picture, centred), centred)(poses))]
    observation = Observation.without_legs(mask, picture, pose)
    tried: dict[str, Array] = {}
    least = np.inf
    for limb in [*arms, arms[0], *legs, *legs[:1]]:
        dofs, library = dofs_of(skeleton, limb), coarse_limbs(skeleton, limb)
        poses = np.repeat(pose[None], len(library), axis=0)
        poses[:, dofs] = library
        drawn = PartialCost(picture, dofs, hidden=[part for arm in arms if arm != limb and arm not in tried for part in hidden[arm]])
        costs = drawn.costs(observation, pose)(poses)
        ranked = np.argsort(costs, kind="stable")
        tried[limb], pose, least = library[ranked], poses[ranked[0]], float(costs[ranked[0]])
    return CoarsePose(pose, least, tried, observation.cost_and_overlap(picture.draw(pose))[1])


def search_turned(picture: Picture, mask: NDArray[np.bool_], floor: float | None = None, moves: bool = True) -> CoarsePose:
    """As `search_pose`; if the person who faces the camera at the fitted height fits badly, the best of those who are turned, and, with a
    whole body, sit, kneel or squat lower or stand higher. A whole person, unless not `moves`, may be where the silhouette ends, too, on a
    floor at a height in the body's frame, metres, or at the distance of their stature."""
    found = search_pose(picture, mask)
    stands = standing_place(picture, mask, floor, np.zeros(len(picture.body.skeleton.dofs)), farthest=True) if moves else None
    if stands is not None:
        found = max(found, search_pose(picture, mask, stands), key=lambda each: each.overlap)
    if found.overlap >= UNCERTAIN_OVERLAP or not mask.any():
        return found
    heights = [*_heights(picture, mask), *([] if stands is None else [stands])]
    starts = [start for upright in heights for start in _turned(picture, upright)]
    return max([found, *(search_pose(picture, mask, start) for start in starts)], key=lambda each: each.overlap)


def _turned(picture: Picture, pose: Array) -> Array:
    """Copies (T, D) of a pose (D,), turned by `TURNS`."""
    skeleton = picture.body.skeleton
    poses = np.repeat(pose[None], len(TURNS), axis=0)
    poses[:, skeleton.dof_indices([name for name in TURNED_DOFS if name in skeleton.dof_names])] = TURNS[:, None]
    return poses


def _heights(picture: Picture, mask: NDArray[np.bool_]) -> Array:
    """Upright poses (P, D) with the crown at the upper edge of a mask (H, W), or below it by `LOWERED`; an upper body has one height."""
    skeleton = picture.body.skeleton
    pose, drawn = np.zeros(len(skeleton.dofs)), np.zeros(0)
    if "root_z" in skeleton.dof_names:
        drawn = np.flatnonzero(picture.mask(pose).any(1))
    if not len(drawn):
        return pose[None]
    metres = abs(float(picture.T_camera_base[2, 3])) / picture.camera.matrix[1, 1]
    poses = np.repeat(pose[None], len(LOWERED), axis=0)
    poses[:, skeleton.dof_indices(["root_z"])[0]] = (drawn[0] - np.flatnonzero(mask.any(1))[0]) * metres - np.array(LOWERED)
    return poses


def align_sideways(picture: Picture, mask: NDArray[np.bool_], pose: Array) -> Array:
    """A pose (D,) moved sideways to the least cost in a mask (H, W). The legs' pixels count: they cost the same at every position."""
    poses = _sideways(picture, pose)[1]
    return poses[np.argmin(silhouette_costs(picture, Observation.of(mask, np.zeros_like(mask)), poses))]


def _sideways(picture: Picture, pose: Array) -> tuple[NDArray[np.int64], Array]:
    """The DOF that moves the body sideways, and the pose (D,) at positions (P, D) across the picture's width."""
    skeleton = picture.body.skeleton
    sideways = skeleton.dof_indices([name for name in SIDEWAYS_DOFS if name in skeleton.dof_names])
    poses = np.repeat(pose[None], PLACES, axis=0)
    poses[:, sideways[0]] = np.linspace(-1, 1, len(poses)) * _half_width(picture, pose)
    return sideways, poses


def _half_width(picture: Picture, pose: Array) -> float:
    """Half the width visible at the distance of a pose (D,), metres."""
    skeleton, place = picture.body.skeleton, picture.T_camera_base[:3, 3]
    if PLACE[0] in skeleton.dof_names:
        place = place + picture.T_camera_base[:3, :3] @ pose[skeleton.dof_indices(PLACE)]
    return abs(float(place[2])) * picture.camera.size[0] / 2 / picture.camera.matrix[0, 0]
