"""How tall the person in the first frames is: heights tried downhill, whether they stand, sit or lie."""

from __future__ import annotations

import types

import actor
import numpy as np
import pytest

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.body.whole_body import anatomical
from shadowpuppet.tracking.multiview import height_estimation
from shadowpuppet.tracking.multiview.height_estimation import RATIO, estimate_height, longest_extent, lowest_point
from shadowpuppet.tracking.multiview.settings import MultiviewSettings
from shadowpuppet.tracking.multiview.size_estimation import dressed
from shadowpuppet.tracking.multiview.surface.visual_hull import SurfacePoints

SETTINGS = MultiviewSettings(particles=8)


def points(z) -> SurfacePoints:
    z = np.asarray(z, float)
    return SurfacePoints(np.column_stack([0 * z, 0 * z, z]), np.zeros((len(z), 3)), np.ones(len(z)), np.zeros(len(z), np.int64))


NOBODY = points([])


@pytest.fixture
def tried(monkeypatch):
    """Heights that are tried, on bodies whose misfit is as `fit` says."""
    said = types.SimpleNamespace(heights=[], fit=lambda height: 1.0)

    class Tracker:
        def __init__(self, height, cameras, settings):
            said.heights.append(height)
            self.height = height

    def misfit(rng, tracker, cloud, masks):
        return np.inf if cloud is NOBODY else said.fit(tracker.height) * (1 + len(masks))

    monkeypatch.setattr(height_estimation, "MultiviewTracker", Tracker)
    monkeypatch.setattr(height_estimation, "_misfit", misfit)
    return said


def found(first):
    return estimate_height(np.random.default_rng(0), lambda height: height, (), first, SETTINGS)


@pytest.mark.parametrize(("extent", "true"), [(1.8, 1.8), (1.45, 1.85), (1.2, 1.2), (0.6, 0.75), (2.2, 1.75)])
def test_the_height_that_fits_best_is_found_between_those_tried(tried, extent, true):
    tried.fit = lambda height: 1 + 20 * np.log(height / true) ** 2
    seen = found([(points(np.linspace(0, extent, 400)), ())] * 9 + [(NOBODY, ())] * 4)
    assert seen.height == pytest.approx(true, rel=0.04)  # average people are more likely
    assert len(tried.heights) == len(set(tried.heights)) < 12
    np.testing.assert_allclose(np.diff(np.sort(np.log(tried.heights))), np.log(RATIO))


def test_where_all_heights_fit_alike_the_average_is_taken(tried):
    assert found([(points(np.linspace(0, 1.6, 400)), ())] * 5).height == pytest.approx(1.7, abs=0.02)


def test_the_frame_that_fits_best_is_named(tried):
    frames = [(points(np.linspace(0, 1.6, 400)), (None,) * number) for number in (3, 2, 0, 1, 2)]
    assert found(frames).frame == 2


def test_where_nobody_is_seen_no_height_is_found(tried):
    assert found([(NOBODY, ())]) is None
    assert found([(NOBODY, ()), (points(np.arange(40)), ())]) is None
    assert not tried.heights


def test_possible_heights_only_are_tried(tried):
    tried.fit = lambda height: height
    assert found([(points(np.linspace(0, 0.5, 400)), ())]).height == pytest.approx(0.5, abs=0.06)
    tried.fit = lambda height: 1 / height**9
    assert found([(points(np.linspace(0, 9, 400)), ())]).height == pytest.approx(2.5, abs=0.25)
    assert 0.5 <= min(tried.heights) <= max(tried.heights) <= 2.5


def test_the_lowest_point_of_a_parabola():
    assert lowest_point(*((x - 0.3) ** 2 for x in (-1, 0, 1))) == pytest.approx(0.3)
    assert lowest_point(1, 1, 1) == 0
    assert lowest_point(np.inf, 1, 2) == 0


def test_the_longest_extent_is_that_of_those_who_lie_too(rng):
    standing = points(np.linspace(0.02, 1.75, 400))
    lying = standing._replace(points=standing.points[:, [2, 0, 1]] @ np.linalg.qr(rng.normal(size=(3, 3)))[0])
    for seen in (standing, lying):
        assert longest_extent([(seen, ())] * 3 + [(NOBODY, ())] * 20) == pytest.approx(1.73, abs=0.03)
    stray = points([*np.linspace(0.0, 1.7, 400), -3.0, 9.0])
    assert longest_extent([(stray, ())]) == pytest.approx(1.7, abs=0.03)
    assert longest_extent([]) is None


def test_a_person_who_sits_is_as_tall_as_they_stand():
    """Wide as dressed people are: an average body would fit best if it were too tall."""
    true = dressed(average_sizes("anatomical", 1.6))
    of = anatomical(true)
    pose = actor.stance(of.skeleton, 0.0, 0.4)
    pose[of.skeleton.dof_indices(["left_hip_y", "right_hip_y", "left_knee_flexion", "right_knee_flexion"])] = np.radians([-82, -80, 88, 91])
    masks = actor.masks(of, pose, 4)
    first = [(actor.hull(4).points(masks), masks)]
    seen = estimate_height(np.random.default_rng(0), lambda tall: make_body("anatomical", dressed(average_sizes("anatomical", tall))),
                           actor.cameras(4), first, SETTINGS)
    assert seen.height == pytest.approx(1.6, abs=0.04)


def test_a_body_that_reaches_out_of_the_silhouettes_fits_worse(monkeypatch):
    surface, masks = actor.filmed()[1][0]
    tracker = height_estimation.MultiviewTracker(actor.body(), actor.cameras(), SETTINGS)
    state = tracker.start(np.random.default_rng(0), surface, masks)
    monkeypatch.setattr(height_estimation.MultiviewObservation, "outside", lambda seen, pose: 0.1)
    misfit = height_estimation._misfit(np.random.default_rng(0), tracker, surface, masks)
    assert misfit == pytest.approx(state.cost + 0.1 * height_estimation.OUTSIDE)
    nobody = [np.zeros_like(mask) for mask in masks]
    assert height_estimation._misfit(np.random.default_rng(0), tracker, actor.hull().points(nobody), nobody) == np.inf
