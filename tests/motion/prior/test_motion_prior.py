"""What may come next: statistics of proposals against the model's; codes; arrays that do not fit."""

from __future__ import annotations

import time

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motions import prior, ring, subspaces

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.motion.prior.motion_prior import Codes, MotionPrior

NUMBER = 40_000


@pytest.mark.parametrize("keep", [0.0, 0.6, 1.0])
def test_proposals_have_the_mean_and_covariance_of_the_model(rng, keep):
    """Of one pose: by region, then of all regions together. Five standard errors, and the seed is fixed."""
    made, pose, last = prior(rng), rng.standard_normal(6), 2
    found = made.propose(rng, np.repeat(pose[None], NUMBER, 0), np.full(NUMBER, last), keep)
    inner = made.subspaces
    P = inner.bases[last]
    kept = keep * (pose - inner.centres[last] - P @ P.T @ (pose - inner.centres[last]))
    for region, chance in enumerate(made.transitions[last]):
        drawn = found.poses[found.regions == region]
        assert len(drawn) / NUMBER == pytest.approx(chance, abs=5 * np.sqrt(chance * (1 - chance) / NUMBER))
        if len(drawn):
            P, r = inner.bases[region], inner.centres[region]
            mean, covariance = r + P @ P.T @ (pose - r) + kept, P @ np.diag(inner.variances[region]) @ P.T
            assert np.abs(drawn.mean(0) - mean).max() < 5 * np.sqrt(covariance.max() / len(drawn))
            assert np.abs(np.cov(drawn.T) - covariance).max() < 5 * np.sqrt(2 / len(drawn)) * covariance.max()


def test_a_region_that_cannot_follow_never_does():
    rng = np.random.default_rng(0)
    made = prior(rng, regions=7)
    regions = rng.integers(7, size=5000)
    steps = (made.propose(rng, np.zeros((5000, 6)), regions).regions - regions) % 7
    assert set(steps.tolist()) == {0, 1}


class Ends:
    """A generator whose uniform numbers lie at an end of [0, 1)."""

    def __init__(self, value: float) -> None:
        self.value, self.standard_normal = value, np.random.default_rng(0).standard_normal

    def random(self, size: int) -> np.ndarray:
        return np.full(size, self.value)


@pytest.mark.parametrize("value", [0.0, np.nextafter(1, 0)])
def test_the_ends_of_the_unit_interval_draw_no_impossible_region(value, rng):
    rows = np.array([[0.1] * 10 + [0.0], [0.0] + [0.1] * 10, [0.0] + [1 / 3] * 3 + [0.0] * 7])[[0, 1, 2] * 4][:11]
    made = MotionPrior(subspaces(rng, 11, 4, 2), rows, np.full(11, 1 / 11))
    drawn = made.propose(Ends(value), np.zeros((11, 4)), np.arange(11)).regions
    assert (rows[np.arange(11), drawn] > 0).all()


@given(seed=st.integers(0, 2**32 - 1), dimensions=st.integers(1, 6))
def test_what_is_reconstructed_is_encoded_without_loss(seed, dimensions):
    rng = np.random.default_rng(seed)
    made = prior(rng, dimensions=dimensions)
    codes = made.encode(3 * rng.standard_normal((20, 6)))
    once = made.reconstruct(codes)
    np.testing.assert_allclose(made.reconstruct(made.encode(once)), once, atol=1e-9)
    assert codes.values.shape == (20, dimensions)


def test_without_regions_each_pose_has_its_nearest(rng):
    made, poses = prior(rng), rng.standard_normal((30, 6))
    found = made.propose(np.random.default_rng(1), poses)
    wanted = made.propose(np.random.default_rng(1), poses, made.encode(poses).regions)
    np.testing.assert_array_equal(found.poses, wanted.poses)
    np.testing.assert_array_equal(found.regions, wanted.regions)


def test_the_same_seed_proposes_the_same_and_nothing_is_changed(rng):
    made, poses = prior(rng), rng.standard_normal((30, 6))
    before = poses.copy()
    first, second = (made.propose(np.random.default_rng(8), poses, keep=0.5).poses for _ in range(2))
    np.testing.assert_array_equal(first, second)
    np.testing.assert_array_equal(poses, before)


def test_no_poses_are_no_proposals(rng):
    found = prior(rng).propose(rng, np.empty((0, 6)))
    assert found.poses.shape == (0, 6)
    assert found.regions.shape == (0,)


def test_many_proposals_cost_little_more_than_one(rng):
    """All at once, not one by one: 1,000 cost 1,000 times as much in a loop, and 16 times here."""
    made, times = prior(rng, regions=20, width=30, dimensions=3), {}
    for number in (1, 1000):
        poses, regions = rng.standard_normal((number, 30)), rng.integers(20, size=number)
        laps = []
        for _ in range(7):
            start = time.perf_counter()
            made.propose(rng, poses, regions)
            laps.append(time.perf_counter() - start)
        times[number] = min(laps)
    assert times[1000] < 200 * times[1]


@pytest.mark.parametrize(("changes", "said"), [
    ({"transitions": np.eye(4)}, r"transitions: found shape \(4, 4\), expected \(3, 3\)"),
    ({"transitions": 0.9 * np.eye(3)}, "transitions: found numbers that are no probabilities"),
    ({"transitions": np.full((3, 3), np.nan)}, "transitions: found numbers that are no probabilities"),
    ({"initial": [1.5, -0.5, 0.0]}, "initial: found numbers that are no probabilities"),
    ({"names": ("hip", "knee")}, "names: found 2 different ones, expected 4"),
    ({"names": ("hip", "knee", "hip", "elbow")}, "names: found 3 different ones, expected 4"),
    ({"rate": 0.0}, "rate: found 0.0, expected frames a second"),
    ({"rate": np.nan}, "rate: found nan"),
])
def test_what_is_no_prior_is_said(rng, changes, said):
    with pytest.raises(ShadowPuppetError, match=said):
        MotionPrior(**{"subspaces": subspaces(rng, 3, 4, 2), "transitions": ring(3), "initial": np.full(3, 1 / 3)} | changes)


def test_arrays_that_do_not_fit_are_said(rng):
    made = prior(rng)
    for poses, said in ((np.zeros((3, 5)), r"poses: found shape \(3, 5\), expected \(N, 6\)"), (np.zeros(6), r"found shape \(6,\)"),
                        (np.full((2, 6), np.nan), "poses: found a number that is not finite")):
        with pytest.raises(ShadowPuppetError, match=said):
            made.encode(poses)
        with pytest.raises(ShadowPuppetError, match=said):
            made.propose(rng, poses)
    for regions in ([0], [0, 5], [-1, 0], [0.0, 1.0]):
        with pytest.raises(ShadowPuppetError, match=r"regions: found an array .* expected 2 whole numbers from 0 to 4"):
            made.propose(rng, np.zeros((2, 6)), regions)
    with pytest.raises(ShadowPuppetError, match="regions: found"):
        made.reconstruct(Codes(np.array([7]), np.zeros((1, 2))))
    with pytest.raises(ShadowPuppetError, match="values: found shape"):
        made.reconstruct(Codes(np.array([0]), np.zeros((1, 3))))
