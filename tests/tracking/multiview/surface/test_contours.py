"""Contours against the sides of all pixels; smoothing on shapes whose outlines are known."""

from __future__ import annotations

from itertools import pairwise

import naive_hull
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from shadowpuppet.tracking.multiview.surface.contours import INSIDE, SAFE_DISTANCE, UNKNOWN, _cells, _follow, trace_contours

shapes = array_shapes(min_dims=2, max_dims=2, max_side=20)
masks = arrays(bool, shapes)


def followed(mask, seen=None):
    return _follow(_cells(mask, seen))


def as_sides(points, starts, person):
    """Middle of a side -> its way, and whether a person is beside it; the way is that to the next middle and from the last."""
    out = {}
    for a, b in pairwise(starts):
        path = points[a:b]
        ways = (np.roll(path, -1, 0) - np.roll(path, 1, 0))
        for place, way, own in zip(path, ways, person[a:b]):
            out[tuple(place)] = way, bool(own)
    return out


@pytest.mark.kernels
@given(masks, st.data())
@settings(max_examples=60, deadline=None)
def test_contours_are_the_sides_between_what_is_denied_and_what_is_not(mask, data):
    seen = data.draw(st.none() | arrays(bool, mask.shape, elements=st.booleans()))
    points, starts, person = followed(mask, seen)
    expected, found = naive_hull.sides(mask, seen), as_sides(points, starts, person)
    assert len(points) == len(expected)  # each once
    assert {place: own for place, (_, own) in found.items()} == {place: own for place, (_, own) in expected.items()}
    for place, (way, _) in found.items():
        assert np.dot(way, expected[place][0]) >= 0


@pytest.mark.kernels
@given(masks)
@settings(max_examples=60, deadline=None)
def test_contours_are_closed_and_step_from_side_to_side(mask):
    points, starts, _ = followed(mask)
    for a, b in pairwise(starts):
        steps = np.linalg.norm(np.roll(points[a:b], -1, 0) - points[a:b], axis=1)
        assert steps.max() <= 1
        assert steps.min() > 0.7


@given(masks)
@settings(max_examples=60, deadline=None)
def test_what_contours_hold_is_what_is_denied(mask):
    points, starts, _ = followed(mask)
    polygons = [points[a:b] for a, b in pairwise(starts)]
    for y, x in np.ndindex(mask.shape):
        assert naive_hull.holds(polygons, np.array([x, y], float)) == (not mask[y, x])


def test_pixels_that_touch_at_a_corner_hang_together():
    mask = np.zeros((12, 12), bool)
    mask[3:6, 3:6] = mask[6:9, 6:9] = True
    points, starts, person = followed(mask)
    assert sorted(np.diff(starts)) == [24, 48]  # one figure, and the picture's border
    assert person.sum() == 24
    assert len(points) == 72


def test_the_whole_and_nothing():
    assert len(trace_contours(np.ones((9, 13), bool)).points) == 0
    empty = trace_contours(np.zeros((9, 13), bool))
    assert not empty.person.any()
    assert {(-0.5, 0.0), (0.0, -0.5), (12.5, 8.0), (12.0, 8.5)} <= {tuple(p) for p in empty.points}  # corners are kept


@pytest.mark.parametrize("width", [1, 5, 6, 7, 8, 14, 62, 63])
def test_pictures_of_any_width(width):
    mask = np.zeros((7, width), bool)
    mask[2:5, -3:] = True
    assert {p for p, (_, own) in as_sides(*followed(mask)).items() if own} == {p for p, (_, own) in naive_hull.sides(mask).items() if own}


@pytest.mark.parametrize("radius", [6, 10.3, 25, 60])
def test_a_circle_keeps_its_radius(radius, rng):
    for centre in rng.uniform(70, 72, (5, 2)):
        y, x = np.mgrid[:140, :140]
        contours = trace_contours(np.hypot(x - centre[0], y - centre[1]) < radius)
        found = np.linalg.norm(contours.points[contours.person] - centre, axis=1)
        assert abs(found.mean() - radius) < 1 / radius + 0.05  # smoothing draws in what is bent
        assert found.std() < 0.25  # pixels' sides alone: 0.29, and stairs


@pytest.mark.parametrize("slope", [0.0, 0.1, 0.5, 1.0])
def test_a_straight_outline_stays_where_it_is(slope):
    y, x = np.mgrid[:100, :100]
    contours = trace_contours(y - 40 - slope * (x - 50) > 0)
    p = contours.points[contours.person]
    off = (p[:, 1] - 40 - slope * (p[:, 0] - 50)) / np.hypot(1, slope)
    # Centres on the line itself are outside: where the slope is a whole number, half a pixel's side is lost.
    assert abs(off.mean() - (0.5 / np.hypot(1, slope) if slope in (0, 1) else off.mean())) < 0.05
    assert abs(off).max() < 0.75
    assert off.std() < 0.2


def test_the_pictures_border_is_nobodys_outline():
    mask = np.zeros((60, 80), bool)
    mask[20:, 30:50] = True  # cut by the lower border
    contours = trace_contours(mask)
    own = contours.points[contours.person]
    assert len(own) > 20
    assert own[:, 1].max() < 60 - SAFE_DISTANCE / 2
    assert {29.5, 49.5} <= set(own[:, 0])  # straight, and not drawn to anywhere


@pytest.mark.kernels
@given(masks)
@settings(max_examples=60, deadline=None)
def test_smoothing_moves_nothing_by_more_than_a_pixel_and_a_half(mask):
    raw, smooth = followed(mask)[0], trace_contours(mask)
    for p in smooth.points:
        assert np.linalg.norm(raw - p, axis=1).min() < 1.5
    assert smooth.starts[-1] == len(smooth.points) == len(smooth.person)


def test_tracing_changes_no_mask():
    mask = np.eye(9, dtype=bool)
    before = mask.copy()
    trace_contours(mask)
    np.testing.assert_array_equal(mask, before)
    assert INSIDE != UNKNOWN
