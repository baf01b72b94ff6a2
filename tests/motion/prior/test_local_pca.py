"""Regions with a subspace each: distances, projections and densities against their definitions; few poses and none in a line."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motions import subspaces
from scipy.stats import multivariate_normal

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.prior.local_pca import Subspaces, principal_subspaces

seeds = st.integers(0, 2**32 - 1)


@given(seed=seeds, regions=st.integers(1, 5), width=st.integers(1, 7), dimensions=st.integers(1, 7), away=st.sampled_from([0.0, 1e4]))
def test_distances_and_densities_are_those_of_the_definition(seed, regions, width, dimensions, away):
    rng = np.random.default_rng(seed)
    made = subspaces(rng, regions, width, min(dimensions, width))
    made = replace(made, centres=made.centres + away)
    poses = made.centres[0] + rng.standard_normal((6, width))
    for i in range(regions):
        P, offsets = made.bases[i], poses - made.centres[i]
        beside = np.eye(width) - P @ P.T
        np.testing.assert_allclose(made.distances(poses)[:, i], ((offsets @ beside) ** 2).sum(1), rtol=1e-9, atol=1e-9)  # eq. 10
        np.testing.assert_allclose(made.coordinates(poses)[:, i], offsets @ P, rtol=1e-9, atol=1e-9)  # eq. 18
        spread = P @ np.diag(made.variances[i]) @ P.T + made.noise[i] * beside
        wanted = np.atleast_1d(multivariate_normal(made.centres[i], spread).logpdf(poses))
        np.testing.assert_allclose(made.log_densities(poses)[:, i], wanted, rtol=1e-6, atol=1e-6)


@given(seed=seeds, width=st.integers(1, 7), dimensions=st.integers(1, 7))
def test_projecting_twice_is_projecting_once_and_loses_the_distance(seed, width, dimensions):
    rng = np.random.default_rng(seed)
    made = subspaces(rng, 4, width, min(dimensions, width))
    poses, regions = rng.standard_normal((9, width)), rng.integers(4, size=9)
    values = made.project(poses, regions)
    back = made.reconstruct(values, regions)
    np.testing.assert_allclose(made.project(back, regions), values, atol=1e-12)
    np.testing.assert_allclose(((back - poses) ** 2).sum(1), made.distances(poses)[np.arange(9), regions], atol=1e-12)
    nearest, coordinates = made.nearest(poses)
    np.testing.assert_array_equal(nearest, made.distances(poses).argmin(1))
    np.testing.assert_allclose(coordinates, made.project(poses, nearest), atol=1e-12)


def test_principal_subspaces_are_those_of_the_covariance(rng):
    poses, partition = rng.standard_normal((60, 5)) * [3, 2, 1, 0.5, 0.1], rng.integers(2, size=60)
    found = principal_subspaces(poses, partition, 2, 3, 1e-9)
    for i in (0, 1):
        values, vectors = np.linalg.eigh(np.cov(poses[partition == i].T, bias=True))
        np.testing.assert_allclose(found.centres[i], poses[partition == i].mean(0))
        np.testing.assert_allclose(found.variances[i], values[:1:-1])
        np.testing.assert_allclose(found.noise[i], values[:2].mean())
        np.testing.assert_allclose(np.abs(found.bases[i].T @ vectors[:, :1:-1]), np.eye(3), atol=1e-9)
        greatest = np.abs(found.bases[i]).argmax(0)
        assert (found.bases[i][greatest, range(3)] > 0).all()


@pytest.mark.parametrize("dimensions", [1, 3, 4])
def test_regions_of_one_pose_or_of_poses_in_a_line_have_a_density(rng, dimensions):
    line = np.linspace(0, 1, 5)[:, None] * [1.0, 2.0, 0.0, -1.0]
    poses = np.concatenate([line, [[5.0, 5.0, 5.0, 5.0]]])
    found = principal_subspaces(poses, np.array([0, 0, 0, 0, 0, 1]), 2, dimensions, 1e-4)
    assert min(found.variances.min(), found.noise.min()) == 1e-4
    assert np.isfinite(found.log_densities(np.concatenate([poses, 100 * poses]))).all()
    np.testing.assert_allclose(found.distances(poses).min(1), 0, atol=1e-12)


def fields(**changes):
    bases = np.repeat(np.eye(3)[None, :, :2], 2, 0)
    return {"centres": np.zeros((2, 3)), "bases": bases, "variances": np.ones((2, 2)), "noise": np.ones(2)} | changes


@pytest.mark.parametrize(("changes", "said"), [
    ({"bases": np.eye(3)}, r"bases: found shape \(3, 3\), expected \(regions, numbers of a pose, dimensions\)"),
    ({"bases": np.zeros((2, 3, 0))}, r"bases: found shape \(2, 3, 0\)"),
    ({"bases": np.zeros((2, 2, 3))}, "as many dimensions as a pose has numbers at most"),
    ({"bases": np.ones((2, 3, 2))}, "bases: found vectors that are not orthonormal"),
    ({"centres": np.zeros((2, 4))}, r"centres: found shape \(2, 4\), expected \(2, 3\)"),
    ({"noise": np.ones((2, 1))}, r"noise: found shape \(2, 1\), expected \(2,\)"),
    ({"centres": np.full((2, 3), np.nan)}, "centres: found a number that is not finite"),
    ({"variances": np.array([[1.0, 1.0], [1.0, 0.0]])}, "variances: found 0.0, expected variances, which are more than zero"),
    ({"noise": np.array([1.0, -2.0])}, "noise: found -2.0"),
])
def test_arrays_that_are_no_subspaces_are_said(changes, said):
    with pytest.raises(ShadowPuppetError, match=said):
        Subspaces(**fields(**changes))
