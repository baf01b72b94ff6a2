"""Runs exported and files converted, as a user types it."""

from __future__ import annotations

import json
import os
import re
import shutil
import sys
import warnings
from pathlib import Path

import acclaim
import biovision
import c3d
import numpy as np
import pytest
import runs

from shadowpuppet.body.models import WHOLE
from shadowpuppet.errors import FormatError, ShadowPuppetWarning, extra_command
from shadowpuppet.io.export import export_run
from shadowpuppet.io.export_formats import FORMATS
from shadowpuppet.io.files.table import read_table
from shadowpuppet.io.motion import EXPORTS
from shadowpuppet.io.motion.bvh import read_bvh
from shadowpuppet.io.motion.c3d import read_c3d, read_header
from shadowpuppet.io.motion.c3d_writer import write_c3d
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.npz import read_motion_npz
from shadowpuppet.io.motion.opensim.model_writer import MARKERS
from shadowpuppet.io.motion.opensim.mot import read_mot
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.animation import Y_UP
from shadowpuppet.motion.limbs import limb_of
from shadowpuppet.motion.motion import JointTable

LOST = (0, 6, 7)


def test_of_several_people_there_is_a_file_each(tmp_path, shell):
    folder = runs.make_people(tmp_path / "pair")
    code, out, err = shell("export", str(folder), "--to", "csv,bvh")
    assert code == 0, err
    assert "pair-person-2.csv" in "".join(out.split())  # which may be broken into lines
    written = sorted(path.name for path in (folder / "export").iterdir())
    assert written == ["pair-person-1.bvh", "pair-person-1.csv", "pair-person-2.bvh", "pair-person-2.csv"]
    for n in (1, 2):
        found = read_motion(folder / "export" / f"pair-person-{n}.csv")
        alone = read_run(folder / f"person-{n}").motion
        assert found.times[0] == pytest.approx(alone.times[0], abs=1e-4)


def test_of_several_people_each_bad_verdict_is_named(tmp_path, shell):
    folder = runs.make_people(tmp_path / "pair")
    file = folder / "person-2" / "metrics.json"
    metrics = json.loads(file.read_text()) if file.exists() else {}
    file.write_text(json.dumps(metrics | {"verdict": {"word": "bad", "reasons": ["the person is lost"]}}))
    code, _, err = shell("export", str(folder), "--to", "csv")
    assert code == 0, err
    assert "verdict on this run of person 2 is bad (the person is lost)" in " ".join(err.split())
    assert "person 1" not in err


@pytest.fixture(scope="module", params=["rounded", "anatomical", "cylinders"])
def run(request, tmp_path_factory):
    return runs.make_run(tmp_path_factory.mktemp("runs") / "walk", request.param, lost=LOST, spread=True)


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return runs.make_run(tmp_path_factory.mktemp("runs") / "walk", "anatomical", frames=25)


@pytest.fixture
def columns() -> int:
    return 100


def refused(shell, *tokens: object) -> str:
    code, _, err = shell(*tokens)
    assert code == 2
    assert "Traceback" not in err
    return next(line for line in err.splitlines() if line.startswith("error: "))


def test_every_format_of_a_run_has_the_runs_joints(shell, run, tmp_path):
    code, out, err = shell("export", run, "--to", "all", "-o", tmp_path / "out")
    assert code == 0, err
    motion = read_run(run).motion
    left_out = set() if motion.body_name in WHOLE else {"osim"}
    assert {path.name for path in (tmp_path / "out").iterdir()} == {f"walk.{name}" for name in EXPORTS if name not in left_out}
    assert ("osim is left out: only whole bodies have bones of constant lengths" in err) == bool(left_out)
    assert "walk.glb" in out
    known = np.delete(np.arange(len(motion)), LOST)
    bvh = read_bvh(tmp_path / "out" / "walk.bvh").joints().select(motion.joint_names).positions @ Y_UP
    assert np.abs(bvh[known] - motion.joints[known]).max() < 1e-4
    for name in ("c3d", "csv", "npz", "parquet"):
        found = read_motion(tmp_path / "out" / f"walk.{name}").select(motion.joint_names)
        np.testing.assert_allclose(found.positions, motion.joints, atol=1e-6, err_msg=name)
    trc = read_joints(tmp_path / "out" / "walk.trc")
    ours = trc.select([MARKERS.get(name, name) for name in motion.joint_names])
    np.testing.assert_allclose(ours.positions @ Y_UP, motion.joints, atol=1e-6)
    assert ("LHeel" in trc.names) == (motion.body_name == "anatomical")
    np.testing.assert_allclose(read_mot(tmp_path / "out" / "walk.mot").times, motion.times[known])
    assert "3 of 40 frames are not known, which this format cannot tell" in err
    assert "3 of 40 frames are not known: the puppet is hidden" in err


def test_a_floor_that_is_not_at_0_is_put_there(shell, tmp_path):
    run = runs.make_run(tmp_path / "run", "rounded", frames=12)
    before, level = read_run(run).motion.joints, -1.25
    export_run(run, ["bvh"], tmp_path / "before")
    with (run / "run.toml").open("a") as file:
        file.write(f'\n[floor]\nheight_m = {level}\nfrom = "the lowest foot over the film"\n')
    code, out, _ = shell("export", run, "--to", "npz,trc,glb,bvh,c3d", "-o", tmp_path / "out")
    assert code == 0
    assert "1.25 m below the camera" in out
    np.testing.assert_allclose(read_motion_npz(tmp_path / "out" / "run.npz").joints[..., 2], before[..., 2] - level, atol=1e-6)
    roots = [np.array((tmp_path / folder / "run.bvh").read_text().splitlines()[-1].split()[:3], float) for folder in ("before", "out")]
    np.testing.assert_allclose(np.sort(np.abs(roots[1] - roots[0])), [0, 0, -level], atol=1e-4)


@pytest.mark.parametrize("floor", ["floor = 1.0", "floor.height_m = 'low'", "floor.height_m = nan", "floor.height_m = true",
                                   "floor.height = 1.0"])  # fmt: skip
def test_a_floor_that_is_no_height_is_refused(tmp_path, floor):
    run = runs.make_run(tmp_path / "run", "rounded", frames=3)
    text = (run / "run.toml").read_text()
    (run / "run.toml").write_text(f"{floor}\n{text}")
    with pytest.raises(FormatError, match=r"run.toml: floor: found .*, expected a table with height_m, metres"):
        read_run(run)


def test_by_default_files_lie_in_the_run_and_a_new_run_may_replace_it(shell, whole, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    assert shell("export", folder, "--to", "csv, BVH")[0] == 0
    assert sorted(path.name for path in (folder / "export").iterdir()) == ["run.bvh", "run.csv"]
    runs.make_run(folder)  # is not refused


def test_a_killed_run_is_exported_as_far_as_it_came(shell, whole, tmp_path):
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    (folder / "motion.npz").unlink()
    (folder / "metrics.json").unlink()
    text = (folder / "run.toml").read_text()
    (folder / "run.toml").write_text(text.replace("complete = true", "complete = false"))
    for name in ("joints.csv", "angles.csv"):
        lines = (folder / name).read_text().splitlines(keepends=True)
        (folder / name).write_text("".join(lines[:12]) + lines[12][:20])
    code, _, err = shell("export", folder, "--to", "bvh,c3d,mot,glb")
    assert code == 0
    assert "the run was broken off: 11 frames of it are exported, as tracked, not smoothed; `shadowpuppet track " in err
    motion = read_run(whole).motion
    found = read_bvh(folder / "export" / "run.bvh").joints().select(motion.joint_names).positions @ Y_UP
    assert len(found) == 11
    np.testing.assert_allclose(found, motion.joints[:11], atol=1e-4)


def test_without_pyarrow_all_others_are_written(shell, whole, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    code, _, err = shell("export", whole, "--to", "all", "-o", tmp_path / "out")
    assert (code, err.splitlines()[0]) == (0, f"warning: parquet is left out: it needs pyarrow; {extra_command('formats')}")
    assert {path.suffix[1:] for path in (tmp_path / "out").iterdir()} == set(EXPORTS) - {"parquet"}
    assert "Parquet needs pyarrow" in refused(shell, "export", whole, "--to", "parquet", "-o", tmp_path / "out")


def test_the_model_and_the_weight_are_chosen(shell, whole, tmp_path):
    for model, knee in (("rajagopal", 1), ("gait2392", -1)):
        assert shell("export", whole, "--to", "mot,osim", "--model", model, "--weight", "70", "-o", tmp_path / model)[0] == 0
        assert np.median(knee * read_mot(tmp_path / model / "walk.mot").values["knee_angle_r"]) > 0
    text = (tmp_path / "gait2392" / "walk.osim").read_text()
    assert sum(map(float, re.findall(r"<mass>(.*)</mass>", text))) == pytest.approx(70, abs=1e-5)
    assert "weight: found 0.5, expected kilograms from 1 to 500" in refused(shell, "export", whole, "--to", "osim", "--weight", "0.5")


def test_a_model_comes_with_its_own_motion(shell, whole, tmp_path):
    assert shell("export", whole, "--to", "osim,mot", "-o", tmp_path)[0] == 0
    coordinates = set(re.findall(r'<Coordinate name="(\w+)"', (tmp_path / "walk.osim").read_text()))
    own = set(read_mot(tmp_path / "walk.mot").values)
    assert own <= coordinates
    assert shell("export", whole, "--to", "mot", "-o", tmp_path / "alone")[0] == 0
    assert own - set(read_mot(tmp_path / "alone" / "walk.mot").values) >= {"neck_flexion", "subtalar_angle_l"}  # Rajagopal's has no neck


def test_units_of_bvh(shell, whole, tmp_path):
    assert shell("export", whole, "--to", "bvh", "--unit", "cm", "-o", tmp_path)[0] == 0
    hips = read_bvh(tmp_path / "walk.bvh").joints().select(["pelvis"]).positions
    assert 80 < hips[:, 0, 1].mean() < 110


def test_units_and_gaps_of_trc(shell, run, tmp_path):
    motion = read_run(run).motion
    known = np.delete(np.arange(len(motion)), LOST)
    for unit, missing in (("mm", "nan"), ("m", "drop"), ("cm", "fill")):
        assert shell("export", run, "--to", "trc", "--unit", unit, "--missing", missing, "-o", tmp_path)[0] == 0
        text = (tmp_path / "walk.trc").read_text()
        assert f"\t{unit}\t" in text
        assert ("NaN" in text) == (missing == "nan")
        found = read_joints(tmp_path / "walk.trc")
        assert len(found.times) == len(known if missing == "drop" else motion)
        places = found.positions[slice(None) if missing == "drop" else known, : len(motion.joint_names)]
        np.testing.assert_allclose(places @ Y_UP, motion.joints[known], atol=1e-6)
    assert "Hip" in found.names or "pelvis" not in motion.joint_names
    assert shell("convert", tmp_path / "walk.trc", tmp_path / "other.trc", "--unit", "m")[0] == 0
    assert "\tm\t" in (tmp_path / "other.trc").read_text()


def test_limbs_that_are_not_vouched_for_keep_their_places_and_have_the_greatest_residual(shell, tmp_path):
    doubtful = {2: {"left_arm": "uncertain"}, 3: {"right_leg": "predicted", "trunk": "uncertain"}}
    folder = runs.make_run(tmp_path / "walk", "anatomical", frames=6, lost=(5,), spread=True, doubtful=doubtful)
    assert shell("export", folder, "--to", "c3d,csv,npz", "-o", tmp_path / "out")[0] == 0
    motion = read_run(folder).motion
    with (tmp_path / "out" / "walk.c3d").open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of theirs
        residuals = np.stack([points[:, 3] for _, points, _ in c3d.Reader(file).read_frames()])
    doubted = np.array([[doubtful.get(t, {}).get(limb_of(name)) is not None for name in motion.joint_names] for t in range(6)])
    assert (residuals[doubted] == 255).all()
    assert (residuals[5] == -1).all()
    np.testing.assert_allclose(residuals[:5][~doubted[:5]], 1000 * np.sqrt((motion.joint_sd[:5]**2).mean(2))[~doubted[:5]], atol=0.51)
    np.testing.assert_allclose(read_c3d(tmp_path / "out" / "walk.c3d").positions, motion.joints, atol=1e-6)
    table = read_table(tmp_path / "out" / "walk.csv")
    for limb, status in zip(motion.limbs, motion.limb_status.T):
        assert table.texts(f"{limb}_status") == status.tolist()
    np.testing.assert_array_equal(read_motion_npz(tmp_path / "out" / "walk.npz").limb_status, motion.limb_status)


def test_angles_are_analog_channels_in_degrees(shell, whole, tmp_path):
    assert shell("export", whole, "--to", "c3d", "-o", tmp_path)[0] == 0
    header = read_header(tmp_path / "walk.c3d")
    units = dict(zip(header.words("ANALOG:LABELS"), header.words("ANALOG:UNITS")))
    assert units["left_knee_flexion"] == "deg"
    assert units["root_x"] == "m"
    assert len(units) == 32


def test_what_cannot_be_exported_is_said(shell, whole, tmp_path):
    assert "formats: found 'fbx', expected some of bvh, c3d, csv, glb, mot, npz, " in refused(shell, "export", whole, "--to", "fbx")
    assert "formats: found ''" in refused(shell, "export", whole, "--to", "")
    assert "found no run.toml" in refused(shell, "export", tmp_path)
    bare = runs.make_run(tmp_path / "bare", frames=5, person=False)
    assert "person.toml: found no such file, expected the person's sizes" in refused(shell, "export", bare, "--to", "csv,bvh")
    assert (bare / "export" / "bare.csv").exists()
    assert shell("export", bare, "--to", "trc,c3d,npz,csv,parquet")[0] == 0
    nobody = runs.make_run(tmp_path / "nobody", frames=3, lost=(0, 1, 2))
    assert "found no frame with a known joint" in refused(shell, "export", nobody, "--to", "csv")
    (tmp_path / "file").touch()
    assert "cannot be made" in refused(shell, "export", whole, "--to", "csv", "-o", tmp_path / "file" / "out")
    other = tmp_path / "other"
    shutil.copytree(whole, other)
    shutil.copy(runs.make_run(tmp_path / "upper", "rounded", 3) / "person.toml", other / "person.toml")
    assert "sizes: found those of the body 'rounded'" in refused(shell, "export", other, "--to", "glb")


def test_a_person_measured_again_is_said(tmp_path, whole):
    folder = tmp_path / "run"
    shutil.copytree(whole, folder)
    text = (folder / "person.toml").read_text()
    line = next(line for line in text.splitlines() if line.startswith("upper_arm_length"))
    (folder / "person.toml").write_text(text.replace(line, "upper_arm_length = 0.36"))
    with pytest.warns(ShadowPuppetWarning, match=r"the body in person\.toml lie up to \d+ mm off the run's"):
        export_run(folder, ["bvh"])


def test_every_format_is_written_and_in_the_manual():
    manual = (Path(__file__).parents[2] / "docs" / "formats.md").read_text("utf-8").partition("## Motion for other programs")[2]
    assert tuple(FORMATS) == EXPORTS
    assert set(re.findall(r"^\| `(\w+)` \|", manual.partition("- **Axes.**")[0], re.MULTILINE)) == set(EXPORTS)


@pytest.mark.filterwarnings("ignore:.*Y points up:shadowpuppet.errors.ShadowPuppetWarning")
@pytest.mark.parametrize("target", [f".{name}" for name in EXPORTS])
def test_joints_become_any_other_file(shell, whole, tmp_path, target):
    code, out, err = shell("convert", whole / "joints.csv", tmp_path / f"made{target}")
    assert code == 0, err
    assert f"made{target}" in out
    motion = read_run(whole).motion
    if target in (".bvh", ".glb", ".usda", ".mot", ".osim"):
        assert "a body's poses fitted to 21 joints, 25 frames" in out
    if target == ".bvh":
        found = read_bvh(tmp_path / "made.bvh").joints().select(motion.joint_names).positions @ Y_UP
        assert np.sqrt(((found - motion.joints) ** 2).sum(2).mean()) < 0.02
    elif target not in (".glb", ".usda", ".mot", ".osim"):
        found = read_motion(tmp_path / f"made{target}").select(motion.joint_names)
        np.testing.assert_allclose(found.positions, motion.joints, atol=2e-6)


def test_skeletons_stay_skeletons(shell, tmp_path):
    (tmp_path / "a.bvh").write_text(biovision.person(6))
    assert shell("convert", "a.bvh", "b.bvh", "--unit", "cm")[0] == 0
    before, after = read_bvh(tmp_path / "a.bvh"), read_bvh(tmp_path / "b.bvh")
    assert {node.name for node in after.nodes} == {node.name for node in before.nodes}
    names = [node.name for node in before.nodes]
    np.testing.assert_allclose(after.joints().select(names).positions, before.joints().positions, atol=2e-3)
    acclaim.write(tmp_path)
    code, out, err = shell("convert", "01_01.amc", "c.glb", "--rate", "60")
    assert code == 0, err
    assert "a skeleton of 29 joints, 3 frames" in out


def test_all_keeps_every_point_under_its_own_name(shell, tmp_path):
    (tmp_path / "a.bvh").write_text(biovision.person(6))
    assert shell("convert", "a.bvh", "ours.c3d")[0] == 0
    assert shell("convert", "a.bvh", "all.c3d", "--all")[0] == 0
    assert "left_elbow" in read_c3d(tmp_path / "ours.c3d").names
    found = read_c3d(tmp_path / "all.c3d")
    assert found.names == tuple(read_bvh(tmp_path / "a.bvh").joints().names)
    np.testing.assert_allclose(found.select(["LeftForeArm"]).positions, read_c3d(tmp_path / "ours.c3d").select(["left_elbow"]).positions)


def test_a_skeleton_of_unknown_names_is_converted_by_a_file_of_names(shell, tmp_path):
    text = biovision.person(6)
    given = {"left_hip": "LeftUpLeg", "left_knee": "LeftLeg", "left_ankle": "LeftFoot", "neck": "Neck"}
    for n, name in enumerate(given.values()):
        text = text.replace(f" {name}\n", f" b{n}\n")
    for name in ("Head", "Arm", "Hand", "Leg", "Foot"):
        text = text.replace(name, "Thing")
    (tmp_path / "a.bvh").write_text(text)
    assert "found neither legs nor arms of known names" in refused(shell, "convert", "a.bvh", "b.csv")
    assert shell("convert", "a.bvh", "b.bvh", "--source-unit", "cm")[0] == 0
    (tmp_path / "n.toml").write_text("".join(f'{ours} = "b{n}"\n' for n, ours in enumerate(given)))
    for target in ("b.csv", "b.glb"):
        code, _, err = shell("convert", "a.bvh", target, "--names", "n.toml")
        assert (code, "make it centimetres" in err) == (0, True)
    assert {*given} <= {*read_joints(tmp_path / "b.csv").names}


def test_markers_of_unknown_names_come_back_as_they_went(shell, tmp_path, rng):
    markers = JointTable(4 + np.arange(5) / 50, ("M001", "Fühler"), rng.uniform(-2, 2, (5, 2, 3)))
    write_c3d(tmp_path / "a.c3d", markers, angles={"Fx1": ("N", np.ones(5)), "Fy1": ("N", np.ones(5))})
    code, _, err = shell("convert", "a.c3d", "b.trc", "--all")
    assert (code, "a.c3d: its 2 analog channels (Fx1, Fy1) are left out" in err) == (0, True)
    code, _, err = shell("convert", "b.trc", "c.c3d", "--all")
    assert (code, "b.trc: found no legs and head of known names that show which axis is up: Y is taken" in err) == (0, True)
    found = read_c3d(tmp_path / "c.c3d")
    assert found.names == markers.names
    np.testing.assert_allclose(found.times, markers.times)
    np.testing.assert_allclose(found.positions, markers.positions, atol=2e-6)
    assert shell("convert", "c.c3d", "d.csv", "--all")[2] == ""


def test_what_cannot_be_converted_is_said(shell, whole, tmp_path, monkeypatch):
    joints = whole / "joints.csv"
    assert "found the ending '.fbx', expected one of .bvh, .c3d, .csv, .glb, .mot" in refused(shell, "convert", joints, "a.fbx")
    assert "found the ending '.mp4'" in refused(shell, "convert", "a.mp4", "a.csv")
    assert "a run's folder by `shadowpuppet export`" in refused(shell, "convert", whole, "a.csv")
    assert "a.csv: cannot be read (no such file" in refused(shell, "convert", "a.csv", "b.csv")
    shutil.copy(joints, tmp_path / "a.csv")
    assert "found the file that is to be read" in refused(shell, "convert", "a.csv", "a.csv")
    (tmp_path / "link.csv").symlink_to(tmp_path / "a.csv")
    os.link(tmp_path / "a.csv", tmp_path / "same.csv")
    for other in (tmp_path / "a.csv", tmp_path / "." / "a.csv", "link.csv", "same.csv"):  # the same file by another name
        assert "found the file that is to be read" in refused(shell, "convert", "a.csv", other)
        assert "found the file that is to be read" in refused(shell, "convert", other, "a.csv")
    assert (tmp_path / "a.csv").read_bytes() == joints.read_bytes()
    assert "rate: found 0.0, expected frames a second" in refused(shell, "convert", "a.csv", "b.csv", "--rate", "0")
    (tmp_path / "m.csv").write_text("time,LASI_x,LASI_y,LASI_z\n0,1,2,3\n")
    assert "found no joint of a known name" in refused(shell, "convert", "m.csv", "b.csv")
    assert shell("convert", "m.csv", "b.trc", "--all")[0] == 0
    (tmp_path / "arm.csv").write_text("time,neck_x,neck_y,neck_z\n0,1,2,3\n")
    assert "needs a skeleton, and none can be fitted" in refused(shell, "convert", "arm.csv", "b.bvh")
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    said = refused(shell, "convert", "a.csv", "b.parquet")
    assert "Parquet needs pyarrow, which is not installed: " in said
    assert not (tmp_path / "b.parquet").exists()


def test_help_names_the_formats(shell):
    assert "bvh, c3d, csv, glb, mot, npz, osim, parquet, trc, usda" in " ".join(shell("export", "--help")[1].replace("│", " ").split())
    assert "--source-unit" in shell("convert", "--help")[1]
