"""The demo, as a user types it, on small recordings; and with its several cameras the other commands."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import made
import numpy as np
import pytest
from measured import angle_errors

from shadowpuppet.body.sizes import AnatomicalSizes
from shadowpuppet.cli import app as cli
from shadowpuppet.io.motion.table import read_joints
from shadowpuppet.io.person import read_person
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.inverse_kinematics import fit_poses
from shadowpuppet.motion.metrics import LIMB_JOINTS
from shadowpuppet.pipeline.synthesize import contact_sheet
from shadowpuppet.synthetic import demo_ring_spec

pytestmark = pytest.mark.whole

QUICK = ["--tracker.cycles", "1", "--tracker.explore", "20", "--initialization.rounds", "20", "--initialization.patience", "5",
         "--initialization.hypotheses", "60"]  # fmt: skip


@pytest.fixture
def home(shown) -> Path:
    """Beside the demo's folder."""
    return shown.parent


@pytest.fixture(scope="module")
def shown(tmp_path_factory):
    """The demo's folder."""
    folder = tmp_path_factory.mktemp("demo") / "show"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("shadowpuppet.pipeline.synthesize.demo_spec", lambda: made.SPEC)
        patch.setattr("shadowpuppet.pipeline.synthesize.demo_ring_spec", lambda: made.RING)
        assert cli.run(["demo", "-o", str(folder), "--quiet", *QUICK]) == 0
    return folder


def test_a_demo_names_its_pictures(shell, shown, monkeypatch):
    monkeypatch.setattr("shadowpuppet.pipeline.synthesize.track_recording", lambda recording, run, *_: summary_of(run))
    monkeypatch.setattr("shadowpuppet.pipeline.synthesize.synthesize", lambda spec, folder, *_: folder)
    code, out, err = shell("demo", "-o", "show", *QUICK)
    assert (code, err) == (0, "")
    assert [line for line in out.splitlines() if line in ("one camera", "several cameras")] == ["one camera", "several cameras"]
    for run in ("run", "run-ring"):
        named = [shown.parent / line.split()[-1] for line in out.splitlines() if f"show{os.sep}{run}{os.sep}" in line]
        page = {"view.html"} if run == "run-ring" else set()
        assert {"overlay.png", "overlay.mp4", "joints.csv", "angles.csv"} | page <= {path.name for path in named}
        assert all(path.stat().st_size > 1000 for path in named)


def summary_of(run):
    from shadowpuppet.pipeline.progress import Summary

    read = read_run(run)
    return Summary(run, read.motion, read.metrics, None)  # pyright: ignore[reportArgumentType]


def test_contact_sheets_show_what_the_films_show(shown):
    [one] = made.images(shown / "run" / "overlay.png")
    film = made.images(shown / "run" / "overlay.mp4")[0].shape
    assert one.shape == (film[0], 6 * film[1], 3)
    assert film[0] > 3 * made.SIZE[1]
    [several] = made.images(shown / "run-ring" / "overlay.png")
    grid = made.images(shown / "run-ring" / "overlay.mp4")[0].shape
    assert several.shape == (2 * grid[0], 2 * grid[1], 3)
    assert contact_sheet(shown / "run-ring" / "overlay.mp4", 3, 2).shape == several.shape  # the last place is black


def test_several_cameras_find_the_whole_person(shown):
    run = read_run(shown / "run-ring")
    assert run.motion.status_counts == {"tracked": len(run.motion)}
    assert set(LIMB_JOINTS) <= set(run.motion.joint_names)
    truth = read_joints(shown / "recording-ring" / "truth.csv")
    feet = ["left_ankle", "right_ankle", "left_knee", "right_knee", "head"]
    off = np.linalg.norm(run.motion.table.select(feet).positions - truth.select(feet).positions, axis=2)
    assert np.median(off) < 0.06


def test_the_demos_ring_is_small():
    spec = demo_ring_spec()
    assert len(spec.views()) == 4
    assert max(max(view.size) for view in spec.views()) <= 320


def test_evaluate_measures_limbs_by_default_and_those_that_are_named(shell):
    code, out, err = shell("evaluate", "show/run-ring")
    assert (code, err) == (0, "")
    rows = [line.split()[0] for line in out.splitlines() if line.startswith(("left_", "right_", "all", "head", "pelvis"))]
    assert rows == [*LIMB_JOINTS, "all"]
    assert not {"cm2", "pixels"} & set(out.split())  # the trackers' cost is none of a user's figures
    assert "plane" not in out
    measured = json.loads(shell("evaluate", "show/run-ring", "--joints", "pelvis,neck,head,limbs", "--json").out)
    assert list(measured["errors"]["joints"])[:3] == ["pelvis", "neck", "head"]
    assert measured["cameras"] == 4
    assert measured["cost_m2"]["count"] == measured["frames"]
    assert not {"cost_px", "plane_mm", "depth_mm"} & {*measured, *measured["errors"]}


def test_evaluate_measures_angles_where_they_are_asked_for(shell, shown):
    code, out, err = shell("evaluate", "show/run-ring", "--angles")
    assert (code, err) == (0, "")
    assert "by degrees, rmse" in out
    measured = json.loads(shell("evaluate", "show/run-ring", "--angles", "--json").out)["angles_deg"]
    assert measured["left_knee"] < 15
    assert measured["pelvis"] < 15
    assert measured["all"] == pytest.approx(np.sqrt(np.mean([value**2 for name, value in measured.items() if name != "all"])))
    assert "expected one of anatomical" in shell("evaluate", "show/run", "--angles").err


def test_angles_are_those_between_turns(shown):
    """The fitted truth against itself, with one knee bent by 10 degrees more and the person turned by 20."""
    truth = read_joints(shown / "recording-ring" / "truth.csv")
    fitted = fit_poses(truth)
    bent, skeleton = fitted.poses.copy(), fitted.body.skeleton
    bent[:, skeleton.dof_indices(("left_knee_flexion", "root_heading"))] += np.radians([10, 20])
    run = read_run(shown / "run-ring").motion
    told = angle_errors(replace(run, poses=bent, status=np.full(len(bent), "tracked")), truth)
    turned = {name: value for name, value in told.items() if value > 0.01}
    assert turned == pytest.approx({"left_knee": 10, "pelvis": 20, "all": np.sqrt(500 / (len(skeleton.joints) - 3))}, abs=1e-3)


def test_info_tells_of_every_camera_as_json(shell):
    code, out, err = shell("info", "show/recording-ring", "--json")
    assert code == 0, err
    look = json.loads(out)
    assert [camera["name"] for camera in look["cameras"]] == ["cam1", "cam2", "cam3", "cam4"]
    assert look["refusal"] is None


def test_fit_person_measures_before_several_cameras_and_track_uses_it(shell, shown):
    code, out, err = shell("fit-person", "show/recording-ring", "-o", "me.toml")
    assert code == 0, err
    sizes = read_person(shown.parent / "me.toml", "anatomical").sizes
    assert isinstance(sizes, AnatomicalSizes)
    for word in ("thigh_length", "sizes, mm", "of body and silhouettes, in", "training motion", "saved    me.toml"):
        assert word in out
    code, out, err = shell("track", "show/recording-ring", "--person", "me.toml", "-o", "again")
    assert code == 0, err
    assert "me.toml" in out
    np.testing.assert_allclose(read_person(shown.parent / "again" / "person.toml", "anatomical").sizes.to_array(), sizes.to_array())
    assert set(read_run(shown.parent / "again").motion.status) == {"tracked"}


def test_sizes_of_another_body_are_refused(shell, shown):
    code, out, err = shell("track", "show/recording-ring", "--person", "show/run/person.toml", "-o", "never")
    assert (code, out) == (2, "")
    assert err.splitlines()[-1].startswith("error: ")
    assert "person.toml" in err
    assert not (shown.parent / "never").exists()
