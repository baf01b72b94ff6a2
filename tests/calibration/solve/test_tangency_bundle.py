"""Cameras placed by outlines: they come back from rough places, and what is not known is said."""

from __future__ import annotations

from dataclasses import replace

import made_rig
import numpy as np
import pytest

from shadowpuppet.calibration.epipolar_tangency import tangent_distances
from shadowpuppet.calibration.silhouettes import silhouettes_of
from shadowpuppet.calibration.solve.tangency_bundle import place_by_outlines
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import align, rigid, rotation_from_vector, unit, vector_from_rotation

SIZE, FRAMES = (320, 240), 24


@pytest.fixture(scope="module")
def true():
    return made_rig.cameras(4, size=SIZE)


@pytest.fixture(scope="module")
def rows(true):
    return [silhouettes_of(row) for row in made_rig.masks(true, FRAMES)]


def rough(cameras, rng, degrees, metres, which=None):
    """The cameras, or some of them, turned and moved by so much in random directions."""
    out = list(cameras)
    for n in range(len(cameras)) if which is None else which:
        turn, move = np.radians(degrees) * unit(rng.normal(size=3)), metres * unit(rng.normal(size=3))
        R = rotation_from_vector(turn) @ cameras[n].T_camera_world[:3, :3]
        out[n] = replace(cameras[n], T_camera_world=rigid(R, -R @ (cameras[n].centre + move)))
    return out


def errors(found, true):
    """Errors within the rig: of places (C,), metres, and directions (C,), degrees, after the best similarity."""
    moved = align(np.array([camera.centre for camera in found]), np.array([camera.centre for camera in true]), scaled=True)
    places = moved.apply(np.array([camera.centre for camera in found])) - np.array([camera.centre for camera in true])
    turns = [vector_from_rotation(a.T_camera_world[:3, :3] @ moved.rotation.T @ b.T_camera_world[:3, :3].T) for a, b in zip(found, true)]
    return np.linalg.norm(places, axis=1), np.degrees(np.linalg.norm(turns, axis=1))


@pytest.fixture(scope="module")
def fits(true, rows):
    """Of cameras a little and far off: where they began, and what was found."""
    starts = [rough(true, np.random.default_rng(seed), degrees, metres) for seed, degrees, metres in ((3, 1.0, 0.05), (4, 6.0, 0.3))]
    return [(start, place_by_outlines(start, rows)) for start in starts]


def test_focal_lengths_come_back_with_the_places(true, rows):
    rng = np.random.default_rng(6)
    factors = [1.04, 0.97, 0.96, 1.02]
    start = [replace(camera, matrix=camera.matrix * [factor, factor, 1])
             for camera, factor in zip(rough(true, rng, 3.0, 0.1), factors)]
    kept, fit = place_by_outlines(start, rows), place_by_outlines(start, rows, rough_focal=0.05)
    assert errors(fit.cameras, true)[0].mean() < 0.5 * errors(kept.cameras, true)[0].mean()
    assert np.nanmax(fit.after) < 0.9 * np.nanmax(kept.after)
    found, exact = (np.array([camera.matrix[0, 0] for camera in cameras]) for cameras in (fit.cameras, true))
    assert np.abs(found / exact - 1).max() < 0.02
    assert (np.abs(found / exact - 1) < 6 * fit.focal_sd).all()
    for camera, before in zip(fit.cameras, start):
        np.testing.assert_array_equal(camera.matrix[:2, 2], before.matrix[:2, 2])  # the principal point stays
    assert not kept.focal_sd.any()
    for camera, before in zip(kept.cameras, start):
        np.testing.assert_array_equal(camera.matrix, before.matrix)


@pytest.mark.parametrize("stands", [[5], [5, 6]])
def test_of_a_person_who_keeps_still_nothing_is_stated_for_certain(true, rows, stands):
    """Sets that are alike agree with each other, whatever their error."""
    fit = place_by_outlines(rough(true, np.random.default_rng(3), 3.0, 0.1), [rows[n] for n in stands] * (FRAMES // len(stands)))
    assert (3 * fit.place_sd > errors(fit.cameras, true)[0]).all()
    assert (3 * fit.place_sd > 0.1).all()


@pytest.mark.parametrize("which", [0, 1])
def test_cameras_come_back_from_rough_places(true, rows, fits, which):
    start, fit = fits[which]
    places, turns = errors(fit.cameras, true)
    assert places.max() < 0.03
    assert turns.max() < 0.6
    assert places.max() < 9 * fit.place_sd.max()
    assert (fit.after < 0.5).all()
    assert (fit.before > 3 * fit.after).all()
    assert fit.far < 0.02
    assert np.nanmax(tangent_distances(fit.cameras, rows)) < 1
    for camera, before, exact in zip(fit.cameras, start, true):
        np.testing.assert_array_equal(camera.matrix, before.matrix)
        assert camera.name == before.name
        assert np.linalg.norm(camera.centre - exact.centre) < 0.4  # the world stays near the rough one


def test_the_optimum_is_the_same_from_either_start(fits):
    places, turns = errors(fits[0][1].cameras, fits[1][1].cameras)
    assert places.max() < 0.003
    assert turns.max() < 0.05


def test_only_those_that_are_free_move(true, rows):
    start = rough(true, np.random.default_rng(7), 3.0, 0.1, which=[1])
    fit = place_by_outlines(start, rows, free=[1])
    assert [found is before for found, before in zip(fit.cameras, start)] == [True, False, True, True]
    assert np.linalg.norm(fit.cameras[1].centre - true[1].centre) < 0.02
    assert fit.place_sd[1] > 0
    assert fit.place_sd[[0, 2, 3]].max() == 0


def test_silhouettes_that_lack_a_part_show_in_the_share_of_far_tangents(true):
    def cut(mask):
        out = mask.copy()
        out[np.flatnonzero(mask.any(1))[-1] - 25 :] = False
        return out

    masks = [[cut(mask) if n == 2 and f % 3 else mask for n, mask in enumerate(row)] for f, row in enumerate(made_rig.masks(true, FRAMES))]
    assert place_by_outlines(true, [silhouettes_of(row) for row in masks]).far > 0.1


def test_a_person_at_one_place_tells_less_than_one_who_walks(true, rows, fits):
    still = [rows[0], rows[1]] * (FRAMES // 2)
    stayed = place_by_outlines(rough(true, np.random.default_rng(8), 3.0, 0.1), still)
    assert errors(stayed.cameras, true)[0].max() > 2 * errors(fits[0][1].cameras, true)[0].max()


def test_too_few_outlines_are_an_error(true, rows):
    with pytest.raises(CalibrationError, match=r"camera 'cam1': found \d+ tangents that other cameras see, too, expected at least 30"):
        place_by_outlines(true, rows[:2])
    lonely = [[None, *row[1:]] for row in rows]
    with pytest.raises(CalibrationError, match="found 0 tangents"):
        place_by_outlines(true, lonely)
    assert len(place_by_outlines(true, lonely, free=[1, 2, 3]).cameras) == 4
