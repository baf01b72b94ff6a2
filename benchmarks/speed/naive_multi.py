"""A naive version of Ni 2008's refinement (V-B) in NumPy: all points at once, part by part, one degree of freedom after another.

The distance of a point to a part is of first order, as in the kernels: the level of the part's own function over the length of its
gradient. It is used in the paper's eqs. 29-41 and in the normal equations of the distances to tangent planes.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.body.shapes import Body, Limbs
from shadowpuppet.body.skeleton import AXES, Skeleton
from shadowpuppet.geometry import Array, rotation_about, rotation_from_vector
from shadowpuppet.tracking.multiview.settings import ForceSettings, SurfaceSettings

FLAT = 1e-4
"""A dome lower than this (m) is a flat end."""


class Surface(NamedTuple):
    """The points on one part, or on each point's own part, that are closest to some points."""

    distance: Array
    """Signed, negative inside, of shape (P,), metres."""
    feet: Array
    """Closest points, of shape (P, 3), metres."""
    normals: Array
    """Outward unit normals there, of shape (P, 3)."""


class Motions(NamedTuple):
    """Motion of the joints by each degree of freedom of a pose."""

    axes: Array
    """Axis of the rotation, or direction of the shift, world (D, 3); its length is the radians or metres for a unit of the DOF."""
    centres: Array
    """A point on the axis of rotation (D, 3), metres."""
    shifts: NDArray[np.bool_]
    """Whether it is a shift (D,)."""
    moved: NDArray[np.bool_]
    """Whether a joint moves with it (D, J)."""


# Kinematics


def place(skeleton: Skeleton, pose: Array) -> tuple[Array, Motions]:
    """Transforms (J, 4, 4) of a pose's (D,) joints, joint to world, and how its DOF move them."""
    T = np.zeros((len(skeleton.joints), 4, 4))
    axes, centres = np.zeros((2, len(skeleton.dofs), 3))
    for j, joint in enumerate(skeleton.joints):
        own = np.eye(4) if joint.parent is None else T[skeleton.joint_index(joint.parent)].copy()
        own[:3, 3] += own[:3, :3] @ joint.offset
        mine = [d for d, dof in enumerate(skeleton.dofs) if dof.joint == joint.name]
        while mine:
            d, dof = mine[0], skeleton.dofs[mine[0]]
            if dof.kind == "vector":
                axes[mine[:3]] = (own[:3, :3] @ left_jacobian(pose[mine[:3]])).T
                centres[mine[:3]] = own[:3, 3]
                own[:3, :3] = own[:3, :3] @ rotation_from_vector(pose[mine[:3]])
                mine = mine[3:]
                continue
            axis, sign = AXES[dof.axis]
            axes[d], centres[d] = sign * own[:3, axis], own[:3, 3]
            if dof.kind == "translation":
                own[:3, 3] += axes[d] * pose[d]
            else:
                own[:3, :3] = own[:3, :3] @ rotation_about(sign * np.eye(3)[axis], pose[d])
            mine = mine[1:]
        T[j] = own
    return T, Motions(axes, centres, np.array([dof.kind == "translation" for dof in skeleton.dofs]), _moved(skeleton))


def left_jacobian(v: Array) -> Array:
    """J (3, 3) of a rotation vector (3,): exp(v + d) = exp(J d) exp(v) for small d."""
    angle, K = np.linalg.norm(v), np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    if angle < 1e-5:
        return np.eye(3) + K / 2
    return np.eye(3) + (1 - np.cos(angle)) / angle**2 * K + (angle - np.sin(angle)) / angle**3 * K @ K


def _moved(skeleton: Skeleton) -> NDArray[np.bool_]:
    """Joints (D, J) that move with each DOF: its own and all below it."""
    below = np.zeros((len(skeleton.joints),) * 2, bool)
    for j, joint in enumerate(skeleton.joints):
        below[j, j] = True
        if joint.parent is not None:
            below[j] |= below[skeleton.joint_index(joint.parent)]
    return np.array([below[:, skeleton.joint_index(dof.joint)] for dof in skeleton.dofs])


# Points on the body


def closest(limbs: Limbs, s: int, T: Array, points: Array) -> Surface:
    """The points on part `s` closest to points (P, 3), world; T (4, 4): the transform of the part's joint."""
    R = T[:3, :3] @ limbs.rotations[s]
    origin = T[:3, :3] @ limbs.starts[s] + T[:3, 3]
    distance, feet, normals = _closest((points - origin) @ R, limbs.lengths[s], limbs.shears[s], limbs.radii[s], limbs.caps[s])
    return Surface(distance, feet @ R.T + origin, normals @ R.T)


def _closest(p: Array, length: float, shear: Array, radii: Array, caps: Array) -> Surface:
    """The same in the part's own frame."""
    z = np.clip(p[:, 2], 0, length)
    over = p[:, 2] - z
    share = (z / length)[:, None]
    middle, radius = share * shear, (1 - share) * radii[0] + share * radii[1]
    level = (p[:, :2] - middle) / radius
    cap = np.where(over < 0, caps[0], caps[1])
    height = np.where((over != 0) & (cap > FLAT), over / np.maximum(cap, FLAT), 0.0)
    rho = np.sqrt((level**2).sum(1) + height**2 + 1e-12)
    # the gradient of rho^2 / 2: along the limb the mantle's circles shift and shrink, those of a dome lie on its ellipsoid
    growth = -(level * (shear / length + level * (radii[1] - radii[0]) / length) / radius).sum(1)
    slope = np.column_stack([level / radius, np.where(over == 0, growth, height / np.maximum(cap, FLAT))])
    steep = np.sqrt((slope**2).sum(1) + 1e-12)
    normals = slope / steep[:, None]
    distance = rho * (rho - 1) / steep
    found = Surface(distance, p - distance[:, None] * normals, normals)
    for end, sign, depth in ((0, -1.0, p[:, 2]), (1, 1.0, length - p[:, 2])):
        if caps[end] <= FLAT:
            found = _to_disc(found, p, sign, depth, middle, level, end * length)
    return found


def _to_disc(found: Surface, p: Array, sign: float, depth: Array, middle: Array, level: Array, z: float) -> Surface:
    """`found`, with points on a flat end instead if these are nearer: beyond the end, or inside and close below it."""
    rho = np.linalg.norm(level, axis=1)
    beyond, below = depth < 0, (depth >= 0) & (rho < 1) & (depth < -found.distance)
    feet = np.column_stack([middle + (p[:, :2] - middle) / np.maximum(rho, 1)[:, None], np.full(len(p), z)])
    off = p - feet
    away = np.linalg.norm(off, axis=1)
    normals = np.tile([0.0, 0.0, sign], (len(p), 1))
    edge = beyond & (rho > 1)
    normals[edge] = off[edge] / away[edge, None]
    taken = beyond | below
    return Surface(np.where(taken, np.where(beyond, away, -depth), found.distance),
                   np.where(taken[:, None], feet, found.feet), np.where(taken[:, None], normals, found.normals))


def nearest(limbs: Limbs, T: Array, points: Array, normals: Array, epsilon: float, choice: str = "modulated",
            ) -> tuple[NDArray[np.int64], Array, Surface]:  # fmt: skip
    """The part (P,) nearest to each point, its distance d (1 - eps cos) (P,) (eq. 31), and the closest point; chosen by that distance, or
    by d (`euclidean`)."""
    parts = [closest(limbs, s, T[joint], points) for s, joint in enumerate(limbs.joints)]
    apart = np.array([np.abs(part.distance) * (1 - epsilon * (part.normals * normals).sum(1)) for part in parts])
    chosen = apart if choice == "modulated" else np.array([np.abs(part.distance) for part in parts])
    which, every = chosen.argmin(0), np.arange(len(points))
    return which, apart[which, every], Surface(*(np.stack(values)[which, every] for values in zip(*parts)))


def cost(body: Body, pose: Array, points: Array, normals: Array, weights: Array, surface: SurfaceSettings) -> float:
    """D of eqs. 30 and 31 for a pose (D,): the mean over the points of min(d^2, tau^2), m^2."""
    _, apart, _ = nearest(_limbs(body), place(body.skeleton, pose)[0], points, normals, surface.epsilon, surface.nearest)
    return float((weights * np.minimum(apart, surface.tau) ** 2).sum() / weights.sum())


def _limbs(body: Body) -> Limbs:
    assert body.limbs is not None
    return body.limbs


# Refinement


def move_by_forces(
    body: Body, pose: Array, points: Array, normals: Array, weights: Array, surface: SurfaceSettings, settings: ForceSettings
) -> Array:
    """The pose (D,) after one iteration of simulated force and moment (eqs. 32-41), with the fine bound.

    Forces are divided by the number of points, moments by the points' inertia about the axis, so that the step does not depend on their
    number. The paper leaves this to its weights lambda and rho.
    """
    limbs, (T, motions) = _limbs(body), place(body.skeleton, pose)
    which, _, found = nearest(limbs, T, points, normals, surface.epsilon, surface.nearest)
    pull = points - found.feet
    apart = np.linalg.norm(pull, axis=1) + 1e-9
    size = apart * (np.maximum((found.normals * normals).sum(1), 0) if settings.modulated else 1)  # m_F
    size = size**2 / settings.fine_tau if settings.rho == "quadratic" else size
    size = size if settings.rho == "none" else np.minimum(size, settings.fine_tau)
    forces = (weights * size / apart)[:, None] * pull  # eq. 32
    owner, step = np.asarray(limbs.joints)[which], np.zeros(len(pose))
    for d, dof in enumerate(body.skeleton.dofs):
        felt = motions.moved[d, owner]  # eqs. 38-40: the joint and all below it
        if motions.shifts[d]:
            step[d] = settings.translation * (forces[felt] @ motions.axes[d]).sum() / (weights[felt].sum() + 1e-9)  # eq. 34
            continue
        if not settings.hierarchical:
            felt = owner == body.skeleton.joint_index(dof.joint)
        lever = found.feet[felt] - motions.centres[d]
        moment = np.cross(lever, forces[felt]).sum(0)  # eq. 33
        inertia = (weights[felt] * (np.cross(motions.axes[d], lever) ** 2).sum(1)).sum()
        step[d] = settings.rotation * (moment @ motions.axes[d]) / (inertia + 1e-4 * weights[felt].sum() + 1e-13)  # eq. 35
    return body.skeleton.clamp((pose + np.clip(step, -0.5, 0.5))[None])[0]  # eq. 41


def normal_equations(
    body: Body, pose: Array, points: Array, normals: Array, weights: Array, surface: SurfaceSettings
) -> tuple[Array, Array]:
    """H (D, D) and g (D,) of the distances to the body along the points' normals: H step = g moves a pose (D,) toward the points.

    A point's weight falls with its distance (Geman & McClure 1987), to zero if the normals are opposed; both are means over the points.
    """
    limbs, (T, motions) = _limbs(body), place(body.skeleton, pose)
    which, apart, found = nearest(limbs, T, points, normals, surface.epsilon, surface.nearest)
    residual = ((points - found.feet) * normals).sum(1)
    fade = 1 / (1 + (apart / surface.tau) ** 2)
    share = weights * fade**2 * np.maximum((found.normals * normals).sum(1), 0) / weights.sum()
    owner, rows = np.asarray(limbs.joints)[which], np.zeros((len(points), len(pose)))
    for d in range(len(pose)):
        moves = motions.axes[d] if motions.shifts[d] else np.cross(motions.axes[d], found.feet - motions.centres[d])
        rows[:, d] = np.where(motions.moved[d, owner], (moves * normals).sum(1), 0.0)
    return rows.T @ (share[:, None] * rows), rows.T @ (share * residual)


def move_by_gauss_newton(
    body: Body, pose: Array, points: Array, normals: Array, weights: Array, surface: SurfaceSettings, pull: float = 1e-6,
    damping: float = 0.03,
) -> Array:
    """The pose (D,) after one damped Gauss-Newton step, pulled by `pull` to its value; a DOF at its limit that would go beyond is left
    out of the system."""
    H, g = normal_equations(body, pose, points, normals, weights, surface)
    low, high = body.skeleton.limits
    free = ~(((pose <= low) & (g < 0)) | ((pose >= high) & (g > 0)))
    A, step = H + np.diag(damping * np.diag(H) + pull), np.zeros(len(pose))
    step[free] = np.linalg.solve(A[np.ix_(free, free)], g[free])
    return body.skeleton.clamp((pose + np.clip(step, -0.5, 0.5))[None])[0]
