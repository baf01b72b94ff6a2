"""Motion capture files: places against plain forward kinematics, files of other layouts, and what is malformed."""

from __future__ import annotations

from math import cos, radians, sin, sqrt

import acclaim
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from shadowpuppet.errors import FormatError
from shadowpuppet.io.motion.amc import read_amc, read_mocap
from shadowpuppet.io.motion.asf import euler, read_asf

UNIT = 0.0254 / 0.45


def times(a, b):
    return [[sum(a[i][k] * b[k][j] for k in range(3)) for j in range(3)] for i in range(3)]


def turned(m, v):
    return [sum(m[i][k] * v[k] for k in range(3)) for i in range(3)]


def rotation(degrees):
    """About x first, then y, then z, as one writes them down."""
    (a, b, c), one = map(radians, degrees), 1.0
    x = [[one, 0, 0], [0, cos(a), -sin(a)], [0, sin(a), cos(a)]]
    y = [[cos(b), 0, sin(b)], [0, one, 0], [-sin(b), 0, cos(b)]]
    z = [[cos(c), -sin(c), 0], [sin(c), cos(c), 0], [0, 0, one]]
    return times(z, times(y, x))


def naive(frame):
    """Ends of all bones of one frame, metres, in the file's world: bone by bone, matrix by matrix."""
    place = {"root": [v * UNIT for v in frame["root"][:3]]}
    turn = {"root": rotation(frame["root"][3:])}
    for name, parent, direction, length, axis, dofs in acclaim.bones():
        angles = {"rx": 0.0, "ry": 0.0, "rz": 0.0} | dict(zip(dofs.split(), frame.get(name, [])))
        c = rotation(axis)
        back = [list(row) for row in zip(*c)]
        turn[name] = times(turn[parent], times(c, times(rotation(list(angles.values())), back)))
        size = sqrt(sum(v * v for v in direction))
        step = turned(turn[name], [v / size * length * UNIT for v in direction])
        place[name] = [p + s for p, s in zip(place[parent], step)]
    return place


def test_places_are_those_of_plain_forward_kinematics(tmp_path, rng):
    path, frames = acclaim.write(tmp_path, 4, rng)
    capture = read_mocap(path)
    table = capture.joints(60.0)
    np.testing.assert_allclose(table.times, np.arange(4) / 60)
    at = dict(zip(table.names, table.positions.swapaxes(0, 1)))
    for n, frame in enumerate(frames):
        wanted = naive(frame)
        for place, bone in enumerate(capture.skeleton.bones):
            np.testing.assert_allclose(capture.ends[n, place], wanted[bone.name], atol=1e-6)
        x, y, z = wanted["lfemur"]
        np.testing.assert_allclose(at["left_knee"][n], [x, -z, y], atol=1e-6)
        np.testing.assert_allclose(at["pelvis"][n], (at["left_hip"][n] + at["right_hip"][n]) / 2)


def test_at_rest_the_person_stands_upright_facing_minus_y(tmp_path):
    path, _ = acclaim.write(tmp_path)
    table = read_mocap(path).at_rest.joints()
    at = dict(zip(table.names, table.positions[0]))
    assert at["left_hand"][0] > 0.5
    assert abs(at["left_hand"][2] - at["left_shoulder"][2]) < 1e-6
    assert at["left_toes"][1] < at["left_ankle"][1] - 0.1
    assert at["face"][1] < at["crown"][1] - 0.1
    assert at["crown"][2] > at["neck"][2] > at["pelvis"][2] > at["left_ankle"][2]


@settings(max_examples=20, deadline=None)
@given(angles=st.tuples(*3 * [st.floats(-180, 180)]), order=st.permutations("XYZ"))
def test_eulers_angles_turn_in_the_order_of_the_letters(angles, order):
    R = np.eye(3)
    for letter in order:
        alone = [angle if name == letter else 0.0 for name, angle in zip("XYZ", angles)]
        R = np.array(rotation(alone)) @ R
    np.testing.assert_allclose(euler("".join(order), np.radians(angles)), R, atol=1e-9)


def test_other_layouts_mean_the_same(tmp_path):
    path, _ = acclaim.write(tmp_path)
    plain = read_mocap(path)
    text = path.read_text("utf-8")
    for other in (text.replace("\n", "\r\n"), text + "\n\n", text.replace("rfemur ", "rfemur   ")):
        path.write_text(other, "utf-8")
        np.testing.assert_array_equal(read_mocap(path).ends, plain.ends)
    radian = acclaim.poses(3, np.random.default_rng(1))
    for frame in radian:
        for name, values in frame.items():
            keep = 3 if name == "root" else 0
            frame[name] = [*values[:keep], *map(radians, values[keep:])]
    path.write_text(acclaim.amc(radian).replace(":DEGREES", ":RADIANS"), "utf-8")
    np.testing.assert_allclose(read_mocap(path).ends, plain.ends, atol=1e-5)
    skeleton = tmp_path / "01.asf"
    skeleton.write_text(acclaim.asf().replace("order TX TY TZ RX RY RZ", "order RX RY RZ TX TY TZ"), "utf-8")
    moved = [frame | {"root": [*frame["root"][3:], *frame["root"][:3]]} for frame in acclaim.poses(3, np.random.default_rng(1))]
    path.write_text(acclaim.amc(moved), "utf-8")
    np.testing.assert_allclose(read_mocap(path).ends, plain.ends)


def test_limits_and_units_are_read(tmp_path):
    acclaim.write(tmp_path)
    skeleton = read_asf(tmp_path / "01.asf")
    femur = skeleton.bones[skeleton.index("lfemur")]
    assert femur.length == pytest.approx(7.4 * UNIT)
    assert femur.limits is not None
    np.testing.assert_allclose(femur.limits, np.radians([[-160, 20]] * 3))
    assert skeleton.bones[skeleton.index("lhipjoint")].dofs == ()
    with pytest.raises(FormatError, match="no bone 'tail'; there are: head, lclavicle"):
        skeleton.index("tail")


BAD_AMC = [
    (lambda t: t.replace("rfemur ", "rfemur x", 1), r"line \d+: found 'rfemur, x[^']*', expected rfemur and 3 numbers"),
    (lambda t: t.replace("lradius ", "lradius 1.0 ", 2).replace("lradius 1.0 ", "lradius ", 1), r"expected lradius and 1 number$"),
    (lambda t: t[: t.index("\n3\n") + 60], r"ends within a frame|expected \w+ and \d number"),
    (lambda t: t.replace("ltoes", "lthumb", 1), r"line \d+: 'lthumb' is there twice in the frame"),
    (lambda t: t.replace("ltoes", "tail", 1), r"'tail' is no bone of 01.asf"),
    (lambda t: "\n".join(line for line in t.splitlines() if not line.startswith("head")), "the frame has no 'head'"),
    (lambda t: t.replace("\n3\n", "\n1\n"), "frame 1 comes after one with a number that is not smaller"),
    (lambda t: t.replace("\n3\n", "\n"), r"line \d+: found 'root.*expected a frame's number"),
    (lambda t: t.replace("\n2\n", "\n"), "'root' is there twice in the frame"),
    (lambda t: t.replace("head ", "head nan ", 1).replace("head nan ", "head nan 1 2 #"), "expected head and 3 numbers"),
    (lambda t: t[: t.index("head ")] + "head nan 1 2" + t[t.index("\n", t.index("head ")) :], "found 'head, nan, 1, 2', expected head"),
    (lambda t: t[: t.index("head ")] + "head 0,5 1 2" + t[t.index("\n", t.index("head ")) :],
     r"line \d+, number 1: found '0,5', expected head and 3 numbers, with a decimal point: 0\.5$"),
    (lambda t: ":DEGREES\n", "found no frames"),
    (lambda t: "", "the file is empty"),
    (lambda t: "hello\n" + t, "line 1: found 'hello', expected a frame's number"),
]


@pytest.mark.parametrize(("break_", "words"), BAD_AMC)
def test_malformed_motions_are_reported_by_line(tmp_path, break_, words):
    path, _ = acclaim.write(tmp_path)
    path.write_text(break_(path.read_text("utf-8")), "utf-8")
    with pytest.raises(FormatError, match=words) as caught:
        read_mocap(path)
    assert str(path) in str(caught.value)
    assert "\n" not in str(caught.value)


BAD_ASF = [
    (lambda t: t.replace("length 7.4", "length long"), r"line \d+: found 'long', expected 1 number"),
    (lambda t: t.replace("length 7.4", "length 7,4"), r"line \d+: found '7,4', expected 1 number, with a decimal point: 7\.4$"),
    (lambda t: t.replace("    name lfemur\n", ""), "a bone without name"),
    (lambda t: t.replace("direction 0.0 1.0 -0.0", "direction 0 0 0", 1), "direction of lowerback: found 0 0 0"),
    (lambda t: t.replace("dof rx ry rz", "dof rx ry l", 1), "dof of lowerback: found 'rx, ry, l'"),
    (lambda t: t.replace("lfemur ltibia", "lfemur"), "'ltibia', expected a bone that hangs on the root|hangs on nothing"),
    (lambda t: t.replace("lfemur ltibia", "lfemur ltibia rtibia"), "'rtibia' is there twice"),
    (lambda t: t.replace("lfemur ltibia", "lfemur tail"), "'tail' is no bone of :bonedata"),
    (lambda t: t.replace("name lfemur", "name rfemur"), "bone 'rfemur' is there twice"),
    (lambda t: t.replace(":bonedata", ":bones"), "found ':bones', expected one of :bonedata"),
    (lambda t: t.replace("order TX TY TZ RX RY RZ", "order TX TY TZ"), "order of the root"),
    (lambda t: t.replace("axis XYZ", "axis XYX"), "axis: found 'XYX'"),
    (lambda t: t.replace("length 0.45", "length 0"), "length: found 0, expected more than 0"),
    (lambda t: t[: t.index(":bonedata")] + ":bonedata\n:hierarchy\n", "found no bones"),
    (lambda t: t[: t.index(":bonedata")] + ":bonedata\nbegin\n id 1\n", "ends within a block"),
    (lambda t: "hello\n" + t, "line 1: found 'hello', expected an ASF file"),
    (lambda t: t.replace("limits (-160.0 20.0)", "limits (-160.0)", 1), "expected 2 numbers"),
]


@pytest.mark.parametrize(("break_", "words"), BAD_ASF)
def test_malformed_skeletons_are_reported_by_line(tmp_path, break_, words):
    acclaim.write(tmp_path)
    path = tmp_path / "01.asf"
    path.write_text(break_(path.read_text("utf-8")), "utf-8")
    with pytest.raises(FormatError, match=words) as caught:
        read_asf(path)
    assert str(path) in str(caught.value)


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_no_cut_or_changed_file_ends_in_anything_but_a_sentence(tmp_path_factory, data):
    folder = tmp_path_factory.mktemp("mocap")
    path, _ = acclaim.write(folder, 2)
    victim = data.draw(st.sampled_from([path, folder / "01.asf"]))
    text = victim.read_text("utf-8")
    at = data.draw(st.integers(0, len(text) - 1))
    head, tail = text[:at], text[at:]
    text = data.draw(st.sampled_from([head, head + "x" + tail[1:], head + tail[1:], head + "\n" + tail]))
    victim.write_text(text, "utf-8")
    told, table = "", None
    try:
        table = read_mocap(path).joints()
    except FormatError as error:
        told = str(error)
    assert str(folder) in told if table is None else np.isfinite(table.positions).all()


def test_the_skeleton_is_found_beside_the_motion(tmp_path):
    path, _ = acclaim.write(tmp_path)
    other = tmp_path / "07.asf"
    other.write_text(acclaim.asf().replace("length 7.4", "length 8.4"), "utf-8")
    assert read_mocap(path).skeleton.path.name == "01.asf"
    assert read_mocap(path, other).skeleton.path.name == "07.asf"
    (tmp_path / "01.asf").unlink()
    assert read_mocap(path).skeleton.path.name == "07.asf"
    other.unlink()
    with pytest.raises(FormatError, match=r"found 0 .asf files beside it, expected 01_01.asf or 01.asf"):
        read_mocap(path)
    with pytest.raises(FormatError, match=r"found the ending '.c3d', expected .amc"):
        read_mocap(tmp_path / "01.c3d")
    with pytest.raises(FormatError, match="cannot be read"):
        read_amc(tmp_path / "gone.amc", read_asf(_again(other)))


def _again(path):
    path.write_text(acclaim.asf(), "utf-8")
    return path


@pytest.mark.shared
@pytest.mark.parametrize("name", ["02_04", "02_10", "03_01"])
def test_the_shared_motions_are_of_people(shared, name):
    table = read_mocap(shared / "mocap" / f"{name}.amc").joints()
    at = dict(zip(table.names, table.positions.swapaxes(0, 1)))
    lengths = (("left_hip", "left_knee", 0.38, 0.46), ("left_shoulder", "left_elbow", 0.26, 0.31), ("neck", "crown", 0.2, 0.32))
    for a, b, low, high in lengths:
        assert (np.linalg.norm(at[a] - at[b], axis=1) > low).all()
        assert (np.linalg.norm(at[a] - at[b], axis=1) < high).all()
    assert (at["neck"][:, 2] > at["pelvis"][:, 2] + 0.2).mean() > 0.8
    assert np.abs(np.diff(table.positions, axis=0)).max() * 120 < 12
