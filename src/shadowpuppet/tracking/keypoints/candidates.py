"""Poses from keypoints alone, by inverse kinematics of triangulated landmarks: as the detector says, and with exchanged sides.

A particle filter finds what is proposed to it. Of a body that faces the wrong way, or of an arm that is elsewhere, no particle comes near
the right pose, whatever the evidence says of it; a pose from the keypoints is there at once.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.geometry import Array
from shadowpuppet.motion.ik_initial_guess import initial_poses
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.tracking.keypoints.definitions import ARMS, LEGS, Landmarks
from shadowpuppet.tracking.keypoints.sights import Sights
from shadowpuppet.tracking.keypoints.triangulation import meeting_points

CHAINS = (("shoulder", "elbow", "wrist"), ("hip", "knee", "ankle"))
"""Joints of a limb."""


def triangulated_landmarks(sights: Sights, landmarks: Landmarks, exchanged: Array | None = None) -> Array:
    """Places (K, 3) of the landmarks, world, metres; not a number of those that fewer than two cameras see. `exchanged`: probabilities
    (C, 2) that a camera's arms and legs are the other side's, by the last pose; where most cameras seem to exchange them that pose is wrong
    rather than the cameras."""
    rows = sights.landmarks
    if exchanged is not None:
        turned = (exchanged > 0.5) & ~seem_wrong(exchanged, sights)
        rows = np.where(turned[sights.cameras, landmarks.limbs[rows]], landmarks.mirrored[rows], rows)
    shape = sights.size, len(landmarks.names)
    centres, rays, weights = np.zeros((shape[0], 3)), np.tile([0.0, 0.0, 1.0], (*shape, 1)), np.zeros(shape)
    centres[sights.cameras], rays[sights.cameras, rows] = sights.origins, sights.rays
    weights[sights.cameras, rows] = 1 - sights.outlying
    return meeting_points(centres, rays, weights) if shape[0] > 1 else np.full((shape[1], 3), np.nan)


def seem_wrong(exchanged: Array, sights: Sights) -> NDArray[np.bool_]:
    """Whether most cameras seem to exchange arms, and legs, (2,), so that the pose is wrong by which they seem to (C, 2)."""
    return np.asarray(exchanged[np.unique(sights.cameras)].mean(0) > 0.5) if len(sights.cameras) else np.zeros(2, bool)


def pose_at(body: Body, landmarks: Landmarks, places: Array, last: Array | None = None) -> Array | None:
    """A pose (D,) of a body with its landmarks near places (K, 3); None if shoulders and hips are not known. Limbs that are not, and the
    head, are as in the pose `last` (D,), or at rest."""
    names = [f"{side}_{joint}" for chain in CHAINS for joint in chain for side in SIDES]
    table = JointTable(np.zeros(1), tuple(names), places[None, [landmarks.names.index(name) for name in names]])
    known = dict(zip(names, np.isfinite(table.positions[0]).all(1)))
    if not all(known[f"{side}_{chain[0]}"] for side in SIDES for chain in CHAINS):
        return None
    pose = initial_poses(body, table)[0]
    if last is not None:
        lost = {f"{side}_{joint}" for side in SIDES for chain in CHAINS if not all(known[f"{side}_{each}"] for each in chain)
                for joint in chain}
        kept = np.array([dof.joint in lost or dof.joint == "head" or dof.joint.endswith("_ankle") for dof in body.skeleton.dofs])
        pose[kept] = last[kept]
    return pose


def placed_by_rays(body: Body, poses: Array, landmarks: Landmarks, sights: Sights) -> Array:
    """Poses (N, D) moved to where their landmarks are nearest to the rays, in least squares; those in front of all cameras alone. One
    camera tells the distance by the size of the person in the picture."""
    moved, place = poses.copy(), body.skeleton.dof_indices(GLOBAL_DOFS[:3])
    moved[:, place] = 0.0
    points = body.skeleton.points(moved, landmarks.joints, landmarks.places)[:, sights.landmarks]
    weighed = sights.across * ((1 - sights.outlying) / sights.squares)[:, None, None]
    tells = np.einsum("mij,mik->jk", sights.across, weighed)
    asked = np.einsum("mij,mik,nmk->nj", sights.across, weighed, sights.origins - points)
    moved[:, place] = np.linalg.solve(tells + 1e-9 * np.trace(tells) * np.eye(3), asked.T).T
    before = ((points + moved[:, None, place] - sights.origins) * sights.rays).sum(2) > 0
    return moved[before.all(1)]


def candidates(body: Body, landmarks: Landmarks, sights: Sights, last: Array | None = None) -> Array:
    """Poses (n, D) that the keypoints show: as the detector says, then with arms, legs and both exchanged in all cameras, the last of
    which mostly face the other way; fewer if too little is known. `last` as in `pose_at`."""
    places = triangulated_landmarks(sights, landmarks)
    orders = (landmarks_with_exchanged(landmarks, limbs) for limbs in ((), (ARMS,), (LEGS,), (ARMS, LEGS)))
    found = (pose_at(body, landmarks, places[order], last) for order in orders)
    return np.array([pose for pose in found if pose is not None]).reshape(-1, len(body.skeleton.dofs))


def landmarks_with_exchanged(landmarks: Landmarks, limbs: tuple[int, ...]) -> NDArray[np.int64]:
    """Indices (K,) of the landmarks with the sides of some limbs, `ARMS` or `LEGS`, exchanged."""
    return np.where(np.isin(landmarks.limbs, limbs), landmarks.mirrored, np.arange(len(landmarks.mirrored)))
