"""The bundle: its derivatives against finite differences, and places, delays and lenses from simulated corners."""

from __future__ import annotations

from dataclasses import replace

import boards
import numpy as np
import pytest

from shadowpuppet.calibration.solve.bundle import Bundle, Free, adjust, projected
from shadowpuppet.calibration.solve.lens import MODELS, lens_advice, observations, solve_lens
from shadowpuppet.calibration.solve.placement import place_cameras
from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import inverse, rigid, rotation_from_vector


def lens(fisheye: bool) -> Camera:
    matrix = np.array([[700.0, 0, 640], [0, 710, 350], [0, 0, 1]])
    return Camera("c", (1280, 720), matrix, np.array([-0.03, 0.01, 0.002, -0.001]), fisheye=fisheye)


@pytest.mark.parametrize("fisheye", [False, True])
def test_derivatives_of_lenses_are_those_of_finite_differences(fisheye):
    camera, points = lens(fisheye), np.array([[0.3, 0.2, 1.0], [-1, 0.5, 1.7], [0.05, -0.4, 2.0]])
    pixels, by_point, by_lens = projected(camera, points)
    np.testing.assert_allclose(pixels, camera.project(points), atol=1e-9)
    for k in range(3):
        step = 1e-6 * np.eye(3)[k]
        slope = (projected(camera, points + step)[0] - projected(camera, points - step)[0]) / 2e-6
        np.testing.assert_allclose(by_point[:, :, k], slope, atol=1e-3)
    for k in range(8):
        def at(d: float, k: int = k) -> np.ndarray:
            matrix, bent = camera.matrix.copy(), camera.distortion.copy()
            matrix[[0, 1, 0, 1], [0, 1, 2, 2]] += d * np.eye(8)[k, :4]
            bent[:4] += d * np.eye(8)[k, 4:]
            return projected(replace(camera, matrix=matrix, distortion=bent), points)[0]

        np.testing.assert_allclose(by_lens[:, :, k], (at(1e-5) - at(-1e-5)) / 2e-5, atol=1e-3)


@pytest.fixture(scope="module")
def rig():
    return boards.ring(4)


def bare(cameras):
    """The cameras without their places."""
    return [replace(camera, T_camera_world=np.eye(4)) for camera in cameras]


def off(true: Camera, found: Camera) -> tuple[float, float]:
    """Errors of place, millimetres, and direction, degrees."""
    T = true.T_camera_world @ inverse(found.T_camera_world)
    return 1000 * float(np.linalg.norm(true.centre - found.centre)), float(np.degrees(np.arccos(min(1.0, (np.trace(T[:3, :3]) - 1) / 2))))


def floor(cameras, rng):
    return {n: view for n, camera in enumerate(cameras) if (view := boards.view_of(camera, boards.FLOOR, rng)) is not None}


def test_places_and_delays_from_a_board_carried_and_laid_down(rig):
    rng = np.random.default_rng(3)
    late = (0.0, 0.02, 0.0, -0.05)
    views, speeds = boards.moments(rig, rng, 50, delays=late)
    placed = place_cameras(bare(rig), boards.BOARD, views, floor(rig, rng), speeds)
    for true, found in zip(rig, placed.cameras):
        place, angle = off(true, found)
        assert place < 5
        assert angle < 0.1
    delays = placed.solved.bundle.delays
    np.testing.assert_allclose(30 * (delays - delays[0]), 30 * np.array(late), atol=0.2)


def test_a_board_on_the_floor_has_its_thickness(rig):
    rng = np.random.default_rng(3)
    views, _ = boards.moments(rig, rng, 40)
    thick = replace(boards.BOARD, thickness=0.05)
    placed = place_cameras(bare(rig), thick, views, floor(rig, rng))
    assert placed.cameras[0].centre[2] == pytest.approx(rig[0].centre[2] + 0.05, abs=0.01)


def test_without_a_floor_z_is_up(rig):
    rng = np.random.default_rng(3)
    placed = place_cameras(bare(rig), boards.BOARD, boards.moments(rig, rng, 40)[0])
    assert not placed.floor
    true, found = (np.array([camera.centre for camera in cameras]) for cameras in (rig, placed.cameras))
    np.testing.assert_allclose(found[:, 2] - found[0, 2], true[:, 2] - true[0, 2], atol=0.05)


def test_what_is_held_is_the_board_on_the_floor_or_else_a_camera(rig, monkeypatch):
    given = []
    monkeypatch.setattr("shadowpuppet.calibration.solve.placement.adjust",
                        lambda start, seen, free: given.append(free) or adjust(start, seen, free))
    rng = np.random.default_rng(3)
    views = boards.moments(rig, rng, 40)[0]
    place_cameras(bare(rig), boards.BOARD, views, floor(rig, rng))
    for free in given:
        assert all(free.places)
        assert not free.boards[-1]
        assert sum(free.boards[:-1]) > 10
        assert not any(free.lenses)
    given.clear()
    place_cameras(bare(rig), boards.BOARD, views)
    for free in given:
        assert sum(free.places) == len(rig) - 1
        assert sum(free.boards) > 10


def test_some_wrong_views_do_not_matter(rig):
    rng = np.random.default_rng(3)
    views, _ = boards.moments(rig, rng, 50)
    for moment in views[::10]:
        for n, view in moment.items():
            moment[n] = view._replace(pixels=view.pixels + 25.0)
    placed = place_cameras(bare(rig), boards.BOARD, views, floor(rig, rng))
    assert max(off(true, found)[0] for true, found in zip(rig, placed.cameras)) < 8


def test_a_camera_that_never_sees_the_board_with_another_is_named(rig):
    views, _ = boards.moments(rig, np.random.default_rng(3), 50)
    apart = [{n: view for n, view in moment.items() if (n == 3) == (k % 2 == 0)} for k, moment in enumerate(views)]
    with pytest.raises(CalibrationError, match=r"'cam4' never sees the board at the same time as the others .*film again"):
        place_cameras(bare(rig), boards.BOARD, apart)


def test_a_camera_that_never_sees_the_board_is_named(rig):
    views, _ = boards.moments(rig, np.random.default_rng(3), 50)
    with pytest.raises(CalibrationError, match="'cam4' never sees the board well enough"):
        place_cameras(bare(rig), boards.BOARD, [{n: view for n, view in moment.items() if n != 3} for moment in views])


def test_a_board_with_the_pattern_on_both_sides_is_reported():
    rig = boards.ring(2)  # opposite each other
    views, _ = boards.moments(rig, np.random.default_rng(3), 60, two_sided=True)
    with pytest.raises(CalibrationError, match="two sides of the board"):
        place_cameras(bare(rig), boards.BOARD, views)


def test_a_lens_from_views_of_a_board():
    camera = boards.ring(1)[0]
    fit = solve_lens("cam1", boards.BOARD, boards.shown(camera, np.random.default_rng(2)), boards.SIZE)
    assert fit.model in MODELS[1:4]
    assert abs(fit.camera.matrix[0, 0] / camera.matrix[0, 0] - 1) < 0.003
    assert abs(fit.camera.matrix[1, 1] / camera.matrix[1, 1] - 1) < 0.003
    assert fit.rms < 0.2
    assert not lens_advice(fit)


@pytest.mark.parametrize("distances", [(1.5, 1.5), (1.2, 1.8)])
def test_a_focal_length_that_no_view_tells_is_unknown(distances):
    camera, rng = replace(boards.ring(1)[0], T_camera_world=np.eye(4), distortion=np.array([1e-9] * 8)), np.random.default_rng(2)
    poses = [rigid(np.eye(3), [*rng.uniform(-0.2, 0.2, 2), z]) for z in np.linspace(*distances, 8)]  # all of them square to it
    views = [boards.view_of(camera, T, rng, noise=0.01) for T in poses]
    seen = observations(boards.BOARD, [(0, b, view) for b, view in enumerate(views)])
    solved = adjust(Bundle((camera,), np.array(poses), np.zeros(1)), seen, Free([False], [True] * 8, [False], [True]))
    assert np.isfinite(solved.lens_sd[0])
    assert solved.lens_sd[0] > 1


@pytest.mark.whole
def test_a_fisheye_is_found_to_be_one():
    K = np.array([[420.0, 0, 640], [0, 420, 360], [0, 0, 1]])
    camera = Camera("wide", boards.SIZE, K, np.array([-0.02, 0.004, 0, 0]), fisheye=True)
    views = boards.shown(camera, np.random.default_rng(2), 40, distances=(0.5, 1.2))
    fit = solve_lens("wide", boards.BOARD, views, boards.SIZE)
    assert fit.model == "fisheye"
    assert abs(fit.camera.matrix[0, 0] / 420 - 1) < 0.01


def test_a_board_held_square_at_one_distance_is_reported():
    camera = boards.ring(1)[0]
    views = boards.shown(camera, np.random.default_rng(2), 40, tilt=2.0, distances=(1.5, 1.52))
    said = lens_advice(solve_lens("cam1", boards.BOARD, views, boards.SIZE))
    assert any("tilted by 30 to 45 degrees" in each for each in said)


def test_few_views_say_what_to_film():
    views = boards.shown(boards.ring(1)[0], np.random.default_rng(2), 4)
    with pytest.raises(CalibrationError, match=r"found 4 different views of the board .*film it again"):
        solve_lens("cam1", boards.BOARD, views, boards.SIZE)


def test_a_board_that_is_never_turned_is_reported():
    camera, rng = boards.ring(1)[0], np.random.default_rng(3)
    R, views = rotation_from_vector([0.5, 0.2, 0.0]), []
    for k in range(40):  # moved about, always tilted alike: parallel planes say one thing
        at = np.array([rng.uniform(-0.6, 0.6), rng.uniform(-0.3, 0.3), rng.uniform(1.2, 2.4)])
        view = boards.view_of(replace(camera, T_camera_world=np.eye(4)), rigid(R, at), rng, time=0.3 * k)
        views += [] if view is None else [view]
    fit = solve_lens(camera.name, boards.BOARD, views, camera.size)
    assert any("focal length is known to" in sentence and "in too few poses" in sentence for sentence in lens_advice(fit))
