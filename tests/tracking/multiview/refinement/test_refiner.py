"""Refinement: its equations, its laws, and what it does to a whole person beside whom points lie. Plain twins are in test_refinement."""

from __future__ import annotations

from types import SimpleNamespace

import actor
import naive_limbs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scans import make_body as random_tree
from scans import scan, some_pose

from benchmarks.speed import naive_multi as naive
from shadowpuppet.body.jacobian import place_one
from shadowpuppet.body.models import WHOLE, average_sizes
from shadowpuppet.body.models import make_body as make_named
from shadowpuppet.body.skeleton import Dof, Joint, Skeleton
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import rotation_about
from shadowpuppet.threads import THREADS_VARIABLE
from shadowpuppet.tracking.multiview.refinement import gauss_newton
from shadowpuppet.tracking.multiview.refinement.correspondence import make_cloud
from shadowpuppet.tracking.multiview.refinement.part_sums import add_descendants
from shadowpuppet.tracking.multiview.refinement.refiner import Refiner
from shadowpuppet.tracking.multiview.settings import ForceSettings, SurfaceSettings

SURFACE = SurfaceSettings(epsilon=0.3, tau=0.06)


@pytest.fixture(params=[1, 2])
def seen(request):
    """A body, a pose of it, and a noisy scan from a pose beside that."""
    rng, body = np.random.default_rng(request.param), random_tree(request.param)
    pose = some_pose(body, rng)
    points, normals, weights = scan(body, body.skeleton.clamp((pose + rng.normal(0, 0.05, len(pose)))[None])[0], rng, 15)
    return body, pose, points + rng.normal(0, 0.01, points.shape), normals, weights


# Normal equations and their solution ----------------------------------------------------------------------------------


@pytest.mark.kernels
def test_normal_equations_are_those_of_the_plain_version(seen):
    """Which finite differences confirm (test_naive_multi)."""
    body, pose, *cloud = seen
    made, of = make_cloud(*cloud), Refiner(body, SURFACE)
    D = len(pose)
    H, g = np.zeros((D, D)), np.zeros(D)
    room = of._room()
    place_one(pose, of._chain, room[1], room[2], room[3])
    points = made.rows, made.spheres, made.origin
    gauss_newton.sum_equations(room[1], of._limbs, *points, of._numbers(), of._which(made), room)
    add_descendants(of._chain, room[6])
    gauss_newton.normal_equations(of._chain, room[2], made.origin, room[6], made.total, H, g)
    plain = naive.normal_equations(body, pose, *cloud, SURFACE)
    np.testing.assert_allclose(H, plain[0], atol=2e-4 * np.abs(plain[0]).max())
    np.testing.assert_allclose(g, plain[1], atol=2e-4 * np.abs(plain[1]).max())
    np.testing.assert_array_equal(H, H.T)
    assert np.linalg.eigvalsh(H).min() > -1e-6


@pytest.mark.kernels
@given(seed=st.integers(0, 2**31), size=st.integers(1, 12))
@settings(max_examples=30, deadline=None)
def test_equations_are_solved(seed, size):
    rng = np.random.default_rng(seed)
    root, b = rng.normal(size=(size, size)), rng.normal(size=size)
    A = root @ root.T + np.eye(size)
    x = b.copy()
    gauss_newton.solve_cholesky(A.copy(), x)
    np.testing.assert_allclose(A @ x, b, atol=1e-8)


# Laws -----------------------------------------------------------------------------------------------------------------


def moved_along(body, poses, turn: float, shift) -> np.ndarray:
    """Poses of somebody who was turned about the world's Z and then moved."""
    out, (c, s) = poses.copy(), (np.cos(turn), np.sin(turn))
    out[:, :3] = poses[:, :3] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) + shift
    out[:, 3] += turn
    return out


@pytest.mark.kernels
@given(turn=st.floats(-3, 3), shift=st.tuples(*[st.floats(-3, 3)] * 3))
@settings(max_examples=10, deadline=None)
def test_where_all_of_it_happens_does_not_matter(turn, shift):
    """Points and poses moved together cost the same, and are refined alike; only the shifts must act before the turns."""
    rng, body = np.random.default_rng(3), random_tree(3)
    R = rotation_about([0, 0, 1], turn)
    pose = some_pose(body, rng)
    points, normals, weights = scan(body, pose, rng, 12)
    poses = body.skeleton.clamp(pose + rng.normal(0, 0.04, (2, len(pose))))
    here, there = make_cloud(points, normals, weights), make_cloud(points @ R.T + shift, normals @ R.T, weights)
    elsewhere, of = moved_along(body, poses, turn, shift), Refiner(body)
    np.testing.assert_allclose(of.costs(elsewhere, there), of.costs(poses, here), rtol=1e-3, atol=1e-8)
    held = np.zeros(len(pose))
    found = [of.gauss_newton(some, ((cloud, 2, 0.06),), some, held) for some, cloud in ((poses, here), (elsewhere, there))]
    np.testing.assert_allclose(moved_along(body, found[0], turn, shift), found[1], atol=1e-2)  # a point between two parts may change
    forced = [of.forces(some, cloud, ForceSettings(iterations=3)) for some, cloud in ((poses, here), (elsewhere, there))]
    np.testing.assert_allclose(moved_along(body, forced[0], turn, shift), forced[1], atol=2e-3)


@pytest.mark.kernels
@given(seed=st.integers(0, 2**31), pull=st.sampled_from([0.0, 1e-5, 1e-2]), iterations=st.integers(0, 4))
@settings(max_examples=15, deadline=None)
def test_gauss_newton_never_raises_what_it_minimises_and_keeps_limits(seed, pull, iterations):
    rng, body = np.random.default_rng(seed), random_tree(seed % 7)
    pose = some_pose(body, rng)
    points, normals, weights = scan(body, pose, rng, 10)
    cloud = make_cloud(points + rng.normal(0, 0.02, points.shape), normals, weights)
    poses = body.skeleton.clamp(pose + rng.normal(0, 0.5, (2, len(pose))))
    of, centre = Refiner(body, SURFACE), pose + rng.normal(0, 0.1, len(pose))
    found = of.gauss_newton(poses, ((cloud, iterations, 0.06),), centre, np.full(len(pose), pull), 1e-4)  # hardly held back at first

    def held(poses):
        return of.costs(poses, cloud, 0.06) + pull * ((poses - centre) ** 2).sum(1)

    assert (held(found) <= held(poses) + 1e-12).all()
    np.testing.assert_array_equal(found, body.skeleton.clamp(found))
    assert np.isfinite(found).all()
    forced = of.forces(poses, cloud, ForceSettings(iterations=iterations))
    np.testing.assert_array_equal(forced, body.skeleton.clamp(forced))
    if iterations == 0:
        np.testing.assert_array_equal(found, poses)
        np.testing.assert_array_equal(forced, poses)


@pytest.mark.kernels
def test_a_step_that_makes_it_worse_is_not_taken():
    """Hardly held back and far off, some first steps go wrong: the pose is then as it was."""
    refused = 0
    for seed in range(40):
        rng, body = np.random.default_rng(seed), random_tree(seed % 7)
        pose, of = some_pose(body, rng), Refiner(body)
        cloud = make_cloud(*scan(body, pose, rng, 10))
        start = body.skeleton.clamp((pose + rng.normal(0, 0.6, len(pose)))[None])
        found = of.gauss_newton(start, ((cloud, 1, 0.06),), start, np.zeros(len(pose)), 1e-6)
        refused += np.array_equal(found, start)
        assert of.costs(found, cloud, 0.06) <= of.costs(start, cloud, 0.06)
    assert 0 < refused < 40


@pytest.mark.kernels
def test_poses_that_are_given_are_not_written_over(seen):
    body, pose, *cloud = seen
    kept, made = pose[None].copy(), make_cloud(*cloud)
    of = Refiner(body)
    of.gauss_newton(kept, ((made, 2, 0.06),), kept, np.zeros(len(pose)))
    of.forces(kept, made, ForceSettings(iterations=2))
    of.costs(kept, made)
    np.testing.assert_array_equal(kept[0], pose)


@pytest.mark.kernels
def test_room_that_is_used_again_remembers_nothing(seen, rng):
    """The same question has the same answer, to the last bit, whatever was asked before."""
    body, pose, *cloud = seen
    made, other = make_cloud(*cloud), make_cloud(*(part[::3] + 0.01 for part in cloud))
    of, held = Refiner(body), np.full(len(pose), 1e-5)

    def answers():
        return of.costs(pose[None], made), of.gauss_newton(pose[None], ((made, 3, 0.05),), pose, held), of.forces(
            pose[None], made, ForceSettings(iterations=3))

    first = answers()
    of.gauss_newton(pose[None] + 0.1, ((other, 2, 0.05),), pose, held)
    of.forces(pose[None] - 0.1, other, ForceSettings(iterations=2, rho="none"))
    for before, after in zip(first, answers()):
        np.testing.assert_array_equal(before, after)


@pytest.mark.kernels
def test_poses_are_refined_alike_on_any_number_of_cores(seen, rng, monkeypatch):
    body, pose, *cloud = seen
    of, made = Refiner(body), make_cloud(*cloud)
    poses = body.skeleton.clamp(pose + rng.normal(0, 0.1, (19, len(pose))))
    found = []
    for limit in ("1", "3"):
        monkeypatch.setenv(THREADS_VARIABLE, limit)
        found.append((of.costs(poses, made), of.forces(poses, made, ForceSettings(iterations=3)),
                      of.gauss_newton(poses, ((made, 3, 0.05),), poses, np.full(len(pose), 1e-5))))
    for one, three in zip(*found, strict=True):
        np.testing.assert_array_equal(one, three)


@pytest.mark.kernels
def test_without_points_poses_stay_or_follow_their_pull(rng):
    body = random_tree()
    pose, nothing = some_pose(body, rng), make_cloud(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    of, centre = Refiner(body), body.skeleton.clamp((pose + 0.05)[None])[0]
    np.testing.assert_array_equal(of.costs(pose[None], nothing), 0)
    np.testing.assert_array_equal(of.forces(pose[None], nothing, ForceSettings())[0], pose)
    stays = of.gauss_newton(pose[None], ((nothing, 4, 0.05),), centre, np.zeros(len(pose)))
    np.testing.assert_array_equal(stays[0], pose)
    pulled = of.gauss_newton(pose[None], ((nothing, 10, 0.05),), centre, np.full(len(pose), 1e-3))
    np.testing.assert_allclose(pulled[0], centre, atol=1e-4)


@pytest.mark.kernels
def test_what_points_do_not_tell_is_left_to_the_pull():
    """How a round straight part is turned about itself."""
    skeleton = Skeleton((Joint("bone", None),), tuple(Dof(f"turn_{axis}", "bone", axis) for axis in "xyz"))
    body = SimpleNamespace(name="bone", skeleton=skeleton, limbs=naive_limbs.one_limb(start=(0.1, 0.1), end=(0.07, 0.07)))
    rng = np.random.default_rng(0)
    points, normals, weights = scan(body, np.array([0.2, -0.1, 0.0]), rng, 200)
    of, start = Refiner(body), np.array([[0.1, 0.0, 1.0]])
    free = of.gauss_newton(start, ((make_cloud(points, normals, weights), 10, 0.05),), start, np.full(3, 1e-9))
    held = of.gauss_newton(start, ((make_cloud(points, normals, weights), 10, 0.05),), np.array([0.1, 0.0, 0.4]), np.full(3, 1e-6))
    assert free[0, 2] == pytest.approx(1.0, abs=0.2)
    assert held[0, 2] == pytest.approx(0.4, abs=0.05)


@pytest.mark.kernels
def test_another_tau_bounds_costs_elsewhere(seen):
    body, pose, *cloud = seen
    made, of = make_cloud(*cloud), Refiner(body, SurfaceSettings(tau=0.05))
    costs = [of.costs(pose[None], made, tau)[0] for tau in (0.01, 0.03, 0.05, 0.5)]
    assert costs == sorted(costs)
    assert costs[2] == of.costs(pose[None], made)[0] != costs[3]
    assert costs[0] < 1e-4


@pytest.mark.kernels
def test_what_cannot_be_refined_is_said():
    cardbox = make_named("cardbox", average_sizes("cardbox", 1.7))
    with pytest.raises(ShadowPuppetError, match=r"body 'cardbox': found no limbs on a tree of joints"):
        Refiner(cardbox)
    of, nothing = Refiner(random_tree()), make_cloud(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    for attempt in (lambda: of.costs(np.zeros((1, 3)), nothing), lambda: of.forces(np.zeros(16), nothing, ForceSettings()),
                    lambda: of.gauss_newton(np.zeros((1, 3)), (), np.zeros(16), np.zeros(16))):  # fmt: skip
        with pytest.raises(ShadowPuppetError, match=r"poses have shape .*, expected \(N, 16\)"):
            attempt()


# A whole person -------------------------------------------------------------------------------------------------------


def beside(name: str, rng: np.random.Generator, number: int = 4):
    """A pose, its surface's points, and poses beside it."""
    of = actor.body(name)
    pose = actor.stance(of.skeleton)
    starts = of.skeleton.clamp(pose + rng.normal(0, 0.07, (number, len(pose))))
    return of, pose, actor.cloud_of(actor.surface(of, pose, rng, 30)), starts


@pytest.mark.parametrize("name", WHOLE)
def test_gauss_newton_finds_the_pose_from_near(name, rng):
    of, pose, cloud, starts = beside(name, rng)
    found = Refiner(of).gauss_newton(starts, ((cloud, 12, 0.06),), starts, np.full(len(pose), 1e-7))
    assert actor.apart(of, starts, pose).min() > 0.05
    assert np.median(actor.apart(of, found, pose)) < 2e-3
    assert (actor.apart(of, found, pose) < actor.apart(of, starts, pose)).all()  # one of them ends in a minimum of its own


@pytest.mark.parametrize("chosen", [{}, {"modulated": False}, {"rho": "none"}, {"rho": "quadratic"}], ids=str)
@pytest.mark.parametrize("name", WHOLE)
def test_forces_find_the_pose_from_near(name, chosen, rng):
    of, pose, cloud, starts = beside(name, rng)
    few, many = (Refiner(of).forces(starts, cloud, ForceSettings(iterations=n, **chosen)) for n in (10, 80))
    start, soon, end = (actor.apart(of, poses, pose).mean() for poses in (starts, few, many))
    assert end < soon < start
    assert end < 0.35 * start


@pytest.mark.parametrize("name", WHOLE)
def test_forces_do_better_where_joints_feel_all_that_hangs_on_them(name, rng):
    """Without the sum over what hangs on a joint poses get better too, but not as good (Ni 2008, eqs. 38-40)."""
    of, _, cloud, starts = beside(name, rng)
    start = Refiner(of).costs(starts, cloud).mean()
    sums, own = (Refiner(of).costs(Refiner(of).forces(starts, cloud, ForceSettings(iterations=20, hierarchical=choice)), cloud).mean()
                 for choice in (True, False))
    assert 2 * sums < own < 0.6 * start


def test_forces_are_bounded_and_go_by_the_normals_only_if_wanted():
    """A bone that can only be shifted, points above it, half of them with normals that point down at it."""
    skeleton = Skeleton((Joint("bone", None),), (Dof("up", "bone", "z", kind="translation"),))
    level = naive_limbs.one_limb(length=1.0, rotation=[[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    body = SimpleNamespace(name="bone", skeleton=skeleton, limbs=level)
    x = np.linspace(0.2, 0.8, 16)
    points = np.column_stack([x, 0 * x, np.full(16, 0.1 + 0.2)])
    normals = np.tile([0.0, 0.0, 1.0], (16, 1)) * np.where(np.arange(16) % 2, 1, -1)[:, None]
    cloud, of = make_cloud(points, normals, np.ones(16)), Refiner(body)

    def rise(**chosen) -> float:
        return of.forces(np.zeros((1, 1)), cloud, ForceSettings(iterations=1, fine_tau=0.08, **chosen))[0, 0]

    assert rise(rho="none", modulated=False) == pytest.approx(0.2, abs=1e-4)
    assert rise(rho="none") == pytest.approx(0.1, abs=1e-4)  # those that look down do not pull
    assert rise(modulated=False) == pytest.approx(0.08, abs=1e-4)
    assert rise() == pytest.approx(0.04, abs=1e-4)
    assert rise(translation=0.5) == pytest.approx(0.02, abs=1e-4)
    assert rise(modulated=False, rho="quadratic") == pytest.approx(0.08, abs=1e-4)  # of a distance of 0.2 m, over the bound

    points[:, 2] = 0.1 + 0.04
    cloud = make_cloud(points, normals, np.ones(16))
    assert rise(modulated=False) == pytest.approx(0.04, abs=1e-4)
    assert rise(modulated=False, rho="quadratic") == pytest.approx(0.04**2 / 0.08, abs=1e-4)


@pytest.mark.parametrize("name", WHOLE)
def test_forces_that_balance_move_nothing_more(name, rng):
    """The iterations end where a step is less than `balance`, and so nearer for a smaller one; a larger limit changes nothing then."""
    of, _, cloud, starts = beside(name, rng)
    none, some, more, nearer = (Refiner(of).forces(starts, cloud, ForceSettings(iterations=n, balance=balance))
                                for n, balance in ((60, 10.0), (60, 0.02), (600, 0.02), (600, 0.002)))
    first = Refiner(of).forces(starts, cloud, ForceSettings(iterations=2, balance=0.0))
    np.testing.assert_array_equal(none, first)  # an iteration with each bound is the least
    np.testing.assert_array_equal(some, more)
    again = Refiner(of).forces(nearer, cloud, ForceSettings(iterations=1, balance=0.0))
    assert np.abs(again - nearer).max() <= 0.002
    assert np.abs(nearer - some).max() > 0.01


def test_the_bound_of_the_forces_is_coarse_first_and_fine_at_last():
    """A bone and points 0.3 m above it: each iteration lifts it by the bound."""
    skeleton = Skeleton((Joint("bone", None),), (Dof("up", "bone", "z", kind="translation"),))
    level = naive_limbs.one_limb(length=1.0, rotation=[[0, 0, 1], [0, 1, 0], [-1, 0, 0]])
    body = SimpleNamespace(name="bone", skeleton=skeleton, limbs=level)
    points = np.column_stack([np.linspace(0.2, 0.8, 16), np.zeros(16), np.full(16, 0.1 + 0.3)])
    cloud = make_cloud(points, np.tile([0.0, 0.0, 1.0], (16, 1)), np.ones(16))
    rises = [Refiner(body).forces(np.zeros((1, 1)), cloud, ForceSettings(iterations=n, coarse_tau=0.08, fine_tau=0.01))[0, 0]
             for n in (1, 2, 3, 4)]
    np.testing.assert_allclose(rises, [0.01, 0.09, 0.1, 0.18], atol=1e-4)


def test_points_that_are_nobody_s_do_not_draw_a_pose_away(rng):
    of, pose, _, starts = beside("anatomical", rng)
    own = actor.surface(of, pose, rng, 30)
    other = own.points + np.array([0.0, 0.0, 0.4]), own.normals[rng.permutation(len(own.normals))]
    cloud = make_cloud(np.concatenate([own.points, other[0][::5]]), np.concatenate([own.normals, other[1][::5]]),
                       np.ones(len(own.points) + len(other[0][::5])))
    found = Refiner(of).gauss_newton(starts, ((cloud, 12, 0.06),), starts, np.full(len(pose), 1e-7))
    assert np.median(actor.apart(of, found, pose)) < 0.02


def test_all_stages_of_clouds_are_worked_through(rng):
    of, pose, cloud, starts = beside("anatomical", rng)
    made, held = Refiner(of), np.full(len(pose), 1e-7)
    few = make_cloud(*actor.surface(of, pose, rng, 8)[:3])
    at_once = made.gauss_newton(starts, ((few, 3, 0.08), (cloud, 5, 0.05)), starts, held)
    in_turn = made.gauss_newton(made.gauss_newton(starts, ((few, 3, 0.08),), starts, held), ((cloud, 5, 0.05),), starts, held)
    np.testing.assert_array_equal(at_once, in_turn)
    assert made.costs(at_once, cloud).mean() < 0.3 * made.costs(starts, cloud).mean()
