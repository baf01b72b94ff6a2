"""What is measured beside distance: against plain loops, and by what must and must not change it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from measured import NAMES, moved, person
from numpy.testing import assert_allclose

from shadowpuppet.body.models import average_sizes, make_body
from shadowpuppet.evaluation.error_metrics import (
    acceleration_errors,
    aligned_distances,
    aligned_errors,
    axis_errors,
    bone_errors,
    hinge_errors,
    pose_losses,
    world_difference,
)
from shadowpuppet.evaluation.joint_angles import dof_errors
from shadowpuppet.geometry import rotation_from_vector, wrapped
from shadowpuppet.motion.metrics import LIMB_JOINTS, joint_errors
from shadowpuppet.motion.motion import JointTable, Motion

TRUTH = person(2)


def noisy(size: float = 0.03, seed: int = 0) -> JointTable:
    return moved(TRUTH, np.random.default_rng(seed).normal(size=TRUTH.positions.shape) * size)


def turned(table: JointTable, vector, shift) -> JointTable:
    return JointTable(table.times, table.names, table.positions @ rotation_from_vector(vector).T + shift)


def measured(run: JointTable, truth: JointTable = TRUTH):
    return joint_errors(run, truth, LIMB_JOINTS)


# Ways of laying a run over its truth


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 99), st.tuples(*[st.floats(-3, 3)] * 3), st.tuples(*[st.floats(-5, 5)] * 3))
def test_each_way_is_blind_to_what_it_takes_away(seed, vector, shift):
    run = noisy(seed=seed)
    plain = aligned_errors(measured(run), run, TRUTH)
    other = turned(run, vector, shift)
    found = aligned_errors(measured(other), other, TRUTH)
    for way in ("whole", "rigid", "similar"):
        assert found[way] == pytest.approx(plain[way], abs=1e-6)
    pushed = moved(run, np.array(shift))
    for way in ("root", "frame_offset"):
        assert aligned_errors(measured(pushed), pushed, TRUTH)[way] == pytest.approx(plain[way], abs=1e-6)
    each = moved(run, np.random.default_rng(seed).normal(size=(len(run.times), 1, 3)))
    for way in ("root", "rigid", "similar"):
        assert aligned_errors(measured(each), each, TRUTH)[way] == pytest.approx(plain[way], abs=1e-6)


def test_the_root_is_taken_away_as_a_plain_loop_does_it():
    run = noisy()
    ours, theirs = run.positions - run.positions[:, :1], TRUTH.positions - TRUTH.positions[:, :1]  # the pelvis comes first
    off = [math.dist(ours[t, NAMES.index(name)], theirs[t, NAMES.index(name)]) for t in range(len(run.times)) for name in LIMB_JOINTS]
    found = aligned_errors(measured(run), run, TRUTH)
    assert found["root"] == pytest.approx(1000 * np.mean(off))
    assert found["root_joint"] == "pelvis"


def test_the_root_of_an_upper_body_is_not_the_pelvis_that_nobody_saw():
    names = ("pelvis", "neck", "left_elbow", "right_elbow")
    run, truth = noisy().select(names), TRUTH.select(names)
    assert aligned_errors(joint_errors(run, truth, names[2:]), run, truth)["root_joint"] == "neck"
    arms = ("left_shoulder", "right_shoulder", "left_elbow")
    assert aligned_errors(joint_errors(noisy().select(arms), truth=TRUTH, joints=arms), noisy().select(arms), TRUTH)["root_joint"] == \
        "left_shoulder and right_shoulder"
    lone = ("left_elbow", "left_wrist")
    found = aligned_errors(joint_errors(noisy().select(lone), TRUTH, lone), noisy().select(lone), TRUTH)
    assert (found["root_joint"], "root" in found) == ("", False)
    assert found["rigid"] == found["none"]  # two joints tell no rotation: their errors stay


def test_what_is_lost_counts_in_every_way():
    run = noisy(0.001)
    gone = run.positions.copy()
    gone[:30] = np.nan
    lost = JointTable(run.times, run.names, gone)
    distances = aligned_distances(measured(lost), lost, TRUTH)
    assert all((d[:30] == 0.5).all() and (d[30:] < 0.05).all() for d in distances.values())
    assert aligned_errors(measured(lost), lost, TRUTH)["rigid"] == pytest.approx(250, abs=5)


def test_a_lost_root_joint_loses_its_frames_from_the_root_alone():
    run = noisy(0.001)
    gone = run.positions.copy()
    gone[:30, NAMES.index("pelvis")] = np.nan
    rootless = JointTable(run.times, run.names, gone)
    distances = aligned_distances(measured(rootless), rootless, TRUTH)
    assert (distances.pop("root")[:30] == 0.5).all()
    assert all((d < 0.05).all() for d in distances.values())


@pytest.mark.parametrize("way", ["none", "whole", "frame_offset", "root", "rigid", "similar"])
def test_a_truth_with_gaps_is_compared_where_it_is_known(way):
    run, gaps = noisy(), TRUTH.positions.copy()
    gaps[:20, NAMES.index("left_knee")] = np.nan
    gaps[40:45] = np.nan
    truth = JointTable(TRUTH.times, TRUTH.names, gaps)
    errors = measured(run, truth)
    distance, whole = aligned_distances(errors, run, truth)[way], aligned_distances(measured(run), run, TRUTH)[way]
    knee = LIMB_JOINTS.index("left_knee")
    assert np.isfinite(aligned_errors(errors, run, truth)[way])
    assert not errors.known[:20, knee].any()
    assert not errors.lost.any()
    assert distance[errors.known] == pytest.approx(whole[errors.known], abs=0.02)


# Axes, worlds


def test_axes_have_signs_and_leave_out_what_is_lost():
    run = moved(TRUTH, [0.01, -0.02, 0.03])
    gone = run.positions.copy()
    gone[:5, 3:] = np.nan
    found = axis_errors(measured(JointTable(run.times, run.names, gone)))
    assert [found[axis]["mean"] for axis in "xyz"] == pytest.approx([10, -20, 30])
    assert [found["joints"]["left_knee"][axis]["rmse"] for axis in "xyz"] == pytest.approx([10, 20, 30])
    assert found["x"]["sd"] == pytest.approx(0, abs=1e-9)
    nothing = JointTable(TRUTH.times, TRUTH.names, np.full_like(TRUTH.positions, np.nan))
    assert axis_errors(measured(nothing)) == {}


@given(st.floats(0.2, 3.0))
def test_another_world_is_reported_by_what_one_rigid_motion_makes_good(angle):
    run = turned(noisy(0.01), [0, 0, angle], [2, -1, 0])
    found = world_difference(measured(run), run, TRUTH)
    assert found["apart"]
    assert found["rotation_deg"] == pytest.approx(np.degrees(angle), abs=1)
    assert np.abs(found["axis"][2]) == pytest.approx(1, abs=0.02)
    assert found["aligned_mm"] < 25


def test_a_bad_run_is_not_taken_for_another_world():
    bad = noisy(0.3)
    assert not world_difference(measured(bad), bad, TRUTH)["apart"]
    assert not world_difference(measured(noisy()), noisy(), TRUTH)["apart"]
    nothing = JointTable(TRUTH.times, TRUTH.names, np.full_like(TRUTH.positions, np.nan))
    assert world_difference(measured(nothing), nothing, TRUTH) == {}


# Posture, motion, bones


def test_an_elbow_is_as_far_bent_as_it_is():
    def arm(bend: float) -> JointTable:
        wrist = [0.3 + 0.25 * np.cos(bend), 0.25 * np.sin(bend), 0]
        return JointTable(np.zeros(1), ("left_shoulder", "left_elbow", "left_wrist"), np.array([[[0, 0, 0], [0.3, 0, 0], wrist]]))

    found = hinge_errors(arm(np.radians(100)), arm(np.radians(70)))
    assert found == {"left_elbow": pytest.approx({"bias": 30, "mean": 30, "rmse": 30, "aligned": 0})}
    assert hinge_errors(arm(np.pi), arm(0.0))["left_elbow"]["mean"] == pytest.approx(180)


def test_accelerations_are_compared_where_both_are_known():
    run = moved(TRUTH, 0.5 * 2.0 * (TRUTH.times**2)[:, None, None] * np.array([1.0, 0, 0]))
    found = acceleration_errors(run, TRUTH)
    assert found["difference_m_s2"] == pytest.approx(2)
    assert found["run_m_s2"] > found["truth_m_s2"]
    short = JointTable(TRUTH.times[:2], TRUTH.names, TRUTH.positions[:2])
    assert acceleration_errors(short, short) == {}


def test_bones_that_are_longer_or_change_are_reported():
    names = ("left_hip", "left_knee")
    places = np.zeros((4, 2, 3))
    places[:, 1, 2] = -0.4
    truth = JointTable(np.arange(4.0), names, places)
    run = places.copy()
    run[:, 1, 2] = [-0.41, -0.43, -0.41, -0.43]
    [(bone, found)] = bone_errors(JointTable(np.arange(4.0), names, run), truth).items()
    assert bone == "left_hip-left_knee"
    assert [found[key] for key in ("longer_mm", "run_sd_mm", "truth_sd_mm")] == pytest.approx([20, 10, 0])


@pytest.mark.parametrize(("status", "expected"), [
    ("tttt", {"frames": 0, "share": 0, "gaps": 0}),
    ("tlltlaat", {"frames": 5, "share": 0.625, "gaps": 2, "longest_frames": 3, "longest_s": 4.0, "longest_from_s": 4.0}),
    ("llt", {"frames": 2, "share": 2 / 3, "gaps": 1, "longest_frames": 2, "longest_s": 2.0, "longest_from_s": 0.0}),
    ("t", {"frames": 0, "share": 0, "gaps": 0}),
])
def test_gaps_are_counted(status, expected):
    words = {"t": "tracked", "l": "lost", "a": "absent"}
    T = len(status)
    nothing = np.full((T, 1), np.nan)
    motion = Motion(body_name="cardbox", dof_names=("a",), joint_names=("neck",), times=np.arange(T, dtype=float), poses=nothing,
                    pose_sd=nothing, joints=np.full((T, 1, 3), np.nan), joint_sd=np.full((T, 1, 3), np.nan), cost=nothing[:, 0],
                    overlap=nothing[:, 0], status=np.array([words[sign] for sign in status]))
    assert pose_losses(motion) == pytest.approx(expected)


# Angles


@given(st.floats(-30, 30), st.integers(-3, 3))
def test_angles_are_wrapped(angle, turns):
    assert -np.pi <= wrapped(np.array(angle)) < np.pi
    assert_allclose(np.exp(1j * wrapped(np.array(angle))), np.exp(1j * angle), atol=1e-9)
    assert_allclose(np.exp(1j * wrapped(np.array(angle + 2 * np.pi * turns))), np.exp(1j * angle), atol=1e-9)


def test_an_angle_that_went_round_once_more_has_no_error():
    skeleton = make_body("cylinders", average_sizes("cylinders", 1.75)).skeleton
    poses = np.zeros((5, len(skeleton.dofs)))
    round_once, name = poses.copy(), "left_shoulder_flexion"
    d = skeleton.dof_names.index(name)
    round_once[:, d] = 2 * np.pi + np.radians([10, -10, 10, -10, 10])
    found = dof_errors(skeleton, round_once, poses)
    assert found[name] == pytest.approx({"bias": 2, "mean": 10, "rmse": 10, "aligned": np.sqrt(96)})
    assert found["right_knee_flexion"]["mean"] == 0
    assert not [n for n in found if skeleton.dofs[skeleton.dof_names.index(n)].kind != "rotation"]
