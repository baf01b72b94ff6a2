"""Rotations and rigid transforms: group laws, and both directions of every conversion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from shadowpuppet.geometry import inverse, rigid, rotation_about, rotation_from_vector, transform, vector_from_rotation

angles = st.floats(-10, 10)
vectors = arrays(float, 3, elements=st.floats(-3, 3))
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
