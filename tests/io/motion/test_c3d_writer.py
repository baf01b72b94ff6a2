"""C3D files written: points, residuals and analog channels, as an independent reader and ours find them."""

from __future__ import annotations

import struct
import warnings

import c3d
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.motion.c3d import read_c3d, read_header
from shadowpuppet.io.motion.c3d_writer import write_c3d
from shadowpuppet.motion.contact.contact import FootEvent
from shadowpuppet.motion.motion import JointTable


def table(rng, frames: int = 20, names=("pelvis", "left_hand", "neck"), rate: float = 30.0) -> JointTable:
    return JointTable(np.arange(frames) / rate, tuple(names), rng.uniform(-3, 3, (frames, len(names), 3)))


def theirs(path) -> tuple[c3d.Reader, list]:
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of theirs, where a parameter of ours is not one that they look for
        reader = c3d.Reader(file)
        return reader, list(reader.read_frames())


@settings(max_examples=40, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(frames=st.integers(1, 6), points=st.integers(1, 9), seed=st.integers(0, 999), rate=st.sampled_from([15.0, 29.97, 120.0]),
       gaps=st.booleans())  # fmt: skip
def test_what_is_written_is_read(tmp_path, frames, points, seed, rate, gaps):
    rng = np.random.default_rng(seed)
    made = table(rng, frames, [f"joint {n}" for n in range(points)], rate)
    if gaps:
        made.positions[rng.random((frames, points)) < 0.3] = np.nan
    write_c3d(tmp_path / "a.c3d", made)
    found = read_c3d(tmp_path / "a.c3d")
    assert found.names == made.names
    np.testing.assert_allclose(found.positions, made.positions, atol=1e-6)
    if frames > 1:
        np.testing.assert_allclose(found.times, made.times, rtol=1e-5)


def test_an_independent_reader_finds_points_residuals_rate_units_and_angles(tmp_path, rng):
    made = table(rng)
    made.positions[4] = np.nan
    made.positions[6, 1] = np.nan
    spread = rng.uniform(0.002, 0.04, (20, 3))
    spread[9], spread[11, 0] = np.nan, 0.9
    angles = {"left_knee_flexion": ("deg", rng.uniform(-90, 90, 20)), "root_z": ("m", rng.uniform(0, 1, 20))}
    angles["root_z"][1][4] = np.nan
    write_c3d(tmp_path / "a.c3d", made, spread, angles)
    reader, frames = theirs(tmp_path / "a.c3d")
    assert [label.strip() for label in reader.point_labels] == list(made.names)
    assert [label.strip() for label in reader.analog_labels] == list(angles)
    assert (reader.point_rate, reader.analog_rate, reader.first_frame, reader.last_frame) == (30.0, 30.0, 1, 20)
    assert reader.get("POINT:UNITS").string_value.strip() == "mm"
    assert [unit.strip() for unit in reader.get("ANALOG:UNITS").string_array] == ["deg", "m"]
    points, analog = np.stack([frame[1] for frame in frames]), np.stack([frame[2][:, 0] for frame in frames])
    known = np.isfinite(made.positions).all(2)
    np.testing.assert_array_equal(points[..., 3] == -1, ~known)
    np.testing.assert_allclose(points[known][:, :3], 1000 * made.positions[known], atol=1e-3)
    np.testing.assert_array_equal(points[~known][:, :3], 0)
    wanted = np.minimum(np.round(1000 * np.nan_to_num(spread)), 255)
    np.testing.assert_array_equal(points[known][:, 3], wanted[known])
    np.testing.assert_allclose(analog, np.stack([values for _, values in angles.values()], 1), rtol=1e-6)


def test_ezc3d_finds_the_same(tmp_path, rng):
    ezc3d = pytest.importorskip("ezc3d")
    made = table(rng)
    made.positions[4] = np.nan
    bends = rng.uniform(-90, 90, 20)
    write_c3d(tmp_path / "a.c3d", made, angles={"left_knee_flexion": ("deg", bends)})
    found = ezc3d.c3d(str(tmp_path / "a.c3d"))
    assert found["parameters"]["POINT"]["LABELS"]["value"] == list(made.names)
    assert found["parameters"]["ANALOG"]["LABELS"]["value"] == ["left_knee_flexion"]
    np.testing.assert_allclose(found["data"]["points"][:3].transpose(2, 1, 0) / 1000, made.positions, atol=1e-6)
    np.testing.assert_allclose(found["data"]["analogs"][0, 0], bends, rtol=1e-6)


def test_without_angles_nothing_is_said_of_analog_channels(tmp_path, rng):
    ezc3d = pytest.importorskip("ezc3d")
    made = table(rng)
    write_c3d(tmp_path / "a.c3d", made)
    assert "ANALOG:RATE" not in read_header(tmp_path / "a.c3d").parameters
    reader, frames = theirs(tmp_path / "a.c3d")
    assert reader.analog_used == 0
    np.testing.assert_allclose(np.stack([frame[1][:, :3] for frame in frames]) / 1000, made.positions, atol=1e-6)
    found = ezc3d.c3d(str(tmp_path / "a.c3d"))
    np.testing.assert_allclose(found["data"]["points"][:3].transpose(2, 1, 0) / 1000, made.positions, atol=1e-6)


@pytest.mark.parametrize("start", [0.0, 4.5, 9000.0])  # the last has a frame number of more than 16 bits
def test_the_start_time_is_the_number_of_the_first_frame(tmp_path, rng, start):
    ezc3d = pytest.importorskip("ezc3d")
    made = table(rng)
    made = JointTable(start + made.times, made.names, made.positions)
    write_c3d(tmp_path / "a.c3d", made)
    np.testing.assert_allclose(read_c3d(tmp_path / "a.c3d").times, made.times, rtol=1e-6, atol=1e-6)
    if start < 2000:  # theirs multiplies the upper 16 bits by 65535
        reader, frames = theirs(tmp_path / "a.c3d")
        assert (len(frames), reader.first_frame) == (20, 1 + round(30 * start))
    found = ezc3d.c3d(str(tmp_path / "a.c3d"))
    assert found["data"]["points"].shape == (4, 3, 20)
    with pytest.raises(ShadowPuppetError, match=r"b\.c3d: found 20 frames from 1e\+09 s on"):
        write_c3d(tmp_path / "b.c3d", JointTable(1e9 + table(rng).times, made.names, made.positions))


def test_long_motions_have_more_frames_than_16_bits_tell(tmp_path, rng):
    made = table(rng, 70_000, ("neck",), 100.0)
    write_c3d(tmp_path / "long.c3d", made)
    found = read_c3d(tmp_path / "long.c3d")
    assert len(found.times) == 70_000
    np.testing.assert_allclose(found.positions[-1], made.positions[-1], atol=1e-6)
    assert struct.unpack_from("<2H", (tmp_path / "long.c3d").read_bytes(), 6) == (1, 0xFFFF)  # as many as the header can tell
    with (tmp_path / "long.c3d").open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        assert c3d.Reader(file).get("POINT:FRAMES").uint16_value == 0xFFFF


def test_more_names_than_one_list_can_hold(tmp_path, rng):
    made = table(rng, 3, [f"marker_{n:04d}" for n in range(600)])
    write_c3d(tmp_path / "many.c3d", made)
    assert read_header(tmp_path / "many.c3d").words("POINT:LABELS3")[-1] == "marker_0599"
    assert read_c3d(tmp_path / "many.c3d").names == made.names


def test_missing_frames_are_unknown_and_odd_times_found_again(tmp_path, rng):
    whole = table(rng)
    kept = np.delete(np.arange(20), [7, 8])
    write_c3d(tmp_path / "a.c3d", JointTable(whole.times[kept], whole.names, whole.positions[kept]))
    found = read_c3d(tmp_path / "a.c3d")
    assert np.flatnonzero(np.isnan(found.positions).all((1, 2))).tolist() == [7, 8]
    np.testing.assert_allclose(found.positions[kept], whole.positions[kept], atol=1e-6)
    odd = np.cumsum(rng.uniform(0.02, 0.08, 20))
    line = np.stack([odd, 2 * odd, -odd], 1)[:, None]  # a straight line stays one
    with pytest.warns(ShadowPuppetWarning, match=r"b\.c3d: the frames do not come at a constant rate"):
        write_c3d(tmp_path / "b.c3d", JointTable(odd, ("neck",), line))
    found = read_c3d(tmp_path / "b.c3d")
    np.testing.assert_allclose(found.positions[:-1, 0, 0], odd[0] + found.times[:-1] - found.times[0], atol=1e-5)
    assert abs(found.times[0] - odd[0]) < 0.5 * np.diff(found.times)[0]


def test_what_cannot_be_written_is_said(tmp_path, rng):
    with pytest.raises(ShadowPuppetError, match="expected points with names of at most 120 letters"):
        write_c3d(tmp_path / "a.c3d", table(rng, 3, ["x" * 121]))
    with pytest.raises(ShadowPuppetError, match="whose names need more than this format holds"):
        write_c3d(tmp_path / "a.c3d", table(rng, 1, [f"{n:05d}{'x' * 90}" for n in range(2000)]))
    with pytest.raises(ShadowPuppetError, match=r"a\.c3d: found no frame"):
        write_c3d(tmp_path / "a.c3d", table(rng, 0))
    with pytest.raises(ShadowPuppetError, match="expected points"):
        write_c3d(tmp_path / "a.c3d", table(rng, 3, []))
    assert list(tmp_path.iterdir()) == []


def test_events_of_the_feet_are_there(tmp_path, rng):
    events = [FootEvent(0.5, "left", True), FootEvent(61.25, "right", False)]
    write_c3d(tmp_path / "a.c3d", table(rng), events=events)
    reader, _ = theirs(tmp_path / "a.c3d")
    assert reader.get("EVENT:USED").uint16_value == 2
    np.testing.assert_allclose(reader.get("EVENT:TIMES").float_array.reshape(2, 2), [[0, 0.5], [1, 1.25]])
    assert [word.strip() for word in reader.get("EVENT:LABELS").string_array] == ["Foot Strike", "Foot Off"]
    assert [word.strip() for word in reader.get("EVENT:CONTEXTS").string_array] == ["Left", "Right"]
    write_c3d(tmp_path / "b.c3d", table(rng))
    assert theirs(tmp_path / "b.c3d")[0].get("EVENT") is None
