"""The floor that a person of known stature shows: cameras at known heights and tilts, who walks, stands and squats before them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from legs import bent, over_floor, wide

from shadowpuppet.body.models import average_sizes
from shadowpuppet.camera.camera import Camera
from shadowpuppet.camera.rasterize import place
from shadowpuppet.tracking.monocular.ground import calibrated_ground, moved_to, shown_ground
from shadowpuppet.tracking.monocular.size_search import Ground, PersonEstimate

EYE, FAR = 1.3, 3.0
SIZES = average_sizes("anatomical", 1.7)


def up_of(tilt: float) -> np.ndarray:
    """The vertical in the frame of a camera that looks down by a tilt, degrees."""
    return np.array([0.0, -np.cos(np.radians(tilt)), -np.sin(np.radians(tilt))])


def camera() -> Camera:
    """One of unknown place, whose picture is high enough."""
    own = wide(over_floor("anatomical")).camera
    matrix = own.matrix.copy()
    matrix[1, 2] = 160
    return replace(own, size=(own.size[0], 320), matrix=matrix, oriented=False)


def masks(tilt: float, places, low=()):
    """Silhouettes of a person at some level distances (m) before a camera with a tilt, degrees; of `low` ones squatting."""
    view = PersonEstimate(SIZES, 1.7, FAR, 0.0, Ground(up_of(tilt), EYE)).picture(camera(), "anatomical")
    skeleton, found = view.body.skeleton, []
    for n, far in enumerate(places):
        pose = bent(skeleton, 60, 90, 30) if n in low else skeleton.pose()
        feet = view.body.points(pose[None], names=["left_heel", "left_toe"])[0, :, 2].min()
        assert view.floor is not None
        pose[skeleton.dof_indices(["root_x", "root_z"])] = FAR - far, view.floor - feet
        found.append(view.mask(pose))
    return found


GUESS = PersonEstimate(SIZES, 1.7, 2.6, -0.1)


@pytest.mark.parametrize("tilt", [-6.0, 0.0, 9.0, 15.0])
def test_a_walk_shows_tilt_and_height_of_the_camera(tilt):
    found = shown_ground(camera(), masks(tilt, np.linspace(2.2, 5.0, 10)), GUESS, "anatomical")
    assert found is not None
    assert np.degrees(np.arccos(np.clip(found.up @ up_of(tilt), -1, 1))) <= 1.5
    assert found.eye == pytest.approx(EYE, abs=0.08)


def test_who_stays_shows_the_height_of_a_level_camera_even_if_they_mostly_squat():
    places, low = [3.0] * 9, (1, 2, 4, 6, 7)
    found = shown_ground(camera(), masks(0.0, places, low), GUESS, "anatomical")
    assert found is not None
    assert np.degrees(np.arccos(np.clip(found.up @ up_of(0.0), -1, 1))) <= 3
    at = found.eye - FAR * np.tan(np.arcsin(-found.up[2]))  # where the person is, a tilt is as good as another height
    assert at == pytest.approx(EYE, abs=0.12)


def test_too_few_moments_and_feet_out_of_the_picture_show_no_floor():
    seen = masks(0.0, [3.0, 3.2])
    assert shown_ground(camera(), seen, GUESS, "anatomical") is None
    cut = [mask.copy() for mask in masks(0.0, [2.8, 3.0, 3.2, 3.4])]
    for mask in cut:
        mask[-1, 100] = True
    assert shown_ground(camera(), cut, GUESS, "anatomical") is None


def test_the_calibration_tells_the_vertical_and_a_floor():
    placed = over_floor("anatomical", high=1.2).camera
    ground = calibrated_ground(placed)
    assert ground is not None
    assert ground.eye == pytest.approx(1.2)
    np.testing.assert_allclose(ground.up, placed.T_camera_world[:3, 2])
    assert calibrated_ground(camera()) is None


def test_an_estimate_with_another_floor_is_at_the_same_place():
    moved = moved_to(camera(), GUESS, Ground(up_of(12.0), EYE))
    at, before = (place(camera(), each.distance, each.elevation, up)[:3, 3] for each, up in ((moved, up_of(12.0)), (GUESS, None)))
    np.testing.assert_allclose(at, before, atol=1e-12)
    assert moved.picture(camera(), "anatomical").floor == pytest.approx(-EYE - moved.elevation)
