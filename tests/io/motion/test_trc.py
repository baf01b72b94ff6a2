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
    TEXT.replace("4\t(X/Y/Z)\ttruth.trc", "4\t(X/Y/Z) C:\\My files\\truth.trc").replace("60\t60\t2\t2", "  60.0\t  60.0\t   2\t   2"),
    TEXT.replace("DataRate\tCameraRate\tNumFrames", "DataRate CameraRate NumFrames").replace("60\t60\t2", "60 60 2"),
    TEXT.replace("neck\t\t\tleft_hand", "neck\t\t\t\tleft_hand").replace("\t20\t30", "\t20\t\t30"),
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
    assert lines[7].split("\t")[5:] == ["NaN", "NaN", "NaN"]


def test_no_cell_is_empty_and_other_readers_keep_their_columns(tmp_path):
    lost = JointTable(np.array([0.0, 0.5, 1.0]), TABLE.names, np.concatenate([PLACES, np.full((1, 2, 3), np.nan)]))
    write_trc(tmp_path / "a.trc", lost)
    rows = (tmp_path / "a.trc").read_text().splitlines()[6:]
    assert [len(row.split()) for row in rows] == [8, 8, 8]
    found = np.loadtxt(tmp_path / "a.trc", skiprows=6)
    np.testing.assert_allclose(found[:, 2:], 1000 * lost.positions.reshape(3, 6), atol=1e-3)
    np.testing.assert_allclose(read_trc(tmp_path / "a.trc").positions, lost.positions, atol=1e-6)


def test_gaps_are_dropped_or_filled_where_that_is_asked(tmp_path):
    places = np.arange(5.0)[:, None, None] * np.ones((5, 3, 3))
    places[[0, 2], 0] = places[4, 1] = places[:, 2] = np.nan
    table = JointTable(np.arange(5) / 10, ("a", "b", "never"), places)
    write_trc(tmp_path / "a.trc", table, "m", "drop")
    found = read_trc(tmp_path / "a.trc")
    assert (found.names, found.times.tolist()) == (("a", "b"), [0.1, 0.3])
    np.testing.assert_allclose(found.positions, places[[1, 3], :2])
    write_trc(tmp_path / "a.trc", table, "m", "fill")
    found = read_trc(tmp_path / "a.trc")
    np.testing.assert_allclose(found.positions[..., 0].T, [[1, 1, 2, 3, 4], [0, 1, 2, 3, 3]])
    for missing in ("drop", "fill"):
        with pytest.raises(ShadowPuppetError, match=r"b\.trc: found no frame in which all"):
            write_trc(tmp_path / "b.trc", JointTable(table.times, ("never",), places[:, 2:]), missing=missing)
    with pytest.raises(ShadowPuppetError, match="missing: found 'none', expected one of drop, fill, nan"):
        write_trc(tmp_path / "b.trc", table, missing="none")


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
    ("\t20\t", "\t20,5\t", "line 7, column 'neck Y': found '20,5', expected a number or nothing, with a decimal point: 20.5"),
    ("2\t0.5", "2\t0,5", "line 8, column 'Time': found '0,5', expected a number or nothing, with a decimal point: 0.5"),
    ("\t1e3\n", "\n", "line 7: found 7 cells, expected 8 for 2 markers"),
    ("\t1e3\n", "\t1e3\t7\n", "line 7: found 9 cells"),
    ("0.5", "0.0", "line 8, column 'time': found 0, expected more than the 0"),
    ("0.5", "", "line 8, column 'time': found no number"),
])
def test_what_is_malformed_is_said(tmp_path, old, new, said):
    assert old in TEXT
    with pytest.raises(FormatError, match=rf"truth\.trc: {said}"):
        read(tmp_path, TEXT.replace(old, new))


def test_the_nominal_rate_is_written_and_the_times_are_read(tmp_path):
    times = np.round(np.arange(61) / 30, 5)  # whose steps have a median of 1/30.003
    write_trc(tmp_path / "truth.trc", JointTable(times, ("neck",), np.zeros((61, 1, 3))))
    text = (tmp_path / "truth.trc").read_text()
    assert text.splitlines()[2] == "30\t30\t61\t1\tmm\t30\t1\t61"
    np.testing.assert_array_equal(read(tmp_path, text.replace("\n30\t30\t", "\n29\t29\t")).times, times)


def test_another_number_of_frames_than_said_is_warned_of(tmp_path):
    with pytest.warns(ShadowPuppetWarning, match="line 3, NumFrames: found '9', but the file has 2 frames"):
        assert len(read(tmp_path, TEXT.replace("60\t2\t2\tmm", "60\t9\t2\tmm")).times) == 2


def test_what_cannot_be_written_is_said(tmp_path):
    with pytest.raises(ShadowPuppetError, match="unit: found 'ft', expected one of cm, m, mm"):
        write_trc(tmp_path / "truth.trc", TABLE, "ft")
    with pytest.raises(ShadowPuppetError, match=r"marker name: found 'a\\tb'"):
        write_trc(tmp_path / "truth.trc", JointTable(np.zeros(1), ("a\tb",), np.zeros((1, 1, 3))))
