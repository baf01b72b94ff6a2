"""Damped Gauss-Newton (Levenberg-Marquardt) on distances to tangent planes: the default preset's refinement, not the paper's."""

from __future__ import annotations

import numpy as np

from shadowpuppet.body.jacobian import MAX_STEP, TRANSLATION, place_one
from shadowpuppet.jit import kernel, reduction_kernel
from shadowpuppet.tracking.multiview.refinement.correspondence import (
    LANES,
    closest_on_part,
    closest_point,
    is_first_of_part,
    nearest,
    place_parts,
)
from shadowpuppet.tracking.multiview.refinement.free_space import push_inside
from shadowpuppet.tracking.multiview.refinement.keypoint_rays import pull_to_rays
from shadowpuppet.tracking.multiview.refinement.part_sums import add_descendants, bounded_cost, sum_by_joint, sum_costs


@kernel
def sum_equations(T, limbs, rows, spheres, origin, numbers, which, room):  # pragma: no cover
    """Fill the joints' sums of the normal equations, under transforms T (J, 3, 4); returns the summed cost, as `sum_costs`."""
    parts, _, _, _, out, lanes, sums = room
    joints, rotations, starts = limbs
    epsilon, choice, tau = numbers
    place_parts(T, origin, joints, rotations, starts, parts)
    lanes[:] = 0
    total = 0.0
    for group in range(spheres.shape[0]):
        near, points = which[group], rows[group]
        nearest(parts, points, spheres[group], epsilon, choice, near)
        total += bounded_cost(points, near, tau)
        for i in range(LANES):
            if is_first_of_part(near, i):
                number = near[LANES + i]
                s = np.int64(number)
                closest_on_part(parts[s], points, out)
                _add_equations(parts[s], number, points, near, tau, out, lanes[s])
    sum_by_joint(joints, lanes, sums)
    return total


@reduction_kernel
def _add_equations(q, number, rows, near, tau, out, lanes):  # pragma: no cover
    """Add the points of part `number` to `lanes` (SUMS LANES,): the products of each row (moment, normal) with itself (21, upper triangle
    by rows) and with the distance to the tangent plane (6)."""
    one, nil = np.float32(1), np.float32(0)
    for i in range(LANES):
        x, y, z = closest_point(q, out, i)
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


@kernel
def normal_equations(chain, screws, origin, sums, total, H, g):  # pragma: no cover
    """Fill H (D, D) and g (D,) from the joints' sums and the screws, which are moved to `origin`; all divided by `total`."""
    D = screws.shape[0]
    H[:] = 0
    for e in range(D):
        s, own = screws[e], sums[chain.owners[e]]
        if chain.kinds[e] != TRANSLATION:  # the moment about `origin`: (c - o) x omega
            s[3] -= origin[1] * s[2] - origin[2] * s[1]
            s[4] -= origin[2] * s[0] - origin[0] * s[2]
            s[5] -= origin[0] * s[1] - origin[1] * s[0]
    for e in range(D):
        s, own = screws[e], sums[chain.owners[e]]
        v0 = own[0] * s[0] + own[1] * s[1] + own[2] * s[2] + own[3] * s[3] + own[4] * s[4] + own[5] * s[5]
        v1 = own[1] * s[0] + own[6] * s[1] + own[7] * s[2] + own[8] * s[3] + own[9] * s[4] + own[10] * s[5]
        v2 = own[2] * s[0] + own[7] * s[1] + own[11] * s[2] + own[12] * s[3] + own[13] * s[4] + own[14] * s[5]
        v3 = own[3] * s[0] + own[8] * s[1] + own[12] * s[2] + own[15] * s[3] + own[16] * s[4] + own[17] * s[5]
        v4 = own[4] * s[0] + own[9] * s[1] + own[13] * s[2] + own[16] * s[3] + own[18] * s[4] + own[19] * s[5]
        v5 = own[5] * s[0] + own[10] * s[1] + own[14] * s[2] + own[17] * s[3] + own[19] * s[4] + own[20] * s[5]
        g[e] = (own[21] * s[0] + own[22] * s[1] + own[23] * s[2] + own[24] * s[3] + own[25] * s[4] + own[26] * s[5]) / total
        j = chain.owners[e]
        while j >= 0:
            for d in range(chain.first[j], chain.first[j + 1]):
                t = screws[d]
                H[d, e] = (t[0] * v0 + t[1] * v1 + t[2] * v2 + t[3] * v3 + t[4] * v4 + t[5] * v5) / total
                H[e, d] = H[d, e]
            j = chain.parents[j]


@kernel
def solve_cholesky(A, b):  # pragma: no cover
    """Overwrite b (D,) with the solution x of A x = b. A (D, D) is positive definite and overwritten too."""
    D = b.size
    for j in range(D):
        for k in range(j):
            A[j, j] -= A[j, k] * A[j, k]
        A[j, j] = np.sqrt(max(A[j, j], 1e-300))
        for i in range(j + 1, D):
            for k in range(j):
                A[i, j] -= A[i, k] * A[j, k]
            A[i, j] /= A[j, j]
    for i in range(D):
        for k in range(i):
            b[i] -= A[i, k] * b[k]
        b[i] /= A[i, i]
    for i in range(D - 1, -1, -1):
        for k in range(i + 1, D):
            b[i] -= A[k, i] * b[k]
        b[i] /= A[i, i]


@kernel
def descend(poses, centre, pull, chain, limbs, rows, groups, origin, points, numbers, damping, iterations, which, room, system,
            spheres, space, distances, emptiness, keypoints, costs):  # pragma: no cover
    """Move poses (N, D), in place, as `Refiner.gauss_newton` describes; `costs` (N,) receives what they cost then. `keypoints`: landmarks,
    sights, m^2 a nat and two work arrays of `pull_to_rays`."""
    landmarks, sights, worth, places, logs = keypoints
    T, screws, work, sums = room[1], room[2], room[3], room[6]
    H, A, vectors = system
    D = pull.size
    g, best, step = vectors[0, :D], vectors[1, :D], vectors[2, :D]
    for n in range(poses.shape[0]):
        pose, about = poses[n], centre[n]
        least, damp = np.inf, damping
        for turn in range(iterations + 1):
            place_one(pose, chain, T, screws, work)
            if turn < iterations:
                cost = sum_equations(T, limbs, rows, groups, origin, numbers, which, room) / points
            else:
                cost = sum_costs(T, limbs, rows, groups, origin, numbers, which, room) / points
            cost += push_inside(T, spheres, space, distances, emptiness * points, origin, sums, turn < iterations) / points
            cost += pull_to_rays(T, landmarks, sights, worth * points, origin, sums, places, logs, turn < iterations) / points
            for d in range(D):
                cost += pull[d] * (pose[d] - about[d]) ** 2
            if cost <= least:
                least = cost
                for d in range(D):
                    best[d] = pose[d]
                damp *= 0.3
                if turn < iterations:
                    add_descendants(chain, sums)
                    normal_equations(chain, screws, origin, sums, points, H, g)
                    for d in range(D):
                        H[d, d] += pull[d]
                        g[d] -= pull[d] * (best[d] - about[d])
            else:
                damp *= 8
            if turn == iterations:
                break
            for d in range(D):
                step[d] = g[d]
                for e in range(D):
                    A[d, e] = H[d, e]
                A[d, d] += damp * H[d, d] + 1e-9
            for d in range(D):
                if (best[d] <= chain.low[d] and g[d] < 0) or (best[d] >= chain.high[d] and g[d] > 0):
                    for e in range(D):
                        A[d, e] = A[e, d] = 0
                    A[d, d], step[d] = 1, 0
            solve_cholesky(A, step)
            for d in range(D):
                move = min(max(step[d], -MAX_STEP), MAX_STEP)
                pose[d] = min(max(best[d] + move, chain.low[d]), chain.high[d])
        costs[n] = least
        for d in range(D):
            pose[d] = best[d]
