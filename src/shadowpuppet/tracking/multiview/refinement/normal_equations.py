"""A pass over the surface points: which part each is nearest to, and a few sums a part of what they say about its motion.

How a degree of freedom moves the part is its screw (`screws.py`), so that normal equations, forces and moments are products of the two,
whatever the number of points.
"""

from __future__ import annotations

import numpy as np

from shadowpuppet.jit import device, kernel, reduction_kernel
from shadowpuppet.tracking.multiview.refinement.correspondence import LANES, foot, measure, nearest, place_parts

SUMS = 29
"""Sums of a part: of the normal equations 21 + 6, of the forces 3 + 3 + 1 + 3 + 6, at most."""
COST, EQUATIONS, FORCES, ROBUST, MODULATED = 0, 1, 4, 1, 2
"""What a pass is for; to `FORCES` are added whether they are bounded, and whether they go by the normals."""


@kernel
def sweep(mode, T, limbs, rows, spheres, origin, numbers, which, room):  # pragma: no cover
    """One pass over the points under transforms T: the summed cost, and another `mode` than `COST` the parts' sums, by joint."""
    parts, _, _, _, out, lanes, sums = room
    joints, rotations, starts = limbs
    epsilon, tau = numbers
    place_parts(T, origin, joints, rotations, starts, parts)
    lanes[:] = 0
    total = 0.0
    for group in range(spheres.shape[0]):
        near, points = which[group], rows[group]
        nearest(parts, points, spheres[group], epsilon, near)
        total += _bounded(points, near, tau)
        if mode == COST:
            continue
        for i in range(LANES):
            number, fresh = near[LANES + i], True
            for k in range(i):
                if near[LANES + k] == number:
                    fresh = False
            if fresh:
                s = np.int64(number)
                measure(parts[s], points, out)
                if mode == EQUATIONS:
                    _add_equations(parts[s], number, points, near, tau, out, lanes[s])
                else:
                    _add_forces(parts[s], number, points, near, tau, mode, out, lanes[s])
    if mode:
        _gather(joints, lanes, sums)
    return total


@reduction_kernel
def _bounded(rows, near, tau):  # pragma: no cover
    total = np.float32(0)
    for i in range(LANES):
        d = min(near[i], tau)
        total += rows[6 * LANES + i] * d * d
    return total


@reduction_kernel
def _add_equations(q, number, rows, near, tau, out, lanes):  # pragma: no cover
    """Add what the points of the part `number` say about its motion to `lanes` (SUMS LANES,): the moment and direction along which each
    measures, multiplied with one another (21, by rows of the upper triangle) and with the distance to the tangent plane (6)."""
    one, nil = np.float32(1), np.float32(0)
    for i in range(LANES):
        x, y, z = foot(q, out, i)
        nx, ny, nz = rows[3 * LANES + i], rows[4 * LANES + i], rows[5 * LANES + i]
        r = (rows[i] - x) * nx + (rows[LANES + i] - y) * ny + (rows[2 * LANES + i] - z) * nz
        share = near[i] / tau
        fade = one / (one + share * share)
        agree = max(out[LANES + i], nil)
        w = rows[6 * LANES + i] * fade * fade * agree if near[LANES + i] == number else nil
        a, b, c = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
        wa, wb, wc, wx, wy, wz = w * a, w * b, w * c, w * nx, w * ny, w * nz
        lanes[i] += wa * a
        lanes[LANES + i] += wa * b
        lanes[2 * LANES + i] += wa * c
        lanes[3 * LANES + i] += wa * nx
        lanes[4 * LANES + i] += wa * ny
        lanes[5 * LANES + i] += wa * nz
        lanes[6 * LANES + i] += wb * b
        lanes[7 * LANES + i] += wb * c
        lanes[8 * LANES + i] += wb * nx
        lanes[9 * LANES + i] += wb * ny
        lanes[10 * LANES + i] += wb * nz
        lanes[11 * LANES + i] += wc * c
        lanes[12 * LANES + i] += wc * nx
        lanes[13 * LANES + i] += wc * ny
        lanes[14 * LANES + i] += wc * nz
        lanes[15 * LANES + i] += wx * nx
        lanes[16 * LANES + i] += wx * ny
        lanes[17 * LANES + i] += wx * nz
        lanes[18 * LANES + i] += wy * ny
        lanes[19 * LANES + i] += wy * nz
        lanes[20 * LANES + i] += wz * nz
        lanes[21 * LANES + i] += wa * r
        lanes[22 * LANES + i] += wb * r
        lanes[23 * LANES + i] += wc * r
        lanes[24 * LANES + i] += wx * r
        lanes[25 * LANES + i] += wy * r
        lanes[26 * LANES + i] += wz * r


@reduction_kernel
def _add_forces(q, number, rows, near, tau, mode, out, lanes):  # pragma: no cover
    """Add the forces on the part `number` (eq. 32) to `lanes` (SUMS LANES,): their moments about the cloud's origin (3), themselves (3),
    and of the points on the model that they act on the number, the sum (3) and the products (6), weighed as the points."""
    nil = np.float32(0)
    bounded, modulated = mode & ROBUST, mode & MODULATED
    for i in range(LANES):
        x, y, z = foot(q, out, i)
        dx, dy, dz = rows[i] - x, rows[LANES + i] - y, rows[2 * LANES + i] - z
        distance = np.sqrt(dx * dx + dy * dy + dz * dz) + np.float32(1e-9)
        size = max(out[LANES + i], nil) * distance if modulated else distance
        size = min(size, tau) if bounded else size
        w = rows[6 * LANES + i] if near[LANES + i] == number else nil
        push = w * size / distance
        fx, fy, fz = push * dx, push * dy, push * dz
        lanes[i] += y * fz - z * fy
        lanes[LANES + i] += z * fx - x * fz
        lanes[2 * LANES + i] += x * fy - y * fx
        lanes[3 * LANES + i] += fx
        lanes[4 * LANES + i] += fy
        lanes[5 * LANES + i] += fz
        lanes[6 * LANES + i] += w
        lanes[7 * LANES + i] += w * x
        lanes[8 * LANES + i] += w * y
        lanes[9 * LANES + i] += w * z
        lanes[10 * LANES + i] += w * x * x
        lanes[11 * LANES + i] += w * x * y
        lanes[12 * LANES + i] += w * x * z
        lanes[13 * LANES + i] += w * y * y
        lanes[14 * LANES + i] += w * y * z
        lanes[15 * LANES + i] += w * z * z


@device
def _gather(joints, lanes, sums):  # pragma: no cover
    """Sums (J, SUMS) by joint of the parts' lanes."""
    sums[:] = 0
    for s in range(joints.size):
        for k in range(SUMS):
            total = 0.0
            for i in range(LANES):
                total += lanes[s, k * LANES + i]
            sums[joints[s], k] += total


@device
def gather_down(chain, sums):  # pragma: no cover
    """Add to every joint's sums those of what hangs on it."""
    for j in range(chain.parents.size - 1, 0, -1):
        if chain.parents[j] >= 0:
            for k in range(SUMS):
                sums[chain.parents[j], k] += sums[j, k]
