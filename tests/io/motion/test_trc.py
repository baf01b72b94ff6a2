"""TRC files: layout as other programs write and read it, units, and what is malformed."""

from __future__ import annotations

import numpy as np
import pytest

from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.motion.trc import read_trc, write_trc
from shadowpuppet.motion.motion import JointTable

TEXT = """PathFileType\t4\t(X/Y/Z)\ttruth.trc
DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits\tOrigDataRate\tOrigDataStartFrame\tOrigNumFrames
60\t60\t2\t2\tmm\t60\t1\t2
Frame#\tTime\tneck\t\t\tleft_hand\t\t
\t\tX1\tY1\tZ1\tX2\tY2\tZ2

1\t0.0\t10\t20\t30\t-1500\t0\t1e3
2\t0.5\t11\t21\t31\t\t\t
"""
PLACES = np.array([[[0.01, 0.02, 0.03], [-1.5, 0, 1]], [[0.011, 0.021, 0.031], [np.nan] * 3]])
TABLE = JointTable(np.array([0.0, 0.5]), ("neck", "left_hand"), PLACES)


def read(tmp_path, text: str) -> JointTable:
    (tmp_path / "truth.trc").write_text(text, "utf-8")
    return read_trc(tmp_path / "truth.trc")


@pytest.mark.parametrize("text", [
    TEXT,
    TEXT.replace("\n", "\r\n"),
    TEXT.replace("PathFileType\t4\t", "PathFileType  4  "),
    TEXT.replace("DataRate\tCameraRate\t", "DataRate\t\tCameraRate\t").replace("\tUnits", "\t\tUnits"),
    TEXT.replace("Z2\n\n", "Z2\n"),
    TEXT.replace("\t\tX1\tY1\tZ1\tX2\tY2\tZ2\n\n", ""),
    TEXT.replace("left_hand\t\t\n", "left_hand\n").replace("1e3\n", "1e3\t\n"),
    TEXT.replace("left_hand\t\t\n", "left_hand\t\t\t\n").replace("31\t\t\t\n", "31\tNaN\tnan\t\t\t\n"),
])
def test_the_layouts_that_are_found_are_read(tmp_path, text):
    found = read(tmp_path, text)
    assert found.names == TABLE.names
    np.testing.assert_array_equal(found.times, TABLE.times)
    np.testing.assert_allclose(found.positions, PLACES)


@pytest.mark.parametrize(("unit", "scale"), [("m", 1), ("cm", 0.01), ("mm", 0.001), ("MM", 0.001)])
def test_units_become_metres(tmp_path, unit, scale):
    found = read(tmp_path, TEXT.replace("\tmm\t", f"\t{unit}\t"))
    np.testing.assert_allclose(found.positions, PLACES * scale / 0.001)
    if unit in ("m", "cm", "mm"):
        write_trc(tmp_path / "other.trc", TABLE, unit)
        np.testing.assert_allclose(read_trc(tmp_path / "other.trc").positions, PLACES, atol=1e-6)


def test_what_is_written_has_the_layout(tmp_path):
    write_trc(tmp_path / "truth.trc", TABLE)
    lines, expected = ((t.splitlines()) for t in ((tmp_path / "truth.trc").read_text("utf-8"), TEXT))
    assert lines[:2] == expected[:2]
    assert lines[2] == "2\t2\t2\t2\tmm\t2\t1\t2"
    assert lines[3] == expected[3]
    assert lines[4:6] == expected[4:6]
    assert lines[6] == "1\t0.000000\t10.000\t20.000\t30.000\t-1500.000\t0.000\t1000.000"
    assert lines[7].split("\t")[5:] == ["", "", "", ""]  # one more, without which OpenSim misses the last


@pytest.mark.parametrize(("old", "new", "said"), [
    (TEXT, "time,neck_x\n", "found no TRC header"),
    ("PathFileType", "PathType", "found no TRC header"),
    ("Frame#", "Image", "found no TRC header"),
    ("\tmm\t", "\tinch\t", "line 3, Units: found 'inch', expected one of cm, m, mm"),
    ("Units", "Unit", "line 3, Units: found ''"),
    ("2\t2\tmm", "2\t3\tmm", "line 3, NumMarkers: found '3', expected 2, as many as line 4 has names"),
    ("neck\t\t\tleft_hand\t\t", "neck\tleft_hand\t\t\t\t", "line 4: found .* expected a marker's name in every third column"),
    ("neck\t\t\tleft_hand\t\t", "\t\t\t\t\t", "line 4: found .* expected a marker's name in every third column"),
    ("left_hand", "neck", "names of joints: found 'neck'"),
    ("\t20\t", "\ttwenty\t", "line 7, column 'neck Y': found 'twenty', expected a number or nothing"),
    ("\t1e3\n", "\n", "line 7: found 7 cells, expected 8 for 2 markers"),
    ("\t1e3\n", "\t1e3\t7\n", "line 7: found 9 cells"),
    ("0.5", "0.0", "line 8, column 'time': found 0, expected more than the 0"),
    ("0.5", "", "line 8, column 'time': found no number"),
])
def test_what_is_malformed_is_said(tmp_path, old, new, said):
    assert old in TEXT
    with pytest.raises(FormatError, match=rf"truth\.trc: {said}"):
        read(tmp_path, TEXT.replace(old, new))


def test_another_number_of_frames_than_said_is_warned_of(tmp_path):
    with pytest.warns(ShadowPuppetWarning, match="line 3, NumFrames: found '9', but the file has 2 frames"):
        assert len(read(tmp_path, TEXT.replace("60\t2\t2\tmm", "60\t9\t2\tmm")).times) == 2


def test_what_cannot_be_written_is_said(tmp_path):
    with pytest.raises(ShadowPuppetError, match="unit: found 'ft', expected one of cm, m, mm"):
        write_trc(tmp_path / "truth.trc", TABLE, "ft")
    with pytest.raises(ShadowPuppetError, match=r"marker name: found 'a\\tb'"):
        write_trc(tmp_path / "truth.trc", JointTable(np.zeros(1), ("a\tb",), np.zeros((1, 1, 3))))
