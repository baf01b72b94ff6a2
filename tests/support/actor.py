"""A whole body in known poses: surface points, silhouettes in a ring of cameras, a walk."""

from __future__ import annotations

from functools import cache

import made_rig
import naive_limbs
import numpy as np
from scans import scan

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.shapes import Body, Limbs
from shadowpuppet.body.sizes import AnatomicalSizes
from shadowpuppet.body.skeleton import Skeleton
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.mask import Mask
from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.geometry import Array
from shadowpuppet.tracking.multiview.refinement.correspondence import Cloud, make_cloud
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints, VisualHull

CAMERAS = 5
"""Not four: in a ring of four, cameras would face each other in pairs."""
LIMBS = tuple(f"{side}_{joint}" for side in ("left", "right") for joint in ("shoulder", "elbow", "wrist", "hip", "knee", "ankle"))


@cache
def body(name: str = "anatomical", height: float = 1.75) -> Body:
    return make_body(name, average_sizes(name, height))


def sizes(**changes: float) -> AnatomicalSizes:
    """Sizes of the average person, some multiplied by factors."""
    mean = average_sizes("anatomical", 1.75)
    assert isinstance(mean, AnatomicalSizes)
    return mean.with_values(**{name: factor * getattr(mean, name) for name, factor in changes.items()})


def limbs_of(of: Body) -> Limbs:
    assert of.limbs is not None
    return of.limbs


def stance(skeleton: Skeleton, swing: float = 0.3, heading: float = 0.0, place: tuple[float, float] = (0.0, 0.0)) -> Array:
    """One pose (D,) of a stride on the floor: `swing` (rad) forward of the left arm and the right leg; elbows bent, arms off the trunk."""
    to = {"root_x": place[0], "root_y": place[1], "root_z": 0.93, "root_heading": heading, "left_elbow_flexion": 0.7,
          "right_elbow_flexion": 0.5, "left_knee_flexion": 0.1 + 0.3 * max(-swing, 0), "right_knee_flexion": 0.1 + 0.3 * max(swing, 0)}
    for side, sign in (("left", 1), ("right", -1)):
        if "left_hip_flexion" in skeleton.dof_names:
            to |= {f"{side}_shoulder_flexion": sign * swing, f"{side}_shoulder_abduction": 0.35, f"{side}_hip_flexion": -sign * swing + 0.1}
        else:
            to |= {f"{side}_shoulder_y": -sign * swing, f"{side}_shoulder_x": sign * 0.35, f"{side}_hip_y": sign * swing - 0.1}
    return skeleton.pose(**to)


def walk(skeleton: Skeleton, frames: int, rate: float = 20.0, begin: float = 0.0) -> Array:
    """Poses (T, D): some steps along a curve."""
    t = begin + np.arange(frames) / rate
    return np.array([stance(skeleton, 0.45 * np.sin(5 * s), 0.4 * s, (0.5 * s - 0.3, 0.1 * s**2)) for s in t])


def surface(of: Body, pose: Array, rng: np.random.Generator, each: int = 40, noise: float = 0.0) -> SurfacePoints:
    """Points of the body's own surface that no other limb covers."""
    points, normals, weights = scan(of, pose, rng, each)
    T = of.skeleton.forward(pose[None])[0]
    hidden, limbs = np.zeros(len(points), bool), limbs_of(of)
    for s, joint in enumerate(limbs.joints):
        own = ((points - T[joint, :, 3]) @ T[joint, :, :3] - limbs.starts[s]) @ limbs.rotations[s]
        hidden |= naive_limbs.within(limbs, s, own + 2e-3 * (own - [0, 0, limbs.lengths[s] / 2]))
    points = points + noise * rng.normal(size=points.shape)
    return SurfacePoints(points[~hidden], normals[~hidden], weights[~hidden], np.zeros(np.count_nonzero(~hidden), np.int64))


def cloud_of(seen: SurfacePoints, share: int = 1) -> Cloud:
    return make_cloud(seen.points[::share], seen.normals[::share], seen.weights[::share])


def apart(of: Body, poses: Array, truth: Array) -> Array:
    """Mean distance (N,) of the limbs' joints, metres."""
    chosen = [of.landmark_names.index(name) for name in LIMBS]
    return np.linalg.norm(of.points(np.atleast_2d(poses))[:, chosen] - of.points(np.atleast_2d(truth))[:, chosen], axis=2).mean(1)


@cache
def cameras(count: int = CAMERAS) -> tuple[Camera, ...]:
    return tuple(made_rig.cameras(count))


@cache
def hull(count: int = CAMERAS) -> VisualHull:
    return VisualHull(cameras(count))


def masks(of: Body, pose: Array, count: int = CAMERAS) -> list[Mask]:
    """Silhouette of a pose (D,) in each camera."""
    return [Picture(of, camera, camera.T_camera_world).mask(pose) for camera in cameras(count)]


@cache
def filmed(name: str = "anatomical", frames: int = 12, begin: float = 0.0) -> tuple[Array, list[tuple[SurfacePoints, list[Mask]]]]:
    """A walk: poses (T, D), and the surface points and masks of every frame."""
    poses = walk(body(name).skeleton, frames, begin=begin)
    seen = [masks(body(name), pose) for pose in poses]
    return poses, [(hull().points(row), row) for row in seen]
