"""Silhouettes against each other: tangent planes and viewing rays of a ball, whose outlines are known exactly."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from shadowpuppet.calibration.epipolar_tangency import tangent_angles, tangent_distances
from shadowpuppet.calibration.silhouette_coverage import (
    COVERAGE_PERCENTILE,
    _percentiles,
    _sampled,
    pixels_beyond,
    triangulated_centre,
)
from shadowpuppet.calibration.silhouettes import Outline, outlines_of, silhouettes_of
from shadowpuppet.camera.camera import Camera
from shadowpuppet.geometry import rigid, rotation_about

SIZE, FOCAL, BALL, RADIUS = (320, 240), 260.0, np.array([0.1, -0.2, 1.0]), 0.4


def looking(place, roll: float = 0.0, name: str = "cam") -> Camera:
    """A camera at a place that looks at the middle of the scene."""
    place = np.asarray(place, float)
    z = np.array([0, 0, 1.0]) - place
    z /= np.linalg.norm(z)
    x = np.cross(z, [0, 0, 1.0])
    x /= np.linalg.norm(x)
    c, s = np.cos(roll), np.sin(roll)
    R = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]) @ np.stack([x, np.cross(z, x), z])
    return Camera(name, SIZE, [[FOCAL, 0, 159.5], [0, FOCAL, 119.5], [0, 0, 1]], T_camera_world=rigid(R, -R @ place))


CAMERAS = (looking([4, 0.5, 1.2]), looking([-0.5, 3.6, 1.5], 0.1), looking([-3, -3, 0.8]), looking([1, -4, 2]))


def ball(camera: Camera, centre=BALL) -> np.ndarray:
    """The exact mask of the ball."""
    pixels = np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), -1)
    rays = camera.rays(pixels) @ camera.T_camera_world[:3, :3]
    rays /= np.linalg.norm(rays, axis=-1, keepdims=True)
    away = centre - camera.centre
    return np.linalg.norm(np.cross(rays, away), axis=-1) < RADIUS


def row(cameras=CAMERAS, seen=None):
    return silhouettes_of([ball(camera) if seen is None or n in seen else None for n, camera in enumerate(cameras)])


def test_tangents_of_a_ball_are_those_of_both_cameras():
    distances = tangent_distances(CAMERAS, [row()])
    assert np.isnan(np.diag(distances)).all()
    np.testing.assert_array_equal(distances, distances.T)
    assert distances[~np.eye(4, dtype=bool)].max() < 1.5
    missing = tangent_distances(CAMERAS, [row(seen=(0, 1)), row(seen=(0, 2))])
    assert np.isfinite(missing[0, [1, 2]]).all()
    assert np.isnan(missing[1, 2])


def test_tangent_planes_touch_the_ball():
    pair = CAMERAS[0], CAMERAS[1]
    first, second = outlines_of(pair, row(pair))
    assert first is not None
    assert second is not None
    found = tangent_angles(pair, (first, second))
    assert found is not None
    line = pair[1].centre - pair[0].centre
    line /= np.linalg.norm(line)
    assert abs(found.reference @ line) < 1e-9
    away = BALL - pair[0].centre
    away -= away @ line * line
    middle = np.arctan2(away @ np.cross(line, found.reference), away @ found.reference)
    half = np.arcsin(RADIUS / np.linalg.norm(away))
    np.testing.assert_allclose(found.angles, [[middle - half, middle + half]] * 2, atol=0.006)
    assert abs(middle) < 0.01  # the reference is the middle of both silhouettes
    turned = tangent_angles(pair, (first, second), np.cross(line, found.reference))
    assert turned is not None
    np.testing.assert_allclose(turned.angles, found.angles - np.pi / 2, atol=1e-9)
    levers = np.zeros(2)
    for outline in (first, second):
        aside = outline.rays - (outline.rays @ line)[:, None] * line
        angles = np.arctan2(aside @ np.cross(line, found.reference), aside @ found.reference)
        levers += [FOCAL / 2 * np.linalg.norm(aside[pick(angles)]) for pick in (np.argmin, np.argmax)]
    np.testing.assert_allclose(found.levers, levers)
    assert found.lever == pytest.approx(np.mean(levers))
    assert tangent_angles((pair[0], pair[0]), (first, first)) is None


def test_who_stands_between_the_cameras_has_no_tangents_and_none_is_at_the_border():
    pair = looking([3, 0, 1.0]), looking([-3, 0, 1.0])
    around = outlines_of(pair, silhouettes_of([ball(camera, np.array([0, 0, 1.0])) for camera in pair]))
    assert None not in around
    assert tangent_angles(pair, tuple(around)) is None
    first, second = outlines_of(CAMERAS[:2], row(CAMERAS[:2]))
    assert first is not None
    assert second is not None
    cut = first._replace(firm=np.zeros_like(first.firm))
    found = tangent_angles((CAMERAS[0], CAMERAS[1]), (cut, second))
    assert found is not None
    assert np.isnan(found.angles[0]).all()
    assert np.isfinite(found.angles[1]).all()


def test_rays_of_a_ball_s_outline_meet_all_other_silhouettes():
    found = pixels_beyond(CAMERAS, row())
    assert found.shape == (4, 5)
    assert found.max() < 1.5
    turned = replace(CAMERAS[2], T_camera_world=rigid(rotation_about([1, 0, 0], np.radians(6)), np.zeros(3)) @ CAMERAS[2].T_camera_world)
    wrong = [CAMERAS[0], CAMERAS[1], turned, CAMERAS[3]]
    beyond = pixels_beyond(wrong, row())
    assert beyond[0, 2] < 1.5  # without it the others agree
    assert beyond[0, -1] > 5
    assert beyond[2, -1] > 5
    assert (beyond[0, [0, 1, 3]] > 5).sum() >= 2
    few = pixels_beyond(CAMERAS, row(seen=(0, 1)))
    assert np.isnan(few).all()
    three = pixels_beyond(CAMERAS, row(seen=(0, 1, 2)))
    assert np.isnan(three[3]).all()
    assert np.isfinite(three[:3]).all()


@settings(max_examples=40)
@given(away=arrays(float, (3, 7, 4), elements=st.floats(0, 9)))
def test_percentiles_are_those_of_the_plain_loops(away):
    cameras, rays, depths = away.shape
    for left_out in (*range(cameras), None):
        kept = [n for n in range(cameras) if n != left_out]
        least = [min(max(away[n, p, z] for n in kept) for z in range(depths)) for p in range(rays)]
        index = cameras if left_out is None else left_out
        assert _percentiles(away)[index] == pytest.approx(np.percentile(least, COVERAGE_PERCENTILE))


def test_distances_are_those_of_the_nearest_pixel():
    distance = np.arange(12, dtype=np.float32).reshape(3, 4) + 1
    pixels = np.array([[0, 0], [3.4, 1.6], [3.6, 0], [-0.4, 2.4], [-0.6, 0], [0, 2.6], [np.nan, 1], [1e9, 0]])
    np.testing.assert_array_equal(_sampled(distance, pixels), [1, 12, 0, 9, 0, 0, 0, 0])


def test_the_middle_is_where_rays_meet():
    def outline(camera: Camera, place) -> Outline:
        ray = np.asarray(place) - camera.centre
        return Outline(np.zeros((1, 2)), np.ones(1, bool), ray[None] / np.linalg.norm(ray))

    place = [0.3, 0.2, 1.4]
    seen = [outline(camera, place) for camera in CAMERAS]
    np.testing.assert_allclose(triangulated_centre(CAMERAS, seen), place, atol=1e-9)
    np.testing.assert_allclose(triangulated_centre(CAMERAS, [seen[0], None, seen[2], None]), place, atol=1e-9)
    assert triangulated_centre(CAMERAS, [seen[0], None, None, None]) is None
    assert triangulated_centre((CAMERAS[0], CAMERAS[0]), [seen[0], seen[0]]) is None
    two = [outline(CAMERAS[0], place), outline(CAMERAS[1], np.add(place, [0, 0, 0.1]))]
    found = triangulated_centre(CAMERAS[:2], two)
    assert found is not None
    misses = [np.linalg.norm(np.cross(each.rays[0], found - camera.centre)) for each, camera in zip(two, CAMERAS)]
    assert misses[0] == pytest.approx(misses[1], rel=1e-6)  # halfway
