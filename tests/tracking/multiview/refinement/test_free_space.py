"""What silhouettes rule out, beside the same in plain NumPy, and what it does to poses."""

from __future__ import annotations

import actor
import made_rig
import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt, map_coordinates

from shadowpuppet.camera.rasterize import Picture
from shadowpuppet.tracking.multiview.refinement.correspondence import make_cloud
from shadowpuppet.tracking.multiview.refinement.free_space import (
    OUTVOTING_CAMERAS,
    TAU,
    Spheres,
    free_space,
    push_inside,
    spheres_in,
)
from shadowpuppet.tracking.multiview.refinement.part_sums import SUMS
from shadowpuppet.tracking.multiview.refinement.refiner import Pass, Refiner

BENT = (-0.09, 0.05, 0.0, 0.0)


def ring(count: int, **more):
    return made_rig.cameras(count, (320, 240), **more)


def seen(of, pose, cameras):
    return [(camera, Picture(of, camera, camera.T_camera_world).mask(pose)) for camera in cameras]


def cost(of, pose, views, weight=1.0, sums=None) -> float:
    T = of.skeleton.forward(pose[None])[0]
    into = np.zeros((len(T), SUMS)) if sums is None else sums
    return pushed(T, spheres_in(of.limbs), free_space(views), weight, into, sums is not None)


def pushed(T, spheres, space, weight, sums, adding) -> float:
    said = np.empty((len(space.windows), len(spheres.radii), 4))
    return push_inside(T, spheres, space, said, weight, np.zeros(3), sums, adding)


def plain_cost(of, pose, views) -> float:
    """The same, with exact distances, sphere by sphere and camera by camera."""
    T, spheres = of.skeleton.forward(pose[None])[0], spheres_in(of.limbs)
    out = np.full((len(views), len(spheres.radii)), -np.inf)
    middle = out.copy()
    for c, (camera, mask) in enumerate(views):
        field = distance_transform_edt(~mask) - distance_transform_edt(mask)
        for k, (joint, place, radius) in enumerate(zip(*spheres[:3], strict=True)):
            point = T[joint, :, :3] @ place + T[joint, :, 3]
            pixel, depth = camera.project(point[None])[0], (camera.T_camera_world @ [*point, 1])[2]
            if (pixel >= 0).all() and (pixel < camera.size).all() and depth > 0:
                middle[c, k] = map_coordinates(field, pixel[::-1, None], order=1, mode="nearest")[0] * depth / camera.matrix[0, 0]
                out[c, k] = middle[c, k] + radius
    wrong = (middle > 0) & ((middle > 0).sum(0) == 1) & ((np.isfinite(middle) & (middle <= 0)).sum(0) >= OUTVOTING_CAMERAS)
    r = np.where(wrong, 0, np.maximum(out, 0))
    return float(np.where(r < TAU, r**2, TAU * (2 * r - TAU)).mean())


@pytest.mark.kernels
@pytest.mark.parametrize(("count", "lens"), [(3, {}), (5, {"distortion": BENT})])
def test_it_costs_what_the_plain_version_says(count, lens, rng):
    of = actor.body()
    pose = actor.stance(of.skeleton)
    views = seen(of, pose, ring(count, **lens))
    assert cost(of, pose, views) < 2e-5
    for spread in (0.1, 0.4):
        other = of.skeleton.clamp((pose + rng.normal(0, spread, len(pose)))[None])[0]
        assert cost(of, other, views) == pytest.approx(plain_cost(of, other, views), rel=0.1, abs=2e-6)
        assert cost(of, other, views, 3.0) == pytest.approx(3 * cost(of, other, views))


@pytest.mark.kernels
def test_the_sums_are_the_cost_s_derivative(rng):
    """Each joint's sum of moments and forces beside the change of the cost as what is fixed to the joint is moved alone."""
    of = actor.body()
    pose = actor.stance(of.skeleton)
    views = seen(of, pose, ring(3, distortion=BENT))
    other = of.skeleton.clamp((pose + rng.normal(0, 0.3, len(pose)))[None])[0]
    T, spheres, space = of.skeleton.forward(other[None])[0], spheres_in(of.limbs), free_space(views)
    sums = np.zeros((len(T), SUMS))
    pushed(T, spheres, space, 1.0, sums, True)
    numeric = np.zeros((len(T), 6))
    for joint in range(len(T)):
        for d in range(6):
            for sign in (-1, 1):
                moved = T.copy()
                twist = np.zeros(6)
                twist[d] = sign * 1e-3
                moved[joint] += np.cross(twist[:3], T[joint], axisb=0, axisc=0)
                moved[joint, :, 3] += twist[3:]
                numeric[joint, d] += sign * pushed(moved, spheres, space, 1.0, sums.copy(), False) / 2e-3
    told = -2 * sums[:, 21:27]
    assert np.linalg.norm(told) > 1e-4
    assert np.linalg.norm(numeric - told) < 0.15 * np.linalg.norm(told)


def test_an_arm_that_reaches_out_is_brought_back_without_any_surface_to_draw_it(rng):
    of = actor.body()
    pose = actor.stance(of.skeleton)
    views, surface = seen(of, pose, ring(4)), actor.surface(of, pose, rng, 30)
    rest = surface.points[:, 1] < 0.1  # all but the left arm
    cloud = make_cloud(surface.points[rest], surface.normals[rest], surface.weights[rest])
    lost, held = pose.copy(), np.full(len(pose), 1e-7)
    lost[of.skeleton.dof_indices(["left_shoulder_x"])] += 0.4

    def left(*more) -> float:
        found = Refiner(of).gauss_newton(lost[None], (Pass(cloud, 15, 0.05, *more),), lost[None], held)
        return actor.apart(of, found, pose)[0]

    assert left(free_space(views), 2.0) < 0.4 * left()
    assert left(free_space(views), 0.0) == left()


def test_a_camera_that_lost_the_legs_is_outvoted_by_three_others():
    of = actor.body()
    pose = actor.stance(of.skeleton)

    def price(count: int) -> float:
        views = seen(of, pose, ring(count))
        rows = np.flatnonzero(views[0][1].any(1))
        views[0][1][rows[len(rows) // 2] :] = False
        return cost(of, pose, views)

    assert price(3) > 1e-3
    assert price(4) < 1e-4


def test_what_is_not_in_a_picture_costs_nothing():
    of = actor.body()
    pose = actor.stance(of.skeleton)
    views = seen(of, pose, ring(3))
    far = pose.copy()
    far[:2] += 500.0
    assert cost(of, far, views) == 0
    assert cost(of, pose, []) == 0
    assert cost(of, pose, views) < 1e-4 < cost(of, pose + np.eye(len(pose))[0] * 0.3, views)


def test_spheres_lie_in_the_limbs():
    of = actor.body()
    spheres = spheres_in(actor.limbs_of(of))
    assert isinstance(spheres, Spheres)
    assert len(spheres.radii) > 2 * len(of.limbs.joints)
    assert (spheres.radii > 0).all()
    assert spheres.radii.max() < 0.15
    ends = np.concatenate([of.limbs.starts, of.limbs.ends])
    nearest = np.linalg.norm(ends[:, None] - spheres.places[None], axis=2).min(1)
    assert nearest.max() < 1e-9


def test_silhouettes_of_several_sizes_stand_side_by_side():
    of = actor.body()
    pose = actor.stance(of.skeleton)
    cameras = [ring(3)[0], made_rig.cameras(3, (200, 160))[1], made_rig.cameras(3)[2]]
    views = seen(of, pose, cameras)
    space = free_space(views)
    assert space.fields.size == sum(int(w[3] * w[4]) for w in space.windows)
    assert cost(of, pose, views) < 1e-4
