"""Calibrations in JSON of any layout, and COLMAP's text."""

from __future__ import annotations

import contextlib
import json

import calibrations
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import CalibrationError
from shadowpuppet.geometry import inverse
from shadowpuppet.io.calibration.calibration_files import examine_calibration, read_calibration
from shadowpuppet.io.calibration.formats import find_calibration, is_calibration

MADE = calibrations.cameras(2)


def write(path, values):
    path.write_text(json.dumps(values))
    return path


def same(found, made=MADE, lens=5):
    assert [camera.name for camera in found] == [camera.name for camera in made]
    for one, other in zip(found, made):
        np.testing.assert_allclose(one.T_camera_world, other.T_camera_world, atol=1e-6)
        np.testing.assert_allclose(one.matrix, other.matrix, atol=1e-6)
        np.testing.assert_allclose(one.distortion[:lens], other.distortion[:lens], atol=1e-9)
        assert one.size == other.size


def test_cmu_panoptic_is_in_centimetres(tmp_path):
    (tmp_path / "p.json").write_text(calibrations.panoptic(MADE))
    found = examine_calibration(tmp_path / "p.json")
    assert found.unit == "cm"
    same(found.cameras)


def by_name(camera):
    return {"intrinsics": {"camera_matrix": camera.matrix.tolist(), "dist_coeffs": [camera.distortion[:5].tolist()]},
            "extrinsics": {"rvec": Rotation.from_matrix(camera.T_camera_world[:3, :3]).as_rotvec().tolist(),
                           "tvec": camera.T_camera_world[:3, 3].tolist()}, "image_size": list(camera.size)}  # fmt: skip


def flat(camera):
    K = camera.matrix
    return {"fx": K[0, 0], "fy": K[1, 1], "cx": K[0, 2], "cy": K[1, 2], "distortion": camera.distortion[:5].tolist(),
            "width": camera.size[0], "height": camera.size[1], "RT": camera.T_camera_world[:3].tolist()}  # fmt: skip


def reverse(camera):
    return {"K": camera.matrix.ravel().tolist(), "D": camera.distortion[:5].tolist(), "resolution": list(camera.size),
            "c2w": inverse(camera.T_camera_world).tolist()}


@pytest.mark.parametrize("layout", [by_name, flat, reverse])
@pytest.mark.parametrize("around", [lambda made: made, lambda made: {"rig": {"cameras": made}}])
def test_layouts_of_other_programs(tmp_path, layout, around):
    same(read_calibration(write(tmp_path / "c.json", around({camera.name: layout(camera) for camera in MADE}))))
    listed = [{"name": camera.name, **layout(camera)} for camera in MADE]
    same(read_calibration(write(tmp_path / "c.json", around(listed))))


@pytest.mark.parametrize(("change", "message"), [
    ({"K": [[1, 2], [3, 4]]}, "expected 3 x 3 numbers, or fx, fy, cx, cy"),
    ({"K": [1, 2, 3]}, "matrix: found 3 values, expected 9 or 4 finite"),
    ({"R": [[1, 0], [0, 1]]}, "rotation: found 4 values, expected 3 or 9"), ({"R": None}, "found a translation only"),
    ({"t": ["a", 1, 2]}, "translation: found .*expected numbers"), ({"D": [1, 2, 3]}, "distortion: found 3 values"),
    ({"K": [[float("nan")] * 3] * 3}, "expected 9 or 4 finite numbers"), ({"t": [1e9, 0, 0]}, "translation: found"),
])  # fmt: skip
def test_what_is_wrong_is_named(tmp_path, change, message):
    camera = MADE[0]
    table = {"K": camera.matrix.tolist(), "R": camera.T_camera_world[:3, :3].tolist(), "t": camera.T_camera_world[:3, 3].tolist(),
             "D": [0.0] * 5, "size": [640, 480], **change}  # fmt: skip
    with pytest.raises(CalibrationError, match=message):
        read_calibration(write(tmp_path / "c.json", {"a": table}))


@pytest.mark.parametrize("text", ["", "{", "[" * 100000, '{"a": 1}', "[1, 2]", "null"])
def test_json_without_cameras(tmp_path, text):
    (tmp_path / "c.json").write_text(text)
    assert not is_calibration(tmp_path / "c.json")
    with pytest.raises(CalibrationError, match="found "):
        read_calibration(tmp_path / "c.json")


leaves = st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=4) | st.lists(st.floats(), max_size=9)
trees = st.recursive(leaves, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
    st.sampled_from(["K", "R", "t", "D", "name", "size", "cameras", "fx", "RT", "c2w"]), inner, max_size=5), max_leaves=12)


@given(tree=trees)
def test_any_json_is_read_or_refused(tmp_path_factory, tree):
    path = write(tmp_path_factory.getbasetemp() / "any.json", tree)
    with contextlib.suppress(CalibrationError):
        assert read_calibration(path)


def test_other_json_of_a_recording_is_no_calibration(tmp_path):
    write(tmp_path / "metrics.json", {"iou": 0.9})
    assert find_calibration(tmp_path) is None
    (tmp_path / "rig.json").write_text(calibrations.panoptic(MADE))
    assert find_calibration(tmp_path) == tmp_path / "rig.json"


@pytest.fixture
def colmap(tmp_path):
    (tmp_path / "sparse").mkdir()
    for name, text in zip(("cameras.txt", "images.txt"), calibrations.colmap(MADE)):
        (tmp_path / "sparse" / name).write_text(text)
    return tmp_path / "sparse"


def test_colmap(colmap):
    same(read_calibration(colmap), lens=4)
    found = examine_calibration(colmap / "images.txt")
    same(found.cameras, lens=4)
    assert "unit of its own" in found.notes[0]
    assert find_calibration(colmap) == colmap


@pytest.mark.parametrize(("name", "text", "message"), [
    ("cameras.txt", "1 THIN_PRISM 640 480 1 2 3", "line 1: found the model 'THIN_PRISM'"),
    ("cameras.txt", "1 PINHOLE 640 480 1 2 3", "line 1: found 5 values, expected width, height and 4 parameters"),
    ("cameras.txt", "1", "line 1: found the model"), ("cameras.txt", "", "cameras.txt has"),
    ("images.txt", "1 1 0 0 0 0 0 0 9 a.jpg", "found the camera '9'"),
    ("images.txt", "1 3 0 0 0 0 0 0 1 a.jpg", "expected one of length 1"),
    ("images.txt", "1 x 0 0 0 0 0 0 1 a.jpg", "expected IMAGE_ID QW"), ("images.txt", "# none", "found no picture"),
])  # fmt: skip
def test_what_is_wrong_in_colmaps_files_is_named(colmap, name, text, message):
    (colmap / name).write_text(text)
    with pytest.raises(CalibrationError, match=message):
        read_calibration(colmap)
