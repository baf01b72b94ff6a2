"""Simulated forces and moments (Ni 2008, V-B): surface points pull the body's parts toward themselves and so move its joints."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.jacobian import MAX_STEP, TRANSLATION, place_one
from shadowpuppet.jit import device, kernel, reduction_kernel
from shadowpuppet.tracking.multiview.refinement.correspondence import (
    LANES,
    closest_on_part,
    closest_point,
    is_first_of_part,
    nearest,
    place_parts,
)
from shadowpuppet.tracking.multiview.refinement.part_sums import add_descendants, sum_by_joint

UNBOUNDED, LINEAR, QUADRATIC = range(3)
"""rho of eq. 32; the quadratic one is divided by tau, so that all have the same bound."""


@kernel
def push(poses, rho, modulated, hierarchical, gains, balance, iterations, chain, limbs, rows, spheres, origin, numbers, which, room,
         vectors):  # pragma: no cover
    """Move poses (N, D), in place, by forces and moments until these balance, in at most `iterations` steps, as `Refiner.forces`
    describes. `rho` is one of the numbers above. Without `hierarchical` only the forces on parts fixed to a joint move it; the root is
    translated by the forces on all parts in either case."""
    T, screws, work, sums, force = room[1], room[2], room[3], room[6], vectors[1, :4]
    for n in range(poses.shape[0]):
        for _ in range(iterations):
            place_one(poses[n], chain, T, screws, work)
            # eqs. 32, 33, 36, 37 of each joint's own parts
            _sum_forces(rho, modulated, T, limbs, rows, spheres, origin, numbers, which, room)
            force[:] = 0
            for j in range(sums.shape[0]):  # eq. 38: the forces on all parts translate the root
                for k in range(4):
                    force[k] += sums[j, 3 + k]
            if hierarchical:
                add_descendants(chain, sums)  # eqs. 39, 40: a joint turns by the moments on all parts below it
            moved = _move_joints(poses[n], chain, T, screws, origin, sums, force, gains, vectors[0])  # eqs. 34, 35, 41
            if moved <= balance:
                break


@kernel
def _sum_forces(rho, modulated, T, limbs, rows, spheres, origin, numbers, which, room):  # pragma: no cover
    """Fill the joints' sums of forces and moments, under transforms T (J, 3, 4)."""
    parts, _, _, _, out, lanes, sums = room
    joints, rotations, starts = limbs
    _, choice, tau = numbers
    place_parts(T, origin, joints, rotations, starts, parts)
    lanes[:] = 0
    for group in range(spheres.shape[0]):
        near, points = which[group], rows[group]
        nearest(parts, points, spheres[group], np.float32(0), choice, near)  # the distances themselves are not used
        for i in range(LANES):
            if is_first_of_part(near, i):
                number = near[LANES + i]
                s = np.int64(number)
                closest_on_part(parts[s], points, out)
                _add_forces(parts[s], number, points, near, tau, rho, modulated, out, lanes[s])
    sum_by_joint(joints, lanes, sums)


@reduction_kernel
def _add_forces(q, number, rows, near, tau, rho, modulated, out, lanes):  # pragma: no cover
    """Add the forces on part `number` to `lanes` (SUMS LANES,): moments about the cloud's origin (3) and forces (3); and, for the model's
    points p' on which they act, the weight, the first moments (3) and the second moments (6)."""
    nil = np.float32(0)
    for i in range(LANES):
        x, y, z = closest_point(q, out, i)
        dx, dy, dz = rows[i] - x, rows[LANES + i] - y, rows[2 * LANES + i] - z
        distance = np.sqrt(dx * dx + dy * dy + dz * dz) + np.float32(1e-9)
        size = max(out[LANES + i], nil) * distance if modulated else distance  # m_F |pp'|, m_F = cos(n, n')
        size = size * size / tau if rho == QUADRATIC else size
        size = size if rho == UNBOUNDED else min(size, tau)  # the robust function rho
        w = rows[6 * LANES + i] if near[LANES + i] == number else nil
        push = w * size / distance
        fx, fy, fz = push * dx, push * dy, push * dz  # eq. 32, from p' to p
        lanes[i] += y * fz - z * fy  # eq. 33, p' x F, about the cloud's origin; the sums are those of eqs. 36, 37
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
def _move_joints(pose, chain, T, screws, origin, sums, force, gains, step):  # pragma: no cover
    """Move a pose (D,) by the force on its root and the moments about its joints; returns the largest change of a degree of freedom. The
    paper's weights rho and lambda are here the gain divided by the mass or inertia of the points that act, so that a step does not depend
    on their number."""
    for d in range(pose.size):
        own, joint, s = sums[chain.owners[d]], T[chain.owners[d]], screws[d]
        mass = own[6] + 1e-9
        if chain.kinds[d] == TRANSLATION:
            step[d] = gains[0] * (force[0] * s[3] + force[1] * s[4] + force[2] * s[5]) / (force[3] + 1e-9)  # eq. 34
            continue
        # moments about the joint's centre c, from those about the origin
        c0, c1, c2 = joint[0, 3] - origin[0], joint[1, 3] - origin[1], joint[2, 3] - origin[2]
        m0, m1, m2 = own[0] - (c1 * own[5] - c2 * own[4]), own[1] - (c2 * own[3] - c0 * own[5]), own[2] - (c0 * own[4] - c1 * own[3])
        # second moments about the joint, and from them the inertia about the axis
        xx, xy, xz = own[10] - 2 * c0 * own[7] + mass * c0 * c0, own[11] - c0 * own[8] - c1 * own[7] + mass * c0 * c1, \
            own[12] - c0 * own[9] - c2 * own[7] + mass * c0 * c2
        yy, yz, zz = own[13] - 2 * c1 * own[8] + mass * c1 * c1, own[14] - c1 * own[9] - c2 * own[8] + mass * c1 * c2, \
            own[15] - 2 * c2 * own[9] + mass * c2 * c2
        length = s[0] * s[0] + s[1] * s[1] + s[2] * s[2]
        along = s[0] * (xx * s[0] + 2 * xy * s[1] + 2 * xz * s[2]) + s[1] * (yy * s[1] + 2 * yz * s[2]) + s[2] * zz * s[2]
        inertia = (xx + yy + zz) * length - along
        step[d] = gains[1] * (m0 * s[0] + m1 * s[1] + m2 * s[2]) / (inertia + 1e-4 * mass)  # eq. 35
    moved = 0.0
    for d in range(pose.size):
        last = pose[d]
        pose[d] = min(max(last + min(max(step[d], -MAX_STEP), MAX_STEP), chain.low[d]), chain.high[d])  # eq. 41
        moved = max(moved, abs(pose[d] - last))
    return moved
