"""BVH files: joints where the angles put them, whatever the order of channels; what is malformed is said with its line."""

from __future__ import annotations

import numpy as np
import pytest
from biovision import bvh, in_order, person
from damage import told_or_read
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import FormatError, ShadowPuppetWarning
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.motion_files import read_motion

TEXT = """HIERARCHY
ROOT Hips
{
  OFFSET 0.0 1.0 0.0
  CHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
  JOINT Knee
  {
    OFFSET 0.0 -2.0 0.0
    CHANNELS 1 Xrotation
    End Site
    {
      OFFSET 0.0 -3.0 0.0
    }
  }
}
MOTION
Frames: 2
Frame Time: 0.05
10 20 30 0 0 0 0
10 20 30 0 0 90 90
"""


def read(tmp_path, text: str):
    (tmp_path / "walk.bvh").write_text(text, "utf-8")
    return read_bvh(tmp_path / "walk.bvh")


def test_a_small_file_by_hand(tmp_path):
    found = read(tmp_path, TEXT)
    assert [node.parent for node in found.nodes] == [-1, 0, 1]
    table = found.joints()
    assert table.names == ("Hips", "Knee", "Knee_end")
    np.testing.assert_allclose(table.times, [0, 0.05])
    np.testing.assert_allclose(table.positions[0], [[10, 21, 30], [10, 19, 30], [10, 16, 30]])
    # the knee turns about x by 90 degrees, so that what hangs down points to -z; and all that about y, so that it points to -x
    np.testing.assert_allclose(table.positions[1], [[10, 21, 30], [10, 19, 30], [7, 19, 30]], atol=1e-12)


@pytest.mark.parametrize("text", [
    TEXT.replace("\n", "\r\n"),
    TEXT.replace("\n{", " {").replace("End Site\n    {", "end site {"),
    TEXT.replace("  ", "\t"),
    TEXT.rstrip("\n"),
    TEXT.replace("Frames: 2", "Frames:\t2").replace("Frame Time: ", "Frame Time:"),
    TEXT.replace("MOTION\n", "MOTION\n\n") + "\n\n",
    TEXT.replace("Xposition", "XPOSITION"),
])
def test_the_layouts_that_are_found_are_read(tmp_path, text):
    np.testing.assert_array_equal(read(tmp_path, text).joints().positions, read(tmp_path, TEXT).joints().positions)


@st.composite
def trees(draw):
    """Nodes of a skeleton, and channels of each in any order."""
    count = draw(st.integers(1, 6))
    parents = [None] + [draw(st.integers(0, n - 1)) for n in range(1, count)]
    offsets = draw(st.lists(st.tuples(*[st.floats(-50, 50)] * 3), min_size=count, max_size=count))
    nodes = [(f"j{n}", None if p is None else f"j{p}", o) for n, (p, o) in enumerate(zip(parents, offsets))]
    turns = [draw(st.permutations(["Xrotation", "Yrotation", "Zrotation"]))[: draw(st.integers(0, 3))] for _ in nodes]
    shifts = draw(st.permutations(["Xposition", "Yposition", "Zposition"]))
    channels = {name: ([*shifts, *turn] if draw(st.booleans()) else [*turn, *shifts]) if parent is None else list(turn)
                for (name, parent, _), turn in zip(nodes, turns)}
    return nodes, channels


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(tree=trees(), seed=st.integers(0, 2**32 - 1), frames=st.integers(1, 4))
def test_joints_are_where_another_way_puts_them(tmp_path, tree, seed, frames):
    """SciPy's intrinsic angles, joint by joint from the root."""
    nodes, channels = tree
    order = in_order(nodes)
    widths = {name: len(channels[name]) for name in order}
    rows = np.random.default_rng(seed).uniform(-180, 180, (frames, sum(widths.values())))
    table = read(tmp_path, bvh(nodes, channels, rows)).joints()
    at, places, turns = 0, {}, {}
    known = {name: (parent, np.array(offset)) for name, parent, offset in nodes}
    for name in order:
        parent, offset = known[name]
        values = dict(zip(channels[name], rows[:, at : at + widths[name]].T))
        at += widths[name]
        axes = "".join(c[0] for c in channels[name] if c.endswith("rotation"))
        angles = np.stack([values[c] for c in channels[name] if c.endswith("rotation")], 1) if axes else None
        own = Rotation.from_euler(axes, angles, degrees=True) if axes else Rotation.identity(frames)
        shift = offset + np.stack([values.get(f"{axis}position", np.zeros(frames)) for axis in "XYZ"], 1)
        places[name] = shift if parent is None else places[parent] + turns[parent].apply(shift)
        turns[name] = own if parent is None else turns[parent] * own
    for name in order:
        np.testing.assert_allclose(table.select([name]).positions[:, 0], places[name], atol=1e-8)


def test_bones_keep_their_length(tmp_path):
    table = read(tmp_path, person(20, size=60.0)).joints()
    for a, b, length in (("LeftUpLeg", "LeftLeg", 42), ("RightForeArm", "RightHand", 26), ("Head", "Head_end", 5)):
        pair = table.select([a, b]).positions
        np.testing.assert_allclose(np.linalg.norm(pair[:, 1] - pair[:, 0], axis=1), length)


def test_long_files_are_placed_in_blocks_alike(tmp_path, monkeypatch):
    text = person(23)
    whole = read(tmp_path, text).joints().positions
    monkeypatch.setattr("shadowpuppet.io.motion.bvh.BLOCK", 7)
    np.testing.assert_array_equal(read(tmp_path, text).joints().positions, whole)


@pytest.mark.parametrize(("knee", "place"), [((0.1, -2.1, 0.0), (10.1, 18.9, 30)), ((0.1, -0.1, 0.0), (10.1, 18.9, 30))])
def test_positions_of_other_joints_hold_the_offset_or_come_on_top(tmp_path, knee, place):
    text = TEXT.replace("CHANNELS 1 Xrotation", "CHANNELS 4 Xposition Yposition Zposition Xrotation")
    shift = " ".join(map(str, knee))
    text = text.replace("0 0 0 0\n", f"0 0 0 {shift} 0\n").replace("90 90", f"90 {shift} 90")
    np.testing.assert_allclose(read(tmp_path, text).joints().positions[0, 1], place)


@pytest.mark.parametrize("added", [True, False])
def test_one_file_has_one_kind_of_positions(tmp_path, added):
    """The wrist's offset is small and its movement large: alone it would be taken for the other kind."""
    nodes = [("Hips", None, (0, 0, 0)), ("Knee", "Hips", (0, -40, 0)), ("Wrist", "Knee", (0, -1, 0))]
    channels = {name: ["Xposition", "Yposition", "Zposition"] for name, _, _ in nodes}
    row = [0, 0, 0, 0.5, 0.5, 0, 0, -0.9, 0.3] if added else [0, 0, 0, 0.5, -39.5, 0, 0, 0.2, 0.3]
    found = read(tmp_path, bvh(nodes, channels, [row, row])).joints().select(["Knee", "Wrist"]).positions[0]
    np.testing.assert_allclose(found, [[0.5, -39.5, 0], [0.5, -41.4, 0.3]] if added else [[0.5, -39.5, 0], [0.5, -39.3, 0.3]])


def test_joints_of_one_name_are_distinguished(tmp_path):
    assert read(tmp_path, TEXT.replace("Knee", "Hips")).joints().names == ("Hips", "Hips#2", "Hips_end")


@pytest.mark.parametrize("layout", ["JOINT {}\n", "JOINT   {}  {{ ", "joint\t{}\t\n", "JOINT {}{{\n"])
@pytest.mark.parametrize("name", ["Bip01 L Thigh", "Joint of the Root", "left  knee 2", "größe"])
def test_a_name_is_the_rest_of_its_line(tmp_path, layout, name):
    there = "  JOINT Knee\n  {\n"
    assert there in TEXT
    text = TEXT.replace(there, layout.format(name) + ("" if "{{" in layout else "{\n")).replace("ROOT Hips", "ROOT The Hips")
    table = read(tmp_path, text).joints()
    assert table.names == ("The Hips", name, f"{name}_end")
    np.testing.assert_array_equal(table.positions, read(tmp_path, TEXT).joints().positions)


@pytest.mark.filterwarnings("ignore:.*points up there:shadowpuppet.errors.ShadowPuppetWarning")
def test_names_with_blanks_are_known_as_those_without(tmp_path):
    plain = person(3)
    spaced = plain.replace("JOINT LeftUpLeg", "JOINT Bip01 L Thigh").replace("JOINT RightUpLeg", "JOINT Bip01 R Thigh")
    assert spaced.count("Thigh") == 2
    (tmp_path / "plain.bvh").write_text(plain)
    (tmp_path / "spaced.bvh").write_text(spaced)
    found, wanted = (read_motion(tmp_path / f"{name}.bvh", unit=0.01) for name in ("spaced", "plain"))
    assert found.names == wanted.names
    np.testing.assert_array_equal(found.positions, wanted.positions)


@pytest.mark.parametrize(("old", "new", "said"), [
    ("10 20 30 0 0 90 90", "10 20 30 0 0 90,5 90,5", "line 20, number 6: found '90,5', expected numbers, with a decimal point: 90.5"),
    ("OFFSET 0.0 -2.0 0.0", "OFFSET 0,0 -2,0 0,0", "line 8: found '0,0 -2,0 0,0', expected 3 numbers, with a decimal point: 0.0"),
    ("Frame Time: 0.05", "Frame Time: 0,05", "line 18: found 'Frame Time: 0,05', expected Frame Time: and a number more than zero, with a "
                                             "decimal point: 0.05"),
])  # fmt: skip
def test_a_decimal_comma_is_named(tmp_path, old, new, said):
    assert old in TEXT
    with pytest.raises(FormatError) as found:
        read(tmp_path, TEXT.replace(old, new))
    assert str(found.value).endswith(f"walk.bvh: {said}")


@pytest.mark.parametrize(("said", "step"), [
    ("0.033333", 1 / 30), ("0.0333", 1 / 30), ("0.033", 1 / 30), ("0.0083333", 1 / 120), ("0.0333667", 1001 / 30000), ("0.05", 0.05),
    ("0.03", 0.03), ("0.0329", 0.0329), ("1.5", 1.5), ("2", 2.0), ("3.3e-2", 0.033),
])  # fmt: skip
def test_a_rounded_time_per_frame_is_that_of_the_rate(tmp_path, said, step):
    assert read(tmp_path, TEXT.replace("0.05", said)).step == pytest.approx(step, rel=1e-12)


@pytest.mark.parametrize(("old", "new", "said"), [
    ("HIERARCHY", "time,neck_x", "line 1: found 'time,neck_x', expected HIERARCHY"),
    ("MOTION\n", "", "found no line MOTION"),
    ("ROOT", "JOINT", "line 2: found 'JOINT', expected ROOT"),
    ("JOINT Knee", "ROOT Knee", "line 6: found 'ROOT', expected JOINT or END or }"),
    ("OFFSET 0.0 1.0 0.0", "OFFSET 0.0 1.0", "line 5: found '0.0 1.0 CHANNELS', expected 3 numbers"),
    ("OFFSET 0.0 1.0 0.0", "OFFSET 0.0 1e999 0.0", "line 4: found '0.0 1e999 0.0', expected 3 numbers"),
    ("CHANNELS 1", "CHANNELS 7", "line 9: found '7', expected a number of channels from 0 to 6"),
    ("CHANNELS 1", "CHANNELS 2", "line 10: found 'End', expected XPOSITION or "),
    ("CHANNELS 1 Xrotation", "CHANNELS 2 Xrotation Xrotation", "line 9: found 'a channel of Knee twice'"),
    ("    }\n", "", "line 14: the hierarchy ends, expected JOINT or END or }"),
    ("  }\n}\n", "  }\n}\n}\n", "line 16: found '}', expected MOTION"),
    ("Frames: 2", "Frames: two", "line 17: found 'Frames: two', expected Frames: and a number more than zero"),
    ("Frame Time: 0.05", "Frame Time: 0", "line 18: found 'Frame Time: 0', expected Frame Time: and a number"),
    ("Frame Time: 0.05", "", "line 19: found '10 20 30 0 0 0 0', expected Frame Time:"),
    ("0 0 0 0\n", "0 0 0\n", "line 19: found 6 numbers, expected 7"),
    ("0 0 0 0\n", "0 0 nan 0\n", "line 19: found 'nan', expected numbers"),
    ("10 20 30 0 0 0 0\n10 20 30 0 0 90 90\n", "", "found 0 frames of 7 channels, expected a motion"),
])
def test_what_is_malformed_is_said(tmp_path, old, new, said):
    assert old in TEXT
    with pytest.raises(FormatError) as found:
        read(tmp_path, TEXT.replace(old, new, 1))
    assert f"walk.bvh: {said}" in str(found.value)
    assert "\n" not in str(found.value)


def test_a_file_that_breaks_off_gives_what_is_whole(tmp_path):
    with pytest.warns(ShadowPuppetWarning) as told:
        table = read(tmp_path, TEXT[:-6]).joints()
    assert len(table.times) == 1
    assert [str(w.message).split(": ", 1)[1] for w in told] == ["line 20: the file breaks off within a frame; the 1 before it are used"]
    with pytest.warns(ShadowPuppetWarning, match=r"line 17, Frames: found 9, but the file has 2; those are used"):
        assert len(read(tmp_path, TEXT.replace("Frames: 2", "Frames: 9")).joints().times) == 2


def test_files_that_cannot_be_read_are_said(tmp_path):
    with pytest.raises(FormatError, match=r"none\.bvh: cannot be read \(no such file"):
        read_bvh(tmp_path / "none.bvh")
    (tmp_path / "film.bvh").write_bytes(bytes(range(256)))
    with pytest.raises(FormatError, match=r"found bytes that are no text"):
        read_bvh(tmp_path / "film.bvh")
    with (tmp_path / "huge.bvh").open("wb") as file:
        file.truncate(3_000_000_000)
    with pytest.raises(FormatError, match=r"huge\.bvh: found 3000000000 bytes, expected a text file of at most"):
        read_bvh(tmp_path / "huge.bvh")


def test_a_hierarchy_without_end_is_refused(tmp_path):
    deep = "HIERARCHY\nROOT a\n{\nOFFSET 0 0 0\nCHANNELS 0\n" + "JOINT b\n{\nOFFSET 0 0 0\nCHANNELS 0\n" * 20_000 + "MOTION\n"
    with pytest.raises(FormatError, match="more than 10000 joints"):
        read(tmp_path, deep)


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(at=st.integers(0, len(TEXT) - 1), put=st.text(max_size=6), cut=st.integers(0, 30))
@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")
def test_no_damage_ends_in_anything_but_a_sentence(tmp_path, at, put, cut):
    text = TEXT[:at] + put + TEXT[at + cut :]
    (tmp_path / "bad.bvh").write_text(text, "utf-8", "surrogatepass", newline="")
    assert told_or_read(lambda: read_bvh(tmp_path / "bad.bvh").joints(), "bad.bvh")
