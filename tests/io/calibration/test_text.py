"""Text of calibration files: numbers with decimal commas, and every format in UTF-16."""

from __future__ import annotations

import re

import calibrations
import numpy as np
import pytest

from shadowpuppet.io.calibration.calibration_files import examine_calibration, read_calibration
from shadowpuppet.io.calibration.draft import numbers_of
from shadowpuppet.io.calibration.formats import is_calibration

MADE = calibrations.cameras(3)


@pytest.mark.parametrize(("text", "counts", "values"), [
    ("1,2,3", (3,), [1, 2, 3]), ("1, 2, 3", (3,), [1, 2, 3]), ("640,480", (2,), [640, 480]), ("1,2, 3,4", (4,), [1, 2, 3, 4]),
    ("1,2,3\n4,5,6", (6,), [1, 2, 3, 4, 5, 6]), ("0,5", (1,), [0.5]), ("0,5 -0,25 1", (3, 5), [0.5, -0.25, 1]),
    ("0,5 1,5e-1", (2, 4), [0.5, 0.15]), ("0,5, 0,25", (2,), [0.5, 0.25]), ("0,5 0,25", (4,), None), ("0,5, 0,25", (2, 4), None),
    ("0,5", (1, 2), None), ("0,5 1.5 2", (3,), [0.5, 1.5, 2]), ("1,2,3 4,5", (5,), [1, 2, 3, 4, 5]), (None, (1,), None),
    ("a,b", (2,), None),
])  # fmt: skip
def test_a_decimal_comma_is_read_or_refused(text, counts, values):
    found = numbers_of(text, counts)
    assert (None if found is None else found.tolist()) == values


@pytest.mark.parametrize("name", ["Calib.qca.txt", "session.xcp"])
def test_xml_with_decimal_commas_tells_the_same_cameras(tmp_path, name):
    path = calibrations.write_all(tmp_path, MADE)[name]
    wanted = read_calibration(path)
    head, end, body = path.read_text().partition("?>")
    commas = re.sub(r'(?<=[" -])\d+\.\d', lambda found: found[0].replace(".", ","), body)
    assert commas.count(",") > 30
    path.write_text(head + end + commas)
    for a, b in zip(read_calibration(path), wanted, strict=True):
        np.testing.assert_allclose(a.T_camera_world, b.T_camera_world)
        np.testing.assert_allclose(a.matrix, b.matrix)


@pytest.mark.parametrize("name", ["anipose.toml", "camera_array.toml", "panoptic.json", "colmap", "Calib.qca.txt", "KRT", "camchain.yaml",
                                  "multical.json", "calibrated_cameras_data.yml", "transforms.json", "session.xcp", "easy", "xml", "rough"])
def test_every_format_is_known_in_utf16(tmp_path, name):
    path = calibrations.write_all(tmp_path, MADE).get(name, tmp_path / f"{name}.toml")
    if name == "rough":
        path.write_text("[a]\nat = [3, 0, 1.5]\ntoward = [0, 0, 1]\nfov = 65\nsize = [640, 480]\n")
    wanted = examine_calibration(path)
    for file in [path] if path.is_file() else path.iterdir():
        file.write_text(file.read_text(), "utf-16")
    found = examine_calibration(path)
    assert found.format == wanted.format
    assert is_calibration(path)
    for a, b in zip(found.cameras, wanted.cameras, strict=True):
        np.testing.assert_array_equal(a.T_camera_world, b.T_camera_world)
        assert a.name == b.name
