"""Inverse kinematics: poses of a body, and the person's sizes, from joints over time, all frames at once.

Damped Gauss-Newton. Frames are coupled by their common sizes and by a weak pull of each angle to its neighbours in time. So the equations
are block tridiagonal with a margin, and the time to solve them grows linearly with the number of frames. Angles that the joints do not
determine (a straight limb's twist, the direction of the feet) follow the neighbouring frames and the usual posture: they are smooth, and a
motion prior can be learnt from them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.anthropometry import stature_of
from shadowpuppet.body.models import WHOLE, make_body, shares_of, sizes_kind, whole_sizes_from_bones
from shadowpuppet.body.shapes import Body
from shadowpuppet.body.sizes import MIN_SIZE, BoneSizes
from shadowpuppet.body.skeleton import SIDES
from shadowpuppet.errors import ShadowPuppetError, choices
from shadowpuppet.geometry import Array
from shadowpuppet.motion.ik_initial_guess import initial_poses
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.motion.plausibility import check_person, positions_of

OUTLIER = 0.1
"""Distance (m) of a joint from the body beyond which its pull falls, because it was measured wrongly."""
SMOOTH_PULL, TRUNK_SMOOTH_PULL, REST_PULL, TWIST_PULL, CHEST_PULL, HEAD_TURN_PULL = 3e-4, 1e-2, 1e-6, 1e-5, 1e-4, 1e-2
"""Weights of pulls (m^2 / rad^2, added to squared distances of joints, m^2). To the next frame's angle: of any DOF; of the trunk's, which
is too heavy to turn suddenly. To the angle at rest: of any DOF; of a limb's twist; of the chest; of the head's turn."""
PROPORTION_TOLERANCE = 0.0015
"""Distance (m) that joints may stray before average proportions are doubted."""
HAND_WEIGHT = 0.02
"""Weight of the base of the fingers relative to other joints."""
SMOOTHING_RATE = 60.0
"""Frame rate (frames/s) for which the smoothing pulls hold; they are scaled so that quick motion is smoothed equally at any rate."""
DIFFERENCE_STEP, CHUNK_FRAMES = 1e-6, 500
"""Step of finite differences, and number of frames that are differentiated at once."""


@dataclass(frozen=True, eq=False)
class FittedPoses:
    """Poses of a body fitted to measured joints, the sizes that go with them, and the residuals."""

    body_name: str
    sizes: BoneSizes
    """The person's: bones as measured, the rest average for the stature."""
    times: Array
    """Seconds, of shape (T,)."""
    poses: Array
    """In the world, of shape (T, D), rad or m; not a number in frames without any joint."""
    joints: JointTable
    """The body's positions of the J fitted joints."""
    distances: Array
    """From the body's joints to the measured ones, of shape (T, J), metres; not a number where unknown."""

    @property
    def body(self) -> Body:
        """The body."""
        return make_body(self.body_name, self.sizes)

    @property
    def residual(self) -> float:
        """Root mean square distance without the hands, metres: bodies have a rigid wrist, people do not."""
        return _rms(self._counted.ravel())

    @property
    def by_joint(self) -> dict[str, float]:
        """The same for each joint, hands included."""
        return {name: _rms(column) for name, column in zip(self.joints.names, self.distances.T)}

    @property
    def by_frame(self) -> Array:
        """The same for each frame, of shape (T,)."""
        return np.array([_rms(row) for row in self._counted])

    @property
    def _counted(self) -> Array:
        return self.distances[:, [not name.endswith("_hand") for name in self.joints.names]]


def fit_poses(joints: JointTable, body: str = "anatomical", sizes: BoneSizes | None = None, source: str = "joints",
              any_bend: bool = False) -> FittedPoses:
    """Poses of a whole body, and the person's sizes if none are given, from joints over time.

    Args:
        joints: in the world, metres, Z up; any of the 17 joints of a body, among them shoulders, elbows, knees, and the pelvis or both
            hips. Frames may lack joints.
        source: the name of the joints in messages.
        any_bend: whether joints may bend as no person's do, so that the nearest possible pose is wanted.

    Raises `ShadowPuppetError` if joints are missing, not in metres, upside down or mirrored, or the body is not a whole one.
    """
    if body not in WHOLE:
        raise ShadowPuppetError(f"body {body!r}: found a body without legs or none, expected one of {choices(WHOLE)}")
    if not any_bend:
        check_person(joints, source)
    person = sizes or whole_sizes_from_bones(sizes_kind(body), _bone_lengths(joints))  # pyright: ignore[reportArgumentType]
    start = make_body(body, person)
    table = joints.select([name for name in start.landmark_names if name in joints.names])
    problem = _Problem(body, table, person, _observable_sizes(start, person, table.names) if sizes is None else ())
    return problem.result(*problem.solve(initial_poses(start, table), person.to_array()))


class _Equations(NamedTuple):
    """Normal equations of a step: blocks of the poses (T, D, D), margin (T, D, S), corner (S, S), right-hand sides (T, D), (S,)."""

    A: Array
    B: Array
    C: Array
    g: Array
    h: Array


class _Problem:
    """The least-squares problem: the joints, and the cost of poses and sizes."""

    def __init__(self, body: str, table: JointTable, sizes: BoneSizes, free: tuple[str, ...]) -> None:
        self.name, self.table, self.kind = body, table, type(sizes)
        self.free = np.array([self.kind.names().index(name) for name in free], np.int64)
        self.known: NDArray[np.bool_] = np.asarray(np.isfinite(table.positions).all(2))
        self.wanted = np.where(self.known[..., None], table.positions, 0.0)
        self.weight = np.array([HAND_WEIGHT if name.endswith("_hand") else 1.0 for name in table.names])
        dofs = make_body(body, sizes).skeleton.dofs
        self.rest = np.array([dof.rest for dof in dofs])
        self.pull = np.array([_pull(dof.name, dof.kind) for dof in dofs])
        steps, slow = np.diff(table.times), [dof.name.startswith(("chest", "root_bow", "root_tilt")) for dof in dofs]
        self.smooth = np.outer(1 / (SMOOTHING_RATE * steps) ** 2, np.where(slow, TRUNK_SMOOTH_PULL, SMOOTH_PULL))
        self.mean, deviation = sizes.to_array()[self.free], np.array([shares_of(self.kind)[name][1] for name in free])
        stature = stature_of(dict(zip(sizes.names(), sizes.to_array())))
        self.hold = len(table.times) * (PROPORTION_TOLERANCE / (deviation * stature)) ** 2 if len(free) else np.zeros(0)

    def body(self, values: Array) -> Body:
        """The body of the given sizes, an array in the order of `names`."""
        return make_body(self.name, self.kind.from_array(values))

    def cost(self, poses: Array, values: Array) -> float:
        """Cost of poses (T, D) and sizes, m^2."""
        squared = ((self._places(self.body(values), poses) - self.wanted) ** 2).sum(2)
        joints = (self.weight * squared / (1 + squared / OUTLIER**2))[self.known].sum()
        smooth = (self.smooth * np.diff(poses, axis=0) ** 2).sum()
        sizes = (self.hold * (values[self.free] - self.mean) ** 2).sum()
        return float(joints + smooth + sizes + (self.pull * (poses - self.rest) ** 2).sum())

    def solve(self, poses: Array, values: Array, rounds: int = 40) -> tuple[Array, Array]:
        """Poses (T, D) and sizes of least cost near the initial ones."""
        low, high = self.body(values).skeleton.limits
        least = np.where(np.isin(self.kind.names(), self.kind.offsets()), -0.2, MIN_SIZE)
        damping, best = 1e-4, self.cost(poses, values)
        equations = self._equations(poses, values)
        for _ in range(rounds):
            step, change = _solve_step(equations, self.smooth, damping, _at_limits(poses, equations.g, low, high))
            new_poses, new_values = np.clip(poses + step, low, high), values.copy()
            new_values[self.free] += change
            new_values = np.clip(new_values, least, 1.9)
            cost = self.cost(new_poses, new_values)
            if cost > best:
                damping *= 10
                if damping > 1e3:
                    break
                continue
            gain, poses, values, best, damping = best - cost, new_poses, new_values, cost, max(damping / 5, 1e-9)
            if gain < 5e-5 * best + 1e-12:
                break
            equations = self._equations(poses, values)
        return poses, values

    def result(self, poses: Array, values: Array) -> FittedPoses:
        """The solution, with unknown frames blanked."""
        body, measured = self.body(values), np.asarray(self.known.any(1))
        places = np.where(measured[:, None, None], self._places(body, poses), np.nan)
        distances = np.where(self.known, np.linalg.norm(places - self.table.positions, axis=2), np.nan)
        return FittedPoses(self.name, self.kind.from_array(values), self.table.times, np.where(measured[:, None], poses, np.nan),
                           JointTable(self.table.times, self.table.names, places), distances)  # fmt: skip

    def _places(self, body: Body, poses: Array) -> Array:
        return body.points(poses, names=self.table.names)

    def _equations(self, poses: Array, values: Array) -> _Equations:
        """The normal equations at poses and sizes: J' W J and J' W r of the joints, and the pulls."""
        T, D, S = *poses.shape, len(self.free)
        A, B, C = np.zeros((T, D, D)), np.zeros((T, D, S)), np.diag(self.hold)
        g, h = np.zeros((T, D)), self.hold * (self.mean - values[self.free])
        body, others = self.body(values), [self.body(values + DIFFERENCE_STEP * (np.arange(len(values)) == k)) for k in self.free]
        for begin in range(0, T, CHUNK_FRAMES):
            rows = slice(begin, begin + CHUNK_FRAMES)
            at = self._places(body, poses[rows])
            J = self._slopes(body, poses[rows], at)
            by_size = [(self._places(other, poses[rows]) - at) / DIFFERENCE_STEP for other in others]
            K = np.stack(by_size, -1) if S else np.zeros((*at.shape, 0))
            r = (self.wanted[rows] - at) * self.known[rows, :, None]
            w = self.weight * self.known[rows] / (1 + (r**2).sum(2) / OUTLIER**2) ** 2
            J, K, r = (each.reshape(len(at), 3 * at.shape[1], each.shape[-1]) for each in (J, K, r[..., None]))
            weighted = np.swapaxes(J * np.repeat(w, 3, axis=1)[..., None], 1, 2)
            A[rows], B[rows], g[rows] = weighted @ J, weighted @ K, (weighted @ r)[..., 0]
            flat = np.swapaxes(K * np.repeat(w, 3, axis=1)[..., None], 1, 2)
            C, h = C + (flat @ K).sum(0), h + (flat @ r).sum(0)[:, 0]
        A[:, np.arange(D), np.arange(D)] += self.pull
        g += self.pull * (self.rest - poses)
        moved = self.smooth * np.diff(poses, axis=0)
        g[:-1] += moved
        g[1:] -= moved
        return _Equations(A, B, C, g, h)

    def _slopes(self, body: Body, poses: Array, at: Array) -> Array:
        """Derivatives (T, J, 3, D) of the joints' positions `at` (T, J, 3)."""
        T, D = poses.shape
        moved = (poses[:, None] + DIFFERENCE_STEP * np.eye(D)).reshape(T * D, D)
        return np.moveaxis(self._places(body, moved).reshape(T, D, -1, 3) - at[:, None], 1, -1) / DIFFERENCE_STEP


def _pull(name: str, kind: str) -> float:
    """Weight of a DOF's pull to its value at rest."""
    if kind == "translation" or name == "root_heading":
        return 0.0
    if name.startswith("head") and name.endswith(("_z", "_twist")):
        return HEAD_TURN_PULL
    if name.startswith("chest"):
        return CHEST_PULL
    return TWIST_PULL if name.endswith(("shoulder_z", "hip_z", "_twist")) else REST_PULL


def _at_limits(poses: Array, downhill: Array, low: Array, high: Array) -> NDArray[np.bool_]:
    """DOF (T, D) that are at a limit and would move beyond it."""
    return ((poses <= low) & (downhill < 0)) | ((poses >= high) & (downhill > 0))


def _solve_step(equations: _Equations, smooth: Array, damping: float, held: NDArray[np.bool_]) -> tuple[Array, Array]:
    """The step of poses (T, D) and sizes (S,): poses are eliminated along the chain, then sizes solved for (Schur complement)."""
    (T, D), S, free = equations.g.shape, len(equations.h), ~held
    A = equations.A * free[:, :, None] * free[:, None, :]
    chain = np.zeros((T, D))
    chain[:-1] += smooth
    chain[1:] += smooth
    A[:, np.arange(D), np.arange(D)] += np.where(held, 1.0, damping + chain)
    right = np.concatenate([equations.g[..., None], equations.B], 2) * free[..., None]
    solved = _solve_chain(A, smooth * (free[1:] & free[:-1]), right)
    margin = (equations.B * free[..., None]).reshape(T * D, S)
    steps = solved.reshape(T * D, 1 + S)
    corner = equations.C + damping * np.eye(S) - margin.T @ steps[:, 1:]
    change = np.asarray(np.linalg.solve(corner, equations.h - margin.T @ steps[:, 0]), float)
    return solved[..., 0] - solved[..., 1:] @ change, change


def _solve_chain(A: Array, links: Array, right: Array) -> Array:
    """Solutions (T, D, R) of a block tridiagonal system A (T, D, D), neighbours linked by -diag(links), links (T - 1, D): Thomas'
    algorithm."""
    T, D, _ = right.shape
    pivot, rest, carried, out = A[0], right[0], [], np.empty_like(right)
    for t in range(T):
        link = np.diag(links[t]) if t < T - 1 else np.zeros((D, 0))
        both = np.linalg.solve(pivot, np.concatenate([link, rest], 1))
        out[t] = both[:, link.shape[1] :]
        if t < T - 1:
            carried.append(both[:, :D])
            pivot, rest = A[t + 1] - links[t][:, None] * both[:, :D], right[t + 1] + links[t][:, None] * out[t]
    for t in range(T - 2, -1, -1):
        out[t] += carried[t] @ out[t + 1]
    return out


def _observable_sizes(body: Body, sizes: BoneSizes, names: tuple[str, ...]) -> tuple[str, ...]:
    """Names of the sizes on which the positions of these joints depend."""
    pose, values = np.zeros((1, len(body.skeleton.dofs))), sizes.to_array()
    moved = [make_body(body.name, type(sizes).from_array(values + 0.01 * row)).points(pose, names=names) for row in np.eye(len(values))]
    at = body.points(pose, names=names)
    return tuple(name for name, place in zip(sizes.names(), moved) if np.abs(place - at).max() > 1e-6)


def _bone_lengths(table: JointTable) -> dict[str, float]:
    """Median lengths (m) of bones between two measured joints."""
    pairs = {"hip_distance": [("left_hip", "right_hip")], "shoulder_distance": [("left_shoulder", "right_shoulder")]}
    for bone, ends in {"upper_arm_length": ("shoulder", "elbow"), "forearm_length": ("elbow", "wrist"), "hand_point": ("wrist", "hand"),
                       "thigh_length": ("hip", "knee"), "shank_length": ("knee", "ankle")}.items():  # fmt: skip
        pairs[bone] = [(f"{side}_{ends[0]}", f"{side}_{ends[1]}") for side in SIDES]
    lengths = {bone: np.concatenate([np.linalg.norm(positions_of(table, a) - positions_of(table, b), axis=1) for a, b in ends])
               for bone, ends in pairs.items()}
    return {bone: float(np.nanmedian(each)) for bone, each in lengths.items() if np.isfinite(each).any()}


def _rms(values: Array) -> float:
    """Root mean square of the known values; not a number if there are none."""
    known = values[np.isfinite(values)]
    return float(np.sqrt((known**2).mean())) if len(known) else float("nan")
