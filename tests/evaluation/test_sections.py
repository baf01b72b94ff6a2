"""Words and tables of a report, for made figures: values, units, signs and decimals."""

from __future__ import annotations

import re
from types import SimpleNamespace

import pytest

from shadowpuppet.evaluation.report import sections
from shadowpuppet.evaluation.report.html import rows
from shadowpuppet.evaluation.summary_text import (
    bones_text,
    clock_text,
    coverage_text,
    exchanges_text,
    feet_text,
    losses_text,
    overlap_sense,
    root_text,
    world_text,
)

ERROR = {"mean_mm": 12.34, "rmse_mm": 15.55, "p50_mm": 10.0, "p90_mm": 20.5, "p95_mm": 25.25, "max_mm": 99.9,
         "plane_mm": 4.56, "depth_mm": 9.12, "far": 0.0123}
MEASURED = {
    "complete": False, "truth": "truth.csv",
    "errors": ERROR | {"frames": 60, "lost": 7, "joints": {"left_wrist": ERROR, "head": ERROR}},
    "aligned_mm": {"none": 12.34, "whole": 11.0, "frame_offset": 10.0, "root": 9.5, "rigid": 8.25, "root_joint": "left_hip and right_hip"},
    "axes_mm": {axis: {"mean": n - 1.5, "sd": 2.25, "rmse": 3.5} for n, axis in enumerate("xyz")},
    "acceleration": {"run_m_s2": 5.25, "truth_m_s2": 3.75, "difference_m_s2": 4.5},
    "overlap": {"count": 60, "mean": 0.9123, "p5": 0.8456},
    "losses": {"frames": 7, "share": 0.1167, "gaps": 2, "longest_frames": 5, "longest_s": 0.333, "longest_from_s": 1.267},
    "world": {"moved": False, "apart": True, "mean_mm": 512.4, "aligned_mm": 30.6, "rotation_deg": 90.04, "moved_mm": [300.0, 400.0, 0.0]},
    "clock": {"run_hz": 25.0, "truth_hz": 59.94, "frames_compared": 60, "offset_s": -0.4, "rival_s": 1.2},
    "bone_errors": {"left_hip-left_knee": {"run_mm": 412.34, "truth_mm": 402.3, "longer_mm": 10.04, "run_sd_mm": 0.005, "truth_sd_mm": 0.5},
                    "neck-head": {"run_mm": 100.0, "truth_mm": 120.0, "longer_mm": -20.0, "run_sd_mm": 0.25, "truth_sd_mm": 0.125}},
    "bends_deg": {"left_knee": {"bias": -3.14, "mean": 4.0, "rmse": 5.55, "aligned": 4.56}},
    "angles_deg": {"left_hip": 4.44, "all": 5.55}, "angles_aligned_deg": {"left_hip": 3.33, "all": 2.22},
    "dofs_deg": {"left_knee_flexion": {"bias": 1.0, "mean": 2.0, "rmse": 3.0, "aligned": 2.5}},
    "status": {"tracked": 50, "lost": 7, "absent": 3}, "frames": 60, "limb_status": None, "feet": {},
}  # fmt: skip


def evaluation(**changes):
    verdict = {"verdict": {"word": "good", "reasons": []}}
    info = {"recording": "lab", "method": "two cameras", "versions": {"numpy": "2.2"}}
    run = SimpleNamespace(metrics=verdict, info=info, settings={"seed": 4}, motion=SimpleNamespace(body_name="anatomical"))
    return SimpleNamespace(measured=MEASURED | changes, errors=SimpleNamespace(names=("left_wrist", "head")), run=run)


def cells(html: str) -> list[list[str]]:
    """The rows of all tables."""
    found = re.findall(r"<tr[^>]*>(.*?)</tr>", html)
    return [re.findall(r"<t[hd]>(.*?)</t[hd]>", row) for row in found]


def test_cards():
    assert list(sections._cards(evaluation())) == [
        ("The run's own verdict", "good", "", "nothing speaks against it"),
        ("Joint error", "12.3", "mm", "mean of 2 joints; rmse 15.6"),
        ("Posture alone", "8.2", "mm", "each frame moved and turned onto the truth"),
        ("Depth", "9.1", "mm", "along the camera's axis; 4.6 across it"),
        ("Far off", "1.2", "%", "of joints are over 300 mm off; worst 100 mm"),
        ("Acceleration", "5.2", "m/s²", "the truth's 3.8: more is jitter"),
        ("Overlap", "0.912", "", "with the silhouettes; p5 0.846"),
        ("Without a pose", "7", "frames", "11.7 %, the longest 0.33 s"),
    ]
    little = evaluation(acceleration={}, overlap={"count": 0}, losses={"frames": 0, "share": 0.0, "longest_s": 0.0},
                        errors={key: value for key, value in MEASURED["errors"].items() if key not in ("depth_mm", "plane_mm")})
    assert [name for name, *_ in sections._cards(little)] == ["The run's own verdict", "Joint error", "Posture alone", "Far off",
                                                            "Without a pose"]
    assert [*sections._cards(little)][-1][1:] == ("0", "frames", "none was lost")
    assert '<b>8.2 <small>mm</small></b>' in sections.cards(evaluation())


def test_notes():
    found = list(sections._notes(evaluation(), "no pictures: gone"))
    assert found == [
        (True, "The run did not come to its end: what it had by then is measured."),
        (True, "The run's joints are 512 mm from the truth's, but 31 mm once the run is moved and turned as a whole: are they in two "
               "worlds, or is the distance wrong? (--align)"),
        (True, "7 of 60 frames of the truth have no pose of the run; each joint counts 500 mm there."),
        (False, "Clock: run 25, truth 59.94 frames/s, compared at 60 times; -0.400 s added to the truth's times."),
        (True, "An offset of 1.200 s fits nearly as well: the motion repeats itself."),
        (False, "No pictures: gone."),
    ]
    html = sections.notes(evaluation(), "no pictures: gone")
    assert [bool(fine) for fine in re.findall(r"<li( class=fine)?>", html)] == [not grave for grave, _ in found]
    fine = {"complete": True, "clock": MEASURED["clock"] | {"offset_s": 0.0, "rival_s": None}, "errors": MEASURED["errors"] | {"lost": 0}}
    said = "As a whole the run is turned by 90.0 degrees and 500 mm off; all errors are stated after that."
    assert list(sections._notes(evaluation(**fine, world=MEASURED["world"] | {"moved": True}), "")) == [(False, said)]
    assert sections.notes(evaluation(**fine, world={}), "") == ""


def test_tables():
    of = evaluation()
    assert cells(sections.joint_table(of)) == [
        ["mm", "mean", "rmse", "median", "90 %", "95 %", "max", "plane", "depth", "over 300"],
        *([name, "12.3", "15.6", "10.0", "20.5", "25.2", "99.9", "4.6", "9.1", "1.2 %"] for name in ("left wrist", "head", "all")),
    ]  # fmt: skip
    assert cells(sections.alignments_table(of)) == [
        ["", "mean, mm"], ["as they stand", "12.3"], ["the whole run moved and turned once", "11.0"], ["each frame moved", "10.0"],
        ["from the middle of both hips", "9.5"], ["each frame moved and turned", "8.2"],
    ]  # fmt: skip
    assert cells(sections.axes_table(of))[1:] == [["x", "-1.5", "2.2", "3.5"], ["y", "-0.5", "2.2", "3.5"], ["z", "+0.5", "2.2", "3.5"]]
    assert "No joint is known" in sections.axes_table(evaluation(axes_mm={}))
    body = sections.body_tables(of)
    assert cells(body) == [
        ["", "run", "truth", "longer", "run&#x27;s sd", "truth&#x27;s sd"],
        ["left hip to left knee", "412.3", "402.3", "+10.0", "0.01", "0.50"], ["neck to head", "100.0", "120.0", "-20.0", "0.25", "0.12"],
        ["", "run less truth", "mean size", "rmse", "without the mean"], ["left knee", "-3.1", "4.0", "5.5", "4.6"],
        ["", "rmse", "frames aligned"], ["left hip", "4.4", "3.3"], ["all", "5.5", "2.2"],
        ["", "run less truth", "mean size", "rmse", "without the mean"],
        ["left knee flexion", "+1.0", "2.0", "3.0", "2.5"],
    ]  # fmt: skip
    assert re.findall(r"<tr class=sum><td>(.*?)</td>", body) == ["all"]
    assert rows([("a",), ("b",), ("c",)], sums=1) == "<tr><td>a</td></tr><tr><td>b</td></tr><tr class=sum><td>c</td></tr>"


def test_facts():
    said = dict(re.findall(r"<dt>(.*?)</dt><dd>(.*?)</dd>", sections.run_facts(evaluation())))
    assert said == {
        "Recording": "lab", "Truth": "truth.csv", "Method": "two cameras", "Body": "anatomical", "Preset and seed": "default, 4",
        "Frames": "50 tracked, 7 lost, 3 absent", "No pose": "7 frames (11.7 %) in 2 gaps; the longest 5 frames, 0.33 s, from 1.27 s",
        "Clock": "run 25, truth 59.94 frames/s, compared at 60 times; -0.400 s added to the truth&#x27;s times",
        "World": "as a whole the run is turned by 90.0 degrees and 500 mm off", "Made with": "numpy 2.2",
    }  # fmt: skip
    assert "joints compared: left wrist, head." in sections.run_facts(evaluation())


# Sentences ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("rms", "verdict"), [(1.11, "too narrow"), (1.1, "right"), (0.9, "right"), (0.89, "too wide")])
def test_coverage(rms, verdict):
    shares = {"within_50": 0.4, "within_90": 0.876, "within_95": 0.97}
    said = coverage_text(shares | {"within_68": 0.66, "within_80": 0.8, "within_99": 0.99, "rms_z": rms})
    assert said.endswith(f"errors are {rms:.2f} of the stated deviations (rms): {verdict}")
    assert "88 % within those of 90 %" in said
    assert coverage_text(None).startswith("none stated")


def test_words():
    assert [overlap_sense(share) for share in (0.85, 0.849, 0.7, 0.699)] == ["good", "fair", "fair", "poor"]
    assert root_text({"root_joint": "pelvis"}) == "pelvis"
    assert losses_text({"frames": 0}) is None
    assert world_text(MEASURED["world"]).endswith("500 mm off")
    found = MEASURED["clock"] | {"speed_error_m_s": 0.123, "speed_error_before_m_s": 0.5}
    rates = "run 25, truth 59.94 frames/s, compared at 60 times"
    assert clock_text(found) == f"{rates}; -0.400 s found and added to the truth's times (speeds differ by 0.12 m/s, 0.50 before)"
    assert clock_text(found | {"speed_error_before_m_s": float("nan")}).endswith("differ by 0.12 m/s)")
    assert clock_text(MEASURED["clock"] | {"offset_s": 0.0}) == rates
    assert bones_text(MEASURED["bone_errors"]) == (
        "15.0 mm from the truth's in the mean, worst neck-head by -20.0; lengths change by 0.25 mm (sd) at most, the truth's by 0.50")
    assert exchanges_text(None) is None
    assert exchanges_text({"arms": {"frames": 0}, "legs": {"frames": 0}}) == "never"
    assert exchanges_text({"arms": {"frames": 3, "share": 0.05, "longest_s": 0.2}, "legs": {"frames": 0}}) == (
        "arms in 5 % of the frames, for 0.20 s at most; legs never")


def test_feet():
    stance = {"slide_mm_s": 20.4, "depth_mm": {"mean": 1.25}, "truth_slide_mm_s": 2.5, "precision": 0.9, "recall": 0.005}
    assert feet_text({}) is None
    assert feet_text({"slide_mm_s": float("nan"), "depth_mm": None, "floor_m": 0.0123}) == (
        "in stance they slide by unknown mm/s; floor at 0.012 m")
    beside = {"slide_mm_s": 30.0, "depth_mm": {"mean": 9.0}, "floor_m": 0.0}
    assert feet_text(beside) == "in stance they slide by 30 mm/s, 9.0 mm below the floor in the mean; floor at 0.000 m"
    assert feet_text(beside | {"true_stance": stance}) == (
        "in stance they slide by 20 mm/s (the truth's points 2), 1.2 mm below the floor in the mean; contacts found are right in 90 %, "
        "under 1 % of the true ones are found; floor at 0.000 m")
    assert "contacts" not in (feet_text(beside | {"true_stance": stance | {"recall": float("nan")}}) or "contacts")
