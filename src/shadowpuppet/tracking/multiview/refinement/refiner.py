"""Poses made better by the surface points that they should explain: Gauss-Newton, and simulated forces (`forces.py`; Ni 2008, V-B) on the
same points. Both run over many poses, each by itself."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.jacobian import MAX_STEP, TRANSLATION, make_chain, place_one
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.tracking.multiview.refinement.correspondence import LANES, Cloud, constants
from shadowpuppet.tracking.multiview.refinement.forces import push
from shadowpuppet.tracking.multiview.refinement.free_space import FreeSpace, free_space, push_inside, spheres_in
from shadowpuppet.tracking.multiview.refinement.normal_equations import COST, EQUATIONS, FORCES, MODULATED, ROBUST, SUMS, gather_down, sweep
from shadowpuppet.tracking.multiview.settings import ForceSettings, SurfaceSettings


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
        """Arrays for the kernels."""
        if body.limbs is None or body.skeleton.couplings:
            raise ShadowPuppetError(f"body {body.name!r}: found no limbs on a tree of joints, which surface points need")
        self.body, self.settings = body, settings or SurfaceSettings()
        self._chain = make_chain(body.skeleton)
        limbs = body.limbs
        self._spheres, self._nowhere = spheres_in(limbs), free_space(())
        self._limbs = limbs.joints, np.ascontiguousarray(limbs.rotations), np.ascontiguousarray(limbs.starts)
        self._parts = constants(limbs)

    def costs(self, poses: Array, cloud: Cloud, tau: float | None = None) -> Array:
        """D of eq. 31 for poses (N, D): mean over the points of min(d^2, tau^2), m^2, of shape (N,). `tau`: another than the settings'."""
        poses, out = self.body.skeleton.checked(poses), np.empty(len(poses))
        _costs(poses, self._chain, self._limbs, cloud.rows, cloud.spheres, cloud.origin, self._numbers(tau), self._which(cloud),
               self._room(), out)
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
            space = space or self._nowhere
            said = np.empty((len(space.windows), len(self._spheres.radii), 4))
            _gauss_newton(poses, centre, np.asarray(pull, float), self._chain, self._limbs, cloud.rows, cloud.spheres, cloud.origin,
                          max(cloud.total, 1e-9), self._numbers(tau), damping, iterations, self._which(cloud), self._room(),
                          self._system(), self._spheres, space, said, emptiness)
        return poses

    def forces(self, poses: Array, cloud: Cloud, settings: ForceSettings) -> Array:
        """Poses (N, D) after some iterations of simulated force and moment (eqs. 32-41), within limits."""
        poses = self.body.skeleton.checked(poses).copy()
        mode = FORCES + ROBUST * settings.robust + MODULATED * settings.modulated
        gains = settings.translation, settings.rotation
        push(poses, mode, settings.hierarchical, gains, settings.iterations, self._chain, self._limbs, cloud.rows, cloud.spheres,
             cloud.origin, self._numbers(), self._which(cloud), self._room(), self._system()[2])
        return poses

    def _numbers(self, tau: float | None = None) -> tuple[np.float32, np.float32]:
        return np.float32(self.settings.epsilon), np.float32(self.settings.tau if tau is None else tau)

    def _room(self) -> tuple[NDArray[Any], ...]:
        """For the kernels; each call has its own, so that threads do not meet."""
        J, D, S = len(self.body.skeleton.joints), len(self.body.skeleton.dofs), len(self._parts)
        return (self._parts.copy(), np.zeros((J, 3, 4)), np.zeros((D, 6)), np.zeros((3, 3, 3)), np.zeros(8 * LANES, np.float32),
                np.zeros((S, SUMS * LANES), np.float32), np.zeros((J, SUMS)))

    def _system(self) -> tuple[Array, Array, Array]:
        D = len(self.body.skeleton.dofs)
        return np.zeros((D, D)), np.zeros((D, D)), np.zeros((3, max(D, 4)))

    @staticmethod
    def _which(cloud: Cloud) -> NDArray[np.float32]:
        return np.zeros((len(cloud.rows), 2 * LANES), np.float32)


# Kernels


@kernel
def _costs(poses, chain, limbs, rows, spheres, origin, numbers, which, room, out):  # pragma: no cover
    for n in range(poses.shape[0]):
        place_one(poses[n], chain, room[1], room[2], room[3])
        out[n] = sweep(COST, room[1], limbs, rows, spheres, origin, numbers, which, room)


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
                  spheres, space, said, emptiness):  # pragma: no cover
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
            held = sweep(EQUATIONS if turn < iterations else COST, T, limbs, rows, groups, origin, numbers, which, room) / points
            held += push_inside(T, spheres, space, said, emptiness * points, origin, sums, turn < iterations) / points
            for d in range(D):
                held += pull[d] * (pose[d] - about[d]) ** 2
            if held <= least:
                least = held
                for d in range(D):
                    best[d] = pose[d]
                damp *= 0.3
                if turn < iterations:
                    gather_down(chain, sums)
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
                move = min(max(step[d], -MAX_STEP), MAX_STEP)
                pose[d] = min(max(best[d] + move, chain.low[d]), chain.high[d])
        for d in range(D):
            pose[d] = best[d]
