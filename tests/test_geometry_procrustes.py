"""Points laid over others: laws of the group, and that nothing nearby is better."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.testing import assert_allclose

from shadowpuppet.geometry import align, rotation_from_vector

vectors = st.tuples(*[st.floats(-3, 3)] * 3).map(np.array)


@given(st.integers(0, 10**6), vectors, vectors, st.floats(0.2, 4))
def test_a_rigid_motion_with_a_scale_is_found_again(seed, vector, shift, scale):
    points = np.random.default_rng(seed).normal(size=(7, 3))
    R = rotation_from_vector(vector)
    found = align(points, scale * points @ R.T + shift, scaled=True)
    assert_allclose(found.rotation, R, atol=1e-7)
    assert_allclose(found.translation, shift, atol=1e-7)
    assert found.scale == pytest.approx(scale)
    assert_allclose(found.apply(points), scale * points @ R.T + shift, atol=1e-7)


@given(st.integers(0, 10**6), vectors, vectors)
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
        assert_allclose(found.rotation[n], alone.rotation, atol=1e-12)
        assert_allclose(found.apply(points)[n][known], targets[n][known], atol=1e-12)
    assert np.isnan(found.apply(points)[2]).all()  # two points tell no rotation
