"""A first pose from one frame's hull: usual postures, or those of a library, in all directions, refined, the best kept.

Ni 2008 does not say how tracking begins.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from shadowpuppet.body import Body
from shadowpuppet.evidence import Evidence
from shadowpuppet.geometry import Array
from shadowpuppet.particle_filter import Particles, Weigh, evaluate
from shadowpuppet.proposals import GLOBAL
from shadowpuppet.refinement import Refiner
from shadowpuppet.usual import usual_postures

HEADINGS = 16
"""Directions that are tried."""
MOST = 60
"""Postures of a library that are tried."""
BEGIN, GOOD = 96, 32
"""Poses that are refined on some of the points, and on all of them."""
ROUGH = ((8, 4, 0.25), (4, 6, 0.12))
FINE = ((4, 4, 0.08), (1, 6, 0.05))
"""Every so many-th point, iterations, robust scale (m)."""
PULL = 1e-4
"""Pull to the posture that a search began with (see `Refiner.gauss_newton`)."""


def search(rng: np.random.Generator, body: Body, refiner: Refiner, evidence: Evidence, library: ArrayLike | None, weigh: Weigh,
           number: int) -> Particles:
    """The `number` best poses (number, D) for a frame's surface points, weighed by `weigh`. `library`: poses (L, D) to begin with, of which
    place and heading do not count."""
    postures = usual_postures(body.skeleton)
    if library is not None and len(library):
        known = np.asarray(library, float)
        postures = np.concatenate([known if len(known) <= MOST else known[np.sort(rng.choice(len(known), MOST, replace=False))], postures])
    poses = placed(body, postures, evidence.full.origin)
    poses = poses[refiner.costs(poses, evidence.cloud(ROUGH[0][0]), ROUGH[0][2]).argsort(kind="stable")[:BEGIN]]
    for stages, kept in ((ROUGH, GOOD), (FINE, number)):
        clouds = tuple((evidence.cloud(share), iterations, tau) for share, iterations, tau in stages)
        poses = refiner.gauss_newton(poses, clouds, poses, np.full(poses.shape[1], PULL))
        found = evaluate(poses, weigh)
        order = found.costs.argsort(kind="stable")[:kept]
        poses = poses[order]
    order = order[np.arange(number) % len(order)]
    return Particles(found.poses[order], found.costs[order], found.log_weights[order])


def placed(body: Body, postures: Array, middle: Array) -> Array:
    """Postures (L, D) in all directions, each with its limbs' middle at `middle` (3,), world: of shape (L HEADINGS, D)."""
    poses = np.repeat(postures, HEADINGS, axis=0)
    place, heading = body.skeleton.dof_indices(GLOBAL[:3]), body.skeleton.dof_indices(GLOBAL[3:])[0]
    poses[:, place] = 0.0
    poses[:, heading] = np.tile(np.arange(HEADINGS) * 2 * np.pi / HEADINGS - np.pi, len(postures))
    limbs = body.limbs
    assert limbs is not None
    middles = body.skeleton.points(poses, limbs.joints, (limbs.starts + limbs.ends) / 2)
    areas = limbs.lengths * limbs.radii.mean((1, 2))
    poses[:, place] = middle - (areas[:, None] * middles).sum(1) / areas.sum()
    return poses
