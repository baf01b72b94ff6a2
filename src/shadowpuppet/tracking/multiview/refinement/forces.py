"""Simulated force and moment (Ni 2008, V-B, eqs. 32-41): what pulls a body's parts to the surface points moves its joints."""

from __future__ import annotations

from shadowpuppet.body.jacobian import MAX_STEP, TRANSLATION, place_one
from shadowpuppet.jit import device, kernel
from shadowpuppet.tracking.multiview.refinement.normal_equations import gather_down, sweep


@device
def _move_by_forces(pose, chain, T, screws, origin, sums, force, gains, step):  # pragma: no cover
    """Move a pose by the moments about its joints and the force on its root: each divided by the inertia of the points that it acts
    on, so that the step does not depend on how many there are."""
    for d in range(pose.size):
        own, joint, s = sums[chain.owners[d]], T[chain.owners[d]], screws[d]
        mass = own[6] + 1e-9
        if chain.kinds[d] == TRANSLATION:
            step[d] = gains[0] * (force[0] * s[3] + force[1] * s[4] + force[2] * s[5]) / (force[3] + 1e-9)
            continue
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
        step[d] = gains[1] * (m0 * s[0] + m1 * s[1] + m2 * s[2]) / (inertia + 1e-4 * mass)
    for d in range(pose.size):
        pose[d] = min(max(pose[d] + min(max(step[d], -MAX_STEP), MAX_STEP), chain.low[d]), chain.high[d])


@kernel
def push(poses, mode, hierarchical, gains, iterations, chain, limbs, rows, spheres, origin, numbers, which, room,
            vectors):  # pragma: no cover
    """Move poses (N, D), in place, as `Refiner.forces` says. Without the hierarchical sum a joint feels only the parts fixed to it;
    what shifts feels all."""
    T, screws, work, sums, force = room[1], room[2], room[3], room[6], vectors[1, :4]
    for n in range(poses.shape[0]):
        for _ in range(iterations):
            place_one(poses[n], chain, T, screws, work)
            sweep(mode, T, limbs, rows, spheres, origin, numbers, which, room)
            force[:] = 0
            for j in range(sums.shape[0]):
                for k in range(4):
                    force[k] += sums[j, 3 + k]
            if hierarchical:
                gather_down(chain, sums)
            _move_by_forces(poses[n], chain, T, screws, origin, sums, force, gains, vectors[0])
