"""Surface points and the parts nearest to them: kernels beside the plain version and brute force; how points are put into groups."""

from __future__ import annotations

import naive_limbs
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from benchmarks.speed import naive_multi as naive
from shadowpuppet.body.shapes import Limbs
from shadowpuppet.tracking.multiview.refinement.correspondence import (
    FAR,
    LANES,
    PART_NUMBERS,
    Cloud,
    closest_on_part,
    make_cloud,
    nearest,
    part_constants,
    place_parts,
)

pytestmark = pytest.mark.kernels
seeds = st.integers(0, 2**31)
ORIGIN = np.array([0.3, -0.2, 0.9])


def unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)


def some_points(rng: np.random.Generator, count: int, around=0.0, reach: float = 0.5) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    return around + rng.uniform(-reach, reach, (count, 3)), unit(rng.normal(size=(count, 3))), rng.uniform(0.3, 1, count)


def placed(limbs: Limbs, T: np.ndarray, origin: np.ndarray) -> np.ndarray:
    parts = part_constants(limbs)
    place_parts(T, origin, limbs.joints, np.ascontiguousarray(limbs.rotations), np.ascontiguousarray(limbs.starts), parts)
    return parts


def taken(cloud: Cloud, first: int, count: int = 1) -> np.ndarray:
    """Some of the rows of all points, in the cloud's order, of shape (G LANES, count)."""
    rows = cloud.rows.reshape(len(cloud.rows), 7, LANES)[:, first : first + count]
    return rows.transpose(0, 2, 1).reshape(-1, count).astype(float)


def measured(part: np.ndarray, cloud: Cloud) -> np.ndarray:
    """What `measure` says of all points, of shape (G LANES, 8)."""
    out = np.zeros(8 * LANES, np.float32)
    every = []
    for rows in cloud.rows:
        closest_on_part(part, rows, out)
        every.append(out.reshape(8, LANES).T.copy())
    return np.concatenate(every).astype(float)


def joint_frames(rng: np.random.Generator, count: int) -> np.ndarray:
    T = np.tile(np.eye(4), (count, 1, 1))
    T[:, :3, :3] = Rotation.random(count, random_state=int(rng.integers(2**31))).as_matrix()
    T[:, :3, 3] = ORIGIN + rng.uniform(-0.3, 0.3, (count, 3))
    return T


# Clouds ---------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("count", [0, 1, LANES - 1, LANES, LANES + 1, 5 * LANES + 3])
def test_a_cloud_has_every_point_once_with_its_normal_and_weight(count, rng):
    points, normals, weights = some_points(rng, count, ORIGIN)
    cloud = make_cloud(points, normals, weights)
    found = np.concatenate([taken(cloud, 0, 3) + cloud.origin, taken(cloud, 3, 4)], 1)
    assert len(found) % LANES == 0
    kept = found[found[:, 6] > 0]
    wanted = np.column_stack([points, normals, weights])
    np.testing.assert_allclose(kept[np.lexsort(kept.T)], wanted[np.lexsort(wanted.T)], atol=1e-6)
    assert cloud.total == pytest.approx(weights.sum(), rel=1e-6)
    assert np.isfinite(cloud.rows).all()
    if count:
        np.testing.assert_allclose(cloud.origin, points.mean(0))


def test_spheres_hold_their_groups(rng):
    cloud = make_cloud(*some_points(rng, 333, ORIGIN))
    places = taken(cloud, 0, 3).reshape(-1, LANES, 3)
    away = np.linalg.norm(places - cloud.spheres[:, None, :3], axis=2)
    assert (away <= cloud.spheres[:, 3:] + 1e-6).all()
    assert (away.max(1) > 0.99 * cloud.spheres[:, 3]).all()


def test_groups_lie_close_together(rng):
    points, normals, weights = some_points(rng, 2000)
    radius = make_cloud(points, normals, weights).spheres[:, 3]
    by_chance = [np.linalg.norm(some - (some.min(0) + some.max(0)) / 2, axis=1).max() for some in points.reshape(-1, LANES, 3)]
    assert np.median(radius) < 0.4 * np.median(by_chance)


def test_points_are_counted_from_the_origin_that_is_given(rng):
    """Metres from an origin near them: single precision is then good for a micrometre even far from the world's own."""
    far = np.array([1e4, -1e4, 50.0])
    points, normals, weights = some_points(rng, 40)
    here, there = make_cloud(points, normals, weights, np.zeros(3)), make_cloud(points + far, normals, weights, far)
    np.testing.assert_allclose(taken(here, 0, 3), taken(there, 0, 3), atol=1e-6)


# One part -------------------------------------------------------------------------------------------------------------


@given(seed=seeds)
@settings(max_examples=15, deadline=None)
def test_distances_feet_and_normals_are_those_of_the_plain_version(seed):
    rng = np.random.default_rng(seed)
    limbs, T = naive_limbs.random_limbs(rng, [0]), joint_frames(rng, 1)
    cloud = make_cloud(*some_points(rng, 4 * LANES, T[0, :3, 3], 0.4), ORIGIN)
    points, normals = taken(cloud, 0, 3) + ORIGIN, taken(cloud, 3, 3)
    R = T[0, :3, :3] @ limbs.rotations[0]
    found, plain = measured(placed(limbs, T, ORIGIN)[0], cloud), naive.closest(limbs, 0, T[0], points)
    np.testing.assert_allclose(found[:, 0], plain.distance, atol=2e-5)
    start = T[0, :3, :3] @ limbs.starts[0] + T[0, :3, 3]
    same = np.linalg.norm(found[:, 2:5] @ R.T + start - plain.feet, axis=1) < 1e-4
    assert same.mean() > 0.96  # where two places are as near, either may be said
    np.testing.assert_allclose(found[same, 5:] @ R.T, plain.normals[same], atol=2e-3)
    np.testing.assert_allclose(found[same, 1], (plain.normals * normals)[same].sum(1), atol=2e-3)


@given(seed=seeds)
@settings(max_examples=15, deadline=None)
def test_points_of_the_surface_are_at_no_distance_and_those_within_at_less(seed):
    rng = np.random.default_rng(seed)
    limbs = naive_limbs.random_limbs(rng, [0])
    part = placed(limbs, np.eye(4)[None], np.zeros(3))[0]
    own = naive_limbs.samples(limbs, 0, 0.05)

    def cloud_of(own: np.ndarray) -> Cloud:
        world = own @ limbs.rotations[0].T + limbs.starts[0]
        return make_cloud(world, np.tile([0.0, 0.0, 1.0], (len(own), 1)), np.ones(len(own)), np.zeros(3))

    assert np.quantile(np.abs(measured(part, cloud_of(own))[:, 0]), 0.98) < 1e-5
    off = cloud_of(own + rng.normal(0, 0.03, own.shape))
    distance = measured(part, off)[:, 0]
    away, _ = naive_limbs.brute(limbs, 0, (taken(off, 0, 3) - limbs.starts[0]) @ limbs.rotations[0], 0.005)
    sure = np.abs(away) > 4e-3
    np.testing.assert_array_equal(distance[sure] < 0, away[sure] < 0)
    assert np.median(np.abs(distance - away)[sure]) < 3e-3


@given(seed=seeds)
@settings(max_examples=20, deadline=None)
def test_a_part_lies_within_its_sphere(seed):
    """By which it is ruled out for far groups of points."""
    rng = np.random.default_rng(seed)
    limbs, T = naive_limbs.random_limbs(rng, [0, 1]), joint_frames(rng, 2)
    parts = placed(limbs, T, ORIGIN)
    assert parts.shape == (2, PART_NUMBERS)
    for s in range(2):
        surface = naive_limbs.samples(limbs, s, 0.03) @ limbs.rotations[s].T + limbs.starts[s]
        world = surface @ T[s, :3, :3].T + T[s, :3, 3] - ORIGIN
        assert np.linalg.norm(world - parts[s, 12:15], axis=1).max() <= parts[s, 15] + 1e-6
        np.testing.assert_allclose(parts[s, :9].reshape(3, 3).T, T[s, :3, :3] @ limbs.rotations[s], atol=1e-6)
        np.testing.assert_allclose(parts[s, 9:12], T[s, :3, :3] @ limbs.starts[s] + T[s, :3, 3] - ORIGIN, atol=1e-6)


# The nearest of several -----------------------------------------------------------------------------------------------


@given(seed=seeds, weights=st.sampled_from([(0.0, 0.0), (0.3, 0.3), (0.9, 0.9), (0.3, 0.0), (0.9, 0.0)]), first=st.integers(0, 5))
@settings(max_examples=25, deadline=None)
def test_the_nearest_part_is_the_nearest_of_all_whichever_is_tried_first(seed, weights, first):
    """By the distance that chooses: modulated by the normals, or the plain one of the paper."""
    epsilon, choice = weights
    rng = np.random.default_rng(seed)
    limbs, T = naive_limbs.random_limbs(rng, [0, 1, 2, 3, 4, 5]), joint_frames(rng, 6)
    on = [naive_limbs.samples(limbs, s, 0.1) @ limbs.rotations[s].T + limbs.starts[s] for s in range(6)]
    points = np.concatenate([one @ T[s, :3, :3].T + T[s, :3, 3] for s, one in enumerate(on)])[:: 5]
    points = points + rng.normal(0, 0.02, points.shape)
    cloud = make_cloud(points, unit(rng.normal(size=points.shape)), np.ones(len(points)), ORIGIN)
    parts = placed(limbs, T, ORIGIN)
    every = np.stack([measured(part, cloud) for part in parts])
    apart, modulated = (np.abs(every[..., 0]) * (1 - weight * every[..., 1]) for weight in (choice, epsilon))
    near = np.zeros(3 * LANES, np.float32)
    for group, (rows, sphere) in enumerate(zip(cloud.rows, cloud.spheres.astype(np.float32))):
        near[LANES : 2 * LANES] = first
        nearest(parts, rows, sphere, np.float32(epsilon), np.float32(choice), near)
        lanes = slice(group * LANES, (group + 1) * LANES)
        mine, which = apart[:, lanes], near[LANES : 2 * LANES].astype(int)
        close = mine.min(0) < 0.1  # distances are of first order: far off a flat dome's may be less than its sphere's
        np.testing.assert_allclose(near[2 * LANES :][close], mine.min(0)[close], atol=1e-5)
        np.testing.assert_allclose(near[:LANES], modulated[:, lanes][which, np.arange(LANES)], atol=1e-5)
        np.testing.assert_allclose(mine[which, np.arange(LANES)][close], mine.min(0)[close], atol=1e-5)
        assert (near[:LANES] < FAR).all()
