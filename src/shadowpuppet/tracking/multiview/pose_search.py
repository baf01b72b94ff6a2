"""Initial poses from one frame: usual postures and those of a library are refined in all headings, and the best kept.

Ni 2008 does not say how tracking begins.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.whole_body import GLOBAL_DOFS, heading_column
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.keypoints.candidates import placed_by_rays
from shadowpuppet.tracking.multiview.observation import MultiviewObservation
from shadowpuppet.tracking.multiview.posture_prior import usual_arms, usual_postures
from shadowpuppet.tracking.multiview.refinement.refiner import Pass, Refiner
from shadowpuppet.tracking.particle_filter import Particles, Weigh, best_of, evaluate

HEADINGS = 16
"""Number of headings in which each posture is tried."""
MAX_LIBRARY_POSES = 60
"""Largest number of library poses that are tried; larger libraries are sampled."""
COARSE_CANDIDATES, FINE_CANDIDATES = 96, 32
"""Numbers of poses that are refined on a share of the points, and on all."""
COARSE_STAGES = ((8, 4, 0.25), (4, 6, 0.12))
FINE_STAGES = ((4, 4, 0.08), (1, 6, 0.05))
"""Stages of refinement: stride of the points, iterations, robust scale (m)."""
ARM_ROUNDS, ARM_SAMPLES, ARM_SPREAD = 2, 600, 0.6
"""Number of searches for each arm of the best pose, candidates per search, and their noise about the usual arms (rad)."""
EMPTINESS = 2.0
"""Weight of limbs that reach out of the silhouettes (see `Pass`): without it, poses are drawn to furniture that the hull contains."""
STRAY = 2
"""Number of surface points at each end of the hull that may be noise."""
PULL = 1e-4
"""Weight of the pull to the posture before refinement (see `Refiner.gauss_newton`)."""


def search(rng: np.random.Generator, body: Body, refiner: Refiner, observation: MultiviewObservation, library: ArrayLike | None,
           weigh: Weigh, number: int, facing: float | None = None) -> Particles:
    """The `number` best poses (number, D) for a frame's surface points, with the costs and weights of `weigh`.

    `library`: initial poses (L, D); their position and heading are ignored. `facing`: heading (rad) from which poses begin less than a
    quarter turn away, and with two cameras, which hardly tell a quarter turn, half of one; None: in all headings. The poses that keypoints
    show are refined however far they are from the points. Without surface points poses are placed and chosen by keypoints.
    """
    keypoints = observation.keypoints
    reach = np.pi / (4 if len(observation.masks) == 2 else 2)

    def rough(poses: Array, tau: float) -> Array:
        if keypoints is not None and not len(observation.surface.points):
            return keypoints.cost(poses)
        return refiner.costs(poses, observation.cloud(COARSE_STAGES[0][0]), tau)

    postures = usual_postures(body.skeleton)
    known = np.asarray([] if library is None else library, float)
    if len(known):
        if len(known) > MAX_LIBRARY_POSES:
            known = known[np.sort(rng.choice(len(known), MAX_LIBRARY_POSES, replace=False))]
        postures = np.concatenate([known, postures])
    poses = place_postures(body, postures, observation.full.origin)
    if len(observation.surface.points):
        poses = np.concatenate([poses, stood(body, poses, _lowest(observation.surface.points))])
    elif keypoints is not None:
        poses = placed_by_rays(body, poses, refiner.landmarks, keypoints.sights)
    poses = _towards(body, poses, facing, reach)
    poses = poses[rough(poses, COARSE_STAGES[0][2]).argsort(kind="stable")[:COARSE_CANDIDATES]]
    if keypoints is not None:
        poses = np.concatenate([poses, _towards(body, keypoints.either_way, facing, reach)])
    poses = best_of((evaluate(_refined(refiner, observation, poses, COARSE_STAGES), weigh),), FINE_CANDIDATES).poses
    found = best_of((evaluate(_refined(refiner, observation, poses, FINE_STAGES), weigh),), number)
    for _, side in product(range(ARM_ROUNDS), ("left", "right")):
        tried = _other_arms(rng, body, found.best, side)
        tried = tried[rough(tried, COARSE_STAGES[1][2]).argsort(kind="stable")[:FINE_CANDIDATES]]
        found = best_of((found, evaluate(_refined(refiner, observation, tried, FINE_STAGES), weigh)), number)
    return found


def _towards(body: Body, poses: Array, facing: float | None, reach: float) -> Array:
    """Those of poses (N, D) that face less than `reach` (rad) away from a heading (rad); None: all."""
    return poses if facing is None else poses[np.cos(poses[:, heading_column(body.skeleton)] - facing) > np.cos(reach) + 1e-6]


def _refined(refiner: Refiner, observation: MultiviewObservation, poses: Array, stages: tuple) -> Array:
    passes = tuple(Pass(observation.cloud(share), iterations, tau, observation.space, EMPTINESS, *observation.rays)
                   for share, iterations, tau in stages)
    return refiner.gauss_newton(poses, passes, poses, np.full(poses.shape[1], PULL))


def _other_arms(rng: np.random.Generator, body: Body, pose: Array, side: str) -> Array:
    """Copies (ARM_SAMPLES, D) of a pose (D,) with the arm of one side drawn around the usual ones."""
    skeleton, usual = body.skeleton, usual_arms(body.skeleton, side)
    poses, dofs = np.repeat(pose[None], ARM_SAMPLES, axis=0), skeleton.dof_indices(usual)
    arms = np.stack(list(usual.values()), 1)
    poses[:, dofs] = arms[np.arange(ARM_SAMPLES) % len(arms)] + ARM_SPREAD * rng.standard_normal((ARM_SAMPLES, len(dofs)))
    return skeleton.clamp(poses)


def place_postures(body: Body, postures: Array, middle: Array) -> Array:
    """Postures (L, D) in all headings, with the limbs' centre at `middle` (3,), world; of shape (L HEADINGS, D)."""
    poses = np.repeat(postures, HEADINGS, axis=0)
    place, heading = body.skeleton.dof_indices(GLOBAL_DOFS[:3]), heading_column(body.skeleton)
    poses[:, place] = 0.0
    poses[:, heading] = np.tile(np.arange(HEADINGS) * 2 * np.pi / HEADINGS - np.pi, len(postures))
    limbs = body.limbs
    assert limbs is not None
    middles = body.skeleton.points(poses, limbs.joints, (limbs.starts + limbs.ends) / 2)
    areas = limbs.lengths * limbs.radii.mean((1, 2))
    poses[:, place] = middle - (areas[:, None] * middles).sum(1) / areas.sum()
    return poses


def stood(body: Body, poses: Array, lowest: float) -> Array:
    """Poses (N, D) moved up or down so that their lowest limb is at the height `lowest`, metres: beside furniture, the middle of all
    surface points is not the person's."""
    limbs = body.limbs
    assert limbs is not None
    radii = limbs.radii.min(2)
    starts, ends = (body.skeleton.points(poses, limbs.joints, places)[..., 2] for places in (limbs.starts, limbs.ends))
    poses, up = poses.copy(), body.skeleton.dof_indices(GLOBAL_DOFS[2:3])[0]
    poses[:, up] += lowest - np.minimum(starts - radii[:, 0], ends - radii[:, 1]).min(1)
    return poses


def _lowest(points: Array) -> float:
    """Height of the lowest of the surface points (P, 3) that are no noise, metres."""
    heights = np.sort(points[:, 2])
    return float(heights[min(STRAY, len(heights) - 1)])
