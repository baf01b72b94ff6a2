"""C3D files: points as they were written, by us and by another library, of every kind of processor; damage ends in a sentence."""

from __future__ import annotations

import numpy as np
import pytest
from damage import told_or_read
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from vicon import DEC, INTEL, MIPS, c3d

from shadowpuppet.errors import FormatError, ShadowPuppetWarning
from shadowpuppet.io.motion.c3d import read_c3d
from shadowpuppet.io.motion.c3d_writer import write_c3d
from shadowpuppet.motion.motion import JointTable

PLACES = np.array([[[10.0, -20.5, 1800.25], [1, 2, 3]], [[11.0, -21.5, 1801.25], [np.nan] * 3], [[12.0, -22.5, 1802.25], [4, 5, 6]]])
NAMES = ["LFEP", "RFEP"]


def read(tmp_path, content: bytes):
    (tmp_path / "walk.c3d").write_bytes(content)
    return read_c3d(tmp_path / "walk.c3d")


@pytest.mark.parametrize("processor", [INTEL, DEC, MIPS])
@pytest.mark.parametrize("scale", [-0.1, 0.25])
@pytest.mark.parametrize("analog", [0, 6])
def test_every_kind_of_number_is_read(tmp_path, processor, scale, analog):
    table = read(tmp_path, c3d(NAMES, PLACES, processor=processor, scale=scale, analog=analog))
    assert table.names == ("LFEP", "RFEP")
    np.testing.assert_allclose(table.times, np.arange(3) / 120)
    np.testing.assert_allclose(table.positions, PLACES / 1000, atol=1e-7 if scale < 0 else 0.126e-3)


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 2**32 - 1), frames=st.integers(1, 9), points=st.integers(1, 40), rate=st.sampled_from([25.0, 59.94, 1000.0]),
       processor=st.sampled_from([INTEL, DEC, MIPS]), unit=st.sampled_from([("mm", 1e-3), ("m", 1.0), ("CM", 1e-2)]))
def test_what_is_written_is_read(tmp_path, seed, frames, points, rate, processor, unit):
    rng = np.random.default_rng(seed)
    places = rng.normal(0, 900, (frames, points, 3))
    places[rng.random((frames, points)) < 0.2] = np.nan
    names = [f"P{n}" for n in range(points)]
    table = read(tmp_path, c3d(names, places, rate=rate, processor=processor, unit=unit[0], analog=int(rng.integers(5))))
    assert table.names == tuple(names)
    np.testing.assert_allclose(table.positions, places * unit[1], rtol=1e-6)
    np.testing.assert_allclose(table.times, np.arange(frames) / rate, rtol=1e-6)


def test_files_of_another_library_are_read(tmp_path):
    ezc3d = pytest.importorskip("ezc3d")
    rng = np.random.default_rng(3)
    places = rng.normal(0, 900, (50, 7, 3))
    places[10:15, 2] = np.nan
    made = ezc3d.c3d()
    made["parameters"]["POINT"]["RATE"]["value"] = [100]
    made["parameters"]["POINT"]["LABELS"]["value"] = tuple("ABCDEFG")
    made["parameters"]["POINT"]["UNITS"]["value"] = ("mm",)
    made["parameters"]["ANALOG"]["RATE"]["value"] = [500]
    made["parameters"]["ANALOG"]["LABELS"]["value"] = ("force",)
    made["data"]["points"] = np.concatenate([places.transpose(2, 1, 0), np.ones((1, 7, 50))])
    made["data"]["analogs"] = rng.normal(0, 1, (1, 1, 250))
    made.write(str(tmp_path / "other.c3d"))
    table = read_c3d(tmp_path / "other.c3d")
    assert table.names == tuple("ABCDEFG")
    np.testing.assert_allclose(table.positions, places / 1000, atol=1e-6)
    np.testing.assert_allclose(np.diff(table.times), 0.01)
    (tmp_path / "ours.c3d").write_bytes(c3d(list("ABCDEFG"), places, rate=100.0, trial=True))  # and the tests' own writer writes C3D
    theirs = ezc3d.c3d(str(tmp_path / "ours.c3d"))["data"]["points"][:3].transpose(2, 1, 0)
    np.testing.assert_allclose(theirs, places, atol=1e-3)


def test_what_was_not_seen_is_not_a_number(tmp_path):
    places = np.ones((4, 1, 3))
    places[3] = 0.0
    table = read(tmp_path, c3d(["A"], places, residuals=[[0.0], [-1.0], [2.5], [0.0]]))
    assert np.isfinite(table.positions[:, 0, 0]).tolist() == [True, False, True, False]
    whole = read(tmp_path, c3d(["A"], places, residuals=[[0.0], [-1.0], [2.0], [0.0]], scale=0.5))
    assert np.isfinite(whole.positions[:, 0, 0]).tolist() == [True, False, True, False]


def test_more_labels_fewer_labels_and_points_without_a_name(tmp_path):
    places = np.arange(1, 13.0).reshape(1, 4, 3)
    assert read(tmp_path, c3d(["A", "*110", "", "B"], places)).names == ("A", "B")
    assert read(tmp_path, c3d(["A", "B"], places)).names == ("A", "B")
    table = read(tmp_path, c3d(["A", "B"], places, parameters=[("POINT", "LABELS2", ["C", "D", "E"])]))
    assert table.names == ("A", "B", "C", "D")
    np.testing.assert_allclose(table.positions[0, 3], [0.010, 0.011, 0.012])
    assert read(tmp_path, c3d(["A", "A", "B", "A"], places)).positions[0, 0, 0] == pytest.approx(0.001)


def test_long_recordings_tell_their_frames_in_32_bits(tmp_path):
    places = np.ones((70_000, 1, 3)) * np.arange(1, 70_001)[:, None, None]
    for more in ({"trial": True, "first": 3}, {"parameters": [("POINT", "LONG_FRAMES", 70000.0)]}):
        table = read(tmp_path, c3d(["A"], places, **more))
        assert len(table.times) == 70_000
        assert table.positions[-1, 0, 0] == pytest.approx(70.0)


@pytest.mark.parametrize("points", [1, 2, 9])
@pytest.mark.parametrize("padded", [False, True])
@pytest.mark.parametrize("wrapped", [False, True])
def test_long_recordings_that_do_not_tell_their_frames_have_those_of_the_files_length(tmp_path, points, padded, wrapped):
    """The header ends at 65,535, or counts from 0 again."""
    places = np.ones((70_001, points, 3)) * np.arange(1, 70_002)[:, None, None]
    content = bytearray(c3d([f"P{n}" for n in range(points)], places))
    if wrapped:
        content[8:10] = (70_001 - 65_536).to_bytes(2, "little")
    content += bytes(-len(content) % 512) if padded else b""
    with pytest.warns(ShadowPuppetWarning, match=r"16 bits state \d+ frames, but the file has 70001 by its length; those are used"):
        table = read(tmp_path, bytes(content))
    assert len(table.times) == 70_001
    assert table.positions[-1, 0, 0] == pytest.approx(70.001)


def test_frames_as_a_float_are_believed_over_16_bits(tmp_path):
    content = c3d(["A"], np.ones((70_000, 1, 3)), parameters=[("POINT", "FRAMES", 69_999.0)])
    assert len(read(tmp_path, content).times) == 69_999


def test_a_header_that_states_fewer_frames_than_the_file_has_is_believed_below_its_limit(tmp_path):
    content = bytearray(c3d(["A"], np.ones((90, 1, 3))))
    content[8:10] = (60).to_bytes(2, "little")
    assert len(read(tmp_path, bytes(content)).times) == 60
    assert len(read(tmp_path, c3d(["A"], np.ones((65_535, 1, 3)))).times) == 65_535


@pytest.mark.parametrize("processor", [INTEL, MIPS])
def test_where_the_parameters_do_not_say_where_the_data_begin_the_header_does(tmp_path, processor):
    content = bytearray(c3d(NAMES, PLACES, processor=processor))
    at = content.index(b"DATA_START") + 14
    assert any(content[at : at + 2])
    content[at : at + 2] = b"\0\0"
    np.testing.assert_allclose(read(tmp_path, bytes(content)).positions, PLACES / 1000, atol=1e-6)


@pytest.mark.parametrize("name", ["köln", "手"])
def test_labels_are_utf_8_or_of_older_programs(tmp_path, name):
    table = JointTable(np.zeros(1), (name,), np.ones((1, 1, 3)))
    write_c3d(tmp_path / "a.c3d", table)
    assert read_c3d(tmp_path / "a.c3d").names == (name,)
    content = c3d(["koln"], np.ones((1, 1, 3))).replace(b"koln", "köln".encode("latin-1"))
    assert read(tmp_path, content).names == ("köln",)


def test_more_frames_and_names_than_a_byte_or_two_can_tell_are_written(tmp_path):
    names = tuple(f"p{n}" for n in range(300))
    few = JointTable(np.arange(2) / 50, names, np.arange(1800.0).reshape(2, 300, 3) / 1000 + 0.001)
    long = JointTable(np.arange(70_000) / 50, ("a",), np.arange(210_000.0).reshape(70_000, 1, 3) / 1e5 + 0.001)
    for table in (few, long):
        write_c3d(tmp_path / "a.c3d", table)
        found = read_c3d(tmp_path / "a.c3d")
        assert found.names == table.names
        np.testing.assert_allclose(found.positions, table.positions, atol=1e-6)


def test_frames_that_are_missing_are_reported(tmp_path):
    content = c3d(NAMES, PLACES)
    with pytest.warns(ShadowPuppetWarning, match=r"walk\.c3d: found 2 frames, but it tells of 3; those are used"):
        assert len(read(tmp_path, content[:-5]).times) == 2
    with pytest.warns(ShadowPuppetWarning, match="POINT:UNITS: found none, millimetres are taken"):
        assert read(tmp_path, c3d(NAMES, PLACES, unit=None)).positions[0, 0, 2] == pytest.approx(1.80025)


@pytest.mark.parametrize(("content", "said"), [
    (b"", "found no C3D header"),
    (b"\2\x50" * 100, "found no C3D header"),
    (b"time,neck_x\n" * 100, "found no C3D header"),
    (c3d(NAMES, PLACES)[:512], "found no parameters in block 2"),
    (c3d(NAMES, PLACES)[:600], "the parameters break off or are damaged"),
    (c3d(NAMES, PLACES, processor=90), "found no parameters in block 2, expected those of an Intel, DEC or MIPS processor"),
    (c3d(NAMES, PLACES, rate=0.0), "found 2 points at 0 frames/s"),
    (c3d(NAMES, PLACES, scale=-1.0).replace(b"mm", b"ft"), "POINT:UNITS: found 'ft', expected one of cm, m, mm"),
    (c3d(["*1", "*2"], PLACES), r"POINT:LABELS: found '\*1, \*2', expected names of points"),
    (c3d(["A_sd", "B"], PLACES), "names of joints: found 'A_sd'"),
    (c3d([], np.zeros((2, 0, 3))), "found 0 points"),
])
def test_what_is_malformed_is_said(tmp_path, content, said):
    with pytest.raises(FormatError, match=rf"walk\.c3d: {said}"):
        read(tmp_path, content)


@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")
def test_a_file_without_data_is_said(tmp_path):
    content = c3d(NAMES, PLACES)
    with pytest.raises(FormatError, match="found no frame of 2 points from byte 1024 on"):
        read(tmp_path, content[:1024])
    with pytest.raises(FormatError, match=r"none\.c3d: cannot be read \(no such file"):
        read_c3d(tmp_path / "none.c3d")


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, 1100), put=st.binary(min_size=1, max_size=8), end=st.integers(1024, 1400))
@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")
def test_no_damage_ends_in_anything_but_a_sentence(tmp_path, at, put, end):
    content = c3d(NAMES, np.tile(PLACES, (4, 1, 1)), analog=3, trial=True)
    content = (content[:at] + put + content[at + len(put) :])[:end]
    (tmp_path / "bad.c3d").write_bytes(content)
    assert told_or_read(lambda: read_c3d(tmp_path / "bad.c3d"), "bad.c3d")
