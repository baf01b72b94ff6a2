"""The plain version of Ni 2008's refinement against brute force, finite differences and what forces must do."""

from __future__ import annotations

from dataclasses import replace

import naive_limbs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scans import make_body, scan, some_pose

from benchmarks.speed import naive_multi as naive
from shadowpuppet.tracking.multiview.settings import ForceSettings, SurfaceSettings

SURFACE = SurfaceSettings(epsilon=0.3, tau=0.06)
seeds = st.integers(0, 2**32 - 1)


@pytest.fixture(scope="module")
def body():
    return make_body()


# Points on limbs ------------------------------------------------------------------------------------------------------


@given(seed=seeds)
@settings(max_examples=25, deadline=None)
def test_points_near_a_limb_are_as_far_as_by_brute_force(seed):
    rng = np.random.default_rng(seed)
    limbs = naive_limbs.random_limbs(rng, [0])
    points = naive_limbs.samples(limbs, 0, 0.02) + rng.normal(0, 0.01, (len(naive_limbs.samples(limbs, 0, 0.02)), 3))
    found = naive._closest(points, limbs.lengths[0], limbs.shears[0], limbs.radii[0], limbs.caps[0])
    away, _ = naive_limbs.brute(limbs, 0, points, 0.004)
    sure = np.abs(away) > 1e-6
    np.testing.assert_array_equal(np.sign(found.distance[sure]), np.sign(away[sure]))
    off = np.abs(found.distance - away)
    assert np.median(off) < 1e-3
    assert np.quantile(off - 0.25 * np.abs(away), 0.95) < 2e-3  # of first order: right near the surface


@pytest.mark.parametrize("caps", [(0.0, 0.0), (0.1, 0.1)])
def test_round_limbs_are_exact(caps, rng):
    limbs = naive_limbs.one_limb(start=(0.1, 0.1), end=(0.1, 0.1), caps=caps)
    points = rng.uniform([-0.4, -0.4, -0.3], [0.4, 0.4, 0.7], (800, 3))
    found = naive._closest(points, 0.4, *(part[0] for part in (limbs.shears, limbs.radii, limbs.caps)))
    away, feet = naive_limbs.brute(limbs, 0, points)
    np.testing.assert_allclose(found.distance, away, atol=3e-3)
    clear = (away > -0.03) & (np.hypot(*points[:, :2].T) > 0.02)  # deep inside, several places are as near
    np.testing.assert_allclose(found.feet[clear], feet[clear], atol=4e-3)


@given(seed=seeds)
@settings(max_examples=25, deadline=None)
def test_normals_point_outward_where_points_lie_on_the_limb(seed):
    rng = np.random.default_rng(seed)
    limbs = naive_limbs.random_limbs(rng, [0])
    shape = limbs.lengths[0], limbs.shears[0], limbs.radii[0], limbs.caps[0]
    on = naive._closest(naive_limbs.samples(limbs, 0, 0.02), *shape)
    np.testing.assert_allclose(np.linalg.norm(on.normals, axis=1), 1, atol=1e-9)
    assert np.quantile(np.abs(on.distance), 0.99) < 1e-6
    out = naive._closest(on.feet + 1e-4 * on.normals, *shape)
    assert np.mean(np.abs(out.distance - 1e-4) < 1e-5) > 0.97  # all but the points on an edge


def test_limbs_are_where_their_joints_are(body, rng):
    pose = some_pose(body, rng)
    T = naive.place(body.skeleton, pose)[0]
    limbs, s = body.limbs, 3
    points = rng.normal(0, 0.4, (200, 3))
    R = T[3][:3, :3] @ limbs.rotations[s]
    own = (points - T[3][:3, :3] @ limbs.starts[s] - T[3][:3, 3]) @ R
    np.testing.assert_allclose(naive.closest(limbs, s, T[3], points).distance,
                               naive._closest(own, limbs.lengths[s], limbs.shears[s], limbs.radii[s], limbs.caps[s]).distance)


def test_the_nearest_part_is_the_one_whose_surface_agrees():
    """Two balls with a point between them: its normal says whose it is, though the other is nearer."""
    balls = [naive_limbs.one_limb(length=1e-3, start=(0.1, 0.1), end=(0.1, 0.1), caps=(0.1, 0.1), at=(x, 0, 0)) for x in (-0.15, 0.15)]
    limbs = replace(balls[0], **{name: np.concatenate([getattr(ball, name) for ball in balls])
                                 for name in ("joints", "rotations", "starts", "lengths", "shears", "radii", "caps")})
    point, normal = np.array([[0.005, 0, 0]]), np.array([[1.0, 0, 0]])  # the left ball's outward normal
    T = np.eye(4)[None]
    assert naive.nearest(limbs, T, point, normal, 0.0)[0] == 1
    which, apart, found = naive.nearest(limbs, T, point, normal, 0.3)
    assert which == 0
    assert apart[0] == pytest.approx(0.055 * 0.7, abs=1e-4)
    assert found.feet[0] == pytest.approx([-0.05, 0, 0], abs=1e-3)


# Kinematics -----------------------------------------------------------------------------------------------------------


def test_joints_stand_where_the_skeleton_says(body, rng):
    pose = some_pose(body, rng)
    np.testing.assert_allclose(naive.place(body.skeleton, pose)[0][:, :3], body.skeleton.forward(pose[None])[0], atol=1e-12)


def test_motions_are_the_derivatives_of_points(body, rng):
    pose, place, step = some_pose(body, rng), rng.normal(0, 0.3, 3), 1e-6
    T, motions = naive.place(body.skeleton, pose)
    for d in range(len(pose)):
        moved = naive.place(body.skeleton, pose + step * np.eye(len(pose))[d])[0]
        for j in range(len(T)):
            point = T[j, :3, :3] @ place + T[j, :3, 3]
            told = motions.axes[d] if motions.shifts[d] else np.cross(motions.axes[d], point - motions.centres[d])
            seen = (moved[j, :3, :3] @ place + moved[j, :3, 3] - point) / step
            np.testing.assert_allclose(seen, told if motions.moved[d, j] else np.zeros(3), atol=1e-5)


# Refinement -----------------------------------------------------------------------------------------------------------


def test_normal_equations_are_those_of_points_that_move_with_their_parts(body, rng):
    pose = some_pose(body, rng)
    points, normals, weights = scan(body, pose, rng)
    points = points + rng.normal(0, 0.02, points.shape)
    H, g = naive.normal_equations(body, pose, points, normals, weights, SURFACE)
    T = naive.place(body.skeleton, pose)[0]
    which, apart, found = naive.nearest(body.limbs, T, points, normals, SURFACE.epsilon)
    share = weights / (1 + (apart / SURFACE.tau) ** 2) ** 2 * np.maximum((found.normals * normals).sum(1), 0) / weights.sum()
    owner = body.limbs.joints[which]
    fixed = np.einsum("pji,pj->pi", T[owner, :3, :3], found.feet - T[owner, :3, 3])

    def residuals(q):
        T = naive.place(body.skeleton, q)[0][owner]
        return ((points - np.einsum("pij,pj->pi", T[:, :3, :3], fixed) - T[:, :3, 3]) * normals).sum(1)

    rows = np.stack([(residuals(pose - e) - residuals(pose + e)) / 2e-6 for e in 1e-6 * np.eye(len(pose))], 1)
    np.testing.assert_allclose(H, rows.T @ (share[:, None] * rows), atol=1e-8)
    np.testing.assert_allclose(g, rows.T @ (share * residuals(pose)), atol=1e-9)


@pytest.mark.parametrize("move", [naive.move_by_gauss_newton,
                                  lambda *args: naive.move_by_forces(*args, ForceSettings(rotation=1.0))])
def test_a_pose_that_fits_stays_and_one_beside_it_comes_nearer(move, body, rng):
    pose = some_pose(body, rng)
    points, normals, weights = scan(body, pose, rng)
    outside = naive.nearest(body.limbs, naive.place(body.skeleton, pose)[0], points, normals, SURFACE.epsilon)[1] < 1e-6
    points, normals, weights = points[outside], normals[outside], weights[outside]  # those that are not in another part
    np.testing.assert_allclose(move(body, pose, points, normals, weights, SURFACE), pose, atol=1e-4)
    off = body.skeleton.clamp((pose + rng.normal(0, 0.05, len(pose)))[None])[0]
    costs = [naive.cost(body, off, points, normals, weights, SURFACE)]
    for _ in range(12):
        off = move(body, off, points, normals, weights, SURFACE)
        costs.append(naive.cost(body, off, points, normals, weights, SURFACE))
    assert costs[-1] < 0.1 * costs[0], costs
    np.testing.assert_array_equal(off, body.skeleton.clamp(off[None])[0])


def test_forces_push_as_the_paper_says(body, rng):
    pose = np.zeros(len(body.skeleton.dofs))
    points, normals, weights = scan(body, pose, rng)
    shift = np.array([0.01, -0.02, 0.015])
    step = naive.move_by_forces(body, pose, points + shift, normals, weights, SURFACE, ForceSettings(modulated=False))
    assert step[:3] @ shift > 0.2 * shift @ shift  # from the model's point to the scene's
    twice = (np.concatenate([part, part]) for part in (points + shift, normals, weights))
    np.testing.assert_allclose(naive.move_by_forces(body, pose, *twice, SURFACE, ForceSettings(modulated=False)), step, atol=1e-9)
    backward = naive.move_by_forces(body, pose, points + shift, -normals, weights, replace(SURFACE, epsilon=0.0), ForceSettings())
    np.testing.assert_allclose(backward, pose, atol=0.2 * np.abs(step).max())  # none where normals disagree
    there = points + np.array([3.0, 0, 0])
    far = naive.move_by_forces(body, pose, there, normals, weights, SURFACE, ForceSettings(modulated=False))
    assert 0 < far[0] <= SURFACE.tau + 1e-9  # bounded
    free = naive.move_by_forces(body, pose, there, normals, weights, SURFACE, ForceSettings(modulated=False, rho="none"))
    assert free[0] == 0.5  # a step is never longer


def test_a_joint_feels_what_hangs_on_it_only_by_the_hierarchical_sum(body):
    """One point beside the shank: the hip turns with it, or does not."""
    pose = np.zeros(len(body.skeleton.dofs))
    T, s = naive.place(body.skeleton, pose)[0], 3
    seen = naive.closest(body.limbs, s, T[3], naive_limbs.samples(body.limbs, s, 0.05) @ body.limbs.rotations[s].T + body.limbs.starts[s]
                         + T[3][:3, 3])
    apart = naive.nearest(body.limbs, T, seen.feet + 0.02 * seen.normals, seen.normals, 0.3)[0]
    chosen = np.flatnonzero(apart == s)[:1]
    cloud = (seen.feet + 0.02 * seen.normals)[chosen], seen.normals[chosen], np.ones(1)
    names = np.array(body.skeleton.dof_names)
    with_sum, without = (naive.move_by_forces(body, pose, *cloud, SURFACE, ForceSettings(hierarchical=on)) for on in (True, False))
    hip = np.char.startswith(names, "hip")
    assert np.abs(with_sum[hip]).max() > 1e-3
    assert np.abs(without[hip]).max() == 0
    np.testing.assert_allclose(with_sum[:3], without[:3])  # the root is pushed by all, either way
    assert with_sum[names == "flexion"] == without[names == "flexion"]
