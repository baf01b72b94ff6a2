"""Calibration files: what is written is read, what other programs write is read, what cannot be is said."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import rigid, rotation_from_vector
from shadowpuppet.io.calibration.calibration_files import read_calibration, write_calibration

GOOD = {
    "name": '"left"', "size": "[640, 480]", "matrix": "[[500.0, 0.0, 320.0], [0.0, 500.0, 240.0], [0.0, 0.0, 1.0]]",
    "distortions": "[0.1, 0.0, 0.0, 0.0]", "rotation": "[1.5, 0.1, -0.2]", "translation": "[0.0, 1.0, 4.0]", "fisheye": "false",
}


def section(title="cam1", without=(), **changes) -> str:
    return f"[{title}]\n" + "".join(f"{k} = {v}\n" for k, v in (GOOD | changes).items() if k not in without)


def read(tmp_path, text):
    path = tmp_path / "calibration.toml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_calibration(path)


reals = st.floats(-1, 1)
triples = st.tuples(reals, reals, reals)


@st.composite
def cameras(draw) -> Camera:
    name = draw(st.text(min_size=1, max_size=8).filter(lambda s: s.isprintable() and s.strip(" .") and not set(s) & set("/\\")))
    fisheye = draw(st.booleans())
    focal = st.floats(1, 5000)
    matrix = np.array([[draw(focal), 0, draw(st.floats(-100, 4000))], [0, draw(focal), 7.25], [0, 0, 1]])
    lens = draw(st.lists(reals, min_size=4, max_size=4) if fisheye else st.lists(reals, min_size=8, max_size=8)
                | st.lists(reals, min_size=5, max_size=5) | st.just([]))
    T = rigid(rotation_from_vector(np.array(draw(triples)) * math.pi), np.array(draw(triples)) * 50)
    size = (draw(st.integers(1, 9000)), draw(st.integers(1, 9000)))
    lens = (lens + [0.0] * 4)[:4] if fisheye else lens
    return Camera(name, size, matrix, lens, T, fisheye, draw(st.booleans()))


@settings(max_examples=50, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(st.lists(cameras(), min_size=1, max_size=3, unique_by=lambda c: c.name))
def test_what_is_written_is_read(tmp_path, rig):
    write_calibration(tmp_path / "c.toml", rig)
    found = read_calibration(tmp_path / "c.toml")
    for a, b in zip(rig, found, strict=True):
        assert (a.name, a.size, a.fisheye, a.oriented) == (b.name, b.size, b.fisheye, b.oriented)
        np.testing.assert_array_equal(a.matrix, b.matrix)
        np.testing.assert_array_equal(a.distortion, b.distortion)
        np.testing.assert_allclose(a.T_camera_world, b.T_camera_world, atol=1e-13, rtol=0)


def test_what_other_programs_add_is_skipped(tmp_path):
    text = section(without=["fisheye", "name"], size="[640.0, 480.0]", error="0.4", port="3", grid_count="[1, 2]")
    others = "# by another program\nversion = 3\n[capture]\nfps = 30\n"
    found = read(tmp_path, others + text + "[metadata]\nadjusted = false\nerror = 0\n")
    assert [(c.name, c.size, c.fisheye) for c in found] == [("cam1", (640, 480), False)]


def test_a_rotation_may_be_a_matrix(tmp_path):
    R = rotation_from_vector([1.5, 0.1, -0.2])
    as_matrix, as_vector = read(tmp_path, section(rotation=R.tolist())), read(tmp_path, section())
    np.testing.assert_allclose(as_matrix[0].T_camera_world, as_vector[0].T_camera_world, atol=1e-12)


def test_a_rotation_is_at_most_a_full_turn(tmp_path):
    whole = read(tmp_path, section(rotation=f"[0.0, {2 * math.pi}, 0.0]"))[0]
    np.testing.assert_allclose(whole.T_camera_world[:3, :3], np.eye(3), atol=1e-12)
    with pytest.raises(CalibrationError, match=r"rotation: found a vector of length 6\.29, expected radians, at most a full turn"):
        read(tmp_path, section(rotation="[0.0, 6.29, 0.0]"))


@pytest.mark.parametrize("field", ["size", "matrix", "distortions", "rotation", "translation"])
def test_a_missing_field_is_said(tmp_path, field):
    with pytest.raises(CalibrationError, match=rf"calibration.toml: \[cam1\]: {field}: missing, expected size, matrix"):
        read(tmp_path, section(without=[field]))


def test_a_misspelt_field_is_named_with_the_missing_one(tmp_path):
    with pytest.raises(CalibrationError, match=r"\[cam1\]: matrix: missing, expected .*translation; found matirx, which is not known$"):
        read(tmp_path, section().replace("matrix", "matirx"))


@pytest.mark.parametrize(("changes", "said"), [
    ({"size": '"640x480"'}, "size: found 640x480, expected 2 finite numbers"),
    ({"size": "[640]"}, "size: found [640], expected 2 finite numbers"),
    ({"size": "[640, true]"}, "size: found [640, True]"),
    ({"size": "[640.5, 480]"}, "size"),
    ({"size": "[-640, 480]"}, "size"),
    ({"matrix": "[500, 500, 320, 240]"}, "matrix: found [500, 500, 320, 240], expected 3 x 3 finite numbers"),
    ({"matrix": "[[1, 0, 0], [0, 1], [0, 0, 1]]"}, "matrix"),
    ({"matrix": "[[500, 0, 320], [0, nan, 240], [0, 0, 1]]"}, "matrix"),
    ({"matrix": "[[500, 3, 320], [0, 500, 240], [0, 0, 1]]"}, "skew"),
    ({"distortions": "0.1"}, "distortions: found 0.1, expected a row of finite numbers"),
    ({"distortions": "[0.1, 0.2]"}, "distortions: found 2 numbers, expected 0 or 4 or 5 or 8"),
    ({"distortions": "[0.1, 0, 0, 1" + "0" * 400 + "]"}, "distortions"),
    ({"rotation": "[nan, 0, 0]"}, "rotation: found [nan, 0, 0], expected 3 or 3 x 3 finite numbers"),
    ({"rotation": "[90.0, 0, 0]"}, "are these degrees?"),
    ({"rotation": "[[1, 0.1, 0], [0, 1, 0], [0, 0, 1]]"}, "rotation: found [[1.0, 0.1, 0.0]"),
    ({"rotation": "[[-1, 0, 0], [0, 1, 0], [0, 0, 1]]"}, "right-handed"),
    ({"translation": "[120.0, 960.0, 2860.0]"}, "it is probably in millimetres: say so"),
    ({"translation": "[120.0, 96.0, 286.0]"}, "it is probably in centimetres: say so by unit = \"cm\""),
    ({"translation": "[inf, 0, 0]"}, "translation"),
    ({"fisheye": "0"}, "fisheye: found 0, expected true or false"),
    ({"name": "3"}, "name: found 3"),
    ({"name": '""'}, "name"),
    ({"name": '".."'}, "name"),
    ({"name": '"../../etc/left"'}, "name: found '../../etc/left', expected a word that can be a file's name"),
])
def test_a_bad_field_is_said_with_file_section_and_field(tmp_path, changes, said):
    with pytest.raises(CalibrationError) as error:
        read(tmp_path, section(**changes))
    assert str(error.value).startswith(f"{tmp_path / 'calibration.toml'}: [cam1]: ")
    assert said in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


def test_a_camera_may_stand_a_hundred_metres_off(tmp_path):
    camera = read(tmp_path, section(translation="[60.0, 0.0, 80.0]"))[0]
    assert np.linalg.norm(camera.centre) == pytest.approx(100)
    with pytest.raises(CalibrationError, match=r"translation: found .*, 100\.001 long, expected at most 100 metres"):
        read(tmp_path, section(translation="[0.0, 0.0, 100.001]"))


def test_two_cameras_of_one_name_are_said(tmp_path):
    with pytest.raises(CalibrationError, match=r"\[b\]: name: found 'left', which another section has"):
        read(tmp_path, section("a") + section("b"))
    with pytest.raises(CalibrationError, match="two cameras are called 'left'"):
        write_calibration(tmp_path / "c.toml", read(tmp_path, section()) * 2)


@pytest.mark.parametrize(("text", "said"), [
    ("", "no camera in it"),
    ("[metadata]\nerror = 0\n", r"no camera in it, expected a section for each, such as \[cam1\]"),
    ("[cam1]\nsize = [640, 480\nmatrix = 1", "not valid TOML.*line 3"),
    (b"\x89PNG\r\n\x1a\n\xff\xfe", "bytes that are no text at position 0"),
    (section() + "a = " + "[" * 5000, "not valid TOML"),
])
def test_a_file_that_is_no_calibration_is_said(tmp_path, text, said):
    with pytest.raises(CalibrationError, match=said):
        read(tmp_path, text)


def test_a_missing_a_huge_and_an_unwritable_file_are_said(tmp_path):
    with pytest.raises(CalibrationError, match="no such file"):
        read_calibration(tmp_path / "nowhere.toml")
    with pytest.raises(CalibrationError, match="is a directory"):
        read_calibration(tmp_path)
    with open(tmp_path / "film.toml", "wb") as file:
        file.truncate(11_000_000)
    with pytest.raises(CalibrationError, match="found 11000000 bytes"):
        read_calibration(tmp_path / "film.toml")
    with pytest.raises(CalibrationError, match="cannot be written"):
        write_calibration(tmp_path / "nowhere" / "c.toml", read(tmp_path, section()))


@pytest.mark.shared
def test_shared_calibrations_round_trip(shared, tmp_path):
    files = [*shared.glob("recordings/*/calibration.toml"), *shared.glob("real/*/calibration.toml")]
    assert files
    for file in files:
        rig = read_calibration(file)
        write_calibration(tmp_path / "c.toml", rig)
        for a, b in zip(rig, read_calibration(tmp_path / "c.toml"), strict=True):
            assert (a.name, a.size) == (b.name, b.size)
            np.testing.assert_allclose(a.T_camera_world, b.T_camera_world, atol=1e-13, rtol=0)
