"""Sums over the surface points of each body part, and their totals down the tree of joints.

A degree of freedom moves a part by its screw (`body.jacobian`), so forces, moments and normal equations are products of a screw and a
few sums per part, whatever the number of points. `forces` and `gauss_newton` fill the sums, one lane per point of a group.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import device, kernel, reduction_kernel
from shadowpuppet.tracking.multiview.refinement.correspondence import LANES, nearest, place_parts

SUMS = 29
"""Number of sums per part: 21 + 6 for the normal equations, 3 + 3 + 1 + 3 + 6 for the forces."""


@kernel
def sum_costs(T, limbs, rows, spheres, origin, numbers, which, room):  # pragma: no cover
    """Sum over the points of min(d^2, tau^2) (eq. 30), under transforms T (J, 3, 4)."""
    parts = room[0]
    joints, rotations, starts = limbs
    epsilon, choice, tau = numbers
    place_parts(T, origin, joints, rotations, starts, parts)
    total = 0.0
    for group in range(spheres.shape[0]):
        nearest(parts, rows[group], spheres[group], epsilon, choice, which[group])
        total += bounded_cost(rows[group], which[group], tau)
    return total


@reduction_kernel
def bounded_cost(rows, near, tau):  # pragma: no cover
    """Sum over a group's points of min(d^2, tau^2) (eq. 30), weighted."""
    total = np.float32(0)
    for i in range(LANES):
        d = min(near[i], tau)
        total += rows[6 * LANES + i] * d * d
    return total


@device
def sum_by_joint(joints, lanes, sums):  # pragma: no cover
    """Fill sums (J, SUMS) with the totals of the parts' lanes (S, SUMS LANES)."""
    sums[:] = 0
    for s in range(joints.size):
        for k in range(SUMS):
            total = 0.0
            for i in range(LANES):
                total += lanes[s, k * LANES + i]
            sums[joints[s], k] += total


@device
def add_descendants(chain, sums):  # pragma: no cover
    """Add to each joint's sums those of the joints below it in the tree (Fig. 3; eqs. 38-40)."""
    for j in range(chain.parents.size - 1, 0, -1):
        if chain.parents[j] >= 0:
            for k in range(SUMS):
                sums[chain.parents[j], k] += sums[j, k]
