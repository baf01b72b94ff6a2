"""Runs measured, in Python and as a user types it: made runs against truths of any kind, clock and world."""

from __future__ import annotations

import json
import warnings
from dataclasses import replace

import biovision
import numpy as np
import pytest
from measured import NAMES, evaluate_run, moved, person, write_run
from vicon import c3d

from shadowpuppet.errors import ShadowPuppetError, ShadowPuppetWarning
from shadowpuppet.evaluation.evaluation import Comparison, measure_run
from shadowpuppet.geometry import rotation_from_vector
from shadowpuppet.io.motion.motion_files import read_motion
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.io.run import read_run
from shadowpuppet.motion.motion import JointTable

TRUTH = person(6)


def noisy(table: JointTable = TRUTH, size: float = 0.01) -> JointTable:
    return moved(table, np.random.default_rng(8).normal(size=table.positions.shape) * size)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with a truth and a run that is near to it; tests change neither."""
    folder = tmp_path_factory.mktemp("measured")
    write_joints(folder / "truth.csv", TRUTH)
    write_run(folder / "run", noisy(), truth=folder / "truth.csv")
    return folder


@pytest.fixture
def shell(shell):
    """Runs `shadowpuppet evaluate`."""
    return lambda *tokens: shell("evaluate", *tokens)


def refused(shell, *tokens: object) -> str:
    code, out, err = shell(*tokens)
    assert (code, out) == (2, "")
    [line] = [line for line in err.splitlines() if not line.startswith("warning: ")]
    assert line.startswith("error: ")
    return line


# What is compared


def test_of_a_part_of_a_recording_the_truth_of_that_part_is_compared(tmp_path):
    """The rest is not lost: nothing was asked for there."""
    write_joints(tmp_path / "truth.csv", TRUTH)
    times = TRUTH.times
    part = noisy().between(times[2], times[5])
    assert part.times.tolist() == times[2:5].tolist()
    write_run(tmp_path / "asked", part, truth=tmp_path / "truth.csv", begin=float(times[2]), end=float(times[5]))
    write_run(tmp_path / "broken", part, truth=tmp_path / "truth.csv")
    asked, broken = (evaluate_run(tmp_path / name)["errors"] for name in ("asked", "broken"))
    assert (asked["frames"], asked["lost"]) == (3, 0)
    assert (broken["frames"], broken["lost"]) == (len(times), len(times) - 3)


@pytest.mark.parametrize(("start", "end", "frames"), [("2", "64", (2, 64)), ("2f", "4f", (2, 4)), (2, None, (2, 179))])
def test_the_truth_s_frames_are_chosen_by_number(folder, start, end, frames):
    errors = evaluate_run(folder / "run", start=start, end=end)
    assert errors["clock"]["frames_compared"] == frames[1] - frames[0] + 1


def test_a_few_frames_given_by_bare_numbers_may_have_been_meant_in_seconds(folder):
    with pytest.warns(ShadowPuppetWarning, match=r"start 1 and end 2 are frames of \S+, 2 in all; seconds are written 1\.0 and 2\.0"):
        evaluate_run(folder / "run", start="1", end="2")


def test_the_truth_s_frames_are_chosen_by_time(folder):
    begin, end = TRUTH.times[[1, 3]]
    by_time = evaluate_run(folder / "run", start=f"{begin:.6f}s", end=f"{end:.6f}")
    assert by_time["errors"] == evaluate_run(folder / "run", start=1, end=3)["errors"]


@pytest.mark.parametrize(("flag", "value", "said"), [
    ("--start", "soon", "start: found 'soon'; expected seconds such as 3.5, or frames such as 120f"),
    ("--start", "999", "start: found 999, expected 0 to 179"), ("--end", "999f", "end: found 999f, expected 0 to 179"),
    ("--end", "99.5", "end: found 99.5 s, expected 0.000 to")])
def test_frames_that_are_not_there_are_refused(shell, folder, flag, value, said):
    assert said in refused(shell, folder / "run", flag, value)


# What is shown and written


def test_all_figures_fit_a_terminal(shell, folder):
    code, out, err = shell(folder / "run")
    assert (code, err) == (0, "")
    assert max(map(len, out.splitlines())) <= 80
    for words in ("joint errors, mm", "mean error (MPJPE), mm, after alignment", "(PA-MPJPE)", "0.810, fair (IoU of body",
                  "from the pelvis", "axes ", "left_knee", "intervals  none stated: the run has no standard deviations",
                  "moves ", "compared at 180 times"):
        assert words in out, words
    assert "no pose" not in out


def test_without_a_truth_what_needs_none_is_shown(shell, tmp_path):
    table = noisy()
    table.positions[30:60] = np.nan
    write_run(tmp_path / "run", table)
    code, out, err = shell("run")
    assert (code, err) == (0, "")
    assert "30 frames (16.7 %) in 1 gaps; the longest 30 frames, 1.03 s, from 1.00 s" in " ".join(out.split())
    assert "joint errors" not in out
    assert "truth" in out
    assert "none is known: nothing is compared" in " ".join(out.split())
    measured = json.loads(shell("run", "--json")[1])
    assert measured["truth"] is None
    assert "errors" not in measured
    for flag in ("--sync", "--align", "--angles"):
        assert f"{flag[2:]}: found no truth to compare with, expected one as TRUTH" in refused(shell, "run", flag)


def test_figures_are_written_where_they_are_wanted_and_nowhere_else(shell, folder, tmp_path):
    before = {path.name: path.read_bytes() for path in (folder / "run").iterdir()}
    code, out, _ = shell(folder / "run", "-o", "figures.json")
    assert code == 0
    assert "figures    figures.json" in out
    assert json.loads((tmp_path / "figures.json").read_text()) == json.loads(shell(folder / "run", "--json")[1])
    assert {path.name: path.read_bytes() for path in (folder / "run").iterdir()} == before


def test_the_run_s_own_metrics_are_changed_only_when_that_is_asked_for(shell, tmp_path):
    write_joints(tmp_path / "truth.csv", TRUTH)
    write_run(tmp_path / "run", noisy(), truth=tmp_path / "truth.csv")
    own = tmp_path / "run" / "metrics.json"
    own.write_text(json.dumps(json.loads(own.read_text()) | {"track_s": 12.5, "axes_mm": "old"}))
    said = refused(shell, "run", "-o", own)
    assert "metrics.json: found the run's own file" in said
    assert "--update" in said
    assert read_run("run").metrics["axes_mm"] == "old"
    assert "the run's own file" in refused(shell, "run", "-o", "run/look.json")
    assert "found the ending '.csv', expected .json" in refused(shell, "run", "-o", "run/joints.csv")
    assert shell("run", "--update")[0] == 0
    metrics = read_run("run").metrics
    assert metrics["track_s"] == 12.5
    off = (noisy().positions - TRUTH.positions)[:, [NAMES.index(name) for name in metrics["errors"]["joints"]]]
    assert metrics["axes_mm"]["x"]["mean"] == pytest.approx(1000 * off[..., 0].mean(), abs=0.01)
    assert shell("run")[0] == 0  # it can be read again


# Frames, joints, names


def test_frames_are_counted_from_start_to_end(shell, folder):
    measured = json.loads(shell(folder / "run", "--start", "10", "--end", "19", "--json")[1])
    assert (measured["errors"]["frames"], measured["clock"]["frames_compared"], measured["frames"]) == (10, 10, 180)
    assert "end: found 5, expected 10 to 179, a frame of" in refused(shell, folder / "run", "--start", "10", "--end", "5")
    assert "end: found 180, expected 0 to 179" in refused(shell, folder / "run", "--end", "180")


def test_groups_and_names_can_be_mixed(folder):
    assert list(evaluate_run(folder / "run", joints=["neck", "upper", "left_hand"])["errors"]["joints"])[:3] == \
        ["neck", "left_shoulder", "left_elbow"]


@pytest.mark.parametrize("ending", ["trc", "c3d"])
def test_other_formats_names_and_rates_give_the_same(folder, tmp_path, ending):
    truth = person(6, 100).select(NAMES[:15])
    if ending == "trc":
        names = {name: name[0].upper() + name.split("_")[1].capitalize() for name in truth.names if "_" in name}
        write_joints(tmp_path / "t.trc", moved(truth, names=[names.get(name, name) for name in truth.names]))
    else:
        short = {"shoulder": "CLO", "elbow": "HUO", "wrist": "RAO", "hip": "FEP", "knee": "FEO", "ankle": "TIO"}
        names = [{"pelvis": "PELO", "neck": "TRXO", "head": "HEDO"}.get(name) or name[0].upper() + short[name.split("_")[1]]
                 for name in truth.names]
        (tmp_path / "t.c3d").write_bytes(c3d(names, 1000 * truth.positions, rate=100.0))
    found, expected = evaluate_run(folder / "run", tmp_path / f"t.{ending}"), evaluate_run(folder / "run")
    assert found["errors"]["frames"] == expected["errors"]["frames"] == 180
    assert found["errors"]["lost"] == 0
    assert found["errors"]["mean_mm"] == pytest.approx(expected["errors"]["mean_mm"], abs=0.2)
    assert found["axes_mm"]["x"]["rmse"] == pytest.approx(expected["axes_mm"]["x"]["rmse"], abs=0.2)


def test_a_skeleton_of_another_program_is_a_truth(tmp_path):
    (tmp_path / "truth.bvh").write_text(biovision.person(8), "utf-8")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ShadowPuppetWarning)  # its unit and which axis is up
        table = read_motion(tmp_path / "truth.bvh")
        write_run(tmp_path / "run", moved(table, [0.03, 0, 0.04]))
        measured = evaluate_run(tmp_path / "run", tmp_path / "truth.bvh")
    assert (measured["errors"]["frames"], measured["errors"]["lost"]) == (8, 0)
    assert measured["errors"]["mean_mm"] == pytest.approx(50, abs=0.01)


def test_names_that_are_missing_are_reported_as_the_file_has_them(shell, folder, tmp_path):
    write_joints(tmp_path / "t.trc", moved(TRUTH.select(("left_knee", "right_knee")), names=("LKnee", "Strange")))
    said = refused(shell, folder / "run", "t.trc", "--joints", "left_knee,right_knee")
    assert "found 'right_knee', which the truth lacks" in said
    assert "t.trc calls them LKnee, Strange" in said
    (tmp_path / "bad.trc").write_text("no\n")
    assert "bad.trc: found no TRC header" in refused(shell, folder / "run", "bad.trc")
    (tmp_path / "bad.csv").write_text("time,left_knee_x\n0,1\n")
    assert "bad.csv: no column 'left_knee_y'" in refused(shell, folder / "run", "bad.csv")
    (tmp_path / "bad.c3d").write_bytes(b"\2\x50")
    assert "bad.c3d: found no C3D header" in refused(shell, folder / "run", "bad.c3d")
    assert "none.bvh: cannot be read" in refused(shell, folder / "run", "none.bvh")


# Clocks


def test_a_run_that_begins_elsewhere_is_said_to_and_found(shell, folder, tmp_path):
    late = moved(TRUTH, times=TRUTH.times + 100.25)
    write_joints(tmp_path / "late.csv", late)
    said = refused(shell, folder / "run", "late.csv")
    assert "found times from 100.25 to 106.22 s, but the run has 0.00 to 5.97 s: give --sync or --offset" in said
    given = json.loads(shell(folder / "run", "late.csv", "--offset", "-100.25", "--json")[1])
    found = json.loads(shell(folder / "run", "late.csv", "--sync", "--json")[1])
    assert found["clock"]["offset_s"] == pytest.approx(-100.25, abs=0.01)
    assert found["clock"]["speed_error_m_s"] < 0.2
    assert found["clock"]["speed_error_before_m_s"] is None
    assert found["errors"]["p50_mm"] == pytest.approx(given["errors"]["p50_mm"], abs=2)
    assert given["errors"]["mean_mm"] == pytest.approx(evaluate_run(folder / "run")["errors"]["mean_mm"], abs=0.01)
    assert "found and added to the truth's times" in " ".join(shell(folder / "run", "late.csv", "--sync")[1].split())
    assert "expected one of them" in refused(shell, folder / "run", "late.csv", "--sync", "--offset", "3")
    assert "expected seconds" in refused(shell, folder / "run", "late.csv", "--offset", "nan")


def test_frames_beyond_the_run_are_lost_not_invented(tmp_path):
    write_joints(tmp_path / "truth.csv", TRUTH)
    part = JointTable(TRUTH.times[:90], TRUTH.names, TRUTH.positions[:90])
    write_run(tmp_path / "run", part, truth=tmp_path / "truth.csv")
    errors = evaluate_run(tmp_path / "run")["errors"]
    assert (errors["frames"], errors["lost"], errors["max_mm"]) == (180, 90, 500)
    assert errors["mean_mm"] == pytest.approx(250, abs=0.01)


# Worlds


def test_another_world_is_said_not_scored_in_silence(shell, folder, tmp_path):
    R = rotation_from_vector([0.1, 0, 1.0])
    write_joints(tmp_path / "far.csv", JointTable(TRUTH.times, TRUTH.names, TRUTH.positions @ R.T + [3, 1, 0]))
    code, out, err = shell(folder / "run", "far.csv", "--json")
    assert (code, err.startswith("warning: the run's joints are ")) == (0, True)
    assert "are they in two worlds, or is the distance wrong? --align compares after that" in err
    measured = json.loads(out)
    assert measured["world"]["apart"]
    assert measured["world"]["rotation_deg"] == pytest.approx(57.6, abs=1)
    assert measured["errors"]["mean_mm"] > 2000
    code, out, err = shell(folder / "run", "far.csv", "--align", "--json")
    assert (code, err) == (0, "")
    moved_there, plain = json.loads(out), evaluate_run(folder / "run")
    assert moved_there["world"]["moved"]
    assert moved_there["errors"]["mean_mm"] == pytest.approx(plain["aligned_mm"]["whole"], abs=0.02)


def test_an_axis_that_points_up_in_the_truth_alone_is_named(shell, folder, tmp_path):
    turned = TRUTH.positions[..., [0, 2, 1]] * [1, 1, -1]
    write_joints(tmp_path / "y up.csv", JointTable(TRUTH.times, TRUTH.names, turned))
    _, _, err = shell(folder / "run", "y up.csv", "--json")
    assert "+Y points up in y up.csv: `shadowpuppet convert 'y up.csv' truth.csv` turns it" in err


@pytest.mark.parametrize(("scale", "match"), [(1000, "are these mm? divide them by 1000"), (100, "are these cm? divide them by 100"),
                                              (0.01, "as large as the run's, expected metres")])  # fmt: skip
def test_a_truth_in_another_unit_is_refused(shell, folder, tmp_path, scale, match):
    write_joints(tmp_path / "far.csv", JointTable(TRUTH.times, TRUTH.names, scale * TRUTH.positions))
    code, out, err = shell(folder / "run", "far.csv", "--json")
    assert (code, out) == (2, "")
    assert "far.csv: found a person" in err
    assert match in err


def test_a_run_in_the_truth_s_world_is_not_warned_of(folder):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("shadowpuppet.evaluation.evaluation.warn", lambda *_, **__: pytest.fail("warned"))
        assert not evaluate_run(folder / "run")["world"]["apart"]


# Intervals


@pytest.mark.parametrize(("sd", "words"), [(0.01, "right"), (0.003, "too narrow"), (0.05, "too wide")])
def test_stated_intervals_are_checked(shell, tmp_path, sd, words):
    write_joints(tmp_path / "truth.csv", TRUTH)
    write_run(tmp_path / "run", noisy(size=0.01), truth=tmp_path / "truth.csv", sd=sd)
    measured = json.loads(shell("run", "--json")[1])["coverage"]
    assert measured["rms_z"] == pytest.approx(0.01 / sd, rel=0.03)
    assert f"of the stated deviations (rms): {words}" in " ".join(shell("run")[1].split())


# Runs that are not whole


def test_a_run_without_frames_is_said(tmp_path):
    write_joints(tmp_path / "truth.csv", TRUTH)
    empty = JointTable(np.zeros(0), TRUTH.names, np.zeros((0, len(TRUTH.names), 3)))
    write_run(tmp_path / "run", empty, truth=tmp_path / "truth.csv")
    with pytest.raises(ShadowPuppetError, match="the run has no frames, so there is nothing to compare"):
        measure_run(tmp_path / "run")
    assert measure_run(write_run(tmp_path / "alone", empty)).measured["losses"] == {"frames": 0, "share": 0.0, "gaps": 0}


def test_a_run_that_lost_everything_is_measured(tmp_path):
    write_joints(tmp_path / "truth.csv", TRUTH)
    nothing = replace(TRUTH, positions=np.full_like(TRUTH.positions, np.nan))
    write_run(tmp_path / "run", nothing, truth=tmp_path / "truth.csv")
    measured = evaluate_run(tmp_path / "run")
    assert measured["errors"]["mean_mm"] == 500
    assert measured["losses"]["longest_frames"] == 180
    assert (measured["world"], measured["axes_mm"], measured["acceleration"], measured["bone_errors"]) == ({}, {}, {}, {})
    with pytest.raises(ShadowPuppetError, match="align: found fewer than three joints known"):
        measure_run(tmp_path / "run", how=Comparison(align=True))


def test_a_killed_run_is_measured(tmp_path, folder):
    import shutil

    killed = shutil.copytree(folder / "run", tmp_path / "run")
    (killed / "motion.npz").unlink()
    (killed / "metrics.json").unlink()
    text = (killed / "run.toml").read_text()
    (killed / "run.toml").write_text(text.replace("complete = true", "complete = false"))
    lines = (killed / "joints.csv").read_text().splitlines(keepends=True)
    (killed / "joints.csv").write_text("".join(lines[:100]) + lines[100][:40])
    match = "broken off after 99 frames, which are measured as tracked, not smoothed; `shadowpuppet track .+ --resume`, with the flags"
    with pytest.warns(ShadowPuppetWarning, match=match):
        measured = evaluate_run(killed)
    assert (measured["complete"], measured["frames"], measured["errors"]["frames"], measured["errors"]["lost"]) == (False, 99, 99, 0)


def test_a_truth_that_is_gone_is_said(tmp_path):
    write_run(tmp_path / "run", noisy(), truth=tmp_path / "gone.csv")
    with pytest.warns(ShadowPuppetWarning, match=r"gone\.csv: the recording's truth is not there any more; give it as TRUTH"):
        assert evaluate_run(tmp_path / "run")["truth"] is None
