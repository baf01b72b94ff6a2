"""Poses made better by the surface points that they should explain: simulated forces (Ni 2008, V-B), and Gauss-Newton on the same points.

Both run over many poses, each by itself. A pass over the points leaves for every part of the body a few sums; how a DOF moves the part
is its screw (`screws.py`), so that forces, moments and normal equations are products of the two.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body import Body
from shadowpuppet.closest import LANES, Cloud, constants, foot, measure, nearest, place_parts
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.free_space import FreeSpace, free_space, push_inside, spheres_in
from shadowpuppet.geometry import Array
from shadowpuppet.kernels import kernel, part, summing
from shadowpuppet.screws import TRANSLATION, make_chain, place_one
from shadowpuppet.settings import ForceSettings, SurfaceSettings

SUMS = 29
"""Sums of a part: of the normal equations 21 + 6, of the forces 3 + 3 + 1 + 3 + 6, at most."""
COST, EQUATIONS, FORCES, ROBUST, MODULATED = 0, 1, 4, 1, 2
"""What a pass is for; to `FORCES` are added whether they are bounded, and whether they go by the normals."""
STEP = 0.5
"""No DOF moves farther than this (rad or m) in one iteration."""


class Pass(NamedTuple):
    """Iterations of Gauss-Newton on the same evidence."""

    cloud: Cloud
    """Surface points."""
    iterations: int
    tau: float
    """Distance (m) at which a point counts a quarter."""
    space: FreeSpace | None = None
    """What the silhouettes rule out, if that counts."""
    emptiness: float = 0.0
    """Weight of the mean squared distance by which limbs reach out of the silhouettes, beside that of the points."""


class Refiner:
    """A body's half of the work. `costs`, `gauss_newton` and `forces` take poses (N, D) and a `Cloud`.

    Raises `ShadowPuppetError` for a body without limbs or with coupled joints.
    """

    def __init__(self, body: Body, settings: SurfaceSettings | None = None) -> None:
        """Arrays and room for the kernels."""
        if body.limbs is None or body.skeleton.couplings:
            raise ShadowPuppetError(f"body {body.name!r}: found no limbs on a tree of joints, which surface points need")
        self.body, self.settings = body, settings or SurfaceSettings()
        self._chain = make_chain(body.skeleton)
        limbs = body.limbs
        self._spheres, self._nowhere = spheres_in(limbs), free_space(())
        self._limbs = limbs.joints, np.ascontiguousarray(limbs.rotations), np.ascontiguousarray(limbs.starts)
        J, D, S = len(body.skeleton.joints), len(body.skeleton.dofs), len(limbs.joints)
        self._room = (constants(limbs), np.zeros((J, 3, 4)), np.zeros((D, 6)), np.zeros((3, 3, 3)), np.zeros(8 * LANES, np.float32),
                      np.zeros((S, SUMS * LANES), np.float32), np.zeros((J, SUMS)))
        self._system = np.zeros((D, D)), np.zeros((D, D)), np.zeros((3, max(D, 4)))

    def costs(self, poses: Array, cloud: Cloud, tau: float | None = None) -> Array:
        """D of eq. 31 for poses (N, D): mean over the points of min(d^2, tau^2), m^2, of shape (N,). `tau`: another than the settings'."""
        poses, out = self.body.skeleton.checked(poses), np.empty(len(poses))
        _costs(poses, self._chain, self._limbs, cloud.rows, cloud.spheres, cloud.origin, self._numbers(tau), self._which(cloud), self._room,
               out)
        return out / max(cloud.total, 1e-9)

    def gauss_newton(self, poses: Array, passes: Sequence[Pass | tuple[Cloud, int, float]], centre: Array, pull: Array,
                     damping: float = 0.03) -> Array:
        """Better poses (N, D): damped (Levenberg-Marquardt), robust, within limits.

        `passes` in turn: a few points first, and what is empty; all points then. `pull` (D,): weight of the squared distance from `centre`
        (N or 1, D) beside the mean squared distance of the points; it decides what these do not see.
        """
        poses = self.body.skeleton.checked(poses).copy()
        centre = np.ascontiguousarray(np.atleast_2d(centre), float)
        for each in passes:
            cloud, iterations, tau, space, emptiness = each if isinstance(each, Pass) else Pass(*each)
            _gauss_newton(poses, centre, np.asarray(pull, float), self._chain, self._limbs, cloud.rows, cloud.spheres, cloud.origin,
                          max(cloud.total, 1e-9), self._numbers(tau), damping, iterations, self._which(cloud), self._room, self._system,
                          self._spheres, space or self._nowhere, emptiness)
        return poses

    def forces(self, poses: Array, cloud: Cloud, settings: ForceSettings) -> Array:
        """Poses (N, D) after some iterations of simulated force and moment (eqs. 32-41), within limits."""
        poses = self.body.skeleton.checked(poses).copy()
        mode = FORCES + ROBUST * settings.robust + MODULATED * settings.modulated
        gains = settings.translation, settings.rotation
        _forces(poses, mode, settings.hierarchical, gains, settings.iterations, self._chain, self._limbs, cloud.rows, cloud.spheres,
                cloud.origin, self._numbers(), self._which(cloud), self._room, self._system[2])
        return poses

    def _numbers(self, tau: float | None = None) -> tuple[np.float32, np.float32]:
        return np.float32(self.settings.epsilon), np.float32(self.settings.tau if tau is None else tau)

    @staticmethod
    def _which(cloud: Cloud) -> NDArray[np.float32]:
        return np.zeros((len(cloud.rows), 2 * LANES), np.float32)


# Kernels


@kernel
def _sweep(mode, T, limbs, rows, spheres, origin, numbers, which, room):  # pragma: no cover
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


@summing
def _bounded(rows, near, tau):  # pragma: no cover
    total = np.float32(0)
    for i in range(LANES):
        d = min(near[i], tau)
        total += rows[6 * LANES + i] * d * d
    return total


@summing
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


@part
def _gather(joints, lanes, sums):  # pragma: no cover
    """Sums (J, SUMS) by joint of the parts' lanes."""
    sums[:] = 0
    for s in range(joints.size):
        for k in range(SUMS):
            total = 0.0
            for i in range(LANES):
                total += lanes[s, k * LANES + i]
            sums[joints[s], k] += total


@part
def _gather_down(chain, sums):  # pragma: no cover
    """Add to every joint's sums those of what hangs on it."""
    for j in range(chain.parents.size - 1, 0, -1):
        if chain.parents[j] >= 0:
            for k in range(SUMS):
                sums[chain.parents[j], k] += sums[j, k]


@kernel
def _costs(poses, chain, limbs, rows, spheres, origin, numbers, which, room, out):  # pragma: no cover
    for n in range(poses.shape[0]):
        place_one(poses[n], chain, room[1], room[2], room[3])
        out[n] = _sweep(COST, room[1], limbs, rows, spheres, origin, numbers, which, room)


@kernel
def _normal_equations(chain, screws, origin, sums, total, H, g):  # pragma: no cover
    """H (D, D) and g (D,) from the joints' sums and the screws, which are moved to `origin`; `total`: what to divide by."""
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
def _solve(A, b):  # pragma: no cover
    """x of A x = b in place of b (D,), by Cholesky; A (D, D) is positive definite, and overwritten."""
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
def _gauss_newton(poses, centre, pull, chain, limbs, rows, groups, origin, points, numbers, damping, iterations, which, room, system,
                  spheres, space, emptiness):  # pragma: no cover
    """See `Refiner.gauss_newton`; `poses` is written over."""
    T, screws, work, sums = room[1], room[2], room[3], room[6]
    H, A, vectors = system
    D = pull.size
    g, best, step = vectors[0, :D], vectors[1, :D], vectors[2, :D]
    for n in range(poses.shape[0]):
        pose, about = poses[n], centre[min(n, centre.shape[0] - 1)]
        least, damp = np.inf, damping
        for turn in range(iterations + 1):
            place_one(pose, chain, T, screws, work)
            held = _sweep(EQUATIONS if turn < iterations else COST, T, limbs, rows, groups, origin, numbers, which, room) / points
            held += push_inside(T, spheres, space, emptiness * points, origin, sums, turn < iterations) / points
            for d in range(D):
                held += pull[d] * (pose[d] - about[d]) ** 2
            if held <= least:
                least = held
                for d in range(D):
                    best[d] = pose[d]
                damp *= 0.3
                if turn < iterations:
                    _gather_down(chain, sums)
                    _normal_equations(chain, screws, origin, sums, points, H, g)
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
            _solve(A, step)
            for d in range(D):
                move = min(max(step[d], -STEP), STEP)
                pose[d] = min(max(best[d] + move, chain.low[d]), chain.high[d])
        for d in range(D):
            pose[d] = best[d]


@summing
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


@part
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
        pose[d] = min(max(pose[d] + min(max(step[d], -STEP), STEP), chain.low[d]), chain.high[d])


@kernel
def _forces(poses, mode, hierarchical, gains, iterations, chain, limbs, rows, spheres, origin, numbers, which, room,
            vectors):  # pragma: no cover
    """See `Refiner.forces`; `poses` is written over. Without the hierarchical sum a joint feels only the parts fixed to it; what shifts
    feels all."""
    T, screws, work, sums, force = room[1], room[2], room[3], room[6], vectors[1, :4]
    for n in range(poses.shape[0]):
        for _ in range(iterations):
            place_one(poses[n], chain, T, screws, work)
            _sweep(mode, T, limbs, rows, spheres, origin, numbers, which, room)
            force[:] = 0
            for j in range(sums.shape[0]):
                for k in range(4):
                    force[k] += sums[j, 3 + k]
            if hierarchical:
                _gather_down(chain, sums)
            _move_by_forces(poses[n], chain, T, screws, origin, sums, force, gains, vectors[0])
