"""Learning: known numbers are found again, no round is worse than the last, and what cannot be learnt from is said."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from motions import gait, prior, walk
from scipy.optimize import linear_sum_assignment
from scipy.spatial.distance import cdist
from scipy.special import xlogy

from shadowpuppet.errors import SettingsError, ShadowPuppetError
from shadowpuppet.motion.prior.settings import PriorSettings
from shadowpuppet.motion.prior.vqpca import PriorFit, _fill, choose_regions, fit_prior, likeliest_rows, log_likelihood, reconstruction_error

seeds = st.integers(0, 2**32 - 1)


def same(one: PriorFit, other: PriorFit) -> bool:
    arrays = [[f.prior.transitions, f.prior.initial, f.prior.subspaces.centres, f.prior.subspaces.bases, f.prior.subspaces.variances,
               f.prior.subspaces.noise, np.array(f.errors), np.array(f.log_likelihoods)] for f in (one, other)]
    return all(np.array_equal(a, b) for a, b in zip(*arrays, strict=True))


# What is learnt


def test_a_made_motion_is_found_again(rng):
    """Regions well apart: centres, subspaces, variances and transitions of 6,000 frames in two clips."""
    made = prior(rng, regions=5, width=6, dimensions=2)
    found = fit_prior(rng, [walk(rng, made, 3000)[0] for _ in range(2)], PriorSettings(regions=5, dimensions=2, starts=8, leave=0.0)).prior
    _, match = linear_sum_assignment(cdist(made.subspaces.centres, found.subspaces.centres))
    inner, wanted = found.subspaces, made.subspaces
    np.testing.assert_allclose(inner.centres[match], wanted.centres, atol=0.05)
    np.testing.assert_allclose(found.transitions[np.ix_(match, match)], made.transitions, atol=0.05)
    np.testing.assert_allclose(inner.variances[match], wanted.variances, rtol=0.2)
    np.testing.assert_allclose(inner.noise[match], wanted.noise, rtol=0.2)
    for i, k in enumerate(match):  # cosines of the angles between the subspaces
        assert np.linalg.svd(wanted.bases[i].T @ inner.bases[k], compute_uv=False).min() > 0.99


def test_a_gait_becomes_a_ring_of_regions_in_order_of_time():
    """Of one and a half cycles: every region is left for the next, or for that in which the cycle begins again."""
    made = fit_prior(np.random.default_rng(3), [gait(90)], PriorSettings(regions=12, leave=0.0)).prior
    following = np.where(np.eye(12, dtype=bool), 0, made.transitions).argmax(1)
    left = (made.transitions.diagonal() < 1).nonzero()[0]
    assert (following[left[:-1]] == left[:-1] + 1).all()
    assert reconstruction_error(made, [gait(200)]) < 0.03 * gait(200).std()
    assert (np.diff(np.unique(made.encode(gait(90)).regions, return_index=True)[1]) > 0).all()


def test_no_transition_leads_from_clip_to_clip():
    """Two poses, one clip of each: the other is never followed."""
    clips = [np.stack([0.001 * np.arange(20), np.full(20, value)], 1) for value in (0.0, 10.0)]
    how = PriorSettings(regions=2, dimensions=1, leave=0.0, starts=20)
    learnt = fit_prior(np.random.default_rng(0), clips, how).prior
    np.testing.assert_allclose(learnt.transitions, np.eye(2), atol=1e-9)
    joined = fit_prior(np.random.default_rng(0), [np.concatenate(clips)], how).prior
    assert joined.transitions[0, 1] == pytest.approx(1 / 20)


def test_names_and_rate_are_kept():
    names = tuple(f"angle_{i}" for i in range(25))
    learnt = fit_prior(np.random.default_rng(0), [gait(40)], PriorSettings(regions=4), names=names, rate=60.0).prior
    assert (learnt.names, learnt.rate) == (names, 60.0)


# Laws


@settings(deadline=None, max_examples=60)
@given(seed=seeds, frames=st.integers(2, 60), width=st.integers(1, 8), regions=st.integers(1, 20), dimensions=st.integers(1, 8),
       rank=st.integers(1, 8), scale=st.sampled_from([1e-6, 1.0, 1e6]), away=st.sampled_from([0.0, 100.0]),
       leave=st.sampled_from([0.0, 0.01, 0.9]))
def test_no_round_is_worse_and_nothing_is_not_a_number(seed, frames, width, regions, dimensions, rank, scale, away, leave):
    """Few frames, poses in a line or a plane, regions of one frame, poses far from zero, repeated poses."""
    rng = np.random.default_rng(seed)
    poses = scale * (rng.standard_normal((frames, min(rank, width))) @ rng.standard_normal((min(rank, width), width)) + away)
    poses = np.concatenate([poses, poses[: frames // 3]])
    how = PriorSettings(regions=min(regions, frames), dimensions=min(dimensions, width), leave=leave, starts=2)
    clips = [poses[: len(poses) // 2], poses[len(poses) // 2 :]]
    learnt = fit_prior(rng, clips, how)
    made, inner, rounding = learnt.prior, learnt.prior.subspaces, 1e-7 * np.ptp(poses)  # a root of squares has half the digits
    assert (np.diff(learnt.errors) <= rounding).all()
    assert (np.diff(learnt.log_likelihoods) >= -1e-9 * (1 + np.abs(learnt.log_likelihoods[0]))).all()
    for values in (made.transitions, inner.centres, inner.bases, inner.variances, inner.noise, learnt.errors, learnt.log_likelihoods):
        assert np.isfinite(values).all()
    assert made.transitions.min() >= leave / how.regions * (1 - 1e-9)
    assert log_likelihood(made, clips) == pytest.approx(learnt.log_likelihoods[-1])
    assert reconstruction_error(made, clips) <= learnt.errors[-1] + rounding
    proposed = made.propose(rng, poses, keep=1.0)
    assert np.isfinite(proposed.poses).all()
    encoded = made.reconstruct(made.encode(poses))
    assert np.sqrt(((encoded - poses) ** 2).mean()) == pytest.approx(reconstruction_error(made, clips), abs=rounding)


@given(seed=seeds)
@settings(deadline=None, max_examples=10)
def test_the_error_settles_where_frames_belong_to_their_nearest_region(seed):
    """The last round's regions are the means of what is nearest to them, or the tolerance ended it: run on with none, nothing moves."""
    how = PriorSettings(regions=6, dimensions=2, tolerance=0.0, iterations=1000, starts=1)
    poses = gait(80) + 0.05 * np.random.default_rng(seed).standard_normal((80, 25))
    made = fit_prior(np.random.default_rng(seed), [poses], how).prior
    regions = made.encode(poses).regions
    assert set(regions.tolist()) == set(range(6))
    for i in range(6):
        np.testing.assert_allclose(made.subspaces.centres[i], poses[regions == i].mean(0), atol=1e-12)


def test_the_same_seed_learns_the_same_and_another_another():
    how = PriorSettings(regions=6, starts=1)
    first, again, other = (fit_prior(np.random.default_rng(seed), [gait(60), gait(30, phase=1.0)], how) for seed in (1, 1, 2))
    assert same(first, again)
    assert not same(first, other)


def test_the_best_of_several_starts_is_kept():
    errors = [fit_prior(np.random.default_rng(5), [gait(100)], PriorSettings(regions=8, starts=starts)).errors[-1] for starts in (1, 3, 12)]
    assert errors[0] >= errors[1] >= errors[2]
    assert errors[0] > errors[2]


def test_as_many_regions_as_poses_reconstruct_all():
    learnt = fit_prior(np.random.default_rng(0), [gait(30)], PriorSettings(regions=30))
    assert learnt.errors[-1] < 1e-7
    assert len(set(learnt.prior.encode(gait(30)).regions.tolist())) > 20


def test_no_region_is_left_empty():
    """Forty poses, thirty of them all but the same: half of the first centres are nobody's nearest after a round."""
    rng = np.random.default_rng(1)
    poses = np.concatenate([1e-9 * rng.standard_normal((30, 4)), rng.standard_normal((10, 4))])
    for seed in range(20):
        learnt = fit_prior(np.random.default_rng(seed), [poses], PriorSettings(regions=12, dimensions=1, starts=1))
        assert len(np.unique(learnt.prior.subspaces.centres, axis=0)) == 12


def test_an_empty_region_gets_the_frame_that_is_reconstructed_worst_of_those_that_leave_another_behind():
    filled = _fill(np.array([0, 0, 0, 3, 4]), np.array([0.1, 0.3, 0.2, 9.0, 8.0]), 5)
    assert filled.tolist() == [0, 1, 2, 3, 4]


# Transitions


@given(seed=seeds, size=st.integers(1, 6), leave=st.sampled_from([0.0, 0.05, 0.5, 0.99]))
def test_rows_are_the_likeliest_that_keep_to_the_floor(seed, size, leave):
    """Against other rows that keep to it: none has a greater likelihood, in any direction."""
    rng = np.random.default_rng(seed)
    counts, least = 10 * rng.random((size, size)) * (rng.random((size, size)) < 0.6), leave / size
    rows = likeliest_rows(counts, least)
    np.testing.assert_allclose(rows.sum(1), 1)
    assert (rows >= least * (1 - 1e-12)).all()
    others = (1 - leave) * rng.dirichlet(np.ones(size), (200, size)) + least
    others = np.concatenate([others, 0.99 * rows + 0.01 * others])
    likelihood = [xlogy(counts, each).sum((-1, -2)) for each in (rows, others)]
    assert (likelihood[0] >= likelihood[1] - 1e-9).all()
    if leave == 0:
        some = counts.sum(1) > 0
        np.testing.assert_allclose(rows[some], (counts / np.where(some, counts.sum(1), 1)[:, None])[some])
    np.testing.assert_allclose(rows[counts.sum(1) == 0], 1 / size)


# The number of regions


def test_the_number_of_regions_follows_unseen_motion():
    """Training errors fall with every region; those of unseen poses, which are noisy, do not."""
    rng = np.random.default_rng(2)
    clips = [gait(150, phase=phase) + 0.02 * rng.standard_normal((150, 25)) for phase in (0.0, 0.7)]
    found = choose_regions(rng, clips, (40, 2, 10, 100, 5000), PriorSettings(starts=1, dimensions=1))
    assert found.candidates == (2, 10, 40, 100)
    assert (np.diff(found.training_errors) < 0).all()
    assert found.held_out_errors[0] > 1.05 * min(found.held_out_errors)
    assert found.held_out_errors[-1] > min(found.held_out_errors)
    assert found.regions == 40
    assert choose_regions(rng, clips, (2, 10, 40), PriorSettings(starts=1, dimensions=1), margin=10.0).regions == 2


def test_the_candidates_do_not_depend_on_one_another():
    clips = [gait(100)]
    both = choose_regions(np.random.default_rng(0), clips, (5, 10), PriorSettings(starts=1))
    one = choose_regions(np.random.default_rng(0), clips, (10,), PriorSettings(starts=1))
    assert both.held_out_errors[1] == one.held_out_errors[0]


# What cannot be learnt from


@pytest.mark.parametrize(("clips", "how", "said"), [
    ([], {}, "clips: found none"),
    ([np.zeros(5)], {}, r"clip 0: found shape \(5,\), expected \(frames, numbers of a pose\)"),
    ([gait(40), np.zeros((0, 25))], {}, r"clip 1: found shape \(0, 25\)"),
    ([gait(40), gait(40)[:, :24]], {}, "clip 1: found poses of 24 numbers, expected 25, as in clip 0"),
    ([gait(40), np.where(np.arange(40)[:, None] % 20 == 7, np.nan, gait(40))], {}, "clip 1: found nan in frame 7, the first of 2 such"),
    ([np.full((40, 2), np.inf)], {}, "clip 0: found inf in frame 0, the first of 40"),
    ([1e12 * gait(40)], {}, "expected numbers less than 1e[+]09"),
    ([gait(19)], {}, "clips: found 19 different poses in 19 frames, expected 20 or more for 20 regions; learn fewer"),
    ([np.repeat(gait(10), 50, 0)], {}, "clips: found 10 different poses in 500 frames, expected 20"),
    ([np.ones((50, 3))], {"regions": 1}, "clips: found 1 different poses in 50 frames, expected 2"),
    ([gait(40)[:, :2]], {}, "dimensions: found 3, expected 2 at most"),
])
def test_clips_that_do_not_do_are_said(clips, how, said):
    with pytest.raises(ShadowPuppetError, match=said):
        fit_prior(np.random.default_rng(0), clips, PriorSettings(**how))


def test_settings_that_cannot_be_are_said():
    with pytest.raises(SettingsError, match="regions: found 0"):
        PriorSettings(regions=0)
    with pytest.raises(SettingsError, match="leave: found 1"):
        PriorSettings(leave=1.0)
    with pytest.raises(SettingsError, match="folds: found 1, expected two or more"):
        choose_regions(np.random.default_rng(0), [gait(60)], folds=1)
    with pytest.raises(ShadowPuppetError, match="clips: found 48 different poses beside each fold, expected 80 or more"):
        choose_regions(np.random.default_rng(0), [gait(60)], (80, 90))
    with pytest.raises(ShadowPuppetError, match="clips: found 2 frames in 2 clips, expected 5 or more in one"):
        choose_regions(np.random.default_rng(0), [gait(1), gait(1)], (1,))
