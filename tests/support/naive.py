"""Every kernel of the core once more, plainly: nothing here is fast, and each can be checked by reading it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise, product

import numpy as np
from numpy.typing import ArrayLike, NDArray

from shadowpuppet.body.shapes import Hulls
from shadowpuppet.body.skeleton import AXES, Skeleton
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.projection import DIRECTIONS, NEAR_PLANE
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array, inverse, rigid, rotation_about, rotation_from_vector, transform
from shadowpuppet.motion.prior.hmm import Posterior

Mask = NDArray[np.bool_]


def forward(skeleton: Skeleton, pose: ArrayLike, root: ArrayLike | None = None) -> dict[str, Array]:
    """4x4 transforms of all joints: the parent's, times offset and couplings, times one matrix for each DOF."""
    values = dict(zip(skeleton.dof_names, np.asarray(pose, float), strict=True))
    out: dict[str, Array] = {}
    for joint in skeleton.joints:
        offset = np.array(joint.offset, float)
        for coupling in skeleton.couplings:
            if coupling.joint == joint.name:
                offset = offset + values[coupling.dof] * np.array(coupling.shift)
        T = (np.eye(4) if root is None else np.asarray(root)) if joint.parent is None else out[joint.parent]
        T = T @ rigid(np.eye(3), offset)
        for d, dof in enumerate(skeleton.dofs):
            if dof.joint == joint.name and dof.kind == "vector":
                three = [values[each.name] for each in skeleton.dofs[d : d + 3]]
                T = T @ rigid(rotation_from_vector(three), np.zeros(3)) if dof.axis == "x" else T
            elif dof.joint == joint.name:
                index, sign = AXES[dof.axis]
                axis = sign * np.eye(3)[index]
                turn = dof.kind == "rotation"
                T = T @ (rigid(rotation_about(axis, values[dof.name]), np.zeros(3)) if turn else rigid(np.eye(3), axis * values[dof.name]))
        out[joint.name] = T
    return out


def to_pixels(camera: Camera, points: ArrayLike) -> Array:
    """Pixels (..., 2) of points (..., 3) in the camera's frame, by OpenCV."""
    return camera.project(transform(inverse(camera.T_camera_world), points))


def clipped(corners: ArrayLike, near: float = NEAR_PLANE) -> list[Array]:
    """What of a polygon (K, 3) lies at z >= near (Sutherland & Hodgman 1974)."""
    out: list[Array] = []
    corners = np.asarray(corners, float)
    for a, b in zip(corners, np.roll(corners, -1, 0)):
        if a[2] >= near:
            out.append(a)
        if (a[2] >= near) != (b[2] >= near):
            out.append(a + (near - a[2]) / (b[2] - a[2]) * (b - a))
    return out


def support(centres: Iterable[Array], axes: Iterable[Array], direction: Array) -> Array:
    """The farthest point (2,) in a direction of ellipses with centres (2,) and three conjugate half axes (3, 2) each."""
    best, farthest = -np.inf, np.zeros(2)
    for centre, three in zip(centres, axes, strict=True):
        reach = three @ direction
        point = centre + reach @ three / np.linalg.norm(reach)
        if point @ direction > best:
            best, farthest = point @ direction, point
    return farthest


def polygon(picture: Picture, joints: dict[str, Array], shape: int) -> Array:
    """Picture (K, 2), pixels, of one shape; joints in the camera's frame."""
    shapes, names = picture.body.shapes, picture.body.skeleton.joint_names
    frames = [joints[names[j]] for j in shapes.joints[shape]]
    if not isinstance(shapes, Hulls):
        seen = clipped(transform(frames[0], shapes.corners[shape]))
        return to_pixels(picture.camera, seen) if seen else np.zeros((0, 2))
    places = [transform(T, c) for T, c in zip(frames, shapes.centres[shape], strict=True)]
    if max(p[2] for p in places) <= NEAR_PLANE:
        return np.zeros((0, 2))
    centres, axes = [], []
    for T, p, radii in zip(frames, places, shapes.radii[shape], strict=True):
        z = max(p[2], NEAR_PLANE)
        centres.append(p[:2] / z)
        axes.append(np.array([r / z * (T[:2, a] - p[:2] / z * T[2, a]) for a, r in enumerate(radii)]))
    flat = np.array([support(centres, axes, direction) for direction in DIRECTIONS])
    return to_pixels(picture.camera, np.concatenate([flat, np.ones((len(flat), 1))], 1))


def half_planes(corners: ArrayLike, size: tuple[int, int], unit: int = 1) -> tuple[Mask, Mask]:
    """Pixels (H, W) whose centres lie in a convex polygon (K, 2), half open, and pixels with centres within 1e-6 of an edge's line.

    Exact for whole numbers; `unit` of them make a pixel. Centres on left and top edges are inside, on others outside.
    """
    P = np.asarray(corners)
    y, x = np.mgrid[: size[1], : size[0]] * unit
    Q = np.roll(P, -1, 0)
    area = (P[:, 0] * Q[:, 1] - Q[:, 0] * P[:, 1]).sum()
    inside, near = np.full(x.shape, area != 0), np.zeros(x.shape, bool)
    for a, b in zip(P, Q):
        dx, dy = (b - a) if area > 0 else (a - b)
        if dx == 0 and dy == 0:
            continue
        side = dx * (y - a[1]) - dy * (x - a[0])
        inside &= (side > 0) | ((side == 0) & (dy < 0 or (dy == 0 and dx > 0)))
        near |= np.abs(side) < 1e-6 * unit * np.hypot(dx, dy)
    return inside, near


def seen_through(quad: ArrayLike, camera: Camera, near: float = NEAR_PLANE) -> tuple[Mask, Mask]:
    """Pixels (H, W) of a pinhole camera whose rays hit a flat convex quad (4, 3) at z >= near, and pixels whose rays pass close to an edge.

    Knows neither projection nor clipping: the ray is cut with the quad's plane.
    """
    quad = np.asarray(quad, float)
    y, x = np.mgrid[: camera.size[1], : camera.size[0]]
    K = camera.matrix
    rays = np.stack([(x - K[0, 2]) / K[0, 0], (y - K[1, 2]) / K[1, 1], np.ones(x.shape)], -1)
    normal = np.cross(quad[2] - quad[0], quad[3] - quad[1])
    normal /= np.linalg.norm(normal)
    with np.errstate(divide="ignore", invalid="ignore"):
        points = rays * ((normal @ quad[0]) / (rays @ normal))[..., None]
    inside, close = points[..., 2] >= near, np.abs(points[..., 2] - near) < 1e-6
    for a, b in zip(quad, np.roll(quad, -1, 0)):
        side = (points - a) @ np.cross(normal, b - a)
        inside &= side >= 0
        close |= np.abs(side) < 1e-6 * np.maximum(np.linalg.norm(points, axis=-1), 1)
    return inside, close | ~np.isfinite(points).all(-1) | (np.abs(rays @ normal) < 1e-6)


def silhouette(picture: Picture, pose: ArrayLike, shapes: Iterable[int] | None = None) -> tuple[Mask, Mask]:
    """The drawn mask (H, W) of a pose, and the pixels that rounding may decide: h of Liu 2011, eq. 2."""
    joints = forward(picture.body.skeleton, pose, picture.T_camera_base)
    width, height = picture.camera.size
    drawn, doubtful = np.zeros((height, width), bool), np.zeros((height, width), bool)
    for shape in range(len(picture.body.parts)) if shapes is None else shapes:
        corners = polygon(picture, joints, shape)
        if len(corners) >= 3:
            inside, near = half_planes(corners, picture.camera.size)
            drawn, doubtful = drawn | inside, doubtful | near
    return drawn, doubtful


def cost(drawn: Mask, mask: Mask, ignore: Mask | bool = False) -> int:
    """Eq. 2: pixels that differ, outside what is ignored."""
    return int(((drawn ^ mask) & ~np.asarray(ignore)).sum())


def convex_hull(points: Iterable[tuple[int, int]]) -> list[tuple[int, int]]:
    """Convex hull of points with whole coordinates, exact (Andrew 1979)."""
    ordered, halves = sorted(set(points)), []
    if len(ordered) < 3:
        return ordered
    for direction in (ordered, ordered[::-1]):
        half: list[tuple[int, int]] = []
        for p in direction:
            while len(half) > 1:
                (ax, ay), (bx, by) = half[-2:]
                if (bx - ax) * (p[1] - ay) - (by - ay) * (p[0] - ax) > 0:
                    break
                half.pop()
            half.append(p)
        halves += half[:-1]
    return halves


def posterior(log_densities: Array, initial: Array, transitions: Array) -> Posterior:
    """Hidden Markov model: every path of states one by one."""
    T, M = log_densities.shape
    with np.errstate(divide="ignore"):
        first, follow = np.log(initial), np.log(transitions)
    paths = list(product(range(M), repeat=T))
    logs = np.array([first[path[0]] + sum(follow[step] for step in pairwise(path)) + sum(log_densities[range(T), path]) for path in paths])
    top, states, pairs = logs.max(), np.zeros((T, M)), np.zeros((M, M))
    if top == -np.inf:
        return Posterior(states, pairs, -np.inf)
    total = float(top + np.log(np.exp(logs - top).sum()))
    for path, log in zip(paths, logs):
        states[range(T), path] += np.exp(log - total)
        np.add.at(pairs, (path[:-1], path[1:]), np.exp(log - total))
    return Posterior(states, pairs, total)
