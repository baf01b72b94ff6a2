"""Tables of calibrations, fits and live sessions, and the page about a calibration session, for made figures."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.body.models import average_sizes
from shadowpuppet.calibration.boards.detection import View
from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli.calibration.calibrate import result_table
from shadowpuppet.cli.calibration.check import check_table, fix_table
from shadowpuppet.cli.tables import pairs, show
from shadowpuppet.cli.track import BARS, _fit_tables, _live_rows, _rig_fit_rows, _sizes_table, sparkline
from shadowpuppet.evaluation.report.calibration_page import ARROW_SCALE, MAP_WIDTH, PICTURE_WIDTH, calibration_page
from shadowpuppet.geometry import rigid


@pytest.fixture
def printed(capsys, monkeypatch):
    monkeypatch.setenv("COLUMNS", "300")

    def lines(*parts) -> list[str]:
        show(*parts)
        return [" ".join(line.split()) for line in capsys.readouterr().out.splitlines() if line.strip()]

    return lines


# A calibration session ------------------------------------------------------------------------------------------------


def camera(name: str, place) -> Camera:
    R = np.array([[0.0, -1, 0], [0, 0, -1], [1, 0, 0]])  # looks along the world's x
    return Camera(name, (1000, 500), [[930.26, 0, 500], [0, 931, 250], [0, 0, 1]], T_camera_world=rigid(R, -R @ np.array(place, float)))


CAMERAS = (camera("a", (-2, 1, 1.5)), camera("b", (-2, -1, -0.001)))
ERRORS, CORNERS = np.array([[0.3, 0.4], [0.0, 0.1]]), np.array([[100.0, 50.0], [900.0, 400.0]])
FIT = SimpleNamespace(camera=CAMERAS[0], model="pinhole", views=24, rms=0.314, held_out=0.345, focal_sd=0.0012, coverage=0.667, tilt=34.6,
                      distances=2.25, residuals=ERRORS, corners=CORNERS)  # fmt: skip
VIEW = View(0.0, np.arange(2), np.zeros((2, 2)), 1.0)


def session(placed: bool = True, advice=(), notes=()):
    boards = np.eye(4)[None].repeat(2, 0)
    boards[1, 0, 3] = 2.0
    solved = SimpleNamespace(residuals=ERRORS, place_sd=(0.0012, 0.002), angle_sd=np.radians((0.01, 0.02)),
                             bundle=SimpleNamespace(delays=(0.0, 0.0123), boards=boards))  # fmt: skip
    pair = SimpleNamespace(first=0, second=1, seen=8, agreed=5, good=True)
    bad = SimpleNamespace(first=1, second=0, seen=9, agreed=1, good=False)
    placement = SimpleNamespace(solved=solved, views=[(0, 0, VIEW)], pairs=[pair, bad]) if placed else None
    return SimpleNamespace(session=SimpleNamespace(folder=Path("/x/lab"), board=SimpleNamespace(text="ChArUco 7x5")), cameras=CAMERAS,
                           lenses=(FIT, None), placement=placement, advice=advice, notes=notes)  # fmt: skip


def test_a_row_a_camera(printed):
    assert printed(result_table(session(notes=("one", "two")))) == [
        "board ChArUco 7x5", "camera lens views error unseen views focal length at, m known to",
        "a pinhole 24 0.31 px 0.34 px 930.3 ± 0.1 % -2.00 1.00 1.50 3.6 mm", "b given 930.3 -2.00 -1.00 0.00 6.0 mm", "notes one", "two",
    ]  # fmt: skip
    assert printed(result_table(session(placed=False)))[2:] == ["a pinhole 24 0.31 px 0.34 px 930.3 ± 0.1 % not known",
                                                                "b given 930.3 not known"]


def test_nothing_is_cut_off_in_a_file(printed, monkeypatch):
    wide = printed(result_table(session()))
    monkeypatch.setenv("COLUMNS", "40")
    assert printed(result_table(session())) == wide


def cells(html: str) -> list[list[str]]:
    return [re.findall(r"<t[hd]>(.*?)</t[hd]>", row) for row in re.findall(r"<tr>(.*?)</tr>", html)]


def test_the_page_of_a_session():
    page = calibration_page(session(advice=("film <again>",), notes=("a note",)))
    assert "<h1>lab: calibration</h1>" in page
    assert "<li>film &lt;again&gt;</li>" in page
    assert "<h3>Notes</h3><ul><li>a note</li></ul>" in page
    head, lens, places, *rest = cells(page)
    assert dict(zip(head, lens)) == {
        "camera": "a", "pixels": "1000 x 500", "model": "pinhole", "views": "24", "error, px": "0.31", "95 %, px": "0.48",
        "unseen views, px": "0.34", "focal lengths, px": "930.3, 931.0", "known to": "0.12 %", "coverage": "67 %", "tilt": "35°",
        "distances": "1 : 2.2"}  # fmt: skip
    assert [dict(zip(places, row)) for row in rest[:2]] == [
        {"camera": "a", "at, m": "-2.000 1.000 1.500", "known to, mm": "3.6", "known to, °": "0.03", "error, px": "0.36",
         "median, px": "0.30", "95 %, px": "0.48", "film late, ms": "0.0"},
        {"camera": "b", "at, m": "-2.000 -1.000 -0.001", "known to, mm": "6.0", "known to, °": "0.06", "error, px": "", "median, px": "",
         "95 %, px": "", "film late, ms": "12.3"}]  # fmt: skip
    assert rest[2:] == [["cameras", "together", "agree", ""], ["a, b", "8", "5", ""], ["b, a", "9", "1", "not used"]]
    plain = calibration_page(session(placed=False))
    assert "<p>Nothing.</p>" in plain
    assert "Notes" not in plain
    assert "Places" not in plain


def test_its_drawings():
    picture, above = re.findall(r"<svg.*?</svg>", calibration_page(session()), re.DOTALL)
    k = PICTURE_WIDTH / 1000
    assert f'viewBox="0 0 {PICTURE_WIDTH} {k * 500:.0f}"' in picture
    assert [tuple(map(float, found)) for found in re.findall(r'cx="([\d.]+)" cy="([\d.]+)"', picture)] == [
        (round(k * 100, 1), round(k * 50, 1)), (round(k * 900, 1), round(k * 400, 1))]
    strokes = re.findall(r"M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)", picture)
    np.testing.assert_allclose(np.array(strokes, float), k * np.column_stack([CORNERS, CORNERS + ARROW_SCALE * ERRORS]), atol=0.05)
    # from x = -2 to 2 and y = -1 to 1, with 0.8 m around: 5.6 m wide, 3.6 m high; y is up
    k = MAP_WIDTH / 5.6
    assert f'viewBox="0 0 {MAP_WIDTH} {k * 3.6:.0f}"' in above
    at = np.array(re.findall(r'cx="([\d.]+)" cy="([\d.]+)"', above), float) / k
    np.testing.assert_allclose(at, [[2.8, 1.8], [4.8, 1.8], [0.8, 0.8], [0.8, 2.8]], atol=0.002)  # two boards, two cameras
    lines = np.array(re.findall(r'M([\d.]+) ([\d.]+)L([\d.]+) ([\d.]+)" stroke="#0072b2"', above), float) / k
    np.testing.assert_allclose(lines, [[0.8, 0.8, 1.3, 0.8], [0.8, 2.8, 1.3, 2.8]], atol=0.002)  # half a metre along x
    (origin,) = re.findall(r"M([\d.]+) ([\d.]+)h10M([\d.]+) ([\d.]+)v10", above)
    np.testing.assert_allclose(np.array(origin, float), [k * 2.8 - 5, k * 1.8, k * 2.8, k * 1.8 - 5], atol=0.06)


# A check --------------------------------------------------------------------------------------------------------------


def check(**changes):
    agreement = SimpleNamespace(names=("a", "b", "c"), apart=(1.04, None, 9.0), wrong=("c",), limit=12.8, height=1.756,
                                pairs=((None, 1.0, 1.0), (1.0, None, None), (1.0, 1.0, None)))  # fmt: skip
    lateness = SimpleNamespace(frames=(-0.04, None, 2.25), spread=(0.1, None, 0.34))
    plain = {"recording": "lab", "sets": 240, "rate": 25.0, "frame_rate": 50.0, "agreement": agreement, "by_clock": False, "still": False,
             "clock": None, "lateness": lateness, "good": False, "doubts": ("this", "that"), "turns": {}, "late": ("c",)}  # fmt: skip
    return SimpleNamespace(**(plain | changes))


def test_how_far_cameras_disagree(printed):
    assert printed(check_table(check())) == [
        "recording lab", "compared 240 sets of silhouettes, 25 a second, of 50 frames/s",
        "limit 12.8 px; cameras that fit are apart by about one",
        "seen silhouettes span 1.76 m, raised hands, hair and shoes included", "camera disagrees by with late by 90 % within",
        "a 1.0 px 2 others 0.0 frames ± 0.1", "b unknown 1 others cannot tell", "c 9.0 px 2 others 2.2 frames ± 0.3 wrong: place and time",
        "verdict this", "that",
    ]  # fmt: skip
    heard = SimpleNamespace(by="sound", names=("a", "b", "c"), seconds=(0.0, -0.041, None))
    found = printed(check_table(check(by_clock=True, clock=heard, good=True, late=(), turns={"a": 1}, lateness=None)))
    assert found[4:6] == ["time by the films' sound", "sound late by a +0.0, b -2.1 frames"]
    assert found[7] == "a 1.0 px 2 others cannot tell wrong: place"
    assert found[-1] == "verdict all cameras agree"
    silent = SimpleNamespace(by="sound", names=("a",), seconds=(None,))
    found = printed(check_table(check(still=True, clock=silent)))
    assert found[4:6] == ["time cannot tell: nobody moves enough", "sound the films share no sound that stands out"]


def test_what_was_mended(printed):
    fix = SimpleNamespace(done=("wrote this", "and that"), pixels=[("a", 9.04, 1.0), ("b", None, None)])
    assert printed(fix_table(fix)) == ["fix wrote this", "and that", "camera before after", "a 9.0 px 1.0 px", "b unknown unknown"]
    assert printed(fix_table(SimpleNamespace(done=(), pixels=[]))) == ["fix nothing is certain enough to be changed"]


# Fits and live sessions -----------------------------------------------------------------------------------------------


def test_sizes_stand_in_two_columns(printed):
    upper, whole = (average_sizes(name, 1.75) for name in ("cardbox", "cylinders"))
    lines = printed(_sizes_table(upper))
    assert lines[:3] == ["sizes, mm", "size mm size mm", f"a1 head_width {1000 * upper.head_width:.0f} a10 torso_top_depth "
                                                         f"{1000 * upper.torso_top_depth:.0f}"]
    assert len(lines) == 2 + 9
    names = whole.names()
    lines = printed(_sizes_table(whole))
    half = (len(names) + 1) // 2
    assert lines[2].startswith(f"{names[0]} {1000 * getattr(whole, names[0]):.0f} {names[half]} ")
    assert len(lines) == 2 + half
    assert lines[-1].split()[0] == names[half - 1]


def test_how_well_sizes_fit(printed):
    guess = SimpleNamespace(height=1.756)
    fit = SimpleNamespace(curves={"O1": [[100.0, 50.0, 10.4], [90.0, 10.0]]}, overlaps={"front": 0.912, "side": 0.8}, guess=guess)
    found = SimpleNamespace(fit=fit, summary={"start_overlap": 0.876}, person=SimpleNamespace(source="references"))
    tables, rows = _fit_tables(found)
    assert printed(*tables) == ["cost by round, pixels", "sizes search rounds first last curve",
                                f"O1 1 3 100 10 {BARS[-1]}{BARS[3]}{BARS[0]}",
                                f"2 2 90 10 {BARS[-1]}{BARS[0]}"]
    assert rows == [("overlap", "front 0.91, side 0.80; film 0.88"), ("height", "1.76 m"), ("source", "references")]
    summary = {"overlap": 0.912, "frames": 24, "residual": 0.0123, "source": "hulls"}
    assert _rig_fit_rows(summary) == [("overlap", "0.91 of body and silhouettes, in 24 frames"),
                                      ("surface", "12.3 mm (rms) from the points of the hulls"), ("source", "hulls")]
    assert _rig_fit_rows(summary | {"residual": float("inf")})[1] == ("surface", None)


def test_a_curve_in_characters():
    assert sparkline(np.arange(len(BARS))) == BARS
    assert sparkline([3.0, 3.0]) == 2 * BARS[0]
    assert len(sparkline(np.arange(100))) == 30
    assert sparkline(np.arange(100))[::29] == BARS[0] + BARS[-1]


def test_how_a_live_session_went(printed):
    live = {"latency_ms": {"median": 41.6, "p95": 80.4}, "latency_frames": {"median": 1.234, "p95": 2.0}, "frames_per_s": 24.96,
            "interval_ms": 40.0, "dropped": 3, "breaks": 0}  # fmt: skip
    assert printed(pairs(_live_rows(live))) == [
        "latency 42 ms from capture to pose (1.23 of a frame's time); p95 80 ms (2.00)",
        "speed 25.0 frames/s of 25.0; 3 dropped"]
    more = printed(pairs(_live_rows(live | {"breaks": 2, "smoothed_latency_ms": {"median": 150.2}})))
    assert more[1] == "smoothed 150 ms from capture, for the display and other programs"
    assert more[3] == "breaks 2 times no pictures came"
    slow = printed(pairs(_live_rows(live | {"frames_per_s": 5.0})))
    assert "too slow only one picture in 5 is tracked: use a lower --rate" in " ".join(slow)
