"""Bodies as skeletons that move: every joint where the body has it, whatever the body and wherever it stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import runs
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import BodyTree, motion_animation


def animated(name: str, rng, frames: int = 30) -> tuple[Animation, np.ndarray]:
    body = runs.body_of(name)
    poses = runs.smooth_poses(body, frames, rng)
    return BodyTree(body).animation(np.arange(frames) / 25, poses, runs.root_of(body)), poses


@pytest.mark.parametrize("name", runs.BODIES)
def test_every_landmark_is_a_joint_and_lies_where_the_body_has_it(name, rng):
    animation, poses = animated(name, rng)
    body = runs.body_of(name)
    wanted = [landmark for landmark in body.landmark_names if not landmark.endswith("_fist")]
    found = animation.table.select(wanted).positions
    np.testing.assert_allclose(found, body.points(poses, runs.root_of(body), wanted), atol=1e-12)


@pytest.mark.parametrize("name", runs.BODIES)
def test_at_rest_a_person_stands_along_y_and_looks_along_z(name, rng):
    animation, _ = animated(name, rng)
    at = dict(zip(animation.names, animation.rest))
    assert at["head"][1] > at["neck"][1] > at["pelvis"][1] + 0.3
    assert at["left_shoulder"][0] > 0.1
    assert at["left_hand"][1] < at["left_elbow"][1] < at["left_shoulder"][1]
    assert set(animation.ends) == {n for n in range(len(animation.names)) if n not in animation.parents}
    if name == "anatomical":
        assert at["left_toe"][2] > at["left_ankle"][2] + 0.12  # toes point forward
        assert at["left_heel"][1] < at["left_ankle"][1]
    crown = at["head"] + animation.ends[animation.names.index("head")]
    top = 1.78 if "left_ankle" in at else 0
    if top:
        ends = [at[animation.names[n]][1] + end[1] for n, end in animation.ends.items()]
        soles = min(ends)
        assert crown[1] - soles == pytest.approx(top, abs=0.06)


def test_only_shoulders_that_follow_the_arm_move_against_the_trunk(rng):
    for name in runs.BODIES:
        animation, _ = animated(name, rng)
        moving = {animation.names[n] for n in animation.moving}
        assert moving == ({"left_shoulder", "right_shoulder"} if name == "rounded" else set())


@pytest.mark.parametrize("name", ["rounded", "anatomical"])
def test_a_runs_frame_in_the_world_is_found_from_its_joints(tmp_path, name):
    motion = read_run(runs.make_run(tmp_path / "run", name, lost=(0, 7, 8))).motion
    animation, off = motion_animation(runs.body_of(name), motion)
    assert off < 1e-12
    assert np.flatnonzero(~animation.known).tolist() == [0, 7, 8]
    np.testing.assert_allclose(animation.table.select(motion.joint_names).positions, motion.joints, atol=1e-12)


def test_of_a_person_who_was_measured_again_each_frame_is_placed_for_itself(tmp_path):
    motion = read_run(runs.make_run(tmp_path / "run", "rounded")).motion
    shifted = motion.joints.copy()
    shifted[20:] += [0.0, 0.4, 0.0]  # the distance was found to be another
    animation, off = motion_animation(runs.body_of("rounded"), replace(motion, joints=shifted))
    assert off < 1e-9
    np.testing.assert_allclose(animation.table.select(motion.joint_names).positions, shifted, atol=1e-9)
    taller, off = motion_animation(runs.body_of("rounded", 1.9), motion)
    assert 0.005 < off < 0.1
    assert np.abs(taller.table.select(motion.joint_names).positions - motion.joints).max() < 0.1


def test_between_frames_turns_are_the_shortest_and_beyond_them_held(rng):
    animation, _ = animated("anatomical", rng)
    mid = animation.at((animation.times[:-1] + animation.times[1:]) / 2)
    whole = Rotation.from_matrix(np.swapaxes(animation.rotations[:-1, 3], 1, 2) @ animation.rotations[1:, 3]).magnitude()
    half = Rotation.from_matrix(np.swapaxes(animation.rotations[:-1, 3], 1, 2) @ mid.rotations[:, 3]).magnitude()
    np.testing.assert_allclose(half, whole / 2, atol=1e-9)
    np.testing.assert_allclose(mid.shifts[:, 0], (animation.shifts[:-1, 0] + animation.shifts[1:, 0]) / 2)
    ends = animation.at([-5.0, 99.0])
    np.testing.assert_array_equal(ends.rotations, animation.rotations[[0, -1]])
    same = animation.at(animation.times)
    np.testing.assert_array_equal(same.rotations, animation.rotations)


def test_gaps_are_bridged_from_the_known_frames_beside_them(rng):
    animation, _ = animated("cylinders", rng)
    rotations = animation.rotations.copy()
    rotations[[0, 10, 11, 29]] = np.nan
    filled = replace(animation, rotations=rotations).at(animation.times)
    assert filled.known.all()
    np.testing.assert_array_equal(filled.rotations[0], animation.rotations[1])
    np.testing.assert_array_equal(filled.rotations[29], animation.rotations[28])
    step = animation.shifts[12, 0] - animation.shifts[9, 0]
    np.testing.assert_allclose(filled.shifts[10, 0], animation.shifts[9, 0] + step / 3)


def test_what_does_not_fit_is_refused(rng):
    animation, _ = animated("anatomical", rng, 3)
    with pytest.raises(ShadowPuppetError, match=r"shifts: found shape \(2, "):
        replace(animation, shifts=animation.shifts[:2])
    with pytest.raises(ShadowPuppetError, match="parents: found"):
        replace(animation, parents=(-1, -1, *animation.parents[2:]))
    with pytest.raises(ShadowPuppetError, match="parents: found"):
        replace(animation, parents=(-1, 5, *animation.parents[2:]))
    with pytest.raises(ShadowPuppetError, match="no frame in which the whole skeleton is known"):
        replace(animation, rotations=animation.rotations * np.nan).at([0.0])
