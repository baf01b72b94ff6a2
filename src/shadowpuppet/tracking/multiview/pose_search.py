"""A first pose from one frame's hull: usual postures, or those of a library, in all directions, refined, the best kept.

Ni 2008 does not say how tracking begins.
"""

from __future__ import annotations

from itertools import product

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.body.shapes import Body
from shadowpuppet.body.whole_body import GLOBAL_DOFS
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.observation import Evidence
from shadowpuppet.tracking.multiview.posture_prior import usual_arms, usual_postures
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner
from shadowpuppet.tracking.particle_filter import Particles, Weigh, evaluate

HEADINGS = 16
"""Directions that are tried."""
MOST = 60
"""Postures of a library that are tried."""
BEGIN, GOOD = 96, 32
"""Poses that are refined on some of the points, and on all of them."""
ROUGH = ((8, 4, 0.25), (4, 6, 0.12))
FINE = ((4, 4, 0.08), (1, 6, 0.05))
"""Every so many-th point, iterations, robust scale (m)."""
TURNS, ARMS_TRIED, SPREAD = 2, 600, 0.6
"""How often each arm is looked for in the best pose, in how many places, and how far these are from the usual ones (rad)."""
PULL = 1e-4
"""Pull to the posture that a search began with (see `Refiner.gauss_newton`)."""


def search(rng: np.random.Generator, body: Body, refiner: Refiner, evidence: Evidence, library: ArrayLike | None, weigh: Weigh,
           number: int) -> Particles:
    """The `number` best poses (number, D) for a frame's surface points, weighed by `weigh`. `library`: poses (L, D) to begin with, of which
    place and heading do not count."""
    postures = usual_postures(body.skeleton)
    known = np.asarray([] if library is None else library, float)
    if len(known):
        postures = np.concatenate([known if len(known) <= MOST else known[np.sort(rng.choice(len(known), MOST, replace=False))], postures])
    poses = placed(body, postures, evidence.full.origin)
    poses = poses[refiner.costs(poses, evidence.cloud(ROUGH[0][0]), ROUGH[0][2]).argsort(kind="stable")[:BEGIN]]
    poses = _refined(refiner, evidence, poses, ROUGH)
    found = _best(evaluate(_refined(refiner, evidence, _best(evaluate(poses, weigh), GOOD).poses, FINE), weigh), number)
    for _, side in product(range(TURNS), ("left", "right")):
        tried = _other_arms(rng, body, found.best, side)
        tried = tried[refiner.costs(tried, evidence.cloud(ROUGH[0][0]), ROUGH[1][2]).argsort(kind="stable")[:GOOD]]
        others = evaluate(_refined(refiner, evidence, tried, FINE), weigh)
        found = _best(Particles(*(np.concatenate(pair) for pair in zip(found, others, strict=True))), number)
    return found


def _refined(refiner: Refiner, evidence: Evidence, poses: Array, stages: tuple) -> Array:
    clouds = tuple((evidence.cloud(share), iterations, tau) for share, iterations, tau in stages)
    return refiner.gauss_newton(poses, clouds, poses, np.full(poses.shape[1], PULL))


def _best(found: Particles, number: int) -> Particles:
    """The best of some particles, the best first; over again where there are fewer."""
    order = found.costs.argsort(kind="stable")[:number]
    order = order[np.arange(number) % len(order)]
    return Particles(found.poses[order], found.costs[order], found.log_weights[order])


def _other_arms(rng: np.random.Generator, body: Body, pose: Array, side: str) -> Array:
    """A pose (D,) with other arms on a side, from all over what they can do, of shape (ARMS_TRIED, D)."""
    skeleton, usual = body.skeleton, usual_arms(body.skeleton, side)
    poses, dofs = np.repeat(pose[None], ARMS_TRIED, axis=0), skeleton.dof_indices(usual)
    arms = np.stack(list(usual.values()), 1)
    poses[:, dofs] = arms[np.arange(ARMS_TRIED) % len(arms)] + SPREAD * rng.standard_normal((ARMS_TRIED, len(dofs)))
    return skeleton.clamp(poses)


def placed(body: Body, postures: Array, middle: Array) -> Array:
    """Postures (L, D) in all directions, each with its limbs' middle at `middle` (3,), world: of shape (L HEADINGS, D)."""
    poses = np.repeat(postures, HEADINGS, axis=0)
    place, heading = body.skeleton.dof_indices(GLOBAL_DOFS[:3]), body.skeleton.dof_indices(GLOBAL_DOFS[3:])[0]
    poses[:, place] = 0.0
    poses[:, heading] = np.tile(np.arange(HEADINGS) * 2 * np.pi / HEADINGS - np.pi, len(postures))
    limbs = body.limbs
    assert limbs is not None
    middles = body.skeleton.points(poses, limbs.joints, (limbs.starts + limbs.ends) / 2)
    areas = limbs.lengths * limbs.radii.mean((1, 2))
    poses[:, place] = middle - (areas[:, None] * middles).sum(1) / areas.sum()
    return poses
