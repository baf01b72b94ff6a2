"""What the keypoints of a frame say about doubt: components of the joints' variances, along the world's axes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.skeleton import other_side
from shadowpuppet.geometry import Array
from shadowpuppet.motion.limbs import LIMBS, limb_of
from shadowpuppet.tracking.doubt.doubt import STEP, limit_deviations
from shadowpuppet.tracking.keypoints.candidates import CHAINS
from shadowpuppet.tracking.keypoints.definitions import ARMS, LEGS, Landmarks
from shadowpuppet.tracking.keypoints.likelihood import pulls, surprises
from shadowpuppet.tracking.keypoints.sights import NEAR, Sights
from shadowpuppet.tracking.multiview.keypoint_evidence import KeypointEvidence

TRUNK = ("shoulder", "hip")
"""Landmarks that show the trunk; every other is its limb's alone."""


class KeypointView(NamedTuple):
    """What keypoints say of a pose."""

    components: dict[str, Array]
    """Lengths (L, 3), metres, by name: `posterior`, `apart` and `exchanged`."""
    known: Array
    """Share of the joints of each of `LIMBS` that two cameras, or the only one, show where the body has them, (5,)."""


def keypoint_view(body: Body, pose: Array, seen: KeypointEvidence) -> KeypointView:
    """What a frame's keypoints say of a pose (D,) of a body.

    Of every joint there are: its standard deviation if rays had no errors but their scales, to first order, with joints' limits as all that
    is known besides (`posterior`); the root mean square distance of its limb's rays from the body (`apart`), bounded; and the distance to
    its counterpart, times the root of the probability that the limbs are the other side's (`exchanged`).
    """
    marks, sights, skeleton = seen.refiner.landmarks, seen.sights, body.skeleton
    moved = np.concatenate([pose[None], pose + STEP * np.eye(len(pose))])
    joints, places = body.points(moved), skeleton.points(moved, marks.joints, marks.places)
    limbs = _limbs_of(marks)
    squares = np.minimum(sights.squares_from(places[0], marks), NEAR**2)
    apart = np.array([np.sqrt(squares[own[sights.landmarks]].mean()) if own[sights.landmarks].any() else NEAR for own in limbs])
    by_joint = [LIMBS.index(limb_of(name)) for name in body.landmark_names]
    counterparts = np.abs(joints[0] - joints[0][other_side(body.landmark_names)])
    odd = np.array([_exchanged(places[0], sights, marks, limb) for limb in (ARMS, LEGS)])
    share = np.array([0.0, odd[0], odd[0], odd[1], odd[1]])[by_joint]
    components = {"posterior": _posterior(places, joints, seen, skeleton.limits), "apart": np.repeat(apart[by_joint, None], 3, 1),
                  "exchanged": np.sqrt(share)[:, None] * counterparts}
    near = np.bincount(sights.landmarks[squares < NEAR**2], minlength=len(marks.names)) >= min(2, seen.cameras)
    joint = np.isin([name.partition("_")[2] for name in marks.names], CHAINS)  # which all detectors have
    return KeypointView(components, np.array([near[own & joint].mean() for own in limbs]))


def _limbs_of(marks: Landmarks) -> list[NDArray[np.bool_]]:
    """Which landmarks (K,) show each of `LIMBS`."""
    names = marks.names
    return [np.array([limb_of(name) == limb or (limb == "trunk" and name.partition("_")[2] in TRUNK) for name in names]) for limb in LIMBS]


def _exchanged(places: Array, sights: Sights, marks: Landmarks, limbs: int) -> float:
    """Probability that the arms or legs of a body with landmarks at places (K, 3) are the other side's."""
    other = np.where(marks.limbs == limbs, marks.mirrored, np.arange(len(marks.names)))
    now, turned = surprises(np.stack([places, places[other]]), sights, marks)
    return float(1 / (1 + np.exp(np.clip(turned - now, -30, 30))))


def _posterior(places: Array, joints: Array, seen: KeypointEvidence, limits: tuple[Array, Array]) -> Array:
    """Standard deviations (L, 3), metres, of joints, given the surprise of rays and the limits of the DOF. `places` (D + 1, K, 3), `joints`
    (D + 1, L, 3): of the pose, and with a step of each of the DOF."""
    sights, marks = seen.sights, seen.refiner.landmarks
    chosen, pull = pulls(places[0], sights, marks)
    turns = (places[1:] - places[0]) / STEP
    rows = np.einsum("mij,dmj->dmi", sights.across, turns[:, chosen])
    tells = np.einsum("dmi,emi,m->de", rows, rows, 2 * pull) + np.diag(1 / limit_deviations(limits) ** 2)
    moves = (joints[1:] - joints[0]) / STEP
    return np.sqrt(np.einsum("dla,de,ela->la", moves, np.linalg.inv(tells), moves))
