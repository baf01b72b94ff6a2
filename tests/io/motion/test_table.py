"""Tables of joints: what is written is read, other columns do not matter, and what is malformed is said."""

from __future__ import annotations

import contextlib

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from shadowpuppet.errors import FormatError, ShadowPuppetError
from shadowpuppet.io.motion.table import read_joints, write_joints
from shadowpuppet.motion.motion import JointTable

HEAD = "time,neck_x,neck_y,neck_z\n"
metres = st.floats(-50, 50) | st.just(np.nan)
names = st.text(st.characters(exclude_categories=["C", "Zl", "Zp"]), min_size=1, max_size=8).filter(
    lambda name: name == name.strip() and not name.endswith("_sd"))


@st.composite
def tables(draw) -> JointTable:
    joints = tuple(draw(st.lists(names, min_size=1, max_size=4, unique=True)))
    count = draw(st.integers(0, 5))
    times = np.cumsum(draw(hnp.arrays(float, count, elements=st.floats(0.001, 1))))
    return JointTable(times, joints, draw(hnp.arrays(float, (count, len(joints), 3), elements=metres)))


@pytest.mark.parametrize("ending", [".csv", ".trc"])
@settings(max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(joints=tables())
def test_what_is_written_is_read(tmp_path, ending, joints):
    path = tmp_path / f"joints{ending}"
    write_joints(path, joints)
    found = read_joints(path)
    assert found.names == joints.names
    np.testing.assert_allclose(found.times, joints.times, atol=5.1e-7)
    np.testing.assert_allclose(found.positions, joints.positions, atol=6e-7)
    assert [p.name for p in tmp_path.iterdir() if p.suffix == ".part"] == []


def read(tmp_path, text: str | bytes, name: str = "truth.csv") -> JointTable:
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_joints(path)


def test_other_columns_order_and_line_ends_do_not_matter(tmp_path):
    text = "\ufeffstatus,neck_z, neck_x ,time,neck_sd_x,neck_y,note\r\nlost,3,1,0.5,,2,\"a, b\"\r\n\r\ntracked,6,,1.5,x,5e0,\r\n"
    found = read(tmp_path, text)
    assert found.names == ("neck",)
    np.testing.assert_array_equal(found.times, [0.5, 1.5])
    np.testing.assert_array_equal(found.positions[:, 0], [[1, 2, 3], [np.nan, 5, 6]])


@pytest.mark.parametrize(("text", "said"), [
    ("", "the file is empty"),
    (" \n\n", "the file is empty"),
    (b"\x89PNG\r\n\x1a\n\xff\xfe", "found bytes that are no text at position 0"),
    (b"time,neck_x\0\n", "found a zero byte at position 11"),
    ("neck_x,neck_y,neck_z\n1,2,3\n", "no column 'time', expected a header time,<name>,...; found 'neck_x, neck_y, neck_z'"),
    ("time;neck_x;neck_y;neck_z\n0;1;2;3\n", "no column 'time', .* found 'time;neck_x;.*'; found semicolons between columns, expected com"),
    ("time\tneck_x\tneck_y\tneck_z\n0\t1\t2\t3\n", "no column 'time', .*; found tabs between columns, expected commas"),
    ("time,torso_bow\n0,1\n", "no joints, expected columns time,<joint>_x.*found 'time, torso_bow'"),
    ("time,neck_x,neck_z\n0,1,2\n", "no column 'neck_y', expected _x, _y and _z of every joint"),
    ("time,neck_x,neck_y,neck_z,neck_x\n0,1,2,3,4\n", "column 'neck_x': found it twice"),
    (HEAD + "0,1,2,3\n1,1,two,3\n", "line 3, column 'neck_y': found 'two', expected a number or nothing"),
    (HEAD + "0,1,2,3\n\n1,1,-inf,3\n", "line 4, column 'neck_y': found '-inf'"),
    (HEAD + "0,1,2,3\n1,1,2\n", "line 3: found 3 cells, expected 4 as in the header"),
    (HEAD + "0,1,2,3\n1,1,2,3,4\n", "line 3: found 5 cells"),
    (HEAD + "0,1,2,3\n0,1,2,3\n", "line 3, column 'time': found 0, expected more than the 0 of the row before"),
    (HEAD + ",1,2,3\n", "line 2, column 'time': found no number, expected seconds"),
    (HEAD + "0,1,2,3\n,,,\n", "line 3, column 'time': found no number"),
    (HEAD + "0,1,2," + "3" * 200_000 + "\n", "line 2: .*field limit"),
    ("time,_x,_y,_z\n0,1,2,3\n", "names of joints: found ''"),
])
def test_what_is_malformed_is_said(tmp_path, text, said):
    with pytest.raises(FormatError, match=rf"truth\.csv: {said}"):
        read(tmp_path, text)


@given(st.binary(max_size=200) | st.text("time,_xyz01.\n\"-", max_size=60).map(str.encode))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_any_bytes_are_read_or_refused_in_a_sentence(tmp_path, data):
    with contextlib.suppress(FormatError):
        assert read(tmp_path, data).names


def test_files_that_are_not_there_or_of_another_kind_are_said(tmp_path):
    with pytest.raises(FormatError, match=r"truth.csv: cannot be read \(no such file"):
        read_joints(tmp_path / "truth.csv")
    with pytest.raises(FormatError, match=r"found the ending '.bvh', expected one of .csv, .trc"):
        read_joints(tmp_path / "truth.bvh")
    with pytest.raises(ShadowPuppetError, match=r"no/truth.csv: cannot be written \(no such file"):
        write_joints(tmp_path / "no" / "truth.csv", JointTable(np.zeros(0), ("neck",), np.zeros((0, 1, 3))))


@pytest.mark.shared
@pytest.mark.parametrize("recording", ["recordings/upper_body", "recordings/walking", "real/balancing"])
def test_the_shared_truths_are_read(shared, recording):
    found = read_joints(shared / recording / "truth.csv")
    assert {"left_shoulder", "left_elbow", "left_wrist"} <= set(found.names)
    assert np.isfinite(found.positions).all()
    marked = shared / recording / "truth.trc"
    if marked.exists():
        other = read_joints(marked)
        assert other.names == found.names
        np.testing.assert_allclose(other.positions, found.positions, atol=1.1e-5)
        np.testing.assert_allclose(other.times, found.times, atol=1.1e-5)
