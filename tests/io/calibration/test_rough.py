"""Rough places of cameras: what is written down is what is read, and what cannot be meant is refused by name."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.io.calibration.calibration_files import examine_calibration, read_calibration
from shadowpuppet.io.calibration.formats import find_calibration

TEXT = """[left]
at = [2.5, -3.0, 1.4]
toward = [0.0, 0.5, 1.0]
fov = 60
size = [640, 480]
[right]
at = [-2, 0, 1]
toward = [0, 0, 1]
fov = 40
"""


def written(folder, text):
    (folder / "rough.toml").write_text(text)
    return folder / "rough.toml"


def test_cameras_stand_where_they_are_said_to_and_are_level(tmp_path):
    path = written(tmp_path, TEXT)
    left, right = read_calibration(path, sizes=lambda name: (480, 640))
    assert (left.name, left.size, right.name, right.size) == ("left", (640, 480), "right", (480, 640))
    np.testing.assert_allclose([left.centre, right.centre], [[2.5, -3, 1.4], [-2, 0, 1]], atol=1e-9)
    middle = Camera.from_fov((640, 480), np.radians(60)).matrix[:2, 2]
    np.testing.assert_allclose(left.project([0, 0.5, 1]), middle, atol=1e-6)
    for camera, degrees in ((left, 60), (right, 40)):
        assert camera.T_camera_world[0, 2] == pytest.approx(0)  # rows are horizontal
        assert camera.T_camera_world[1, 2] < 0  # and up is up
        assert np.degrees(2 * np.arctan(camera.size[0] / 2 / camera.matrix[0, 0])) == pytest.approx(degrees)
    assert "calibrate RECORDING --from-person" in examine_calibration(path, sizes=lambda name: (480, 640)).notes[0]


def test_a_unit_and_an_up_direction_are_those_of_other_calibrations(tmp_path):
    left, _ = read_calibration(written(tmp_path, TEXT), unit="mm", up="y", sizes=lambda name: (480, 640))
    np.testing.assert_allclose(left.centre, [2.5, -3, 1.4], atol=1e-9)


def test_rough_places_are_no_calibration_of_a_recording(tmp_path):
    written(tmp_path, TEXT)
    assert find_calibration(tmp_path) is None


@pytest.mark.parametrize(("before", "after", "words"), [
    ("fov = 60\n", "", "[left]: fov: missing, expected at, toward, fov"),
    ("fov = 60", "fov = 180", "[left]: fov: found 180 degrees, expected between 0 and 180"),
    ("fov = 60", "fov = [60]", "[left]: fov: found [60], expected a finite number"),
    ("toward = [0.0, 0.5, 1.0]", "toward = [2.5, -3.0, 1.4]", "[left]: toward: found [2.5, -3.0, 1.4], the place of the camera itself"),
    ("toward = [0.0, 0.5, 1.0]", "toward = [2.5, -3.0, 0]", "[left]: toward: found [2.5, -3.0, 0.0], straight below the camera"),
    ("at = [-2, 0, 1]", "at = [-2, 0]", "[right]: at: found [-2, 0], expected 3 finite numbers"),
    ("at = [2.5", "att = [2.5", "[left]: att: no such value; possible are at, toward, fov, size; did you mean at?"),
    ("toward", "towrad", "[left]: towrad: no such value; possible are at, toward, fov, size; did you mean toward?"),
    ("nothing", "nothing", "[right]: size: missing, expected the pictures' width and height in pixels, such as size = [1920, 1080]"),
])
def test_what_cannot_be_meant_is_named(tmp_path, before, after, words):
    path = written(tmp_path, TEXT.replace(before, after, 1))
    with pytest.raises(CalibrationError) as caught:
        read_calibration(path)
    assert f"{path}: {words}" in str(caught.value)
