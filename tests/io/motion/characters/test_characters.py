"""Rest poses, names of other programs' bones, and USD: the motion stays where it is."""

from __future__ import annotations

import json
import re
import struct
from dataclasses import replace

import numpy as np
import pytest
import runs

from shadowpuppet.errors import SettingsError, ShadowPuppetWarning
from shadowpuppet.io.export import export_run
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.characters.bone_names import OF_PROGRAMS, bone_names
from shadowpuppet.io.motion.characters.usd import joint_paths, write_usda
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.motion.animation import Y_UP
from shadowpuppet.motion.body_animation import BodyTree
from shadowpuppet.motion.mesh import body_mesh
from shadowpuppet.motion.rest_pose import RAISED, with_rest


def puppet(name, rng, frames=8):
    body = runs.body_of(name)
    animation = BodyTree(body).animation(np.arange(frames) / 25, runs.smooth_poses(body, frames, rng), np.eye(4))
    return animation, body_mesh(body)


def skinned(animation, mesh, n):
    places, turns = animation.world()
    own = mesh.joints
    return places[n, own] + (turns[n, own] @ (mesh.points - animation.rest[own])[..., None])[..., 0]


@pytest.mark.parametrize("rest", RAISED)
@pytest.mark.parametrize("name", ["rounded", "anatomical", "cylinders"])
def test_another_rest_pose_is_the_same_motion_with_straight_arms(name, rest, rng):
    animation, mesh = puppet(name, rng)
    moved, skin = with_rest(animation, mesh, rest)
    assert moved.world()[0] == pytest.approx(animation.world()[0], abs=1e-9)
    for n in (0, 5):
        assert skinned(moved, skin, n) == pytest.approx(skinned(animation, mesh, n), abs=1e-9)
    at = dict(zip(moved.names, moved.rest))
    for side, outward in (("left", 1), ("right", -1)):
        for a, b in (("shoulder", "elbow"), ("elbow", "wrist"), ("wrist", "hand")):
            along = at[f"{side}_{b}"] - at[f"{side}_{a}"]
            angle = np.radians(RAISED[rest])
            assert along / np.linalg.norm(along) == pytest.approx([outward * np.sin(angle), -np.cos(angle), 0], abs=1e-9)
    if rest == "t":
        palms = skin.normals[np.isin(skin.joints, [moved.names.index("left_hand")])]
        assert np.linalg.norm(palms, axis=1) == pytest.approx(1, abs=1e-9)
    assert np.abs(np.linalg.det(moved.rotations) - 1).max() < 1e-9


def test_an_unknown_rest_pose_or_program_is_refused(rng, tmp_path):
    with pytest.raises(SettingsError, match="rest: found 'y', expected one of a, hang, t"):
        with_rest(*puppet("rounded", rng), "y")
    with pytest.raises(SettingsError, match="names: found 'maya', expected one of humanik, mixamo, unreal, vrm"):
        bone_names("maya")
    for more in ({"rest": "y"}, {"names": "maya"}):
        with pytest.raises(SettingsError, match=next(iter(more))):
            export_run(runs.make_run(tmp_path / "run", frames=3), ["bvh"], **more)


@pytest.mark.parametrize("program", OF_PROGRAMS)
def test_bones_have_a_programs_names_left_and_right(program):
    names = bone_names(program)
    assert len(set(names.values())) == len(names) - 1  # chest or torso, whichever a body has
    for ours, theirs in names.items():
        if ours.startswith("left_"):
            right = names[ours.replace("left", "right")]
            assert right != theirs
            back = right.replace("Right", "Left").replace("right", "left") if program != "unreal" else f"{right[:-1]}l"
            assert back == theirs


EXPECTED = {"mixamo": ("mixamorig:Hips", "mixamorig:LeftArm", "mixamorig:RightLeg"), "humanik": ("Hips", "LeftArm", "RightLeg"),
            "unreal": ("pelvis", "upperarm_l", "calf_r"), "vrm": ("hips", "leftUpperArm", "rightLowerLeg")}  # fmt: skip


@pytest.mark.parametrize("program", EXPECTED)
def test_files_with_a_programs_names_and_rest_pose_hold_the_runs_joints(program, tmp_path):
    run = runs.make_run(tmp_path / "run", "anatomical", frames=6)
    export_run(run, ["bvh", "glb"], tmp_path, rest="t", names=program)
    bvh = read_bvh(tmp_path / "run.bvh")
    assert {node.name for node in bvh.nodes} >= set(EXPECTED[program])
    ours = {theirs: name for name, theirs in bone_names(program).items()}
    joints = bvh.joints()
    plain = read_motion(run / "motion.npz").select([ours[name] for name in EXPECTED[program]])
    found = joints.select(EXPECTED[program])
    assert found.positions == pytest.approx(plain.positions @ Y_UP.T, abs=1e-4)
    content = glb_content(tmp_path / "run.glb")
    nodes = {node["name"]: node for node in content["nodes"]}
    hand = nodes[bone_names(program)["left_elbow"]]
    assert (hand["rotation"], hand["translation"][1]) == ([0, 0, 0, 1], pytest.approx(0, abs=1e-9))  # aside, at rest
    assert hand["translation"][0] > 0.2


def glb_content(path):
    data = path.read_bytes()
    (length,) = struct.unpack_from("<I", data, 12)
    return json.loads(data[20 : 20 + length])


def test_a_moving_shoulder_of_a_bvh_file_has_a_collar_bone_by_name(tmp_path):
    run = runs.make_run(tmp_path / "run", "rounded", frames=6)
    export_run(run, ["bvh"], tmp_path, names="mixamo")
    names = [node.name for node in read_bvh(tmp_path / "run.bvh").nodes]
    assert names.index("mixamorig:LeftShoulder") < names.index("mixamorig:LeftArm")
    assert not any(name.startswith("left_") for name in names)


# USD


def numbers(text):
    return np.array([float(each) for each in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", text)])


def array_of(text, name):
    return re.search(rf" {re.escape(name)} = \[(.*?)\](?: \(|\n)", text)[1]


def samples_of(text, name, width):
    body = re.search(rf"{name}\.timeSamples = {{\n(.*?)\n        }}", text, re.DOTALL)[1]
    rows = dict(line.strip().rstrip(",").split(": ", 1) for line in body.splitlines())
    return {float(code): numbers(row).reshape(-1, width) for code, row in rows.items()}


@pytest.mark.parametrize("name", ["rounded", "anatomical"])
def test_usd_holds_the_skeleton_the_motion_and_the_skin(name, tmp_path, rng):
    animation, mesh = puppet(name, rng)
    write_usda(tmp_path / "a.usda", animation, mesh, "off")
    text = (tmp_path / "a.usda").read_text()
    assert text.startswith("#usda 1.0\n")
    assert [text.count(each) for each in ("{", "(", "[")] == [text.count(each) for each in ("}", ")", "]")]
    paths = re.findall(r'"(.*?)"', array_of(text, "joints"))
    assert paths == joint_paths(animation)
    turns, shifts = samples_of(text, "rotations", 4), samples_of(text, "translations", 3)
    assert list(turns) == list(shifts) == list(range(8))
    places = np.zeros((len(paths), 3))
    world = np.zeros((len(paths), 3, 3))
    for j, path in enumerate(paths):  # by forward kinematics of what is in the file
        w, x, y, z = turns[5][j]
        R = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                      [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                      [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])  # fmt: skip
        parent = paths.index(path.rpartition("/")[0]) if "/" in path else None
        world[j] = R if parent is None else world[parent] @ R
        places[j] = shifts[5][j] if parent is None else places[parent] + world[parent] @ shifts[5][j]
    assert places == pytest.approx(animation.world()[0][5] @ Y_UP.T, abs=1e-5)
    bind = numbers(array_of(text, "bindTransforms")).reshape(-1, 4, 4)
    assert bind[:, 3, :3] == pytest.approx(animation.rest, abs=1e-5)
    assert numbers(array_of(text, "primvars:skel:jointIndices")).tolist() == mesh.joints.tolist()
    assert numbers(array_of(text, "points")).reshape(-1, 3) == pytest.approx(mesh.points, abs=1e-5)


def test_usd_has_the_nominal_rate_if_the_times_are_its_own_but_for_rounding(tmp_path, rng):
    animation, mesh = puppet("rounded", rng)
    write_usda(tmp_path / "a.usda", replace(animation, times=np.round(np.arange(8) / 30, 5)), mesh)
    assert re.findall(r"(?:timeCodes|frames)PerSecond = (\S+)", (tmp_path / "a.usda").read_text()) == ["30", "30"]


def test_unknown_frames_are_invisible_in_usd_and_names_are_made_valid(tmp_path, rng):
    run = runs.make_run(tmp_path / "run", "anatomical", frames=8, lost=(3, 4))
    with pytest.warns(ShadowPuppetWarning, match="2 of 8 frames are not known"):
        export_run(run, ["usda"], tmp_path, names="mixamo")
    text = (tmp_path / "run.usda").read_text()
    assert 'token visibility.timeSamples = { 0: "inherited", 3: "invisible", 5: "inherited" }' in text
    assert list(samples_of(text, "rotations", 4)) == [0, 1, 2, 5, 6, 7]
    assert "mixamorig_Hips/mixamorig_LeftUpLeg/mixamorig_LeftLeg" in text
