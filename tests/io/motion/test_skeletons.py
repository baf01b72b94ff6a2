"""Skeletons of other programs' files kept: joints where the files' own reading has them, whatever the unit and the axis that is up."""

from __future__ import annotations

import acclaim
import biovision
import numpy as np
import pytest
from damage import told_or_read

from shadowpuppet.errors import FormatError, ShadowPuppetWarning
from shadowpuppet.io.motion.amc import ENDS, read_mocap
from shadowpuppet.io.motion.bvh_writer import write_bvh
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.skeletons import CMU, read_animation


def test_amc_bones_begin_where_those_above_them_end(tmp_path, rng):
    path, _ = acclaim.write(tmp_path, 12, rng)
    animation, capture = read_animation(path), read_mocap(path).joints()
    at = dict(zip(animation.names, np.moveaxis(animation.table.positions, 1, 0)))
    below = {bone.parent: bone.name for bone in read_mocap(path).skeleton.bones}
    names = [bone.name for bone in read_mocap(path).skeleton.bones]
    for joint, bone in ENDS.items():
        child = below.get(names.index(bone))
        if child is not None:
            np.testing.assert_allclose(at[CMU[child]], capture.select([joint]).positions[:, 0], atol=1e-12)
    np.testing.assert_allclose(np.diff(animation.times), 1 / 120)
    np.testing.assert_allclose(np.diff(read_animation(path, rate=60).times), 1 / 60)
    assert not animation.moving
    head = animation.names.index("Head")
    crown = animation.world()[0][:, head] + animation.world()[1][:, head] @ np.array(animation.ends[head])
    np.testing.assert_allclose(crown, capture.select(["crown"]).positions[:, 0], atol=1e-12)


@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")
def test_amc_to_bvh_has_our_joints_where_they_were(tmp_path):
    path, _ = acclaim.write(tmp_path, 12, size=8.0)
    write_bvh(tmp_path / "a.bvh", read_animation(path))
    ours, theirs = read_motion(tmp_path / "a.bvh"), read_motion(path)
    apart = ("pelvis", "left_hand", "right_hand")  # the root is no joint of ours there, and the made skeleton has no fingers
    names = [name for name in theirs.names if name not in apart]
    assert len(names) == 14
    np.testing.assert_allclose(ours.select(names).positions, theirs.select(names).positions, atol=1e-5)


@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")
@pytest.mark.parametrize("scale", [1.0, 0.01, 10.0])
def test_bvh_joints_lie_where_its_own_reading_has_them(tmp_path, rng, scale):
    (tmp_path / "a.bvh").write_text(biovision.person(8, scale=scale, rng=rng))
    animation, read = read_animation(tmp_path / "a.bvh"), read_motion(tmp_path / "a.bvh", own_names=True)
    assert "LeftForeArm" in animation.names
    assert not any(name.endswith("_end") for name in animation.names)
    np.testing.assert_allclose(animation.table.positions, read.select(animation.names).positions, atol=1e-9)
    places, turns = animation.world()
    toe = animation.names.index("LeftToeBase")
    tip = places[:, toe] + turns[:, toe] @ np.array(animation.ends[toe])
    np.testing.assert_allclose(tip, read.select(["LeftToeBase_end"]).positions[:, 0], atol=1e-9)
    rest = dict(zip(animation.names, animation.rest))
    assert rest["Head"][1] > 0.5  # metres, Y up
    write_bvh(tmp_path / "b.bvh", animation)
    np.testing.assert_allclose(read_animation(tmp_path / "b.bvh").table.positions, animation.table.positions, atol=2e-5)


ZUP = [("root", None, (0, 0, 0)), ("trunk", "root", (0, 0, 20)), ("arm", "trunk", (10, 2, 0)), ("tail", "root", (0, 1, -9))]


def write_creature(folder, turned=lambda x, y, z: (x, y, z)):
    channels = {name: (["Xposition", "Yposition", "Zposition"] if p is None else []) + ["Zrotation", "Yrotation", "Xrotation"]
                for name, p, _ in ZUP}
    rows = np.random.default_rng(2).normal(0, 9, (5, 3 + 3 * len(ZUP)))
    nodes = [(name, parent, turned(*offset)) for name, parent, offset in ZUP]
    (folder / "c.bvh").write_text(biovision.bvh(nodes, channels, rows))


@pytest.mark.parametrize("turned", [lambda x, y, z: (x, y, z), lambda x, y, z: (x, z, -y)])
def test_a_skeleton_that_is_no_persons_keeps_its_bones_and_stands_in_the_file(tmp_path, turned):
    write_creature(tmp_path, turned)
    with pytest.raises(FormatError, match=r"c\.bvh: found neither legs nor arms of known names"):
        read_animation(tmp_path / "c.bvh")
    animation = read_animation(tmp_path / "c.bvh", unit=0.01)
    raw = read_motion(tmp_path / "c.bvh", own_names=True, unit=0.01).select(animation.names).positions
    ours, theirs = (np.linalg.norm(places[:, 1:] - places[:, :1], axis=2) for places in (animation.table.positions, raw))
    np.testing.assert_allclose(ours, theirs, atol=1e-9)
    np.testing.assert_allclose(dict(zip(animation.names, animation.rest))["trunk"], [0, 0.2, 0], atol=1e-12)  # Y up at rest


def test_places_that_move_within_the_skeleton_are_followed_by_turning_bones(tmp_path):
    nodes = [("Hips", None, (0, 0, 0)), ("LeftUpLeg", "Hips", (0, -5, 0)), ("LeftLeg", "LeftUpLeg", (0, -42, 0)),
             ("LeftFoot", "LeftLeg", (0, -41, 0)), ("Head", "Hips", (0, 60, 0))]  # fmt: skip
    channels = {name: ["Xposition", "Yposition", "Zposition", "Zrotation", "Xrotation", "Yrotation"] for name, *_ in nodes}
    rows = np.random.default_rng(0).normal(0, 5, (6, 30))
    for n, (_, _, offset) in enumerate(nodes):
        rows[:, 6 * n : 6 * n + 3] = np.array(offset) + rows[:, 6 * n : 6 * n + 3] / 10
    (tmp_path / "a.bvh").write_text(biovision.bvh(nodes, channels, rows))
    with pytest.warns(ShadowPuppetWarning):
        animation = read_animation(tmp_path / "a.bvh")
    assert len(animation.moving) == 4
    with pytest.warns(ShadowPuppetWarning, match=r"b\.bvh: joints lie up to 3\.2 mm off, as bones keep their lengths"):
        write_bvh(tmp_path / "b.bvh", animation)
    with pytest.warns(ShadowPuppetWarning):
        again = read_animation(tmp_path / "b.bvh")
    np.testing.assert_allclose(again.table.select(animation.names).positions, animation.table.positions, atol=0.01)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("ending", ["bvh", "amc"])
def test_damaged_files_are_read_or_told(tmp_path, rng, ending):
    acclaim.write(tmp_path, 2)
    whole = biovision.person(3) if ending == "bvh" else (tmp_path / "01_01.amc").read_text()
    path = tmp_path / f"01_02.{ending}"
    for n in range(50):
        letters = list(whole)
        for place in rng.integers(0, len(letters), 3):
            letters[place] = str(rng.choice(list("0123456789.-e {}\nx")))
        path.write_text("".join(letters[: rng.integers(0, len(letters))] if n % 4 == 0 else letters))
        assert told_or_read(lambda: read_animation(path).table, path.name), n


def test_other_files_are_refused(tmp_path):
    with pytest.raises(FormatError, match=r"found the ending '\.fbx', expected one of \.amc, \.bvh"):
        read_animation(tmp_path / "a.fbx")
    with pytest.raises(FormatError, match="cannot be read"):
        read_animation(tmp_path / "a.bvh")
    with pytest.raises(FormatError, match=r"a\.amc: cannot be read"):
        read_animation(tmp_path / "a.amc")
