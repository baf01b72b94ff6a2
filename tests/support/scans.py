"""A synthetic body with parts in random directions on a small tree, and surface points of it."""

from __future__ import annotations

from types import SimpleNamespace

import naive_limbs
import numpy as np

from benchmarks.speed import naive_multi as naive
from shadowpuppet.body.skeleton import Dof, Joint, Skeleton
from shadowpuppet.geometry import Array


def make_body(seed: int = 1) -> SimpleNamespace:
    """Six parts on five joints, with translations, rotations and rotation vectors."""
    joints = (Joint("pelvis", None), Joint("chest", "pelvis", (0, 0, 0.3)), Joint("hip", "pelvis", (0, 0.1, -0.05)),
              Joint("knee", "hip", (0, 0, -0.4)), Joint("arm", "chest", (0, 0.2, 0.2)))
    dofs = [*(Dof(f"root_{axis}", "pelvis", axis, kind="translation") for axis in "xyz"), Dof("heading", "pelvis", "z"),
            Dof("bow", "pelvis", "y"), Dof("tilt", "pelvis", "-x"), *_vector("chest"), *_vector("hip"),
            Dof("flexion", "knee", "-y", 0, 2.5), *_vector("arm")]  # fmt: skip
    limbs = naive_limbs.random_limbs(np.random.default_rng(seed), [0, 1, 2, 3, 4, 0])
    return SimpleNamespace(name="made", skeleton=Skeleton(joints, tuple(dofs)), limbs=limbs)


def _vector(joint: str) -> list[Dof]:
    return [Dof(f"{joint}_{axis}", joint, axis, -3, 3, kind="vector") for axis in "xyz"]


def some_pose(body, rng: np.random.Generator) -> Array:
    """A random pose (D,) within the limits."""
    return body.skeleton.clamp(rng.normal(0, 0.4, (1, len(body.skeleton.dofs))))[0]


def scan(body, pose: Array, rng: np.random.Generator, each: int = 150) -> tuple[Array, Array, Array]:
    """Points (P, 3) on the parts' surfaces, their outward normals (P, 3), and weights (P,)."""
    T, limbs, found = naive.place(body.skeleton, pose)[0], body.limbs, []
    for s, joint in enumerate(limbs.joints):
        cloud = naive_limbs.samples(limbs, s, 0.03)
        cloud = cloud[rng.permutation(len(cloud))[:each]] @ limbs.rotations[s].T + limbs.starts[s]
        found.append(naive.closest(limbs, s, T[joint], cloud @ T[joint][:3, :3].T + T[joint][:3, 3]))
    points, normals = (np.concatenate([getattr(one, name) for one in found]) for name in ("feet", "normals"))
    return points, normals, rng.uniform(0.3, 1, len(points))
