"""Rotations, rigid transforms, alignment and Euler angles: group laws, both directions of every conversion, nothing nearby is better."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.spatial.transform import Rotation

from shadowpuppet.geometry import (
    ORDERS,
    align,
    clear_order,
    continuous_angles,
    inverse,
    rigid,
    rotation_about,
    rotation_from_vector,
    shortest_rotation,
    transform,
    unit,
    vector_from_rotation,
)

angles = st.floats(-10, 10)
vectors = arrays(float, 3, elements=st.floats(-3, 3))
short_vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)
AXES = np.eye(3)


@given(vectors)
def test_rotations_are_orthonormal_and_right_handed(vector):
    R = rotation_from_vector(vector)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(R) == pytest.approx(1)


@given(vectors)
def test_a_rotation_keeps_its_axis_and_turns_by_its_angle(vector):
    R = rotation_from_vector(vector)
    np.testing.assert_allclose(R @ vector, vector, atol=1e-12)
    assert np.trace(R) == pytest.approx(1 + 2 * math.cos(np.linalg.norm(vector)))


def test_turning_is_by_the_right_hand():
    for i in range(3):
        np.testing.assert_allclose(rotation_about(AXES[i], math.pi / 2) @ AXES[(i + 1) % 3], AXES[(i + 2) % 3], atol=1e-15)


@given(angles, angles)
def test_rotations_about_one_axis_add(a, b):
    axis = np.array([2.0, -3.0, 6.0]) / 7
    np.testing.assert_allclose(rotation_about(axis, a) @ rotation_about(axis, b), rotation_about(axis, a + b), atol=1e-12)


def test_the_shortest_rotation_turns_one_direction_to_the_other_and_keeps_their_common_normal(rng):
    start, end = unit(rng.standard_normal((2, 50, 3)))
    R, normal = shortest_rotation(start, end, 1e-9), unit(np.cross(start, end))
    np.testing.assert_allclose((R @ start[..., None])[..., 0], end, atol=1e-9)
    np.testing.assert_allclose((R @ normal[..., None])[..., 0], normal, atol=1e-9)
    np.testing.assert_allclose(shortest_rotation(start[0], end[:2], 1e-9)[0], R[0], atol=1e-12)
    np.testing.assert_array_equal(shortest_rotation(start, start, 1e-9), np.broadcast_to(np.eye(3), (50, 3, 3)))


def test_rotations_are_batched_over_angles(rng):
    batch = rng.uniform(-4, 4, (5, 2))
    R = rotation_about(AXES[2], batch)
    assert R.shape == (5, 2, 3, 3)
    np.testing.assert_array_equal(R[3, 1], rotation_about(AXES[2], batch[3, 1]))


@given(arrays(float, 3, elements=st.floats(-1, 1)).filter(lambda v: np.linalg.norm(v) > 1e-3),
       st.sampled_from([0.0, 1e-12, 1e-6, 0.3, 2.0, math.pi - 1e-6, math.pi - 1e-9, math.pi]))
def test_vectors_come_back_from_matrices_up_to_half_a_turn(direction, angle):
    vector = direction / np.linalg.norm(direction) * angle
    found = vector_from_rotation(rotation_from_vector(vector))
    away = min(np.abs(found - vector).max(), np.abs(found + vector).max() if angle == math.pi else np.inf)
    assert away < 1e-12


@given(vectors, vectors, vectors, vectors, arrays(float, (4, 3), elements=st.floats(-10, 10)))
def test_rigid_transforms_are_a_group_that_acts_on_points(v1, t1, v2, t2, points):
    A, B = rigid(rotation_from_vector(v1), t1), rigid(rotation_from_vector(v2), t2)
    np.testing.assert_allclose(transform(A, transform(B, points)), transform(A @ B, points), atol=1e-11)
    np.testing.assert_allclose(inverse(A) @ A, np.eye(4), atol=1e-12)
    np.testing.assert_allclose(inverse(A @ B), inverse(B) @ inverse(A), atol=1e-12)


def test_transforms_are_batched(rng):
    R, t = rotation_about(AXES[0], rng.uniform(-3, 3, 6)), rng.normal(size=(6, 3))
    T = rigid(R, t)
    np.testing.assert_allclose(inverse(T) @ T, np.broadcast_to(np.eye(4), (6, 4, 4)), atol=1e-12)
    assert rigid(np.eye(3), t).shape == (6, 4, 4)
    assert transform(T[0], np.zeros((2, 5, 3))).shape == (2, 5, 3)


# Alignment ------------------------------------------------------------------------------------------------------------


@given(st.integers(0, 10**6), short_vectors, short_vectors, st.floats(0.2, 4))
def test_a_rigid_motion_with_a_scale_is_found_again(seed, vector, shift, scale):
    points = np.random.default_rng(seed).normal(size=(7, 3))
    R = rotation_from_vector(vector)
    found = align(points, scale * points @ R.T + shift, scaled=True)
    np.testing.assert_allclose(found.rotation, R, atol=1e-7)
    np.testing.assert_allclose(found.translation, shift, atol=1e-7)
    assert found.scale == pytest.approx(scale)
    np.testing.assert_allclose(found.apply(points), scale * points @ R.T + shift, atol=1e-7)


@given(st.integers(0, 10**6), short_vectors, short_vectors)
def test_no_other_rigid_motion_is_nearer(seed, vector, shift):
    rng = np.random.default_rng(seed)
    points, targets = rng.normal(size=(2, 6, 3))
    found = align(points, targets)
    other = points @ (rotation_from_vector(0.1 * vector) @ found.rotation).T + found.translation + 0.05 * shift
    assert ((found.apply(points) - targets) ** 2).sum() <= ((other - targets) ** 2).sum() + 1e-9
    scaled = align(points, targets, scaled=True)
    assert ((scaled.apply(points) - targets) ** 2).sum() <= ((found.apply(points) - targets) ** 2).sum() + 1e-9


def test_a_mirror_image_is_turned_not_mirrored(rng):
    points = rng.normal(size=(8, 3))
    found = align(points, points * [-1, 1, 1])
    assert np.linalg.det(found.rotation) == pytest.approx(1)
    assert np.abs(found.apply(points) - points * [-1, 1, 1]).max() > 0.1


def test_each_frame_is_its_own_and_what_is_unknown_does_not_count(rng):
    points = rng.normal(size=(4, 6, 3))
    R = rotation_from_vector([0.3, 0.2, 1])
    targets = points @ R.T + rng.normal(size=(4, 1, 3))
    targets[1, 2], points[1, 4], targets[2, :4] = np.nan, np.nan, np.nan
    found = align(points, targets)
    for n in (0, 1, 3):
        known = np.isfinite(points[n] + targets[n]).all(1)
        alone = align(points[n][known], targets[n][known])
        np.testing.assert_allclose(found.rotation[n], alone.rotation, atol=1e-12)
        np.testing.assert_allclose(found.apply(points)[n][known], targets[n][known], atol=1e-12)
    assert np.isnan(found.apply(points)[2]).all()  # two points tell no rotation


# Euler angles ---------------------------------------------------------------------------------------------------------


def made(order: str, angles) -> np.ndarray:
    return Rotation.from_euler(order, angles).as_matrix()  # capitals: about the axes as turned before


@settings(max_examples=60, deadline=None)
@given(order=st.sampled_from(ORDERS), seed=st.integers(0, 10_000), frames=st.integers(1, 12))
def test_angles_make_the_rotations_again(order, seed, frames):
    R = Rotation.random(frames, random_state=np.random.default_rng(seed)).as_matrix()
    np.testing.assert_allclose(made(order, continuous_angles(R, order)), R, atol=1e-9)


@pytest.mark.parametrize("order", ORDERS)
def test_angles_that_were_continuous_come_back_even_beyond_a_turn_and_a_quarter(order):
    t = np.linspace(0, 1, 200)[:, None]
    angles = t * [9.0, -2.6, 5.0] + [0.2, 0.1, -0.4]  # the second passes -90 degrees between frames, the others go around
    found = continuous_angles(made(order, angles), order)
    np.testing.assert_allclose(np.diff(found, axis=0), np.diff(angles, axis=0), atol=1e-9)
    assert np.abs(np.diff(found, axis=0)).max() < 0.06


@pytest.mark.parametrize("order", ORDERS)
@pytest.mark.parametrize("quarter", [np.pi / 2, -np.pi / 2])
def test_in_the_singular_posture_the_first_angle_stays(order, quarter):
    angles = np.array([[0.5, 0.9 * quarter, 0.3]] + [[0.5, quarter, 0.3 + 0.1 * n] for n in range(4)])
    found = continuous_angles(made(order, angles), order)
    np.testing.assert_allclose(found, angles, atol=1e-6)


def test_limits_choose_between_the_two_triples():
    angles = np.tile([2.8, 0.3, 2.9], (20, 1)) + 0.01 * np.arange(20)[:, None]
    R = made("ZXY", angles)
    wide = np.radians([[90, 270], [-60, 60], [90, 270]])
    np.testing.assert_allclose(continuous_angles(R, "ZXY", wide), angles, atol=1e-9)
    narrow = np.radians([[-90, 90], [-200, 200], [-90, 90]])
    np.testing.assert_allclose(continuous_angles(R, "ZXY", narrow), angles * [1, -1, 1] + [-np.pi, np.pi, -np.pi], atol=1e-9)


def test_the_usual_order_is_kept_where_it_is_clear_and_left_where_it_is_not():
    calm = made("ZXY", np.radians([[10, 20, 30], [170, -40, 90.0]]))
    assert clear_order(calm) == "ZXY"
    raised = made("XYZ", np.radians([[a, 3, 2] for a in range(0, 180, 5)]))  # a limb that swings forward through a quarter about x
    assert clear_order(raised) != "ZXY"
    steps = np.abs(np.diff(continuous_angles(raised, clear_order(raised)), axis=0)).max()
    assert steps < np.radians(6)
