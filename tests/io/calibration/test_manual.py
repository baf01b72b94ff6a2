"""The manual's table of the keys of calibration files is that of the readers."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from shadowpuppet.io.calibration import json_cameras, kalibr, opencv, pose2sim, qualisys, vicon
from shadowpuppet.io.calibration.keys import LENS_KEYS, UNIT_KEYS, unknown_keys
from shadowpuppet.io.calibration.programs import mc_calib, multical, transforms

PAGE = (Path(__file__).parents[3] / "docs" / "calibration.md").read_text("utf-8")
ROWS = {cells[1].strip().strip("`"): [re.findall("`([^`]+)`", cell) for cell in cells[2:4]]
        for cells in (line.split("|") for line in PAGE.partition("### Which keys are used")[2].partition("###")[0].splitlines())
        if len(cells) > 3 and not cells[1].startswith("-")}  # fmt: skip
LISTED = {"TOML": (pose2sim.KNOWN, (*pose2sim.IGNORED, *pose2sim.ASIDE)), "transforms.json": (transforms.USED, transforms.IGNORED),
          "MC-Calib": (mc_calib.FIELDS, ("nb_camera",)), "Kalibr": (kalibr.KNOWN[:6], kalibr.KNOWN[6:]), "multical": ((), multical.IGNORED)}
KNOWN = {"JSON": json_cameras.KNOWN, "OpenCV, EasyMocap, JARVIS": (*opencv.PATTERNS.values(), opencv.IGNORED, LENS_KEYS, UNIT_KEYS),
         "Qualisys": (*qualisys.CAMERA_KEYS, *qualisys.PARTS, *qualisys.OTHER_PARTS, "skew"),
         "Vicon": (*vicon.CAMERA_KEYS, *vicon.FRAME_KEYS, "SKEW")}  # fmt: skip


@pytest.mark.parametrize("name", LISTED)
def test_the_manual_lists_the_keys_of_a_format(name):
    for keys, cell in zip(LISTED[name], ROWS[name], strict=True):
        assert set(keys) - set(cell) == set()
        assert all(key in keys or LENS_KEYS.fullmatch(key) or UNIT_KEYS.fullmatch(key) for key in cell if name != "multical")


@pytest.mark.parametrize("name", KNOWN)
def test_keys_that_the_manual_names_are_known(name):
    tables = {key: {"a": 1} for cell in ROWS[name] for key in cell}
    assert len(tables) > 4
    assert list(unknown_keys("", tables, KNOWN[name])) == []


def test_every_format_has_a_row_in_the_manual():
    assert {*LISTED, *KNOWN} | {"format", "COLMAP, KRT, BioCV"} == set(ROWS)
