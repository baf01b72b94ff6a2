"""BVH files written: joints where the run has them, in our reader and in an independent one; gaps and odd times told."""

from __future__ import annotations

import re
import warnings
from dataclasses import replace

import numpy as np
import pytest
import runs

from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.bvh_writer import write_bvh
from shadowpuppet.motion.animation import Y_UP, Animation
from shadowpuppet.motion.body_animation import BodyTree

FRAMES = 30


def animated(name: str, rng, frames: int = FRAMES) -> Animation:
    body = runs.body_of(name)
    return BodyTree(body).animation(np.arange(frames) / 25, runs.smooth_poses(body, frames, rng), runs.root_of(body))


def places(path, names) -> np.ndarray:
    """Of our reader, turned back."""
    return read_bvh(path).joints().select(names).positions @ Y_UP


@pytest.mark.parametrize("name", runs.BODIES)
def test_joints_lie_where_they_did_within_a_fifth_of_a_millimetre(tmp_path, name, rng):
    animation = animated(name, rng)
    write_bvh(tmp_path / "a.bvh", animation)
    found = places(tmp_path / "a.bvh", animation.names)
    assert np.abs(found - animation.table.positions).max() < (2e-4 if name == "rounded" else 1e-5)
    assert read_bvh(tmp_path / "a.bvh").step == pytest.approx(0.04)


@pytest.mark.parametrize("name", ["rounded", "anatomical", "cylinders"])
def test_an_independent_reader_puts_every_joint_there_too(tmp_path, name, rng):
    animation = animated(name, rng)
    write_bvh(tmp_path / "a.bvh", animation)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", PendingDeprecationWarning)  # of what it is made of
        bvhio = pytest.importorskip("bvhio")
    root = bvhio.readAsHierarchy(str(tmp_path / "a.bvh"))
    wanted = animation.table.positions
    seen = set()
    for frame in (0, 11, FRAMES - 1):
        root.loadPose(frame)
        for joint, _, _ in root.layout():
            if joint.Name in animation.names:
                seen.add(joint.Name)
                at = np.array(joint.PositionWorld) @ Y_UP
                np.testing.assert_allclose(at, wanted[frame, animation.names.index(joint.Name)], atol=2e-4)
    assert seen == set(animation.names)


def test_all_joints_have_one_order_and_only_the_root_has_positions(tmp_path, rng):
    """Of three programs one was 550 mm off where orders differ, one refused positions below the root, one was 362 mm off."""
    for name in ("anatomical", "rounded"):
        write_bvh(tmp_path / "a.bvh", animated(name, rng))
        text = (tmp_path / "a.bvh").read_text()
        (six, order), *others = re.findall(r"CHANNELS (6 Xposition Yposition Zposition|3) (.*)", text)
        assert six.startswith("6")
        assert set(others) == {("3", order)}
        assert text.splitlines()[:4] == ["HIERARCHY", "ROOT pelvis", "{", "\tOFFSET 0.000000 0.000000 0.000000"]
        assert "-0.000000" not in text
        assert ("left_shoulder_base" in text) == (name == "rounded")


def test_angles_do_not_jump(tmp_path, rng):
    animation = animated("anatomical", rng, 200)
    write_bvh(tmp_path / "a.bvh", animation)
    steps = np.abs(np.diff(read_bvh(tmp_path / "a.bvh").values, axis=0))
    turns = np.einsum("tjab,tjab->tj", animation.rotations[1:], animation.rotations[:-1])
    largest = np.degrees(np.arccos(np.clip((turns - 1) / 2, -1, 1))).max()
    assert steps[:, 3:].max() < 4 * largest  # a heading of more than a turn, limbs through every quarter


@pytest.mark.parametrize(("unit", "scale"), [("m", 1), ("cm", 100), ("mm", 1000)])
def test_units(tmp_path, unit, scale, rng):
    animation = animated("rounded", rng)
    write_bvh(tmp_path / "a.bvh", animation, unit)
    np.testing.assert_allclose(places(tmp_path / "a.bvh", animation.names) / scale, animation.table.positions, atol=2e-4)
    with pytest.raises(ShadowPuppetError, match="unit: found 'ft', expected one of cm, m, mm"):
        write_bvh(tmp_path / "a.bvh", animation, "ft")


def test_frames_that_are_not_known_are_bridged_and_that_is_said(tmp_path, rng):
    animation = animated("anatomical", rng)
    rotations = animation.rotations.copy()
    rotations[[0, 12, 13]] = np.nan
    with pytest.warns(ShadowPuppetWarning, match=r"a\.bvh: 3 of 30 frames are not known, which this format cannot tell"):
        write_bvh(tmp_path / "a.bvh", replace(animation, rotations=rotations))
    found = places(tmp_path / "a.bvh", animation.names)
    known = np.delete(np.arange(FRAMES), [0, 12, 13])
    np.testing.assert_allclose(found[known], animation.table.positions[known], atol=1e-5)
    np.testing.assert_allclose(found[0], found[1], atol=1e-5)
    root = animation.shifts[:, 0]
    np.testing.assert_allclose(found[12, 0], (2 * root[11] + root[14]) / 3, atol=1e-5)


def test_frames_that_are_missing_in_time_are_bridged_too(tmp_path, rng):
    whole = animated("anatomical", rng)
    kept = np.delete(np.arange(FRAMES), [4, 5])
    animation = replace(whole, times=whole.times[kept], rotations=whole.rotations[kept], shifts=whole.shifts[kept])
    with pytest.warns(ShadowPuppetWarning, match="2 of 30 frames are not known"):
        write_bvh(tmp_path / "a.bvh", animation)
    np.testing.assert_allclose(places(tmp_path / "a.bvh", whole.names)[kept], whole.table.positions[kept], atol=1e-5)


def test_odd_times_become_a_rate_and_that_is_said(tmp_path, rng):
    animation = replace(animated("cylinders", rng), times=np.cumsum(rng.uniform(0.02, 0.08, FRAMES)))
    with pytest.warns(ShadowPuppetWarning, match="do not come at a constant rate"):
        write_bvh(tmp_path / "a.bvh", animation)
    found = read_bvh(tmp_path / "a.bvh")
    at = animation.times[0] + np.arange(len(found.values)) * found.step
    wanted = np.stack([np.interp(at, animation.times, column) for column in animation.shifts[:, 0].T], 1)
    np.testing.assert_allclose(found.joints().positions[:-1, 0] @ Y_UP, wanted[:-1], atol=1e-5)


def test_what_cannot_be_written_is_said(tmp_path, rng):
    animation = animated("anatomical", rng, 3)
    with pytest.raises(ShadowPuppetError, match=r"a\.bvh: joint name: found 'left hip'"):
        write_bvh(tmp_path / "a.bvh", replace(animation, names=("left hip", *animation.names[1:])))
    with pytest.raises(ShadowPuppetError, match=r"a\.bvh: found no frame in which the whole skeleton is known"):
        write_bvh(tmp_path / "a.bvh", replace(animation, shifts=animation.shifts * np.nan))
    with pytest.raises(ShadowPuppetError, match=r"a\.bvh: found no frame"):
        write_bvh(tmp_path / "a.bvh", replace(animation, times=np.zeros(0), rotations=animation.rotations[:0], shifts=animation.shifts[:0]))
    with pytest.raises(ShadowPuppetError, match="cannot be written"):
        write_bvh(tmp_path / "no" / "a.bvh", animation)
    assert list(tmp_path.iterdir()) == []
