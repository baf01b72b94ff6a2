"""Cost D of poses for surface points (eq. 30), and refinement of poses by simulated forces (Ni 2008, V-B) or Gauss-Newton.

All methods take many poses and treat each independently.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.jacobian import make_chain, place_one
from shadowpuppet.body.shapes import Body
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.threads import in_parts, shared_out
from shadowpuppet.tracking.keypoints.definitions import NO_LANDMARKS, Landmarks, landmarks_of
from shadowpuppet.tracking.keypoints.likelihood import surprises
from shadowpuppet.tracking.keypoints.sights import NO_SIGHTS, Sights
from shadowpuppet.tracking.multiview.refinement.correspondence import LANES, Cloud, normal_weights, part_constants
from shadowpuppet.tracking.multiview.refinement.forces import LINEAR, QUADRATIC, UNBOUNDED, push
from shadowpuppet.tracking.multiview.refinement.free_space import FreeSpace, free_space, spheres_in
from shadowpuppet.tracking.multiview.refinement.gauss_newton import descend
from shadowpuppet.tracking.multiview.refinement.part_sums import SUMS, sum_costs
from shadowpuppet.tracking.multiview.settings import ForceSettings, SurfaceSettings
from shadowpuppet.tracking.resampling import Indices

Refine = Callable[[Array], tuple[Indices | slice, Array]]
"""Function from poses (N, D) to the indices of the M that are refined to the end, and these refined (M, D)."""
RHO = {"none": UNBOUNDED, "linear": LINEAR, "quadratic": QUADRATIC}
"""The kernel's numbers of `ForceSettings.rho`."""


class Pass(NamedTuple):
    """Some iterations of Gauss-Newton on the same points."""

    cloud: Cloud
    iterations: int
    tau: float
    """Distance (m) at which a point's weight is a quarter."""
    space: FreeSpace | None = None
    """Distances to the silhouettes; None: the silhouettes do not count."""
    emptiness: float = 0.0
    """Weight of the mean squared distance by which limbs reach out of the silhouettes; added to that of the points."""
    sights: Sights = NO_SIGHTS
    """Rays to the body's landmarks (`Refiner.landmarks`)."""
    worth: float = 0.0
    """What a nat of their surprise costs, m^2; added to the mean squared distance of the points."""


class Refiner:
    """A body's arrays for the kernels. Its methods take poses (N, D) and a `Cloud` of surface points.

    Raises `ShadowPuppetError` for a body without limbs or with coupled joints.
    """

    def __init__(self, body: Body, settings: SurfaceSettings | None = None) -> None:
        """Collect the arrays."""
        if body.limbs is None or body.skeleton.couplings:
            raise ShadowPuppetError(f"body {body.name!r}: found no limbs on a tree of joints, which surface points need")
        self.body, self.settings = body, settings or SurfaceSettings()
        self._chain = make_chain(body.skeleton)
        limbs = body.limbs
        self.spheres, self._no_space = spheres_in(limbs), free_space(())
        self._limbs = limbs.joints, np.ascontiguousarray(limbs.rotations), np.ascontiguousarray(limbs.starts)
        self._parts = part_constants(limbs)

    @cached_property
    def landmarks(self) -> Landmarks:
        """The body's landmarks that keypoints show."""
        return landmarks_of(self.body)

    def costs(self, poses: Array, cloud: Cloud, tau: float | None = None) -> Array:
        """D of eq. 30 for poses (N, D): the mean over the points of min(d^2, tau^2), m^2, of shape (N,). `tau` replaces the settings'."""
        poses, out = self.body.skeleton.checked(poses), np.empty(len(poses))

        def work(part: slice) -> None:
            _costs(poses[part], self._chain, self._limbs, cloud.rows, cloud.spheres, cloud.origin, self._numbers(tau), self._which(cloud),
                   self._room(), out[part])

        shared_out(work, in_parts(len(poses)))
        return out / max(cloud.total, 1e-9)

    def gauss_newton(self, poses: Array, passes: Sequence[Pass | tuple[Cloud, int, float]], centre: Array, pull: Array,
                     damping: float = 0.03) -> Array:
        """Poses (N, D) refined by damped Gauss-Newton, robust and within limits.

        Args:
            passes: applied one after another; usually a share of the points first, then all.
            centre: poses toward which the poses are pulled, of shape (N or 1, D).
            pull: weights (D,) of the squared distances from `centre`, added to the mean squared distance of the points (m^2).
            damping: initial damping of each DOF, as a share of its curvature.
        """
        poses = self.body.skeleton.checked(poses).copy()
        for each in passes:
            poses = self.descend(poses, each if isinstance(each, Pass) else Pass(*each), centre, pull, damping)[0]
        return poses

    def descend(self, poses: Array, each: Pass, centre: Array, pull: Array, damping: float = 0.03) -> tuple[Array, Array]:
        """Poses (N, D) refined by one pass of `gauss_newton`, whose arguments these are, and what they cost then (N,), m^2."""
        poses = self.body.skeleton.checked(poses).copy()
        centre, pull = np.broadcast_to(np.asarray(centre, float), poses.shape), np.asarray(pull, float)
        cloud, iterations, tau, space, emptiness, sights, worth = each
        space, costs = space or self._no_space, np.empty(len(poses))
        marks = self.landmarks if sights.size else NO_LANDMARKS

        def work(part: slice) -> None:
            keypoints = marks.arrays, sights, worth, np.zeros((len(marks.names), 3)), np.zeros((sights.size, 2, 2))
            distances = np.empty((len(space.windows), len(self.spheres.radii), 4))
            descend(poses[part], np.ascontiguousarray(centre[part]), pull, self._chain, self._limbs, cloud.rows, cloud.spheres,
                    cloud.origin, max(cloud.total, 1e-9), self._numbers(tau), damping, iterations, self._which(cloud), self._room(),
                    self._system(), self.spheres, space, distances, emptiness, keypoints, costs[part])

        shared_out(work, in_parts(len(poses)))
        return poses, costs

    def surprises(self, poses: Array, sights: Sights) -> Array:
        """Surprise (N,), nats, of keypoints given poses (N, D)."""
        marks = self.landmarks
        return surprises(self.body.skeleton.points(poses, marks.joints, marks.places), sights, marks)

    def forces(self, poses: Array, cloud: Cloud, settings: ForceSettings) -> Array:
        """Poses (N, D) moved by simulated force and moment (eqs. 32-41), within limits, until these balance: first with the coarse, then
        with the fine bound of the forces."""
        poses, s = self.body.skeleton.checked(poses).copy(), settings
        half = s.iterations // 2

        def work(part: slice) -> None:
            for tau, iterations in ((s.coarse_tau, half), (s.fine_tau, s.iterations - half)):
                push(poses[part], RHO[s.rho], s.modulated, s.hierarchical, (s.translation, s.rotation), s.balance, iterations, self._chain,
                     self._limbs, cloud.rows, cloud.spheres, cloud.origin, self._numbers(tau), self._which(cloud), self._room(),
                     self._system()[2])

        shared_out(work, in_parts(len(poses)))
        return poses

    def _numbers(self, tau: float | None = None) -> tuple[np.float32, ...]:
        return *normal_weights(self.settings), np.float32(self.settings.tau if tau is None else tau)

    def _room(self) -> tuple[NDArray[Any], ...]:
        """Work arrays of the kernels; new ones for each call, so that threads do not share them."""
        J, D, S = len(self.body.skeleton.joints), len(self.body.skeleton.dofs), len(self._parts)
        return (self._parts.copy(), np.zeros((J, 3, 4)), np.zeros((D, 6)), np.zeros((3, 3, 3)), np.zeros(8 * LANES, np.float32),
                np.zeros((S, SUMS * LANES), np.float32), np.zeros((J, SUMS)))

    def _system(self) -> tuple[Array, Array, Array]:
        D = len(self.body.skeleton.dofs)
        return np.zeros((D, D)), np.zeros((D, D)), np.zeros((3, max(D, 4)))

    @staticmethod
    def _which(cloud: Cloud) -> NDArray[np.float32]:
        return np.zeros((len(cloud.rows), 3 * LANES), np.float32)


@kernel
def _costs(poses, chain, limbs, rows, spheres, origin, numbers, which, room, out):  # pragma: no cover
    for n in range(poses.shape[0]):
        place_one(poses[n], chain, room[1], room[2], room[3])
        out[n] = sum_costs(room[1], limbs, rows, spheres, origin, numbers, which, room)
