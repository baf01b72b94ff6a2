"""Who is in the first frames: sizes found from hulls alone, held where they are known, and nobody said so."""

from __future__ import annotations

import functools
import types
from functools import partial

import actor
import numpy as np
import pytest

from shadowpuppet.body.models import WHOLE, average_sizes, make_body, shares_of
from shadowpuppet.body.sizes import AnatomicalSizes
from shadowpuppet.body.whole_body import anatomical
from shadowpuppet.errors import TrackingError
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.size_estimation import (
    JOINT_DEVIATION,
    SIZES_FROM_JOINTS,
    estimate_height,
    estimate_sizes,
    observed_height,
    size_deviations,
)
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints

SETTINGS = MultiviewSettings(particles=8)
NAMES = AnatomicalSizes.names()
GIRTHS = {"thigh_width": 1.25, "waist_depth": 1.35, "waist_width": 1.2, "pelvis_width": 1.2, "pelvis_depth": 1.2, "upper_arm_width": 1.2}
MEAN = actor.sizes()


@functools.cache
def stout() -> tuple[AnatomicalSizes, np.ndarray, list]:
    """Somebody of average bones and wide girths, who walks and bends knees and elbows."""
    true = actor.sizes(**GIRTHS)
    body = anatomical(true)
    poses = actor.walk(body.skeleton, 6, 5.0)
    rng = np.random.default_rng(2)
    for joint in ("left_elbow", "right_elbow", "left_knee", "right_knee"):
        poses[:, body.skeleton.dof_indices([f"{joint}_flexion"])] += rng.uniform(0, 0.5, (len(poses), 1))
    masks = [actor.masks(body, pose) for pose in poses]
    return true, poses, [(actor.hull().points(row), row) for row in masks]


def measured(spread, first=None, expected=MEAN, seed: int = 0, library=None):
    first = stout()[2] if first is None else first
    library = actor.walk(actor.body().skeleton, 12) if library is None else library
    make = partial(make_body, "anatomical")
    return estimate_sizes(np.random.default_rng(seed), make, expected, spread, actor.cameras(), first, SETTINGS, library)


def test_girths_are_found_where_the_bones_are_known():
    true, poses, _ = stout()
    spread = size_deviations(MEAN, shown=True)
    found = measured(np.where(spread > JOINT_DEVIATION, 4 * spread, spread))  # more than people differ, so that a few frames decide
    before, after = (np.array([abs(getattr(sizes, name) - getattr(true, name)) for name in GIRTHS]) for sizes in (MEAN, found.sizes))
    assert after.sum() < 0.5 * before.sum()
    assert found.frames >= 5
    assert found.overlap > 0.85
    assert found.residual < 0.01
    for name in set(NAMES) & set(SIZES_FROM_JOINTS):
        assert getattr(found.sizes, name) == pytest.approx(getattr(MEAN, name), abs=5 * JOINT_DEVIATION)
    np.testing.assert_array_equal(found.body.points(poses), anatomical(found.sizes).points(poses))


def test_a_height_is_enough_to_begin_with():
    """Somebody of 1.75 m, taken to be of 1.62 m."""
    short = average_sizes("anatomical", 1.62)
    assert isinstance(short, AnatomicalSizes)
    found = measured(size_deviations(short, shown=False), expected=short)
    long = ("thigh_length", "shank_length", "upper_arm_length", "forearm_length", "lumbar_height", "thorax_height")
    before, after = (sum(getattr(sizes, name) for name in long) for sizes in (short, found.sizes))
    true = sum(getattr(stout()[0], name) for name in long)
    assert abs(after - true) < 0.6 * abs(before - true)


def test_known_sizes_are_kept_and_the_person_is_looked_for_all_the_same():
    true = stout()[0]
    found = measured(np.zeros(len(NAMES)), expected=true)
    assert found.sizes == true
    assert found.frames == 6
    assert found.overlap > 0.9


def test_the_same_seed_measures_the_same():
    spread = size_deviations(MEAN, shown=True)
    one, other = (measured(spread) for _ in range(2))
    assert (one.sizes, one.residual, one.overlap, one.frames) == (other.sizes, other.residual, other.overlap, other.frames)


def test_nobody_is_said():
    nobody = [np.zeros_like(mask) for mask in stout()[2][0][1]]
    with pytest.raises(TrackingError, match=r"nobody is found in the first 3 frames' silhouettes: .*`shadowpuppet info` tells"):
        measured(size_deviations(MEAN, shown=True), [(actor.hull().points(nobody), nobody)] * 3)


def test_a_person_in_a_few_frames_only_is_taken_as_expected():
    """Of too few frames nothing is solved for; those without anybody do no harm."""
    first = stout()[2]
    nobody = [np.zeros_like(mask) for mask in first[0][1]]
    gone = actor.hull().points(nobody), nobody
    found = measured(size_deviations(MEAN, shown=False), [gone, gone, *first[:2], gone])
    assert found.sizes == MEAN
    assert found.frames == 2
    assert np.isnan(found.residual)


@pytest.mark.parametrize(("extent", "fits", "shares", "best"), [
    (0.55, 1.1, [0.93, 1.0, 1.08, 1.2], 1.2),
    (1.02, 1.1, [0.8, 0.86, 0.93, 1.0, 1.08, 1.2], 1.08),
    (2.4, 1.1, [0.8, 0.86, 0.93, 1.0], 0.8),
    (1.8, None, [0.8, 0.86, 0.93, 1.0, 1.08, 1.2], 0.93),  # all fit: the usual one
])
def test_possible_heights_near_the_extent_are_tried(monkeypatch, extent, fits, shares, best):
    tried, nobody = [], points([])

    class Tracker:
        def __init__(self, height, cameras, settings):
            tried.append(height)
            self.cost = 1.0 if fits is None else abs(height - fits)

        def start(self, rng, cloud, masks):
            return types.SimpleNamespace(cost=1e9 if cloud is nobody else self.cost, status="absent" if cloud is nobody else "tracked")

    monkeypatch.setattr("shadowpuppet.tracking.multiview.size_estimation.MultiviewTracker", Tracker)
    first = [(points(np.linspace(0, extent, 400)), ())] * 9 + [(nobody, ())] * 9
    seen = observed_height(first)
    assert seen is not None
    assert height_of(first) == pytest.approx(best * seen)
    np.testing.assert_allclose(tried, np.array(shares) * seen)


def height_of(first) -> float | None:
    return estimate_height(np.random.default_rng(0), lambda height: height, (), first, SETTINGS)


def test_where_nobody_or_a_giant_is_seen_no_height_is_found():
    assert height_of([(points([]), ())]) is None
    assert height_of([(points(np.linspace(0, 9.0, 400)), ())]) is None


# What is known before -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WHOLE)
def test_bones_that_joints_show_are_sharp_and_all_else_as_people_differ(name):
    sizes = average_sizes(name, 1.7)
    shown, guessed = (size_deviations(sizes, shown=choice) for choice in (True, False))
    shares = shares_of(type(sizes))
    for size, one, other in zip(sizes.names(), shown, guessed):
        assert one == (JOINT_DEVIATION if size in SIZES_FROM_JOINTS else other), size
        assert other == pytest.approx(shares[size][1] * 1.7, rel=0.05)
    np.testing.assert_allclose(size_deviations(average_sizes(name, 0.9), shown=False) / guessed, 0.9 / 1.7, rtol=0.03)
    assert set(SIZES_FROM_JOINTS) >= {"thigh_length", "forearm_length", "hip_distance"}


def points(z) -> SurfacePoints:
    z = np.asarray(z, float)
    return SurfacePoints(np.column_stack([0 * z, 0 * z, z]), np.zeros((len(z), 3)), np.ones(len(z)), np.zeros(len(z), np.int64))


def test_who_stands_tallest_is_as_tall_as_seen():
    standing, bowed, nobody = points(np.linspace(0.02, 1.75, 400)), points(np.linspace(0, 1.1, 400)), points([])
    assert observed_height([(standing, ())] * 3 + [(bowed, ())] * 7 + [(nobody, ())] * 20) == pytest.approx(1.72, abs=0.03)
    stray = points([*np.linspace(0.0, 1.7, 400), -3.0, 9.0])
    assert observed_height([(stray, ())]) == pytest.approx(1.7, abs=0.03)
    assert observed_height([(nobody, ()), (points(np.arange(40)), ())]) is None
    assert observed_height([]) is None
