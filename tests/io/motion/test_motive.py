"""Tables of Motive (OptiTrack): bones or markers by name, in metres; what is neither is named."""

from __future__ import annotations

import numpy as np
import pytest
from damage import told_or_read
from motive import PARTS, export

from shadowpuppet.errors import FormatError, ShadowPuppetWarning
from shadowpuppet.io.motion.motion_files import read_motion, read_truth
from shadowpuppet.io.motion.table import read_joints


@pytest.mark.parametrize("form", [
    {}, {"unit": "Millimeters", "scale": 1000}, {"unit": "Centimeters", "scale": 100}, {"parents": False, "labels": False},
    {"kind": "Marker"}, {"kind": "Bone Marker"}, {"space": ""},
])  # fmt: skip
def test_bones_and_markers_are_joints(tmp_path, form):
    (tmp_path / "walk.csv").write_text(export(**form), "utf-8-sig")
    found = read_joints(tmp_path / "walk.csv")
    assert found.names == tuple(f"Anna:{name}" for name in PARTS)
    np.testing.assert_allclose(found.times, [0, 1 / 120], atol=1e-6)
    np.testing.assert_allclose(found.positions, np.add([*PARTS.values()], [[[0.0]], [[0.1]]]), atol=1e-5)


@pytest.mark.filterwarnings("ignore:.*points up there:shadowpuppet.errors.ShadowPuppetWarning")
def test_joints_have_our_names_and_z_up(tmp_path):
    (tmp_path / "walk.csv").write_text(export())
    found = read_motion(tmp_path / "walk.csv")
    assert set(found.names) == {"pelvis", "neck", "head", "left_shoulder", "left_elbow", "left_wrist", "left_hip", "left_knee",
                                "left_ankle"}  # fmt: skip
    np.testing.assert_allclose(found.select(["left_elbow"]).positions[0, 0], [0.5, 0, 1.45], atol=1e-6)
    np.testing.assert_allclose(read_truth(tmp_path / "walk.csv").select(["left_knee"]).positions[0, 0], [0.1, 0.5, 0], atol=1e-6)


def test_places_that_are_not_known_are_empty_and_unnamed_markers_are_left_out(tmp_path):
    text = export("Marker", ["a", "Unlabeled 1003", "b"]).replace("0.000000,1.700000,0.000000", ",,")
    (tmp_path / "walk.csv").write_text(text + "\r\n")
    found = read_joints(tmp_path / "walk.csv")
    assert found.names == ("a", "b")
    np.testing.assert_array_equal(np.isfinite(found.positions).all(2), [[True, False], [True, True]])


@pytest.mark.parametrize(("form", "said"), [
    ({"kind": "Rigid Body"}, "found columns of Rigid Body, expected positions of bones or named markers: export from Motive with Bones"),
    ({"unit": "Feet"}, "line 1, Length Units: found 'Feet', expected one of centimeters, meters, millimeters"),
    ({"space": "Local"}, "line 1, Coordinate Space: found 'Local', expected Global"),
    ({"names": ["a", "a"]}, "'a': found 6 columns of its position, expected X, Y and Z once"),
    ({"more": "2,0.5,1,2,3,4,5,much\r\n"}, "line 11, column '8': found 'much', expected a number or nothing"),
    ({"more": "2,0.001\r\n"}, r"line 11, column 'time': found 0\.001, expected more than"),
    ({"more": f"2,{'9' * 200_000}\r\n"}, "line 11: field larger than field limit"),
])  # fmt: skip
def test_what_cannot_be_read_is_named(tmp_path, form, said):
    (tmp_path / "walk.csv").write_text(export(**form))
    with pytest.raises(FormatError, match=rf"walk\.csv: {said}"):
        read_joints(tmp_path / "walk.csv")


@pytest.mark.filterwarnings(f"ignore::{ShadowPuppetWarning.__module__}.ShadowPuppetWarning")
def test_no_cut_ends_in_anything_but_a_sentence(tmp_path):
    text = export()
    for end in range(0, len(text), 97):
        (tmp_path / "walk.csv").write_text(text[:end])
        assert told_or_read(lambda: read_motion(tmp_path / "walk.csv"), "walk.csv")
