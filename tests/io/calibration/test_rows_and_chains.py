"""Kalibr's chains of cameras, and files that are rows of numbers: the cameras that were written come back, what is missing is named."""

from __future__ import annotations

import calibrations
import numpy as np
import pytest

from shadowpuppet.errors import CalibrationError
from shadowpuppet.io.calibration.calibration_files import examine_calibration, read_calibration
from shadowpuppet.io.calibration.formats import find_calibration


@pytest.fixture(scope="module")
def made():
    return calibrations.cameras(lens=(-0.08, 0.03, 0.0004, -0.0003))


def written(folder, name, text):
    (folder / name).write_text(text)
    return folder / name


def said(path, *words):
    with pytest.raises(CalibrationError) as caught:
        read_calibration(path)
    assert all(word in str(caught.value) for word in (str(path), *words)), str(caught.value)


@pytest.mark.parametrize("indented", ["  - [", "- [ "])
def test_a_chain_is_in_the_frame_of_its_first_camera(tmp_path, made, rng, indented):
    text = calibrations.kalibr(made).replace("  - [", indented)
    found = read_calibration(written(tmp_path, "camchain.yaml", text))
    assert [(camera.name, camera.size, camera.fisheye) for camera in found] == [(f"cam{n}", calibrations.SIZE, False) for n in range(3)]
    points = rng.normal(0, 0.4, (40, 3))
    to_first = made[0].T_camera_world
    for a, b in zip(found, made):
        np.testing.assert_allclose(a.project(points @ to_first[:3, :3].T + to_first[:3, 3]), b.project(points), atol=1e-6)


def test_a_chain_may_have_fisheyes_or_no_distortion(tmp_path, made):
    fisheye, = read_calibration(written(tmp_path, "camchain.yaml", calibrations.kalibr(made[:1], distortion="equidistant")))
    assert fisheye.fisheye
    np.testing.assert_allclose(fisheye.distortion[:4], made[0].distortion[:4])
    plain, = read_calibration(written(tmp_path, "camchain.yaml", calibrations.kalibr(made[:1], distortion="none")))
    assert not plain.distortion.any()


@pytest.mark.parametrize(("before", "after", "words"), [
    ("camera_model: pinhole", "camera_model: omni", ("[cam0]: camera_model and distortion_model: found 'omni' and 'radtan'",)),
    ("distortion_model: radtan", "distortion_model: fov", ("found 'pinhole' and 'fov', expected pinhole and one of radtan, equidistant",)),
    ("intrinsics: [", "intrinsics: [1.0, ", ("[cam0]: intrinsics: found", "expected 4 finite numbers")),
    ("T_cn_cnm1", "T_cam_imu", ("[cam1]: T_cn_cnm1: found 'nothing', expected 16 finite numbers",)),
    ("resolution: [640, 480]", "resolution: [nan, 480]", ("[cam0]: resolution: found",)),
])
def test_what_is_missing_in_a_chain_is_named(tmp_path, made, before, after, words):
    said(written(tmp_path, "camchain.yaml", calibrations.kalibr(made).replace(before, after, 1)), *words)


def test_krt_s_unit_is_not_known_and_may_be_stated(tmp_path, made):
    path = written(tmp_path, "KRT", calibrations.krt(made))
    assert not examine_calibration(path).unit_known
    np.testing.assert_allclose(read_calibration(path, unit="mm")[1].centre, made[1].centre / 1000, atol=1e-9)


def test_krt_may_have_two_coefficients(tmp_path, made):
    lines = calibrations.krt(made[:1]).splitlines()
    lines[4] = "-0.08 0.03"
    camera, = read_calibration(written(tmp_path, "KRT", "\n".join(lines)), sizes=lambda name: calibrations.SIZE)
    np.testing.assert_allclose(camera.distortion[:4], [-0.08, 0.03, 0, 0])


@pytest.mark.parametrize(("line", "text", "words"), [
    (1, "1 2", ("line 2: found '1 2', expected 3 finite numbers",)),
    (4, "1 2 3", ("line 5: found '1 2 3', expected 1 or 2 or 4 or 5 or 8 finite numbers",)),
    (5, "a b c d", ("line 6: found 'a b c d', expected 4 finite numbers",)),
    (7, None, ("line 7: the file ends within camera", "expected eight rows")),
])
def test_what_is_wrong_in_krt_is_named(tmp_path, made, line, text, words):
    lines = calibrations.krt(made[:1]).splitlines()
    lines[line:] = [] if text is None else [text, *lines[line + 1 :]]
    path = written(tmp_path, "KRT", "\n".join(lines))
    with pytest.raises(CalibrationError) as caught:
        read_calibration(path)
    assert all(word in str(caught.value) for word in words), str(caught.value)


def test_an_empty_krt_has_no_camera(tmp_path):
    said(written(tmp_path, "KRT", "\n\n"), "found no camera in it")


def test_biocv_s_cameras_are_a_file_each(tmp_path, made):
    for camera in made:
        written(tmp_path, f"{camera.name}.mp4.calib", calibrations.biocv(camera))
    found = read_calibration(tmp_path)
    assert [camera.name for camera in found] == [camera.name for camera in made]
    np.testing.assert_allclose([camera.centre for camera in found], [camera.centre for camera in made], atol=1e-9)
    assert find_calibration(tmp_path) == tmp_path


def test_a_short_file_of_biocv_s_is_reported(tmp_path, made):
    said(written(tmp_path, "00.calib", "640\n480\n1 0 0\n"), "not as many as in BioCV's files")
