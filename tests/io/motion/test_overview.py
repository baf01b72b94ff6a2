"""Motion files explained by `info`, and other files called what they are."""

from __future__ import annotations

import json

import biovision
import numpy as np
import pytest
from vicon import c3d

from shadowpuppet.errors import FormatError
from shadowpuppet.io.motion import READABLE
from shadowpuppet.io.motion.motion_files import READERS
from shadowpuppet.io.motion.overview import look_at_motion


def test_a_skeleton_is_explained(tmp_path):
    (tmp_path / "a.bvh").write_text(biovision.person(6))
    look = look_at_motion(tmp_path / "a.bvh")
    assert (look.frames, look.rate, look.start, look.unknown) == (6, pytest.approx(30), 0.0, 0.0)
    assert (look.known["left_elbow"], look.leg) == ("LeftForeArm", pytest.approx(0.83))
    assert "Spine" in look.others
    assert [note[:40] for note in look.notes] == ["BVH files do not tell their unit; legs 8", "+Y points up there; turned so that Z doe"]


def test_a_skeleton_of_unknown_names_and_markers_are_explained_too(tmp_path):
    text = biovision.person(3)
    for joint in ("UpLeg", "Foot", "ForeArm"):
        text = text.replace(joint, "Thing")
    (tmp_path / "a.bvh").write_text(text)
    look = look_at_motion(tmp_path / "a.bvh")
    assert (look.leg, look.notes[0][:41]) == (None, "found neither legs nor arms of known name")
    places = np.ones((4, 3, 3))
    places[0, 0] = np.nan
    channels = [("ANALOG", "USED", [2]), ("ANALOG", "LABELS", ["Fx1", "Fy1"])]
    (tmp_path / "a.c3d").write_bytes(c3d(["LASI", "RLFC", "RMFC"], places, analog=2, first=13, parameters=channels))
    look = look_at_motion(tmp_path / "a.c3d")
    assert (look.known, look.others, look.channels) == ({"right_knee": "RLFC and RMFC"}, ("LASI",), ("Fx1", "Fy1"))
    assert (look.start, look.end, look.unknown) == (pytest.approx(0.1), pytest.approx(0.125), pytest.approx(1 / 12))


def test_what_is_malformed_is_said(tmp_path):
    assert {*READERS, ".amc", ".bvh"} == set(READABLE)
    for name, text in (("a.bvh", "HIERARCHY"), ("a.trc", "1"), ("a.csv", "time\n0\n"), ("b.csv", "time,neck_x,neck_y,neck_z\n")):
        (tmp_path / name).write_text(text)
        with pytest.raises(FormatError, match=name):
            look_at_motion(tmp_path / name)


def test_info_explains_motion_and_says_what_other_files_are(shell, tmp_path):
    (tmp_path / "a.bvh").write_text(biovision.person(6))
    code, out, err = shell("info", "a.bvh")
    assert (code, err) == (0, "")
    assert "BVH (Biovision)" in out
    assert "0.83 m from hip to ankle" in out
    assert json.loads(shell("info", "a.bvh", "--json")[1])["known"]["left_hip"] == "LeftUpLeg"
    assert "a.bvh, which is no calibration file" in shell("info", "a.bvh", "--to", "b.toml")[2]
    for name, said in (("a.fbx", "found the ending '.fbx', expected a film, a calibration or a motion file; motion is read from .amc"),
                       ("a.txt", "found no calibration in it that is known"), ("a.toml", "no camera in it, expected a section for each"),
                       ("run.toml", "is a file of a recording or run, expected its folder"), ("a.xcp", "a.xcp: ")):  # fmt: skip
        (tmp_path / name).write_text("a = 1\n")
        code, _, err = shell("info", name)
        assert (code, said in err, "film cannot" in err) == (2, True, False), err
