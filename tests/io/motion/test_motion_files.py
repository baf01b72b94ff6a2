"""Motion from any file: the same person comes out of each, by our names, in metres, Z up."""

from __future__ import annotations

import re

import acclaim
import biovision
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from vicon import c3d

from shadowpuppet.errors import FormatError, ShadowPuppetWarning
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.joint_names import JOINTS, columns_of, read_names, renamed, with_names
from shadowpuppet.io.motion.motion_files import TO_Z_UP, leg_length, read_motion, up_axis
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.motion.metrics import LIMB_JOINTS
from shadowpuppet.motion.motion import JointTable

VICON = {"pelvis": "PELO", "neck": "TRXO", "head": "HEDO",
         **{f"{side}_{joint}": side[0].upper() + marker for side in ("left", "right") for joint, marker in
            (("shoulder", "CLO"), ("elbow", "HUO"), ("wrist", "RAO"), ("hip", "FEP"), ("knee", "FEO"), ("ankle", "TIO"))}}


@pytest.fixture
def standing(tmp_path) -> JointTable:
    """A person by our names, metres, Z up."""
    (tmp_path / "made.bvh").write_text(biovision.person(6), "utf-8")
    with pytest.warns(ShadowPuppetWarning):
        return read_motion(tmp_path / "made.bvh")


def same(a: JointTable, b: JointTable, names=None, atol: float = 1e-6) -> None:
    names = names or a.names
    np.testing.assert_allclose(a.select(names).positions, b.select(names).positions, atol=atol)


def test_a_skeleton_of_another_program_becomes_ours(tmp_path, standing):
    raw = read_bvh(tmp_path / "made.bvh").joints()
    assert standing.names == JOINTS[:17]  # without heels and toes
    there = raw.select(["Hips", "LeftArm", "LeftHand", "LeftHandMiddle1", "RightLeg"]).positions
    ours = standing.select(["pelvis", "left_shoulder", "left_wrist", "left_hand", "right_knee"]).positions
    np.testing.assert_allclose(ours[..., 0], 0.01 * there[..., 0])
    np.testing.assert_allclose(ours[..., 2], 0.01 * there[..., 1])  # y was up
    np.testing.assert_allclose(ours[..., 1], -0.01 * there[..., 2])
    assert leg_length(standing) == pytest.approx(0.83)


@pytest.mark.parametrize(("scale", "unit"), [(1.0, "centimetres"), (10.0, "millimetres"), (1 / 2.54, "inches"),
                                             (0.45 / 2.54, "units of the CMU database")])
def test_the_unit_of_a_skeleton_is_found_and_said(tmp_path, standing, scale, unit):
    (tmp_path / "other.bvh").write_text(biovision.person(6, prefix="mixamorig:", scale=scale), "utf-8")
    with pytest.warns(ShadowPuppetWarning) as told:
        same(read_motion(tmp_path / "other.bvh"), standing)
    said = sorted(str(w.message) for w in told)
    assert "other.bvh: +Y points up there; turned so that Z does" in said[0]
    assert f"do not tell their unit; legs {83 * scale:.4g} long make it {unit}" in said[1]


def test_metres_are_not_spoken_of(tmp_path, standing):
    (tmp_path / "other.bvh").write_text(biovision.person(6, scale=0.01), "utf-8")
    with pytest.warns(ShadowPuppetWarning, match="points up") as told:
        same(read_motion(tmp_path / "other.bvh"), standing)
    assert len(told) == 1


@pytest.mark.filterwarnings("ignore::shadowpuppet.errors.ShadowPuppetWarning")
def test_no_person_has_such_legs(tmp_path):
    (tmp_path / "giant.bvh").write_text(biovision.person(3, scale=0.03), "utf-8")
    with pytest.raises(FormatError, match=r"giant\.bvh: found legs 2\.49 long in an unknown unit, expected a person's"):
        read_motion(tmp_path / "giant.bvh")
    text = biovision.person(3)
    for joint in ("UpLeg", "Foot", "ForeArm"):
        text = text.replace(joint, "Thing")
    (tmp_path / "giant.bvh").write_text(text, "utf-8")
    with pytest.raises(FormatError, match=r"found neither legs nor arms of known names among 'Hips, Spine, .*--source-unit.*--names"):
        read_motion(tmp_path / "giant.bvh")


def test_names_that_no_program_has_are_given_by_a_file(tmp_path, standing):
    write_joints(tmp_path / "a.csv", JointTable(standing.times, tuple(f"bone {n}" for n in range(len(standing.names))), standing.positions))
    (tmp_path / "names.toml").write_text("".join(f'{name} = "bone {n}"\n' for n, name in enumerate(standing.names)))
    given = read_names(tmp_path / "names.toml")
    same(read_motion(tmp_path / "a.csv", names=given), standing)
    with pytest.raises(FormatError, match=r"a\.csv: names: found 'tail', which is no joint of the file; there are: bone 0, bone 1, "):
        read_motion(tmp_path / "a.csv", names={"head": "tail"})
    swapped = read_motion(tmp_path / "a.csv", names=given | {"left_knee": given["right_knee"], "right_knee": given["left_knee"]})
    np.testing.assert_array_equal(swapped.select(["left_knee"]).positions, read_motion(tmp_path / "a.csv", names=given)
                                  .select(["right_knee"]).positions)
    for text, said in (("tail = 'a'", "found the joint 'tail', expected some of pelvis, neck,"), ("head = 3", "head: found 3, expected"),
                       ("head = 'a'\nneck = 'a'", "'a', which another joint has, too"), ("", "found no names, expected lines such as")):
        (tmp_path / "names.toml").write_text(text)
        with pytest.raises(FormatError, match=said):
            read_names(tmp_path / "names.toml")


def test_a_name_of_ours_for_another_joint_gives_way():
    assert with_names(("head", "skull", "neck"), {"head": "skull", "neck": "neck"}) == ("head#2", "head", "neck")


@pytest.mark.parametrize("ending", ["csv", "trc"])
def test_tables_are_read(tmp_path, standing, ending):
    write_joints(tmp_path / f"motion.{ending}", standing)
    same(read_motion(tmp_path / f"motion.{ending}"), standing, atol=2e-6)


def test_markers_of_a_gait_model_are_ours(tmp_path, standing):
    chosen = standing.select(list(VICON))
    names = [f"Anna:{VICON[name]}" for name in chosen.names] + ["LASI"]
    places = np.concatenate([chosen.positions, np.ones((6, 1, 3))], 1)
    places[2, 4] = np.nan
    (tmp_path / "walk.c3d").write_bytes(c3d(names, 1000 * places, rate=60.0))
    found = read_motion(tmp_path / "walk.c3d")
    assert sorted(found.names) == sorted(VICON)
    places[:, :15] = chosen.positions
    places[2, 4] = np.nan
    same(found, JointTable(found.times, chosen.names, places[:, :15]), atol=1e-6)
    np.testing.assert_allclose(np.diff(found.times), 1 / 60)


def test_acclaim_finds_its_skeleton_and_takes_a_rate(tmp_path):
    path, _ = acclaim.write(tmp_path, 7, size=5.0)
    assert read_motion(path).names == JOINTS[:17]
    assert np.diff(read_motion(path).times)[0] == pytest.approx(1 / 120)
    assert np.diff(read_motion(path, rate=60).times)[0] == pytest.approx(1 / 60)
    (tmp_path / "01.asf").unlink()
    with pytest.raises(FormatError, match=r"01_01\.amc: found 0 \.asf files beside it"):
        read_motion(path)


@pytest.mark.parametrize("axis", TO_Z_UP)
def test_whichever_axis_is_up_z_is_afterwards(tmp_path, standing, axis):
    R = np.array(TO_Z_UP[axis], float)
    np.testing.assert_allclose(R @ R.T, np.eye(3))
    assert np.linalg.det(R) == pytest.approx(1)  # a mirror would make left right
    write_joints(tmp_path / "turned.trc", JointTable(standing.times, standing.names, standing.positions @ R))
    with pytest.warns(ShadowPuppetWarning, match=rf"turned\.trc: \{axis.upper()} points up there"):
        same(read_motion(tmp_path / "turned.trc"), standing, atol=2e-6)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(tilt=st.floats(-25, 25), heading=st.floats(-180, 180))
def test_who_bends_or_turns_is_upright_still(standing, tilt, heading):
    from shadowpuppet.geometry import rotation_about

    R = rotation_about([0, 0, 1], np.radians(heading)) @ rotation_about([0, 1, 0], np.radians(tilt))
    assert up_axis(JointTable(standing.times, standing.names, standing.positions @ R.T)) == "+z"


def test_who_lies_aslant_or_is_not_known_is_left_alone(tmp_path, standing):
    from shadowpuppet.geometry import rotation_from_vector

    slant = rotation_from_vector(np.radians(54.7356) * np.array([-1, 1, 0]) / np.sqrt(2))  # z to the middle between all three axes
    write_joints(tmp_path / "slant.trc", JointTable(standing.times, standing.names, standing.positions @ slant.T))
    same(read_motion(tmp_path / "slant.trc"), JointTable(standing.times, standing.names, standing.positions @ slant.T), atol=2e-6)
    assert up_axis(JointTable(standing.times, ("left_elbow",), np.ones((6, 1, 3)))) == "+z"
    assert up_axis(JointTable(standing.times, standing.names, np.full_like(standing.positions, np.nan))) == "+z"


CONVENTIONS = {
    "Mixamo": "mixamorig:Hips mixamorig:Neck mixamorig:Head mixamorig:HeadTop_End mixamorig:LeftShoulder mixamorig:LeftArm "
              "mixamorig:LeftForeArm mixamorig:LeftHand mixamorig:LeftHandMiddle1 mixamorig:LeftUpLeg mixamorig:LeftLeg mixamorig:LeftFoot",
    "CMU in BVH": "Hips Neck Head Neck1 LHipJoint LeftShoulder LeftArm LeftForeArm LeftHand LeftFingerBase "
                  "LeftUpLeg LeftLeg LeftFoot LeftToeBase",
    "Xsens": "Pelvis Neck Head T8 LeftShoulder LeftUpperArm LeftForeArm LeftHand - LeftUpperLeg LeftLowerLeg LeftFoot LeftToe",
    "Poser": "hip neck head lCollar lShldr lForeArm lHand - lThigh lShin lFoot",
    "DAZ": "hip neckLower head lCollar lShldrBend lForearmBend lHand lMid1 lThighBend lShin lFoot",
    "iClone": "CC_Base_Pelvis CC_Base_NeckTwist01 CC_Base_Head CC_Base_L_Clavicle CC_Base_L_Upperarm CC_Base_L_Forearm CC_Base_L_Hand "
              "CC_Base_L_Mid1 CC_Base_L_Thigh CC_Base_L_Calf CC_Base_L_Foot",
    "Motion Builder": "Hips Neck Head LeftCollar LeftShoulder LeftElbow LeftWrist - LeftHip LeftKnee LeftAnkle",
    "Biped": "Bip01_Pelvis Bip01_Neck Bip01_Head Bip01_L_Clavicle Bip01_L_UpperArm Bip01_L_Forearm Bip01_L_Hand - "
             "Bip01_L_Thigh Bip01_L_Calf Bip01_L_Foot",
    "Blender": "hips neck head shoulder.L upper_arm.L forearm.L hand.L - thigh.L shin.L foot.L toe.L",
    "Unreal": "pelvis neck head clavicle_l upperarm_l lowerarm_l hand_l - thigh_l calf_l foot_l ball_l",
    "SMPL": "pelvis neck head left_collar left_shoulder left_elbow left_wrist left_hand left_hip left_knee left_ankle left_foot",
    "Kinect": "SpineBase Neck Head SpineMid ShoulderLeft ElbowLeft WristLeft HandLeft HipLeft KneeLeft AnkleLeft FootLeft",
    "Vicon": "S1:PELO S1:TRXO S1:HEDO S1:LSHO S1:LCLO S1:LHUO S1:LRAO S1:LHNO S1:LFEP S1:LFEO S1:LTIO S1:LANK_",
    "HumanEva": "torsoDistal torsoProximal headProximal headDistal upperLArmProximal lowerLArmProximal lowerLArmDistal - upperLLegProximal "
                "lowerLLegProximal lowerLLegDistal",
    "joint centres": "Pelvis Neck Head LASI LSJC LEJC LWJC - LHJC LKJC LAJC",
    "OpenCap": "midHip Neck head LBigToe LShoulder LElbow LWrist - LHJC_study LKnee LAnkle LHeel",
    "COCO": "midhip neck head left_eye left_shoulder left_elbow left_wrist - left_hip left_knee left_ankle",
    "ours": "pelvis neck head x left_shoulder left_elbow left_wrist left_hand left_hip left_knee left_ankle",
}
MEANT = ["pelvis", "neck", "head", "left_shoulder", "left_elbow", "left_wrist", "left_hand", "left_hip", "left_knee", "left_ankle"]


@pytest.mark.parametrize("program", CONVENTIONS)
@pytest.mark.parametrize("side", ["left", "right"])
def test_names_of_other_programs_are_known(program, side):
    text = CONVENTIONS[program]
    if side == "right":
        for old, new in (("Left", "Right"), ("left_", "right_"), ("_L_", "_R_"), (r"\.L", ".R"), (r"_l\b", "_r"), (":L", ":R"),
                         (r"\bl(?=[A-Z])", "r"), (r"(?<=er)L(?=[AL])", "R"), (r"\bL(?=[A-Z])", "R")):
            text = re.sub(old, new, text)
    names = text.split()
    found = columns_of([name.replace("_", " ") if program == "Biped" else name for name in names])
    meant = [joint.replace("left", side) for joint in MEANT]
    skipped = {f"{side}_hand"} if "-" in names else set()
    soles = {f"{side}_heel", f"{side}_toe"}
    assert sorted(set(found) - soles) == sorted(set(meant) - skipped)
    assert (soles <= set(found)) == (program == "OpenCap")
    order = [found[joint] for joint in meant if joint in found]
    assert order == sorted(order)  # the lists above are in our order, with others in between
    assert names[found[f"{side}_shoulder"]].lower().replace("_", "").replace(".", "")[-5:] not in ("ollar", "vicle")
    if program in ("Mixamo", "CMU in BVH", "Xsens"):
        assert "Shoulder" not in names[found[f"{side}_shoulder"]]


DETECTORS = {
    "BODY_25": "Nose Neck RShoulder RElbow RWrist LShoulder LElbow LWrist MidHip RHip RKnee RAnkle LHip LKnee LAnkle REye LEye REar LEar "
               "LBigToe LSmallToe LHeel RBigToe RSmallToe RHeel",
    "HALPE_26": "Hip RHip RKnee RAnkle RBigToe RSmallToe RHeel LHip LKnee LAnkle LBigToe LSmallToe LHeel Neck Head Nose RShoulder RElbow "
                "RWrist LShoulder LElbow LWrist",
    "COCO": "nose left_eye right_eye left_ear right_ear left_shoulder right_shoulder left_elbow right_elbow left_wrist right_wrist left_hip"
            " right_hip left_knee right_knee left_ankle right_ankle",
}


@pytest.mark.parametrize("detector", DETECTORS)
def test_all_limbs_of_detectors_are_known(detector):
    names = DETECTORS[detector].split()
    table = renamed(JointTable(np.zeros(1), tuple(names), np.arange(3.0 * len(names)).reshape(1, -1, 3)))
    assert {*LIMB_JOINTS, "pelvis"} <= {*table.names}
    assert ("neck" in table.names, "head" in table.names) == (detector != "COCO", False)
    for name in LIMB_JOINTS:
        side, joint = name.split("_")
        there = f"{side[0].upper()}{joint.capitalize()}" if detector != "COCO" else name
        np.testing.assert_array_equal(table.select([name]).positions[0, 0], np.arange(3) + 3 * names.index(there))


@pytest.mark.parametrize(("outside", "inside", "joint"), [
    ("R.Knee.Lat", "R.Knee.Med", "right_knee"), ("L.Ankle.Lat", "L.Ankle.Med", "left_ankle"), ("RLFC", "RMFC", "right_knee"),
    ("LLMAL", "LMMAL", "left_ankle"), ("RLEL", "RMEL", "right_elbow"), ("RFAradius", "RFAulna", "right_wrist"),
    ("r_knee_study", "r_mknee_study", "right_knee"), ("L_lelbow_study", "L_melbow_study", "left_elbow"),
    ("r_ankle", "r_mankle", "right_ankle"),
])  # fmt: skip
def test_between_two_markers_lies_the_joint(outside, inside, joint):
    places = np.array([[[1.0, 2, 3], [3, 2, 1], [9, 9, 9]]])
    table = renamed(JointTable(np.zeros(1), (outside, inside, "C7"), places))
    assert table.names == (joint,)
    np.testing.assert_array_equal(table.positions, [[[2, 2, 2]]])
    alone = JointTable(np.zeros(1), (inside, "neck"), places[:, :2])
    assert renamed(alone).names == ("neck",)  # one of the two is no joint
    ours = JointTable(np.zeros(1), (outside, inside, joint), places)
    np.testing.assert_array_equal(renamed(ours).positions, [[[9, 9, 9]]])


def test_a_head_beside_a_nose_is_the_crown_and_the_pelvis_lies_between_the_hips():
    names = ("Nose", "Head", "Neck", "RHip", "LHip", "RKnee", "LKnee")
    table = renamed(JointTable(np.zeros(1), names, np.arange(21.0).reshape(1, 7, 3)))
    assert table.names == ("pelvis", "neck", "left_hip", "left_knee", "right_hip", "right_knee")
    np.testing.assert_allclose(table.positions[0, 0], (table.positions[0, 2] + table.positions[0, 4]) / 2)


def test_what_is_not_ours_is_said(tmp_path):
    write_joints(tmp_path / "markers.trc", JointTable(np.zeros(1), ("LASI", "RASI"), np.ones((1, 2, 3))))
    with pytest.raises(FormatError, match=r"markers\.trc: found no joint of a known name among 'LASI, RASI', expected such as pelvis"):
        read_motion(tmp_path / "markers.trc")
    with pytest.raises(FormatError, match=r"film\.mp4: found the ending '\.mp4', expected one of \.amc, \.bvh, \.c3d, \.csv, "):
        read_motion(tmp_path / "film.mp4")
    with pytest.raises(FormatError, match=r"none\.BVH: cannot be read"):
        read_motion(tmp_path / "none.BVH")


@pytest.mark.shared
def test_motion_capture_of_the_database(shared):
    table = read_motion(shared / "mocap" / "03_01.amc")
    assert table.names == JOINTS[:17]  # without heels and toes
    assert up_axis(table) == "+z"
    assert 0.7 < leg_length(table) < 1.0
    for name in ("walking", "jogging", "boxing"):
        both = [read_motion(shared / "recordings" / name / f"training.{ending}") for ending in ("csv", "trc")]
        same(*both, atol=2e-5)
