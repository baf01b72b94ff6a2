"""Limbs by brute force: capped tapered elliptic cylinders as clouds of points with normals, and as sets of points."""

from __future__ import annotations

import numpy as np
from scipy.spatial import cKDTree

from shadowpuppet.body.shapes import Limbs
from shadowpuppet.geometry import Array


def one_limb(length=0.4, shear=(0.0, 0.0), start=(0.1, 0.08), end=(0.1, 0.08), caps=(0.0, 0.0), rotation=None, at=(0.0, 0.0, 0.0)) -> Limbs:
    """A single part on joint 0."""
    return Limbs(np.zeros(1, np.int64), np.eye(3)[None] if rotation is None else np.asarray(rotation, float)[None], np.array([at], float),
                 np.array([length]), np.array([shear], float), np.array([[start, end]], float), np.array([caps], float), ("part",))


def random_limbs(rng: np.random.Generator, joints: list[int]) -> Limbs:
    """Parts of human proportions, one per joint, in random directions; flat ends and domes."""
    from scipy.spatial.transform import Rotation

    S = len(joints)
    radii = rng.uniform(0.03, 0.15, (S, 1, 1)) * rng.uniform(0.75, 1.3, (S, 2, 2))
    caps = np.where(rng.uniform(size=(S, 2)) < 0.4, 0.0, rng.uniform(0.02, 0.1, (S, 2)))
    return Limbs(np.array(joints, np.int64), Rotation.random(S, random_state=int(rng.integers(2**31))).as_matrix(),
                 rng.uniform(-0.1, 0.1, (S, 3)), rng.uniform(0.2, 0.5, S), rng.uniform(-0.04, 0.04, (S, 2)), radii, caps,
                 tuple(f"part{n}" for n in range(S)))


def samples(limbs: Limbs, s: int, step: float = 0.003) -> Array:
    """Points (P, 3) on the whole surface of part `s`, in its frame, about `step` (m) apart."""
    L, shear, radii, caps = limbs.lengths[s], limbs.shears[s], limbs.radii[s], limbs.caps[s]
    angles = np.arange(0, 2 * np.pi, step / radii.max())
    circle = np.stack([np.cos(angles), np.sin(angles)], -1)
    clouds = []
    for share in np.linspace(0, 1, int(L / step) + 2):
        ring = share * shear + ((1 - share) * radii[0] + share * radii[1]) * circle
        clouds.append(np.column_stack([ring, np.full(len(ring), share * L)]))
    for end, sign in ((0, -1), (1, 1)):
        around = np.linspace(0, np.pi / 2, int(max(radii[end].max(), caps[end]) * np.pi / 2 / step) + 2)
        for turn in around:  # a flat end is a dome of no height
            ring = end * shear + np.sin(turn) * radii[end] * circle
            clouds.append(np.column_stack([ring, np.full(len(ring), end * L + sign * caps[end] * np.cos(turn))]))
    return np.concatenate(clouds)


def within(limbs: Limbs, s: int, points: Array) -> Array:
    """Mask (P,) of the points (P, 3), in the frame of part `s`, that lie inside it, from its definition."""
    out = np.zeros(len(points), bool)
    L, shear, radii, caps = limbs.lengths[s], limbs.shears[s], limbs.radii[s], limbs.caps[s]
    for n, (x, y, z) in enumerate(points):
        share = min(max(z / L, 0.0), 1.0)
        u, v = (np.array([x, y]) - share * shear) / ((1 - share) * radii[0] + share * radii[1])
        over, cap = (-z, caps[0]) if z < 0 else (z - L, caps[1]) if z > L else (0.0, 1.0)
        out[n] = over < cap and u**2 + v**2 + (over / cap) ** 2 < 1
    return out


def brute(limbs: Limbs, s: int, points: Array, step: float = 0.003) -> tuple[Array, Array]:
    """Signed distances (P,) and closest points (P, 3) of points in the frame of part `s`, too large by about `step`^2 at most."""
    cloud = samples(limbs, s, step)
    away, which = cKDTree(cloud).query(points)
    return np.where(within(limbs, s, points), -away, away), cloud[which]
