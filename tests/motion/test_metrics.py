"""Metrics: equal to a plain re-implementation and to the project's score.py, and laws that errors must obey."""

from __future__ import annotations

import importlib.util
import json
import math
import subprocess
import sys
from types import ModuleType

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose, assert_array_equal

from shadowpuppet.camera.camera import Camera
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.geometry import rigid, rotation_from_vector, transform
from shadowpuppet.io.motion.table import read_joints, write_joints
from shadowpuppet.motion import metrics
from shadowpuppet.motion.metrics import LIMB_JOINTS, UPPER_JOINTS, evaluate, joint_errors, match
from shadowpuppet.motion.motion import JointTable, MotionBuilder, MotionFrame

NAMES = ("left_elbow", "left_hand", "right_wrist")


def table(seed: int, count: int, rate: float, gaps: float, names=NAMES, offset: float = 0.0) -> JointTable:
    rng = np.random.default_rng(seed)
    times = offset + np.cumsum(rng.uniform(0.7, 1.3, count)) / rate
    positions = np.round(rng.normal(size=(count, len(names), 3)) * 0.2, 5)
    positions[rng.random((count, len(names))) < gaps] = np.nan
    return JointTable(np.round(times, 5), tuple(names), positions)


@st.composite
def pairs(draw) -> tuple[JointTable, JointTable]:
    """A run and a truth of other rates, lengths, starts, with gaps in both."""
    seed, gaps = draw(st.integers(0, 10**6)), st.sampled_from([0.0, 0.0, 0.3])
    run = table(seed, draw(st.integers(1, 12)), draw(st.sampled_from([5, 15, 60])), draw(gaps))
    truth = table(seed + 1, draw(st.integers(1, 12)), draw(st.sampled_from([7, 15, 30])), draw(gaps), NAMES[::-1],
                  draw(st.sampled_from([0.0, 0.1, -2.0])))
    assume(np.isfinite(truth.positions).all(2).any())
    return run, truth


def naive(run: JointTable, truth: JointTable) -> dict[str, float]:
    """The same figures, joint by joint, in plain Python."""
    step = float(np.median(np.diff(truth.times))) if len(truth.times) > 1 else math.inf
    distances, planes, depths, aligned, lost_frames = [], [], [], [], 0
    for t, places in zip(truth.times, truth.positions):
        i = min(range(len(run.times)), key=lambda i: (abs(run.times[i] - t), i))
        near = abs(run.times[i] - t) <= step / 2 + 1e-9
        rows = []
        for name in NAMES:
            r, e = places[truth.names.index(name)], run.positions[i, run.names.index(name)]
            rows.append((e if near else e * math.nan) - r if not np.isnan(r).any() else None)
        seen = [d for d in rows if d is not None and not np.isnan(d).any()]
        mean = sum(seen) / len(seen) if seen else np.zeros(3)
        lost_frames += any(d is not None and np.isnan(d).any() for d in rows)
        for d in rows:
            if d is None:
                continue
            gone = np.isnan(d).any()
            distances.append(500 if gone else 1000 * math.dist(d, (0, 0, 0)))
            planes.append(500 if gone else 1000 * math.hypot(d[0], d[2]))
            depths.append(500 if gone else 1000 * abs(d[1]))
            aligned.append(500 if gone else 1000 * math.dist(d, mean))
    v = np.array(distances)
    return {"frames": len(truth.times), "lost": lost_frames, "mean_mm": v.mean(), "rmse_mm": np.sqrt((v**2).mean()),
            "p50_mm": np.median(v), "p90_mm": np.percentile(v, 90), "p95_mm": np.percentile(v, 95), "max_mm": v.max(),
            "plane_mm": np.mean(planes), "depth_mm": np.mean(depths), "far": (v > 300).mean(),
            "aligned_mean_mm": np.mean(aligned)}


@given(pairs())
def test_figures_are_those_of_the_plain_loop(pair):
    found = joint_errors(*pair, NAMES).summary()
    found.pop("joints")
    expected = naive(*pair)
    assert found.keys() == expected.keys()
    assert_allclose(list(found.values()), [expected[key] for key in found], rtol=1e-9)


@pytest.fixture(scope="module")
def score(shared) -> ModuleType:
    spec = importlib.util.spec_from_file_location("score", shared / "tools" / "score.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def assert_scores_agree(score: ModuleType, folder, run: JointTable, truth: JointTable, names, start: int = 0) -> None:
    for name, joints in (("run", run), ("truth", truth)):
        write_joints(folder / f"{name}.csv", joints)
    expected = score.score(folder / "run.csv", folder / "truth.csv", list(names), start)
    found = joint_errors(read_joints(folder / "run.csv"), read_joints(folder / "truth.csv"), names, start=start).summary()
    joints, others = expected.pop("joints"), found.pop("joints")
    assert_allclose([found[key] for key in expected], list(expected.values()), rtol=1e-9)
    assert joints.keys() == others.keys()
    for name, values in joints.items():
        assert_allclose([others[name][key] for key in values], list(values.values()), rtol=1e-9)


@pytest.mark.shared
@settings(max_examples=40, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(pairs())
def test_figures_are_those_of_score(score, tmp_path, pair):
    assert_scores_agree(score, tmp_path, *pair, NAMES)


@pytest.mark.shared
@pytest.mark.parametrize(("recording", "group"), [("upper_body", UPPER_JOINTS), ("reaching", UPPER_JOINTS), ("walking", LIMB_JOINTS)])
def test_figures_of_whole_recordings_are_those_of_score(score, shared, tmp_path, rng, recording, group):
    truth = read_joints(shared / "recordings" / recording / "truth.csv")
    assert (set(score.UPPER), set(score.LIMBS)) == (set(UPPER_JOINTS), set(LIMB_JOINTS))
    noisy = truth.positions + rng.normal(size=truth.positions.shape) * 0.1
    noisy[50:60] = np.nan
    run = JointTable(truth.times + 0.01, truth.names, noisy)
    assert_scores_agree(score, tmp_path, run, truth, group, start=7)


def test_the_truth_itself_has_no_error():
    truth = table(0, 20, 15, 0.2)
    errors = joint_errors(truth, truth, NAMES)
    assert all(np.nanmax(getattr(errors, kind)) == 0 for kind in ("distance", "plane", "depth", "aligned"))


@given(pairs(), st.tuples(*[st.floats(-3, 3)] * 3))
def test_plane_and_depth_make_up_the_distance_and_turn_with_the_world(pair, vector):
    """A camera that turns with the world sees the same."""
    run, truth = pair
    level = Camera("cam", (4, 4), [[1, 0, 0], [0, 1, 0], [0, 0, 1]], T_camera_world=rigid(metrics.LEVEL_CAMERA, [1, 2, 3]))
    T = rigid(rotation_from_vector(vector), np.zeros(3))
    turned = Camera("cam", (4, 4), level.matrix, T_camera_world=level.T_camera_world @ np.linalg.inv(T))
    moved = [JointTable(t.times, t.names, transform(T, t.positions)) for t in pair]
    a, b = joint_errors(run, truth, NAMES, camera=level), joint_errors(*moved, NAMES, camera=turned)
    for kind in ("distance", "plane", "depth", "aligned"):
        assert_allclose(getattr(a, kind), getattr(b, kind), atol=1e-12)
        assert_array_equal(getattr(a, kind), getattr(joint_errors(run, truth, NAMES), kind))
    seen = a.known & ~a.lost
    assert_allclose(np.hypot(a.plane, a.depth)[seen], a.distance[seen])


def test_a_shift_of_all_joints_is_no_aligned_error():
    truth = table(0, 20, 15, 0.0)
    run = JointTable(truth.times, truth.names, truth.positions + np.array([0.3, 0.0, -0.4]))
    errors = joint_errors(run, truth, NAMES)
    assert_allclose(errors.distance, 0.5)
    assert_allclose(errors.aligned, 0, atol=1e-12)


def test_leaving_out_frames_does_not_help():
    truth = table(0, 20, 15, 0.0)
    run = JointTable(truth.times, truth.names, truth.positions + 0.2)
    some = JointTable(run.times[:12], run.names, run.positions[:12])
    whole, part = (joint_errors(r, truth, NAMES).summary() for r in (run, some))
    assert (whole["lost"], part["lost"], part["max_mm"]) == (0, 8, 500)
    assert part["mean_mm"] > whole["mean_mm"]


instants = st.lists(st.integers(0, 60), min_size=1, max_size=12, unique=True)


@given(instants, instants)
def test_frames_are_matched_as_by_trying_all(a, b):
    times, truth = np.sort(a) / 8, np.sort(b) / 8
    index, matched = match(times, truth)
    assert_array_equal(index, np.abs(times[None] - truth[:, None]).argmin(1))
    half = np.median(np.diff(truth)) / 2 if len(truth) > 1 else np.inf
    assert_array_equal(matched, np.abs(times[None] - truth[:, None]).min(1) <= half + 1e-9)


def test_default_joints_are_those_of_the_body_that_was_seen():
    upper = table(0, 2, 15, 0, ("pelvis", "neck", *UPPER_JOINTS, "left_wrist", "right_wrist"))
    whole = table(0, 2, 15, 0, (*LIMB_JOINTS, "left_hand", "right_hand"))
    assert joint_errors(upper, whole).names == UPPER_JOINTS
    assert joint_errors(whole, whole).names == LIMB_JOINTS
    assert joint_errors(whole, upper).names == tuple(name for name in LIMB_JOINTS if name in upper.names)


@pytest.mark.parametrize(("run", "truth", "names", "said"), [
    (table(0, 3, 15, 0), table(0, 3, 15, 0), ["left_elbow", "toe"], "found 'toe', which the run lacks; the run has left_e"),
    (table(0, 3, 15, 0), table(0, 3, 15, 0, ["neck"]), ["left_hand"], "'left_hand', which the truth lacks; .* the truth has n"),
    (table(0, 3, 15, 0), table(0, 3, 15, 0, ["neck"]), None, "found 'none to compare'"),
    (table(0, 0, 15, 0), table(0, 3, 15, 0), NAMES, "the run has no frames"),
    (table(0, 3, 15, 0), table(0, 0, 15, 0), NAMES, "the truth has no position"),
    (table(0, 3, 15, 0), table(0, 3, 15, 1.1), NAMES, "the truth has no position"),
])
def test_what_cannot_be_compared_is_said(run, truth, names, said):
    with pytest.raises(ShadowPuppetError, match=said):
        joint_errors(run, truth, names)


@given(st.integers(0, 1000), st.tuples(*[st.floats(-20, 20)] * 3))
def test_a_constant_acceleration_is_found_whatever_the_steps(seed, acceleration):
    t = np.cumsum(np.random.default_rng(seed).uniform(0.02, 0.1, 12))
    path = 1.5 - 3 * t[:, None] + 0.5 * np.array(acceleration) * t[:, None] ** 2
    joints = JointTable(t, ("neck",), path[:, None])
    assert_allclose(metrics.accelerations(joints)[:, 0], np.broadcast_to(acceleration, (10, 3)), atol=1e-8)
    assert_allclose(metrics.jitter(joints), math.dist(acceleration, (0, 0, 0)), atol=1e-8)


def test_jitter_of_noise_is_what_theory_says(rng):
    """Second differences of white noise of variance s^2 have the variance 6 s^2 / dt^4."""
    joints = JointTable(np.arange(20000) / 10, ("neck",), rng.normal(size=(20000, 1, 3)) * 0.01)
    assert_allclose(metrics.jitter(joints), 0.01 * 100 * math.sqrt(18), rtol=0.02)
    assert math.isnan(metrics.jitter(table(0, 2, 15, 0)))


def test_bones_of_a_rigid_body_keep_their_length(rng):
    names = ("neck", "left_shoulder", "left_elbow", "left_wrist")
    body = rng.normal(size=(4, 3))
    places = np.array([transform(rigid(rotation_from_vector(rng.normal(size=3)), rng.normal(size=3)), body) for _ in range(9)])
    lengths = metrics.bone_lengths(JointTable(np.arange(9.0), names, places))
    assert list(lengths) == ["left_shoulder-left_elbow", "left_elbow-left_wrist"]
    for i, bone in enumerate(lengths.values(), 1):
        assert_allclose([bone["mean"], bone["sd"]], [math.dist(body[i], body[i + 1]), 0], atol=1e-12)


masks = st.integers(0, 2**12 - 1).map(lambda n: np.array([n >> i & 1 for i in range(12)], bool).reshape(3, 4))


@given(masks, masks, masks)
def test_overlap_is_the_share_of_pixels_that_agree(a, b, ignore):
    both, either = (a & b & ~ignore).sum(), ((a | b) & ~ignore).sum()
    expected = both / either if either else np.nan
    assert_array_equal(metrics.overlap(a, b, ignore), expected)
    assert_array_equal(metrics.overlap(b, a, ignore), expected)
    assert_array_equal(metrics.overlap(a & ~ignore, b & ~ignore), expected)


def test_statistics_leave_out_what_is_no_number():
    found = metrics.statistics([3.0, np.nan, 1.0, 2.0])
    assert (found["count"], found["mean"], found["min"], found["p50"], found["max"]) == (3, 2, 1, 2, 3)
    assert metrics.statistics([np.nan]) == {"count": 0}


def test_an_evaluation_is_all_plain_numbers():
    truth = table(0, 8, 15, 0, UPPER_JOINTS)
    builder = MotionBuilder("cardbox", ["torso_y"], UPPER_JOINTS)
    for time, places in zip(truth.times, truth.positions):
        builder.append(MotionFrame(time, "tracked", joints=places + 0.1, cost=100.0, overlap=0.9))
    said = json.loads(json.dumps(evaluate(builder.build(), truth)))
    assert_allclose([said["errors"]["mean_mm"], said["errors"]["plane_mm"], said["errors"]["depth_mm"]], 100 * np.sqrt([3, 2, 1]))
    assert_allclose(said["jitter_m_s2"], said["truth_jitter_m_s2"])
    assert (said["frames"], said["status"], said["overlap"]["mean"], said["cost_px"]["p95"]) == (8, {"tracked": 8}, 0.9, 100)
    assert said["limb_status"] == {"left_arm": {"tracked": 8}, "right_arm": {"tracked": 8}}
    assert "errors" not in evaluate(builder.build())


def test_measuring_and_reading_need_no_compiler_codec_or_pictures():
    code = ("import sys, shadowpuppet.motion.metrics, shadowpuppet.io.motion.table, shadowpuppet.io.run, shadowpuppet.io.person\n"
            "import shadowpuppet.camera.drawing\n"
            "print([name for name in ('numba', 'av', 'cv2', 'matplotlib') if name in sys.modules])")
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "[]\n"
