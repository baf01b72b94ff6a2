"""MOT files and OpenSim's coordinates: a model with OpenSim's axes puts the joints where they were."""

from __future__ import annotations

import numpy as np
import pytest
import runs
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from shadowpuppet.errors import FormatError, ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.opensim.coordinates import MODELS, PELVIS_POSITION, Ball, coordinates
from shadowpuppet.io.motion.opensim.model_writer import MARKERS, marker_names
from shadowpuppet.io.motion.opensim.mot import Coordinates, read_mot, write_mot
from shadowpuppet.io.motion.trc import read_trc, write_trc
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.animation import Animation
from shadowpuppet.motion.body_animation import BodyTree, motion_animation

TEXT = """walk
version=1
nRows=2
nColumns=3
inDegrees=yes
endheader
time\tknee_angle_r\tpelvis_ty
0.00\t90\t0.95
0.04\t45.0\t9.6e-1
"""
MODEL = np.array([[1.0, 0, 0], [0, 0, 1.0], [0, -1.0, 0]])
"""From our world to the model's: X forward, Y up, Z to the right."""


def ball(q: Coordinates, *names: str, left: bool = False) -> np.ndarray:
    """Rotations of a joint of the model: about Z, X, Y, the last two the other way on the left (Rajagopal 2016)."""
    signs = (1, -1, -1) if left else (1, 1, 1)
    values = np.stack([sign * q.values.get(name, np.zeros(len(q.times))) for name, sign in zip(names, signs)], 1)
    return Rotation.from_euler("ZXY", values).as_matrix()


@pytest.mark.parametrize("name", runs.BODIES)
def test_the_models_joints_lie_where_the_runs_did(tmp_path, name):
    motion = read_run(runs.make_run(tmp_path / "run", name)).motion
    write_mot(tmp_path / "a.mot", motion.times, coordinates(motion_animation(runs.body_of(name), motion)[0], "own"))
    q = read_mot(tmp_path / "a.mot")
    at = dict(zip(motion.joint_names, np.moveaxis(motion.joints @ MODEL.T, 1, 0)))
    pelvis = ball(q, "pelvis_tilt", "pelvis_list", "pelvis_rotation")
    np.testing.assert_allclose(np.stack([q.values[f"pelvis_t{axis}"] for axis in "xyz"], 1), at["pelvis"], atol=1e-6)
    chest = pelvis @ ball(q, "lumbar_extension", "lumbar_bending", "lumbar_rotation")
    limbs = [("shoulder", "elbow", "wrist", "arm_flex", "arm_add", "arm_rot", "elbow_flex", chest, 1)]
    if "left_hip" in at:
        limbs.append(("hip", "knee", "ankle", "hip_flexion", "hip_adduction", "hip_rotation", "knee_angle", pelvis, -1))
    for side in ("left", "right"):
        for a, b, c, flex, add, rot, bend, above, sense in limbs:
            start, middle, end = (at[f"{side}_{joint}"] for joint in (a, b, c))
            upper = above @ ball(q, *(f"{angle}_{side[0]}" for angle in (flex, add, rot)), left=side == "left")
            lower = upper @ Rotation.from_euler("Z", sense * q.values[f"{bend}_{side[0]}"][:, None]).as_matrix()
            for R, near, far in ((upper, start, middle), (lower, middle, end)):
                length = np.linalg.norm(far - near, axis=1).mean()
                np.testing.assert_allclose(near - length * R[:, :, 1], far, atol=1e-5)


def test_signs_are_those_that_opensim_and_people_use():
    body = runs.body_of("anatomical")

    def value(coordinate: str, **dofs: float) -> float:
        animation = BodyTree(body).animation(np.zeros(1), body.skeleton.pose(**dofs)[None], np.eye(4))
        return float(np.degrees(coordinates(animation)[coordinate][0]))

    assert value("knee_angle_l", left_knee_flexion=1.0) == pytest.approx(np.degrees(1))
    assert value("elbow_flex_r", right_elbow_flexion=1.0) == pytest.approx(np.degrees(1))
    assert value("ankle_angle_r", right_ankle_flexion=0.3, right_ankle_inversion=0.2) == pytest.approx(-np.degrees(0.3))  # toes down
    assert value("hip_flexion_r", right_hip_y=-0.5) == pytest.approx(np.degrees(0.5))  # forward
    assert value("hip_adduction_r", right_hip_x=-0.5) == pytest.approx(-np.degrees(0.5))  # outward
    assert value("hip_adduction_l", left_hip_x=0.5) == pytest.approx(-np.degrees(0.5))
    assert value("arm_add_l", left_shoulder_x=1.2) == pytest.approx(-np.degrees(1.2))
    assert value("pelvis_tilt", root_bow=0.2) == pytest.approx(-np.degrees(0.2))
    assert value("pelvis_rotation", root_heading=0.7) == pytest.approx(np.degrees(0.7))
    assert value("lumbar_extension", chest_y=0.3) == pytest.approx(-np.degrees(0.3))


def turning(degrees: float, across: float = 20.0) -> tuple[np.ndarray, Animation]:
    """A walk that turns from `degrees` by `across`, and the way of its pelvis."""
    body = runs.body_of("anatomical")
    headings = np.radians(np.linspace(degrees, degrees + across, 9))
    poses = np.stack([body.skeleton.pose(root_heading=heading, root_z=0.9, root_x=x) for x, heading in enumerate(headings)])
    return poses[:, :3], BodyTree(body).animation(np.arange(9) / 10, poses, np.eye(4))


@pytest.mark.parametrize("model", [name for name, model in MODELS.items() if model.hip is not None])
def test_the_pelvis_origin_is_the_models(model):
    _, animation = turning(0)
    q, ours = coordinates(animation, model), coordinates(animation, "own")
    hip = np.array(MODELS[model].hip)
    offsets = animation.offsets[[animation.names.index(f"{side}_hip") for side in ("left", "right")]]
    scale = (offsets[0, 0] - offsets[1, 0]) / (2 * hip[2])
    pelvis = Rotation.from_euler("ZXY", np.stack([q[name] for name in ("pelvis_tilt", "pelvis_list", "pelvis_rotation")], 1))
    hips = np.stack([q[name] for name in PELVIS_POSITION], 1) + pelvis.apply(scale * np.array([hip[0], hip[1], 0.0]))
    own = np.stack([ours[name] for name in PELVIS_POSITION], 1)
    middle = offsets.mean(0) @ np.array([[0.0, 0, 1], [0, 1.0, 0], [-1.0, 0, 0]]).T
    np.testing.assert_allclose(hips, own + pelvis.apply(middle), atol=1e-9)
    assert 0.07 < np.linalg.norm(np.stack([q[name] for name in PELVIS_POSITION], 1) - own, axis=1).max() < 0.12


def test_a_bent_knee_is_negative_in_gait2392_which_has_no_arms():
    body = runs.body_of("anatomical")
    animation = BodyTree(body).animation(np.zeros(1), body.skeleton.pose(left_knee_flexion=1.0, left_elbow_flexion=1.0)[None], np.eye(4))
    q = coordinates(animation, "gait2392")
    assert q["knee_angle_l"][0] == pytest.approx(-1.0)
    assert "elbow_flex_l" not in q
    assert coordinates(animation, "pose2sim")["elbow_flex_l"][0] == pytest.approx(1.0)


def test_a_sole_that_turns_inward_is_positive():
    body = runs.body_of("anatomical")
    for side in ("left", "right"):
        pose = body.skeleton.pose(**{f"{side}_ankle_flexion": 0.3, f"{side}_ankle_inversion": 0.2})
        q = coordinates(BodyTree(body).animation(np.zeros(1), pose[None], np.eye(4)), "own")
        assert q[f"subtalar_angle_{side[0]}"][0] == pytest.approx(0.2)
        assert q[f"ankle_angle_{side[0]}"][0] == pytest.approx(-0.3)


def test_the_world_is_rotated_where_the_model_would_clamp():
    way, animation = turning(120)
    with pytest.warns(ShadowPuppetWarning, match="the world is rotated by -130 degrees about the vertical"):
        q = coordinates(animation, "rajagopal")
    np.testing.assert_allclose(np.degrees(q["pelvis_rotation"]), np.linspace(-10, 10, 9), atol=1e-9)
    plain = coordinates(animation, "own")
    np.testing.assert_allclose(np.degrees(plain["pelvis_rotation"]), np.linspace(120, 140, 9), atol=1e-9)
    moved, before = (np.stack([found[name] for name in PELVIS_POSITION], 1) for found in (q, plain))
    shift = Rotation.from_euler("y", -130, degrees=True).apply(before[-1] - before[0])  # the models' pelvis origins turn with the pelvis
    assert np.linalg.norm(moved[-1] - moved[0] - shift) < 0.05
    assert np.ptp(way[:, 0]) == 8


def test_a_whole_turn_is_said_to_be_clamped():
    _, animation = turning(-150, 300)
    with pytest.warns(ShadowPuppetWarning, match=r"pelvis_rotation runs from -150 to 150 degrees; 'gait2392' clamps"):
        q = coordinates(animation, "gait2392")
    np.testing.assert_allclose(np.degrees(q["pelvis_rotation"])[[0, -1]], [-150, 150], atol=1e-9)


def test_an_unknown_model_is_said(tmp_path):
    with pytest.raises(ShadowPuppetError, match=r"model: found 'gait', expected one of rajagopal, gait2392, pose2sim, own"):
        coordinates(turning(0)[1], "gait")


def test_names_in_the_tables_stand_once():
    for model in MODELS.values():
        names = [name for part in model.parts for name in (part.names if isinstance(part, Ball) else (part.name,))]
        assert len(set(names)) == len(names)
    assert len(set(MARKERS.values())) == len(MARKERS)


def test_markers_have_names_of_opensim_and_y_up_and_come_back(tmp_path, rng):
    motion = read_run(runs.make_run(tmp_path / "run", lost=(3,))).motion
    write_trc(tmp_path / "a.trc", marker_names(motion.table))
    there = read_trc(tmp_path / "a.trc")
    assert "LShoulder" in there.names
    assert "HeadBase" in there.names
    up = there.positions[:, there.names.index("Neck"), 1]
    np.testing.assert_allclose(up, motion.joints[:, motion.joint_names.index("neck"), 2], atol=1e-6)
    with pytest.warns(ShadowPuppetWarning, match=r"\+Y points up"):
        back = read_motion(tmp_path / "a.trc")
    np.testing.assert_allclose(back.select(motion.joint_names).positions, motion.joints, atol=1e-6)


def test_opensim_reads_both_files(tmp_path):
    opensim = pytest.importorskip("opensim")
    motion = read_run(runs.make_run(tmp_path / "run", lost=(3,))).motion
    values = coordinates(motion_animation(runs.body_of("anatomical"), motion)[0], "own")
    write_mot(tmp_path / "a.mot", motion.times, values)
    write_trc(tmp_path / "a.trc", marker_names(motion.table))
    table, markers = opensim.TimeSeriesTable(str(tmp_path / "a.mot")), opensim.TimeSeriesTableVec3(str(tmp_path / "a.trc"))
    assert (table.getNumRows(), markers.getNumRows()) == (39, 40)
    knee = table.getDependentColumn("knee_angle_r").to_numpy()
    np.testing.assert_allclose(knee, np.degrees(np.delete(values["knee_angle_r"], 3)), atol=1e-5)
    row = markers.getRowAtIndex(9)
    place = [row[markers.getColumnIndex("LKnee")][axis] for axis in range(3)]
    assert np.isnan(markers.getRowAtIndex(3)[markers.getColumnIndex("RAnkle")][2])
    np.testing.assert_allclose(place, 1000 * motion.joints[9, motion.joint_names.index("left_knee")] @ MODEL.T, atol=1e-3)


def test_frames_that_are_not_known_have_no_row(tmp_path):
    motion = read_run(runs.make_run(tmp_path / "run", lost=(0, 5, 6))).motion
    write_mot(tmp_path / "a.mot", motion.times, coordinates(motion_animation(runs.body_of("anatomical"), motion)[0], "own"))
    found = read_mot(tmp_path / "a.mot")
    np.testing.assert_allclose(found.times, np.delete(motion.times, [0, 5, 6]))


def read(tmp_path, text: str) -> Coordinates:
    (tmp_path / "a.mot").write_text(text, "utf-8")
    return read_mot(tmp_path / "a.mot")


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(seed=st.integers(0, 999), frames=st.integers(1, 5))
def test_what_is_written_is_read(tmp_path, seed, frames):
    rng = np.random.default_rng(seed)
    values = {"pelvis_tx": rng.uniform(-5, 5, frames), "hip_flexion_r": rng.uniform(-7, 7, frames)}
    write_mot(tmp_path / "b.mot", np.arange(frames) / 50, values)
    found = read_mot(tmp_path / "b.mot")
    np.testing.assert_allclose(found.times, np.arange(frames) / 50)
    for name, column in values.items():
        np.testing.assert_allclose(found.values[name], column, atol=1e-6)


def test_a_small_file_by_hand(tmp_path):
    found = read(tmp_path, TEXT)
    np.testing.assert_allclose(found.values["knee_angle_r"], [np.pi / 2, np.pi / 4])
    np.testing.assert_allclose(found.values["pelvis_ty"], [0.95, 0.96])
    np.testing.assert_allclose(read(tmp_path, TEXT.replace("=yes", "=no")).values["knee_angle_r"], [90, 45])


@pytest.mark.parametrize(("old", "new", "said"), [
    ("endheader\n", "", "found no line endheader"),
    (TEXT, "time,x\n", "found no line endheader"),
    ("time\t", "seconds\t", "line 7: found 'seconds, knee_angle_r, pelvis_ty'"),
    ("pelvis_ty", "knee_angle_r", "line 7: found"),
    ("\t0.95", "", "line 8: found 2 numbers, expected 3"),
    ("45.0", "many", "line 9, column 'knee_angle_r': found 'many'"),
    ("0.04", "0.00", "line 9, column 'time': found 0, expected more than the 0"),
])
def test_what_is_malformed_is_said(tmp_path, old, new, said):
    assert old in TEXT
    with pytest.raises(FormatError, match=rf"a\.mot: {said}"):
        read(tmp_path, TEXT.replace(old, new))


def test_another_number_of_rows_is_warned_of(tmp_path):
    with pytest.warns(ShadowPuppetWarning, match="nRows: found 7, but the file has 2 rows"):
        assert len(read(tmp_path, TEXT.replace("nRows=2", "nRows=7")).times) == 2


def test_nothing_known_is_said(tmp_path, rng):
    with pytest.raises(ShadowPuppetError, match=r"a\.mot: found no frame in which all of 1 coordinates are known"):
        write_mot(tmp_path / "a.mot", np.zeros(1), {"pelvis_tx": np.array([np.nan])})
