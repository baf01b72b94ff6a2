"""Bundle adjustment: body sizes and the poses of several frames, fitted jointly to the surface points of these frames.

A body's joint offsets and limb shapes are linear in its sizes.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.jacobian import Chain, make_chain, place_one
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import Sizes
from shadowpuppet.geometry import Array
from shadowpuppet.jit import kernel
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.keypoints.likelihood import pulls, surprises
from shadowpuppet.tracking.keypoints.sights import Sights
from shadowpuppet.tracking.multiview.refinement.correspondence import (
    LANES,
    Cloud,
    Single,
    closest_on_part,
    closest_point,
    nearest,
    normal_weights,
    part_constants,
    place_parts,
)
from shadowpuppet.tracking.multiview.refinement.free_space import FreeSpace, Spheres, rows_inside, spheres_in
from shadowpuppet.tracking.multiview.settings import SurfaceSettings

Measured = TypeVar("Measured", bound=Sizes)
SIZE_STEP = 1e-3
"""Step (m) of the finite differences with respect to the sizes."""
POINT_NOISE, INDEPENDENT_POINTS = 0.01, 30.0
"""Standard deviation (m) of a surface point from its body; effective number of independent points per frame (neighbours correlate)."""
ROUNDS = 10
MAX_SIZE_STEP, MAX_POSE_STEP = 0.03, 0.3
"""Largest step of a size (m) and of a DOF (rad or m) in a round."""


class Deviations(NamedTuple):
    """How people's sizes deviate from those expected: independent normal distributions, common causes, and what is known of sums."""

    alone: Array
    """Standard deviations (m) of each, (K,), or (2, K) of those that are smaller and larger than expected; 0 for fixed sizes."""
    together: Array | None = None
    """Deviations (S, K), m, each row for one standard deviation of a common cause, such as the stature."""
    sums: Array | None = None
    """Rows (R, K), 1/m: a sum of the sizes, weighted by them, is within one of that of the expected sizes, as is a known height."""

    @classmethod
    def of(cls, spread: Array | Deviations) -> Deviations:
        """Deviations, or independent ones of some standard deviations."""
        return spread if isinstance(spread, Deviations) else cls(spread)

    def precision(self, side: int) -> Array:
        """Inverse covariance (K, K) of sizes that are smaller (`side` 0), or larger (1), than expected; 0 for fixed ones but in sums."""
        spread = np.broadcast_to(self.alone, (2, np.shape(self.alone)[-1]))[side]
        alone = np.zeros(len(spread))
        alone[spread > 0] = 1 / spread[spread > 0] ** 2
        found = np.diag(alone) if self.sums is None else np.diag(alone) + self.sums.T @ self.sums
        if self.together is None or not len(self.together):
            return found
        weighed = self.together * alone  # Woodbury's identity
        return found - weighed.T @ np.linalg.solve(np.eye(len(self.together)) + weighed @ self.together.T, weighed)


@dataclass(frozen=True, eq=False)
class Bundle(Generic[Measured]):
    """Sizes and poses that fit the surface points best."""

    sizes: Measured
    poses: Array
    """Poses of the frames, of shape (F, D)."""
    residual: float
    """Weighted root mean square distance of the points to the tangent planes, metres."""


def solve_bundle(make: Callable[[Measured], Body], expected: Measured, spread: Array | Deviations, poses: Array, clouds: Sequence[Cloud],
                 settings: SurfaceSettings | None = None, rounds: int = ROUNDS, pull: float | Array = 1e-6, centre: Array | None = None,
                 first: Measured | None = None, worth: float = INDEPENDENT_POINTS,
                 spaces: Sequence[FreeSpace] = (), emptiness: float = 0.0, rays: Sequence[tuple[Sights, float]] = ()) -> Bundle[Measured]:
    """Sizes and poses that fit the surface points of F frames, by damped Gauss-Newton from poses (F, D) and sizes `first` or `expected`.

    `spread`: deviations from the expected sizes, or `Deviations.alone`. `spaces`, one per frame, and `emptiness`: silhouettes that limbs
    must not reach out of, as in `Pass`. `pull`, one or (F, D): weight of the squared distance from `centre` (F, D; default: `poses`), as in
    `Refiner.gauss_newton`. `worth`: effective number of independent points per frame. `rays`, one per frame: to the person's landmarks, and
    what a nat of their surprise costs, m^2.
    """
    settings, start, about = settings or SurfaceSettings(), poses if centre is None else centre, expected.to_array()
    pull, prior = np.broadcast_to(pull, poses.shape), Deviations.of(spread)
    free, scale = np.flatnonzero(np.atleast_2d(prior.alone)[0] > 0), worth / POINT_NOISE**2
    smaller, larger = (prior.precision(side)[np.ix_(free, free)] for side in range(2))
    at, damping, best = ((about if first is None else first.to_array()), poses), 1e-2, None
    for turn in range(rounds + 1):
        body = make(type(expected).from_array(at[0]))
        lengths = _lengths(body) if spaces else None
        model, nudged = _model(body, lengths), _nudged(make, type(expected), at[0], free, lengths)
        frames = [_equations(model, nudged, pose, cloud, settings, space, emptiness)
                  for pose, cloud, space in zip(at[1], clouds, spaces or [None] * len(clouds), strict=True)]
        if rays:
            frames = [_sighted(frame, model, nudged, pose, *seen) for frame, pose, seen in zip(frames, at[1], rays, strict=True)]
        off = (at[0] - about)[free]
        tight = np.where(off[:, None] < 0, smaller, larger)
        cost = scale * (sum(frame.cost for frame in frames) + (pull * (at[1] - start) ** 2).sum()) + off @ tight @ off
        better = best is None or cost < best.cost
        damping *= 0.3 if better else 8
        if best is None or better:
            best = _Solution(at, cost, frames, tight, tight @ off, body)
        if turn < rounds:
            at = _moved(best, free, scale, start, pull, damping)
    assert best is not None
    residual = np.sqrt(np.mean([frame.squared for frame in best.frames]))
    return Bundle(type(expected).from_array(best.at[0]), best.at[1], float(residual))


class _Model(NamedTuple):
    """Arrays of a body for the kernels."""

    chain: Chain
    joints: NDArray[np.int64]
    rotations: Array
    starts: Array
    parts: Single
    spheres: Spheres | None
    """Those that must not reach out of silhouettes, if any are given."""
    reach: NDArray[np.bool_]
    """Whether a DOF moves a joint, of shape (D, J)."""
    body: Body


def _lengths(body: Body) -> Array:
    assert body.limbs is not None
    return body.limbs.lengths


def _model(body: Body, lengths: Array | None = None) -> _Model:
    """Arrays of a body, with as many spheres as for limbs of these `lengths` (S,); None: without spheres, which take most of the time."""
    skeleton, limbs = body.skeleton, body.limbs
    assert limbs is not None
    parents = skeleton.tree[0]
    above = np.eye(len(parents), dtype=bool)
    for j, parent in enumerate(parents):
        if parent >= 0:
            above[:, j] |= above[:, parent]
    chain = make_chain(skeleton)
    return _Model(chain, limbs.joints, np.ascontiguousarray(limbs.rotations), np.ascontiguousarray(limbs.starts), part_constants(limbs),
                  None if lengths is None else spheres_in(limbs, lengths), above[chain.owners],
                  body)


class _Frame(NamedTuple):
    """A frame's normal equations, divided by the total weight of its points."""

    cost: float
    """Mean of the bounded squared distances, as in eq. 30, m^2."""
    squared: float
    """Weighted mean square distance to the tangent planes, m^2."""
    rows: Array
    """Normal matrix of pose and sizes, of shape (D + K, D + K)."""
    gradient: Array
    """Right side, of shape (D + K,)."""


class _Solution(NamedTuple):
    """Sizes and poses, their cost and normal equations."""

    at: tuple[Array, Array]
    cost: float
    frames: list[_Frame]
    tight: Array
    """Inverse covariance (K, K) of the free sizes on the side where they are."""
    strain: Array
    body: Body


def _nudged(make: Callable[[Measured], Body], kind: type[Measured], at: Array, free: NDArray[np.int64],
            lengths: Array | None = None) -> list[_Model]:
    """Bodies, one per free size, in which that size is larger by `SIZE_STEP`; `lengths` as in `_model`."""
    return [_model(make(kind.from_array(at + SIZE_STEP * (np.arange(len(at)) == k))), lengths) for k in free]


def _moved(best: _Solution, free: NDArray[np.int64], scale: float, start: Array, pull: Array, damping: float) -> tuple[Array, Array]:
    """Sizes and poses after a step: the poses are eliminated (Schur complement), the sizes solved for, the poses substituted back."""
    D, K, tight = start.shape[1], len(free), best.tight / scale
    total, right, parts = tight + damping * np.diag(np.diag(tight)), -best.strain / scale, []
    for frame, pose, first, held in zip(best.frames, best.at[1], start, pull, strict=True):
        H, g = frame.rows.copy(), frame.gradient.copy()
        H[np.arange(D), np.arange(D)] += held
        g[:D] -= held * (pose - first)
        H[np.arange(D + K), np.arange(D + K)] *= 1 + damping
        H[np.arange(D), np.arange(D)] += 1e-9
        solved = np.linalg.solve(H[:D, :D], np.concatenate([H[:D, D:], g[:D, None]], 1))
        total = total + H[D:, D:] - H[D:, :D] @ solved[:, :K]
        right = right + g[D:] - H[D:, :D] @ solved[:, K]
        parts.append(solved)
    step = np.linalg.solve(total, right)
    sizes = best.at[0].copy()
    step = np.clip(step, -MAX_SIZE_STEP, MAX_SIZE_STEP)
    sizes[free] += step
    moves = np.array([solved[:, K] - solved[:, :K] @ step for solved in parts])
    return sizes, best.body.skeleton.clamp(best.at[1] + np.clip(moves, -MAX_POSE_STEP, MAX_POSE_STEP))


def _equations(model: _Model, nudged: list[_Model], pose: Array, cloud: Cloud, settings: SurfaceSettings, space: FreeSpace | None = None,
               emptiness: float = 0.0) -> _Frame:
    """A frame's normal equations in its pose and the sizes."""
    near = np.zeros((len(cloud.rows), 3 * LANES), np.float32)
    screws, out = _measured(model, pose, cloud, settings, near, True)
    distances, weights, levers = out[0], out[1] / max(cloud.total, 1e-9), out[2:8].T
    screws[:, 3:] -= np.cross(cloud.origin, screws[:, :3])
    moves = (levers @ screws.T) * model.reach[:, model.joints[near[:, LANES : 2 * LANES].ravel().astype(int)]].T
    grows = [(distances - _measured(other, pose, cloud, settings, near, False)[1][0]) / SIZE_STEP for other in nudged]
    rows = np.concatenate([moves, np.transpose(grows).reshape(len(moves), len(nudged))], 1)
    weighed = rows * weights[:, None]
    squared = float(weights @ distances**2 / max(weights.sum(), 1e-9))
    frame = _Frame(float(out[8].sum()) / max(cloud.total, 1e-9), squared, rows.T @ weighed, weighed.T @ distances)
    return frame if space is None else _within(frame, model, nudged, pose, screws, space, emptiness, cloud.origin)


def _within(frame: _Frame, model: _Model, nudged: list[_Model], pose: Array, screws: Array, space: FreeSpace, emptiness: float,
            origin: Array) -> _Frame:
    """A frame's equations with those of limbs that reach out of silhouettes. `screws` (D, 6): about the `origin` (3,)."""
    out = _reaching(model, pose, space, emptiness, origin)
    used = np.flatnonzero(out[1] > 0)
    distances, weights = out[0, used], out[1, used]
    assert model.spheres is not None
    joints = np.tile(model.spheres.joints, len(space.windows))[used]
    moves = (out[2:8, used].T @ screws.T) * model.reach[:, joints].T
    grows = [(distances - _reaching(other, pose, space, emptiness, origin)[0, used]) / SIZE_STEP for other in nudged]
    rows = np.concatenate([moves, np.transpose(grows).reshape(len(moves), len(nudged))], 1)
    weighed = rows * weights[:, None]
    return frame._replace(cost=frame.cost + float(out[8].sum()), rows=frame.rows + rows.T @ weighed,
                          gradient=frame.gradient + weighed.T @ distances)


def _sighted(frame: _Frame, model: _Model, nudged: list[_Model], pose: Array, sights: Sights, worth: float) -> _Frame:
    """A frame's equations with those of landmarks that are seen on rays: two rows a ray, across it."""
    if not sights.size:
        return frame
    marks, (places, screws) = landmarks_of(model.body), _landmarks(model, pose)
    chosen, pull = pulls(places, sights, marks)

    def away(places: Array) -> Array:
        """Distances (2 M,) from the landmarks to the rays, along both directions across."""
        return np.einsum("mij,mj->mi", sights.across, sights.origins - places[chosen]).ravel()

    distances, weights, normals = away(places), worth * pull.repeat(2), sights.across.reshape(-1, 3)
    points, reach = places[chosen].repeat(2, 0), model.reach[:, marks.joints[chosen].repeat(2)].T
    moves = (np.concatenate([np.cross(points, normals), normals], 1) @ screws.T) * reach
    grows = [(distances - away(_landmarks(other, pose)[0])) / SIZE_STEP for other in nudged]
    rows = np.concatenate([moves, np.transpose(grows).reshape(len(moves), len(nudged))], 1)
    weighed = rows * weights[:, None]
    cost = worth * float(surprises(places[None], sights, marks)[0])
    return frame._replace(cost=frame.cost + cost, rows=frame.rows + rows.T @ weighed, gradient=frame.gradient + weighed.T @ distances)


def _landmarks(model: _Model, pose: Array) -> tuple[Array, Array]:
    """Places (K, 3) of the landmarks of a pose (D,), world, and the screws (D, 6) of its DOF."""
    T, screws, marks = np.zeros((len(model.chain.parents), 3, 4)), np.zeros((len(pose), 6)), landmarks_of(model.body)
    place_one(pose, model.chain, T, screws, np.zeros((3, 3, 3)))
    own = T[marks.joints]
    return np.einsum("kij,kj->ki", own[..., :3], marks.places) + own[..., 3], screws


def _reaching(model: _Model, pose: Array, space: FreeSpace, emptiness: float, origin: Array) -> Array:
    """What `rows_inside` says of a pose (D,), (9, C K)."""
    assert model.spheres is not None
    T, number = np.zeros((len(model.chain.parents), 3, 4)), len(model.spheres.radii)
    place_one(pose, model.chain, T, np.zeros((len(pose), 6)), np.zeros((3, 3, 3)))
    out = np.zeros((9, len(space.windows) * number))
    rows_inside(T, model.spheres, space, np.empty((len(space.windows), number, 4)), emptiness, origin, out)
    return out


def _measured(model: _Model, pose: Array, cloud: Cloud, settings: SurfaceSettings, near: Single, associate: bool) -> tuple[Array, Array]:
    """Screws (D, 6), and for each point (9, P) the distance along its normal, weight, moment and normal (6), and bounded cost."""
    T, screws, out = np.zeros((len(model.chain.parents), 3, 4)), np.zeros((len(pose), 6)), np.zeros((9, len(cloud.rows) * LANES))
    place_one(pose, model.chain, T, screws, np.zeros((3, 3, 3)))
    _tangents(T, model.joints, model.rotations, model.starts, model.parts, cloud.rows, cloud.spheres, cloud.origin,
              *normal_weights(settings), np.float32(settings.tau), associate, near, np.zeros(8 * LANES, np.float32), out)
    return screws, out


@kernel
def _tangents(T, joints, rotations, starts, parts, rows, spheres, origin, epsilon, choice, tau, associate, near, room,
              out):  # pragma: no cover
    """See `_measured`. With `associate` the nearest parts are found, else those in `near` (G, 3 LANES) are kept."""
    one, nil = np.float32(1), np.float32(0)
    place_parts(T, origin, joints, rotations, starts, parts)
    for group in range(spheres.shape[0]):
        points, own = rows[group], near[group]
        if associate:
            nearest(parts, points, spheres[group], epsilon, choice, own)
        for s in range(joints.size):
            used = False
            for i in range(LANES):
                used |= own[LANES + i] == s
            if not used:
                continue
            q = parts[s]
            closest_on_part(q, points, room)
            for i in range(LANES):
                if own[LANES + i] != s:
                    continue
                at = group * LANES + i
                x, y, z = closest_point(q, room, i)
                nx, ny, nz = points[3 * LANES + i], points[4 * LANES + i], points[5 * LANES + i]
                share = own[i] / tau
                fade = one / (one + share * share)
                out[0, at] = (points[i] - x) * nx + (points[LANES + i] - y) * ny + (points[2 * LANES + i] - z) * nz
                out[1, at] = points[6 * LANES + i] * fade * fade * max(room[LANES + i], nil)
                out[2, at], out[3, at], out[4, at] = y * nz - z * ny, z * nx - x * nz, x * ny - y * nx
                out[5, at], out[6, at], out[7, at] = nx, ny, nz
                out[8, at] = points[6 * LANES + i] * min(own[i], tau) ** 2
