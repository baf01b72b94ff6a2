"""Sizes and poses solved together: the equations beside the plain version, and girths and bones found from a few made poses."""

from __future__ import annotations

from functools import cache

import actor
import numpy as np
import pytest
from scans import make_body as random_tree
from scans import scan, some_pose

from benchmarks.detector import EXACT, detected
from benchmarks.speed import naive_multi as naive
from shadowpuppet.body.anthropometry import SOLE
from shadowpuppet.body.models import WHOLE, average_sizes, shares_of
from shadowpuppet.body.sizes import AnatomicalSizes
from shadowpuppet.body.whole_body import anatomical
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.tracking.keypoints.definitions import landmarks_of
from shadowpuppet.tracking.keypoints.sights import Sights, sights_of
from shadowpuppet.tracking.multiview import bundle_adjustment
from shadowpuppet.tracking.multiview.bundle_adjustment import Deviations, solve_bundle
from shadowpuppet.tracking.multiview.refinement.correspondence import LANES, Cloud, make_cloud
from shadowpuppet.tracking.multiview.refinement.free_space import free_space
from shadowpuppet.tracking.multiview.settings import SurfaceSettings
from shadowpuppet.tracking.multiview.size_estimation import STATURE_KNOWN, known_stature

MEAN = actor.sizes()
NAMES = AnatomicalSizes.names()
SPREAD = 4 * np.array([shares_of(AnatomicalSizes)[name][1] * 1.72 for name in NAMES])
"""More than people differ, so that a few frames decide."""


@pytest.mark.kernels
@pytest.mark.parametrize("epsilon", [0.0, 0.3])
@pytest.mark.parametrize("seed", [1, 2])
def test_what_points_say_about_a_pose_is_what_the_plain_version_says(seed, epsilon):
    rng, body, surface = np.random.default_rng(seed), random_tree(seed), SurfaceSettings(epsilon=epsilon, tau=0.06)
    pose = some_pose(body, rng)
    points, normals, weights = scan(body, pose, rng, 15)
    points = points + rng.normal(0, 0.02, points.shape)
    frame = bundle_adjustment._equations(bundle_adjustment._model(body), [], pose, make_cloud(points, normals, weights), surface)
    H, g = naive.normal_equations(body, pose, points, normals, weights, surface)
    np.testing.assert_allclose(frame.rows, H, atol=2e-4 * np.abs(H).max())
    np.testing.assert_allclose(frame.gradient, g, atol=2e-4 * np.abs(g).max())
    assert frame.cost == pytest.approx(naive.cost(body, pose, points, normals, weights, surface), rel=2e-4)


def test_what_sizes_do_to_distances_is_their_derivative(rng):
    """Of a longer loin: what hangs on the chest rises, so that the points there are less far out along their normals."""
    body, settings, step = actor.body(), SurfaceSettings(), bundle_adjustment.SIZE_STEP
    pose, k = actor.stance(body.skeleton), NAMES.index("lumbar_height")
    seen = actor.surface(body, pose, rng, 20)
    cloud = make_cloud(seen.points + 0.005 * seen.normals, seen.normals, seen.weights)
    nudged = bundle_adjustment._nudged(anatomical, AnatomicalSizes, MEAN.to_array(), np.array([k]))
    frame = bundle_adjustment._equations(bundle_adjustment._model(body), nudged, pose, cloud, settings)
    near = np.zeros((len(cloud.rows), 3 * LANES), np.float32)
    _, here = bundle_adjustment._measured(bundle_adjustment._model(body), pose, cloud, settings, near, True)
    taller = anatomical(MEAN.with_values(lumbar_height=MEAN.lumbar_height + step))
    grows = (here[0] - bundle_adjustment._measured(bundle_adjustment._model(taller), pose, cloud, settings, near, False)[1][0]) / step
    nearest = near[:, LANES : 2 * LANES].ravel()
    arms = np.isin(nearest, [s for s, part in enumerate(body.parts) if part.endswith(("arm", "hand"))])
    legs = np.isin(nearest, [s for s, part in enumerate(body.parts) if part.endswith(("thigh", "shank", "foot"))])
    assert np.quantile(np.abs(grows - here[7])[arms], 0.75) < 0.05  # all but points of edges
    np.testing.assert_allclose(grows[legs], 0, atol=1e-6)
    assert frame.rows[-1, -1] == pytest.approx((here[1] * grows**2).sum() / cloud.total, rel=1e-3)
    assert frame.gradient[-1] == pytest.approx((here[1] * here[0] * grows).sum() / cloud.total, rel=1e-3)


@pytest.mark.kernels
@pytest.mark.parametrize("damping", [0.0, 0.1])
def test_a_step_is_that_of_all_equations_at_once(damping, rng):
    """Poses are eliminated, sizes solved for, poses found from these: as good as one great system of equations."""
    body, F, D, K = random_tree(), 3, 16, 4
    frames = []
    for _ in range(F):
        rows = rng.normal(size=(60, D + K))
        frames.append(bundle_adjustment._Frame(0.0, 0.0, rows.T @ rows / 60, 1e-3 * rng.normal(size=D + K)))
    poses = np.stack([some_pose(body, rng) for _ in range(F)])
    poses[:, body.skeleton.dof_names.index("flexion")] = 1.0
    start, pull, sizes = poses + 0.01 * rng.normal(size=poses.shape), rng.uniform(0, 0.1, poses.shape), rng.normal(size=6)
    free, tight, strain, scale = np.array([0, 2, 3, 5]), rng.uniform(0.1, 1, K), rng.normal(size=K), 1e3
    solution = bundle_adjustment._Solution((sizes, poses), 0.0, frames, scale * np.diag(tight), strain, body)
    found = bundle_adjustment._moved(solution, free, scale, start, pull, damping)
    A, b = np.zeros((F * D + K, F * D + K)), np.zeros(F * D + K)
    last = F * D + np.arange(K)
    for f, frame in enumerate(frames):
        at = np.concatenate([f * D + np.arange(D), last])
        A[np.ix_(at, at)] += frame.rows
        b[at] += frame.gradient
    A[last, last] += tight
    b[last] -= strain / scale
    A[range(F * D), range(F * D)] += pull.ravel()
    b[: F * D] -= (pull * (poses - start)).ravel()
    A[np.diag_indices_from(A)] *= 1 + damping
    step = np.linalg.solve(A, b)
    np.testing.assert_allclose(found[0][free], sizes[free] + step[F * D :], atol=1e-8)
    np.testing.assert_array_equal(found[0][[1, 4]], sizes[[1, 4]])
    np.testing.assert_allclose(found[1], poses + step[: F * D].reshape(F, D), atol=1e-8)


def test_a_step_that_makes_it_worse_is_not_taken(monkeypatch):
    """Whatever the equations say: here, the contrary."""
    near, clouds = shown()[2:]
    kept = bundle_adjustment._moved
    at_first = solve_bundle(anatomical, MEAN, SPREAD, near, clouds, rounds=0)

    def contrary(best, *rest):
        sizes, poses = kept(best, *rest)
        return 2 * best.at[0] - sizes, 2 * best.at[1] - poses

    monkeypatch.setattr(bundle_adjustment, "_moved", contrary)
    found = solve_bundle(anatomical, MEAN, SPREAD, near, clouds, rounds=4)
    assert found.sizes == at_first.sizes
    np.testing.assert_array_equal(found.poses, near)


# Somebody who is not average ------------------------------------------------------------------------------------------

BONES = {"thigh_length": 1.08, "upper_arm_length": 0.9, "hip_distance": 1.2}
GIRTHS = {"thigh_width": 1.2, "waist_depth": 1.3, "upper_arm_width": 1.15, "calf_width": 1.2}


@cache
def shown(frames: int = 3, noise: float = 0.003) -> tuple[AnatomicalSizes, np.ndarray, np.ndarray, list[Cloud]]:
    """True sizes and poses, poses beside these, and surface points."""
    rng, true = np.random.default_rng(5), actor.sizes(**BONES, **GIRTHS)
    body = anatomical(true)
    poses = actor.walk(body.skeleton, frames, 4.0)
    for joint in ("left_elbow", "right_elbow", "left_knee", "right_knee"):  # what a limb's length is shows where it bends
        poses[:, body.skeleton.dof_indices([f"{joint}_flexion"])] = rng.uniform(0.2, 1.5, (frames, 1))
    clouds = [actor.cloud_of(actor.surface(body, pose, rng, 30, noise)) for pose in poses]
    return true, poses, body.skeleton.clamp(poses + rng.normal(0, 0.04, poses.shape)), clouds


def off(found: AnatomicalSizes, names) -> np.ndarray:
    true = shown()[0]
    return np.array([abs(getattr(found, name) - getattr(true, name)) for name in names])


def test_girths_and_bones_are_found_with_the_poses():
    true, poses, near, clouds = shown()
    found = solve_bundle(anatomical, MEAN, SPREAD, near, clouds)
    every = (*BONES, *GIRTHS)
    assert (off(found.sizes, every) < 0.75 * off(MEAN, every)).all()
    assert off(found.sizes, every).sum() < 0.4 * off(MEAN, every).sum()
    body = anatomical(found.sizes)
    there = body.points(found.poses)
    before, truth = anatomical(MEAN).points(near), anatomical(true).points(poses)
    assert np.linalg.norm(there - truth, axis=2).mean() < 0.3 * np.linalg.norm(before - truth, axis=2).mean()
    assert found.residual < 0.008
    np.testing.assert_array_equal(found.poses, body.skeleton.clamp(found.poses))


def test_sizes_without_a_deviation_stay_as_they_are():
    _, _, near, clouds = shown()
    spread = np.where([name.endswith(("width", "depth")) for name in NAMES], SPREAD, 0.0)
    found = solve_bundle(anatomical, MEAN, spread, near, clouds, rounds=3)
    for name, wide in zip(NAMES, spread):
        assert (getattr(found.sizes, name) == getattr(MEAN, name)) == (wide == 0), name


def test_sizes_may_deviate_more_to_one_side_than_to_the_other():
    """Upper arms are shorter than expected, thighs longer."""
    near, clouds = shown()[2:]
    tight = 1e-3 * SPREAD
    smaller = solve_bundle(anatomical, MEAN, np.array([SPREAD, tight]), near, clouds)
    larger = solve_bundle(anatomical, MEAN, np.array([tight, SPREAD]), near, clouds)
    assert smaller.sizes.upper_arm_length < MEAN.upper_arm_length - 0.01
    assert larger.sizes.upper_arm_length == pytest.approx(MEAN.upper_arm_length, abs=1e-3)
    assert larger.sizes.thigh_length > MEAN.thigh_length + 0.01
    assert smaller.sizes.thigh_length == pytest.approx(MEAN.thigh_length, abs=1e-3)


def test_with_no_size_free_the_poses_alone_are_solved_for():
    true, poses, near, clouds = shown()
    found = solve_bundle(anatomical, true, np.zeros(len(NAMES)), near, clouds)
    assert found.sizes == true
    assert actor.apart(anatomical(true), found.poses, poses).mean() < 0.3 * actor.apart(anatomical(true), near, poses).mean()


def test_nothing_is_ever_made_worse_and_more_rounds_do_more():
    _, _, near, clouds = shown()
    residuals = [solve_bundle(anatomical, MEAN, SPREAD, near, clouds, rounds=rounds) for rounds in (0, 1, 4, 10)]
    np.testing.assert_array_equal(residuals[0].poses, near)
    assert residuals[0].sizes == MEAN

    def cost(found) -> float:
        of = bundle_adjustment._model(anatomical(found.sizes))
        frames = [bundle_adjustment._equations(of, [], pose, cloud, SurfaceSettings()) for pose, cloud in zip(found.poses, clouds)]
        strain = (found.sizes.to_array() - MEAN.to_array()) / SPREAD
        worth = bundle_adjustment.INDEPENDENT_POINTS / bundle_adjustment.POINT_NOISE**2
        return worth * (sum(f.cost for f in frames) + 1e-6 * ((found.poses - near) ** 2).sum()) + (strain**2).sum()

    costs = [cost(found) for found in residuals]
    assert costs[3] <= costs[2] <= costs[1] <= costs[0]
    assert costs[3] < 0.3 * costs[0]


def test_the_order_of_points_does_not_matter_and_the_same_question_has_the_same_answer(rng):
    body, poses = anatomical(MEAN), shown()[2][:1]
    seen = [actor.surface(body, pose, rng, 15, 0.01) for pose in poses]
    straight = [actor.cloud_of(one) for one in seen]
    mixed = []
    for one in seen:
        order = rng.permutation(len(one.points))
        mixed.append(make_cloud(one.points[order], one.normals[order], one.weights[order]))
    one, again, other = (solve_bundle(anatomical, MEAN, SPREAD, poses, some, rounds=3) for some in (straight, straight, mixed))
    assert one.sizes == again.sizes
    np.testing.assert_array_equal(one.poses, again.poses)
    np.testing.assert_allclose(other.sizes.to_array(), one.sizes.to_array(), atol=1e-3)
    np.testing.assert_allclose(other.poses, one.poses, atol=1e-2)


def test_what_is_expected_holds_where_the_frames_say_nothing():
    near, clouds = shown()[2:]
    nothing = make_cloud(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    found = solve_bundle(anatomical, MEAN, SPREAD, near[:2], [nothing, nothing])
    np.testing.assert_allclose(found.sizes.to_array(), MEAN.to_array(), atol=1e-9)
    np.testing.assert_array_equal(found.poses, near[:2])
    tight = solve_bundle(anatomical, MEAN, 1e-5 * SPREAD, near, clouds, rounds=4)
    np.testing.assert_allclose(tight.sizes.to_array(), MEAN.to_array(), atol=1e-4)


def test_sizes_may_begin_elsewhere_than_where_they_are_expected():
    true, _, near, clouds = shown()
    begun = solve_bundle(anatomical, MEAN, SPREAD, near, clouds, rounds=0, first=true)
    assert begun.sizes == true
    found = solve_bundle(anatomical, MEAN, SPREAD, near, clouds, first=true)
    assert off(found.sizes, GIRTHS).sum() < 0.4 * off(MEAN, GIRTHS).sum()


def test_deviations_that_sizes_share_are_those_of_their_covariance(rng):
    spread, shared = rng.uniform(0.01, 0.1, 7), rng.normal(0, 0.05, (2, 7))
    both = np.diag(spread**2) + shared.T @ shared
    np.testing.assert_allclose(Deviations(spread, shared).precision(0), np.linalg.inv(both))
    spread[[1, 4]] = 0
    found, free = Deviations(spread, shared).precision(0), np.flatnonzero(spread)
    both = np.diag(spread[free] ** 2) + shared[:, free].T @ shared[:, free]
    np.testing.assert_allclose(found[np.ix_(free, free)], np.linalg.inv(both))
    assert not found[[1, 4]].any()
    np.testing.assert_array_equal(Deviations(spread).precision(1), np.diag([0 if s == 0 else 1 / s**2 for s in spread]))
    assert Deviations(np.array([spread, 2 * spread])).precision(1)[0, 0] == Deviations(2 * spread).precision(0)[0, 0]


def test_a_known_sum_of_sizes_leaves_their_differences_free(rng):
    """Sizes with a known stature deviate as normal ones do whose sum is given: by Bayes' rule."""
    spread, row = rng.uniform(0.01, 0.1, 5), np.array([[1.0, 1.0, 0.0, 1.0, 0.0]])
    covariance = np.linalg.inv(Deviations(spread, sums=row / 1e-4).precision(0))
    free = np.diag(spread**2)
    given = free - free @ row.T @ np.linalg.inv(row @ free @ row.T) @ row @ free
    np.testing.assert_allclose(covariance, given, atol=1e-6)


@pytest.mark.parametrize("name", WHOLE)
def test_the_sizes_of_an_average_person_add_up_to_the_stature(name):
    sizes = average_sizes(name, 1.70)
    assert float((known_stature(sizes) @ sizes.to_array())[0]) * STATURE_KNOWN == pytest.approx(1.70 - SOLE, abs=0.01)


def test_whoever_is_taller_than_expected_is_taller_all_over():
    """Where sizes share a stature, few points suffice to move them together."""
    tall = anatomical(AnatomicalSizes.from_array(1.08 * MEAN.to_array()))
    poses, close = shown()[1], SPREAD / 8
    rng = np.random.default_rng(3)
    clouds = [actor.cloud_of(actor.surface(tall, pose, rng, 30, 0.003)) for pose in poses]
    alone = solve_bundle(anatomical, MEAN, close, poses, clouds, worth=1.0)
    together = solve_bundle(anatomical, MEAN, Deviations(close, 0.06 * MEAN.to_array()[None]), poses, clouds, worth=1.0)
    grown = [np.array([getattr(found.sizes, name) / getattr(MEAN, name) for name in ("thigh_length", "shank_length", "lumbar_height")])
             for found in (alone, together)]
    assert grown[1].min() > 1.05
    assert grown[0].max() < 1.03


@pytest.mark.kernels
def test_limbs_that_reach_out_of_silhouettes_cost_what_their_equations_say(rng):
    """The gradient in the pose and in the sizes beside numeric derivatives of the cost."""
    body, pose = actor.body(), actor.stance(actor.body().skeleton)
    space = free_space(list(zip(actor.cameras(3), actor.masks(body, pose, 3), strict=True)))
    other = body.skeleton.clamp((pose + rng.normal(0, 0.2, len(pose)))[None])[0]
    nothing, mean, origin = make_cloud(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)), MEAN.to_array(), np.zeros(3)
    free = np.array([NAMES.index(name) for name in ("thigh_length", "forearm_length", "thorax_height")])
    lengths = actor.limbs_of(anatomical(MEAN)).lengths

    def cost(at, sizes) -> float:
        model = bundle_adjustment._model(anatomical(AnatomicalSizes.from_array(sizes)), lengths)
        return float(bundle_adjustment._reaching(model, at, space, 2.0, origin)[8].sum())

    nudged = bundle_adjustment._nudged(anatomical, AnatomicalSizes, mean, free, lengths)
    model = bundle_adjustment._model(anatomical(MEAN), lengths)
    frame = bundle_adjustment._equations(model, nudged, other, nothing, SurfaceSettings(), space, 2.0)
    numeric = [(cost(other + step, mean) - cost(other - step, mean)) / 2e-3 for step in 1e-3 * np.eye(len(other))]
    numeric += [(cost(other, mean + step) - cost(other, mean - step)) / 2e-3 for step in 1e-3 * np.eye(len(mean))[free]]
    assert frame.cost == pytest.approx(cost(other, mean))
    assert np.linalg.norm(numeric) > 1e-4
    assert np.linalg.norm(np.array(numeric) + 2 * frame.gradient) < 0.15 * np.linalg.norm(numeric)


def test_bones_do_not_grow_into_empty_space_nor_shrink_for_one_camera():
    """Shanks without surface points, expected too long: silhouettes shorten them, but not a single silhouette that lacks a leg."""
    body, poses = anatomical(MEAN), actor.walk(actor.body().skeleton, 3, 4.0)
    rng, long = np.random.default_rng(4), MEAN.with_values(shank_length=1.2 * MEAN.shank_length)
    seen = [actor.surface(body, pose, rng, 30) for pose in poses]
    clouds = [make_cloud(each.points[high], each.normals[high], each.weights[high]) for each in seen for high in [each.points[:, 2] > 0.45]]
    masks = [actor.masks(body, pose, 3) for pose in poses]
    spread = np.where(np.array(NAMES) == "shank_length", 0.1, 0.0)

    def shank(expected, *emptiness) -> float:
        spaces = [free_space(list(zip(actor.cameras(3), row, strict=True))) for row in masks]
        return solve_bundle(anatomical, expected, spread, poses, clouds, pull=1.0, spaces=spaces, emptiness=emptiness[0]).sizes.shank_length

    assert shank(long, 0.0) > 1.15 * MEAN.shank_length
    assert shank(long, 2.0) < 1.12 * MEAN.shank_length
    for row in masks:
        row[0][np.flatnonzero(row[0].any(1))[-60:]] = False
    assert shank(MEAN, 2.0) > 0.98 * MEAN.shank_length


def test_sizes_stay_possible_whatever_the_points_say(rng):
    """A body is asked for only of sizes that a person may have."""
    _, _, near, clouds = shown()
    nobody = [make_cloud(cloud.origin + rng.normal(0, 0.02, (300, 3)), np.tile([0, 0, 1.0], (300, 1)), np.ones(300)) for cloud in clouds]
    try:
        found = solve_bundle(anatomical, MEAN, 20 * SPREAD, near, nobody)
    except ShadowPuppetError as error:
        pytest.fail(f"a size went out of range: {error}")
    assert np.abs(found.sizes.to_array() - MEAN.to_array()).max() <= bundle_adjustment.ROUNDS * bundle_adjustment.MAX_SIZE_STEP + 1e-9
    np.testing.assert_array_equal(found.poses, anatomical(found.sizes).skeleton.clamp(found.poses))


def test_no_step_is_longer_than_it_may_be(monkeypatch):
    """However far off the points are."""
    _, _, near, clouds = shown()
    far = [cloud._replace(origin=np.add(cloud.origin, (0.15, 0.0, 0.1))) for cloud in clouds]
    seen, kept = [], bundle_adjustment._moved

    def watched(best, *rest):
        sizes, poses = kept(best, *rest)
        seen.append((np.abs(sizes - best.at[0]).max(), np.abs(poses - best.at[1]).max()))
        return sizes, poses

    monkeypatch.setattr(bundle_adjustment, "_moved", watched)
    monkeypatch.setattr(bundle_adjustment, "MAX_SIZE_STEP", 0.002)
    monkeypatch.setattr(bundle_adjustment, "MAX_POSE_STEP", 0.02)
    solve_bundle(anatomical, MEAN, SPREAD, near, far, rounds=2)
    longest = np.max(seen, 0)
    np.testing.assert_allclose(longest, [0.002, 0.02], rtol=1e-6)


# Keypoints ------------------------------------------------------------------------------------------------------------


def sights_to(body, pose) -> Sights:
    marks = landmarks_of(body)
    points = body.skeleton.points(pose[None], marks.joints, marks.places)
    found = detected(np.random.default_rng(3), actor.cameras(), np.zeros(1), marks.names, points, EXACT)[0]
    return sights_of(actor.cameras(), found, (0,) * len(found), marks, points[0].mean(0))


def test_what_keypoints_say_of_pose_and_sizes_is_the_slope_of_their_cost():
    long, pose = anatomical(actor.sizes(thigh_length=1.05, forearm_length=0.95)), actor.stance(actor.body().skeleton, 0.3)
    sights, worth, K = sights_to(long, pose + 0.02), 2.0, [NAMES.index(name) for name in ("thigh_length", "forearm_length")]
    empty, values = bundle_adjustment._Frame(0.0, 0.0, np.zeros((34, 34)), np.zeros(34)), MEAN.to_array()

    def at(pose, values):
        model = bundle_adjustment._model(anatomical(AnatomicalSizes.from_array(values)))
        nudged = bundle_adjustment._nudged(anatomical, AnatomicalSizes, values, np.array(K))
        return bundle_adjustment._sighted(empty, model, nudged, pose, sights, worth)

    found, step = at(pose, values), 1e-5
    slopes = [(at(pose + step * row, values).cost - at(pose - step * row, values).cost) / (2 * step) for row in np.eye(32)]
    slopes += [(at(pose, values + step * row).cost - at(pose, values - step * row).cost) / (2 * step) for row in np.eye(len(NAMES))[K]]
    np.testing.assert_allclose(-2 * found.gradient, slopes, rtol=0.02, atol=0.02 * np.abs(slopes).max())


def test_bones_are_those_that_keypoints_show():
    true = actor.sizes(thigh_length=1.08, upper_arm_length=0.94)
    poses = actor.walk(anatomical(true).skeleton, 3)
    nothing = make_cloud(np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0))
    rays = [(sights_to(anatomical(true), pose), 2e-6) for pose in poses]
    alone, found = (solve_bundle(anatomical, MEAN, SPREAD, poses, [nothing] * 3, rays=seen).sizes for seen in ((), rays))
    assert alone == MEAN
    for name in ("thigh_length", "upper_arm_length", "shank_length"):
        assert getattr(found, name) == pytest.approx(getattr(true, name), abs=0.006)
