"""Kernels of refinement beside the plain version of the same."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scans import make_body, scan, some_pose

from benchmarks.speed import naive_multi as naive
from shadowpuppet.tracking.multiview.refinement.correspondence import LANES, make_cloud
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner
from shadowpuppet.tracking.multiview.settings import ForceSettings, SurfaceSettings

SURFACE = SurfaceSettings(epsilon=0.3, tau=0.06)
pytestmark = pytest.mark.kernels


@pytest.fixture(params=range(3))
def seen(request):
    """A body, a pose of it, and a noisy scan from a pose beside that, with some points that are nobody's."""
    rng, body = np.random.default_rng(request.param), make_body(request.param)
    pose = some_pose(body, rng)
    points, normals, weights = scan(body, body.skeleton.clamp((pose + rng.normal(0, 0.05, len(pose)))[None])[0], rng, 15)
    points[::7] += rng.normal(0, 0.2, points[::7].shape)
    normals = normals + rng.normal(0, 0.2, normals.shape)
    return body, pose, points, normals / np.linalg.norm(normals, axis=1, keepdims=True), weights


@pytest.mark.parametrize("choice", ["euclidean", "modulated"])
@pytest.mark.parametrize("epsilon", [0.0, 0.3])
def test_costs_are_those_of_the_plain_version(seen, epsilon, choice, rng):
    body, pose, *cloud = seen
    surface = replace(SURFACE, epsilon=epsilon, nearest=choice)
    poses = body.skeleton.clamp(pose + rng.normal(0, 0.1, (3, len(pose))))
    plain = [naive.cost(body, one, *cloud, surface) for one in poses]
    np.testing.assert_allclose(Refiner(body, surface).costs(poses, make_cloud(*cloud)), plain, rtol=2e-4)


@pytest.mark.parametrize("chosen", [{}, {"modulated": False}, {"rho": "none"}, {"rho": "quadratic"}, {"hierarchical": False},
                                    {"modulated": False, "rho": "none", "hierarchical": False}, {"translation": 0.5, "rotation": 0.9}])
@pytest.mark.parametrize("choice", ["euclidean", "modulated"])
def test_forces_move_a_pose_as_in_the_plain_version(seen, choice, chosen):
    body, pose, *cloud = seen
    surface = replace(SURFACE, nearest=choice)
    forces = ForceSettings(iterations=2, coarse_tau=surface.tau, fine_tau=surface.tau, **chosen)
    plain = pose
    for _ in range(2):
        plain = naive.move_by_forces(body, plain, *cloud, surface, forces)
    assert np.abs(plain - pose).max() > 1e-3
    np.testing.assert_allclose(Refiner(body, surface).forces(pose[None], make_cloud(*cloud), forces)[0], plain, atol=2e-5)


def test_gauss_newton_moves_a_pose_as_in_the_plain_version(seen):
    """One iteration; by then the damping has been made less once, as the pose is the best that is known."""
    body, pose, *cloud = seen
    plain = naive.move_by_gauss_newton(body, pose, *cloud, SURFACE, damping=0.3 * 0.05)
    assert naive.cost(body, plain, *cloud, SURFACE) < naive.cost(body, pose, *cloud, SURFACE)
    found = Refiner(body, SURFACE).gauss_newton(pose[None], ((make_cloud(*cloud), 1, SURFACE.tau),), pose, np.full(len(pose), 1e-6), 0.05)
    np.testing.assert_allclose(found[0], plain, atol=2e-3)


@pytest.mark.parametrize("count", [0, 1, LANES - 1, LANES, LANES + 1])
def test_a_cloud_may_have_any_number_of_points(count, rng):
    body = make_body()
    pose = some_pose(body, rng)
    points, normals, weights = (part[:count] for part in scan(body, pose, rng, 4))
    cloud = make_cloud(points + 0.01, normals, weights)
    plain = naive.cost(body, pose, points + 0.01, normals, weights, SURFACE) if count else 0.0
    np.testing.assert_allclose(Refiner(body, SURFACE).costs(pose[None], cloud), plain, rtol=2e-4, atol=1e-12)


def test_the_order_of_points_and_poses_does_not_matter(seen, rng):
    body, pose, *cloud = seen
    order = rng.permutation(len(cloud[0]))
    refiner, held = Refiner(body, SURFACE), np.full(len(pose), 1e-6)
    poses = body.skeleton.clamp(pose + rng.normal(0, 0.05, (3, len(pose))))
    together = refiner.gauss_newton(poses, ((make_cloud(*cloud), 3, SURFACE.tau),), poses, held)
    shuffled = refiner.gauss_newton(poses[::-1], ((make_cloud(*(part[order] for part in cloud)), 3, SURFACE.tau),), poses[::-1], held)
    np.testing.assert_allclose(shuffled[::-1], together, atol=5e-3)
    alone = [refiner.gauss_newton(one[None], ((make_cloud(*cloud), 3, SURFACE.tau),), one, held)[0] for one in poses]
    np.testing.assert_array_equal(together, alone)  # a pose does not know of the others
