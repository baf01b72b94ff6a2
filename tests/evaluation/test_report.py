"""The page: whole, in one file, asking for nothing; with the frames that it says it shows."""

from __future__ import annotations

import base64
import re
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import cv2
import numpy as np
import pytest
import runs
from made import write_film
from measured import NAMES, TRUTH, moved, run_that_errs, write_run

from shadowpuppet.camera.camera import Camera
from shadowpuppet.cli import app as cli
from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.evaluation.evaluation import Comparison, measure_run
from shadowpuppet.evaluation.report import angle_charts, charts
from shadowpuppet.evaluation.report.charts import by_joint_and_time, fit_over_time
from shadowpuppet.evaluation.report.drawing import POINTS, binned
from shadowpuppet.evaluation.report.page import page, write_report
from shadowpuppet.evaluation.report.pictures import _side_by_side, draw_bones, pictures, report_frames
from shadowpuppet.geometry import rigid
from shadowpuppet.io.calibration.calibration_files import write_calibration
from shadowpuppet.io.motion.table import write_joints
from shadowpuppet.motion.motion import JointTable
from shadowpuppet.pipeline.overlay_video import grid_of

SIZE = (160, 120)
VOID = {"meta", "img", "br", "link", "input", "hr"}


def camera(name: str = "cam", turn: float = 0.0) -> Camera:
    """Three metres before the person, level; turned about them by so many radians."""
    c, s = np.cos(turn), np.sin(turn)
    R = np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]]) @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    return Camera(name, SIZE, [[140, 0, 79.5], [0, 140, 59.5], [0, 0, 1]], T_camera_world=rigid(R, [0, 0.95, 3.0]))


class Checked(HTMLParser):
    """Reads a page: elements that are not closed, what would be fetched, ids."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open, self.fetched, self.ids, self.tags = [], [], [], []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        self.tags.append(tag)
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            if name in ("src", "href", "xlink:href", "data", "action", "poster", "srcset") or "url(" in (value or ""):
                self.fetched.append(value)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def images(text: str) -> list[np.ndarray]:
    found = re.findall(r'src="data:image/jpeg;base64,([^"]+)"', text)
    return [cv2.imdecode(np.frombuffer(base64.b64decode(each), np.uint8), cv2.IMREAD_COLOR) for each in found]


@pytest.fixture
def quick(monkeypatch):
    """Pages without their plots, where those are not what is tested."""
    for name in ("over_time", "by_joint_and_time", "by_joint", "shares", "path_of", "jitter_by_joint", "fit_over_time", "coverage_chart"):
        monkeypatch.setattr(charts, name, lambda *_: "<svg></svg>")
    monkeypatch.setattr(angle_charts, "bland_altman", lambda *_: "<svg></svg>")


# The page as a whole


@pytest.fixture(scope="module")
def plain_page(tmp_path_factory):
    folder = tmp_path_factory.mktemp("page")
    return page(measure_run(run_that_errs(folder, sd=0.01)))


def test_a_page_is_whole_and_asks_for_nothing(plain_page):
    read = Checked(plain_page)
    assert read.open == []
    assert not [value for value in read.fetched if not re.match(r"(data:image/|#|url\(#|\(?clip-path: url\(#|.*url\(#)", value)]
    assert "script" not in read.tags
    assert "link" not in read.tags
    assert not re.search(r"@import|url\(['\"]?(?!#)", plain_page)
    assert "default-src 'none'" in plain_page


def test_what_a_plot_refers_to_is_there_and_its_own(plain_page):
    read = Checked(plain_page)
    wanted = {name for value in read.fetched for name in re.findall(r"#([\w-]+)", value)}
    assert wanted <= {*read.ids}
    of_other_plots = [name for name in read.ids if read.ids.count(name) > 1 and not re.search(r"-(figure|axes|patch|line2d)", name)]
    owners = {name.split("-")[0] for name in read.ids}
    assert {"time", "map", "joints", "shares", "path", "jitter", "fit", "coverage"} <= owners
    assert len({name for name in of_other_plots if name.split("-")[0] not in owners}) == 0


def test_figures_are_those_that_were_measured(tmp_path, quick):
    of = measure_run(run_that_errs(tmp_path))
    text = page(of)
    for value in (of.measured["errors"]["mean_mm"], of.measured["aligned_mm"]["rigid"],
                  of.measured["errors"]["joints"]["left_wrist"]["max_mm"], of.measured["axes_mm"]["x"]["rmse"]):
        assert f"{value:.1f}" in text
    for head in ("Error over time", "Joints", "Motion", "Body", "Silhouettes", "Stated uncertainty", "What the figures mean", "The run"):
        assert f"<h2>{head}</h2>" in text


@pytest.mark.parametrize(("body", "panels"), [("rounded", 7), ("anatomical", 19)])
def test_angles_of_both_sides_share_a_panel(tmp_path, body, panels):
    text = page(measure_run(runs.make_run(tmp_path / "run", body, lost=(3,), spread=True)))
    section = text.partition("<h2>Angles</h2>")[2].partition("<h2>")[0]
    assert len(set(re.findall(r'id="angles-axes_(\d+)"', section))) >= panels
    assert ">elbow flexion<" in section
    assert ">torso y<" not in section  # metres


def test_the_runs_own_verdict_comes_first(tmp_path):
    of = measure_run(run_that_errs(tmp_path))
    assert "The run's own verdict" not in page(of)
    of.run.metrics["verdict"] = {"word": "doubtful", "reasons": ["left arm <doubtful> in 80 % of frames"]}
    card = page(of).partition('<div class="card">')[2].partition("</div>")[0]
    assert "doubtful" in card
    assert "left arm &lt;doubtful&gt; in 80 % of frames" in card


def test_a_page_is_the_same_each_time(tmp_path, plain_page):
    again = page(measure_run(run_that_errs(tmp_path, sd=0.01)))
    folder = re.search(r"<dt>Truth</dt><dd>(.*)/truth.csv</dd>", plain_page)
    assert folder is not None
    assert again.replace(str(tmp_path), folder[1]).replace(f"<b>{tmp_path.name}/", f"<b>{Path(folder[1]).name}/") == plain_page


def test_names_in_files_are_text_never_markup(tmp_path, quick):
    run = run_that_errs(tmp_path, method="<script>alert(1)</script>", seed='"><img src=x onerror=y>')
    evil = tmp_path / "<b onload=x>.csv"
    write_joints(evil, TRUTH)
    text = page(measure_run(run, evil))
    assert Checked(text).open == []
    assert "<script" not in text
    assert "<b onload" not in text
    assert "&lt;script&gt;alert(1)&lt;/script&gt;" in text


def test_without_a_truth_there_is_a_page_too(tmp_path):
    text = page(measure_run(write_run(tmp_path / "run", TRUTH)))
    assert Checked(text).open == []
    assert "There is no truth to compare with" in text
    assert "Error over time" not in text
    assert "Silhouettes" in text


@pytest.mark.parametrize("kind", ["empty", "one", "lost", "two_joints", "other_world", "sync"])
def test_odd_runs_make_pages(tmp_path, kind):
    table, how, truth = moved(TRUTH, 0.01), Comparison(), TRUTH
    if kind == "empty":
        table = JointTable(np.zeros(0), NAMES, np.zeros((0, len(NAMES), 3)))
        text = page(measure_run(write_run(tmp_path / "run", table)))
        assert "The run has no frames" in text
        return
    if kind == "one":
        table, truth = (JointTable(t.times[:1], t.names, t.positions[:1]) for t in (table, truth))
    if kind == "lost":
        table.positions[:] = np.nan
    if kind == "two_joints":
        how = Comparison(joints=("left_knee", "right_knee"))
    if kind == "other_world":
        table, how = moved(table, [5, 0, 0]), Comparison(align=True)
    if kind == "sync":
        truth, how = moved(TRUTH, times=TRUTH.times + 0.4), Comparison(sync=True)
    write_joints(tmp_path / "truth.csv", truth)
    text = page(measure_run(write_run(tmp_path / "run", table), tmp_path / "truth.csv", how))
    assert Checked(text).open == []
    assert "nan mm" not in text
    assert "No pictures: the run has no overlay.mp4, and its recording, nowhere, is not there." in text
    if kind == "other_world":
        assert "all errors are stated after that" in text
    if kind == "sync":
        assert "-0.4" in text


# Frames


def test_the_worst_frames_are_chosen_and_usual_ones(tmp_path):
    chosen = report_frames(measure_run(run_that_errs(tmp_path)))
    worst = [each for each in chosen if not each.typical]
    assert {12, 40} <= {each.frame for each in worst}
    assert [each.letter for each in chosen] == list("ABCDEFGH")
    assert sum(each.typical for each in chosen) == 2
    assert np.diff([each.time for each in worst]).min() >= 4 / 12 - 1e-9
    at_12 = next(each for each in chosen if each.frame == 12)
    assert at_12.worst[0][0] == "left_wrist"
    assert at_12.worst[0][1] == pytest.approx(1000 * np.sqrt(3), rel=0.05)


def test_frames_without_a_pose_do_not_push_the_others_out(tmp_path):
    table = moved(TRUTH, 0.01)
    table.positions[10:50] = np.nan
    write_joints(tmp_path / "truth.csv", TRUTH)
    of = measure_run(write_run(tmp_path / "run", table, truth=tmp_path / "truth.csv"))
    worst = [each for each in report_frames(of) if not each.typical]
    assert sum(10 <= each.frame < 50 for each in worst) == 2
    assert len(worst) > 3
    assert grey_share(by_joint_and_time(of)) == pytest.approx(40 / 60, abs=0.03)


def grey_share(svg: str) -> float:
    """Which share of the map of errors is of the colour of what is lost."""
    found = re.search(r'href="data:image/png;base64,([^"]+)"', svg)
    assert found is not None
    image = cv2.imdecode(np.frombuffer(base64.b64decode(found[1]), np.uint8), cv2.IMREAD_COLOR)
    return float((np.abs(image.astype(int) - [0x78, 0x70, 0x6B]).max(2) < 6).mean())


def test_overlaps_are_drawn_up_to_one(tmp_path):
    numbers = re.findall(r">(\d\.\d+)<", fit_over_time(measure_run(run_that_errs(tmp_path))))
    assert max(map(float, numbers[: numbers.index("0.0")])) == 1.0  # from 0.0 on those of cost and time


def test_a_curve_of_many_frames_is_drawn_as_means_of_neighbours():
    times = np.arange(3.0 * POINTS)
    gaps = np.where(np.arange(len(times)) % 3 == 1, np.nan, times)
    gaps[:3] = np.nan
    middle, known = binned(times, [gaps])
    np.testing.assert_allclose(middle, 3 * np.arange(POINTS) + 1)
    np.testing.assert_allclose(known, [np.nan, *middle[1:]])


def test_frames_of_a_camera_s_overlay_are_shown_side_by_side_with_the_truth(tmp_path, quick):
    run = run_that_errs(tmp_path)
    write_calibration(run / "calibration.toml", [camera()])
    grey = [np.concatenate([np.full((3 * SIZE[1], SIZE[0], 3), 40 + 2 * n, np.uint8), np.full((70, SIZE[0], 3), 255, np.uint8)])
            for n in range(len(TRUTH.times))]  # fmt: skip
    write_film(run / "overlay.mp4", grey, 15, lossless=False)
    of = measure_run(run)
    text = page(of)
    assert Checked(text).open == []
    found = images(text)
    assert len(found) == 8
    assert "From overlay.mp4, with the truth" in text
    for each, image in zip(report_frames(of), found):
        tiles = np.array_split(image, 3, axis=1)
        assert image.shape[1] == pytest.approx(4 * image.shape[0], rel=0.02)
        assert np.median(tiles[0]) == pytest.approx(40 + 2 * each.frame, abs=4)  # the right frame
        assert tiles[0].max() < 200
        assert tiles[2].max() > 220  # the truth's bones


def test_of_several_cameras_overlay_the_person_is_cut_out(tmp_path):
    """Of seven tiles five are shown; in each the middle of the person is in the middle, and the truth's bones are there."""
    cameras = [camera(f"cam{n}", 0.8 * n) for n in range(7)]
    run = run_that_errs(tmp_path)
    write_calibration(run / "calibration.toml", cameras)
    grid = grid_of(cameras)
    size = grid.rows * (grid.header + grid.height) + 60, grid.columns * grid.width, 3  # with a strip of words
    grids = [np.full(size, 40 + 2 * n, np.uint8) for n in range(len(TRUTH.times))]
    write_film(run / "overlay.mp4", grids, 15)
    of = measure_run(run)
    shots, source = pictures(of, report_frames(of))
    assert (len(shots), source) == (8, "overlay.mp4")
    image = cv2.imdecode(np.frombuffer(shots["B"], np.uint8), cv2.IMREAD_COLOR)
    assert image.shape[1] == pytest.approx(5 * 0.75 * image.shape[0], rel=0.05)
    for tile in np.array_split(image, 5, axis=1):
        white = np.argwhere(tile[len(tile) // 10 :].min(2) > 200)
        assert len(white) > 50
        assert abs(white[:, 1].mean() / tile.shape[1] - 0.5) < 0.2


@pytest.mark.parametrize("side", [-1, 1])
def test_the_five_cameras_that_see_the_person_largest_are_shown(side):
    """Of two the picture is smaller, wherever in it the person is."""
    cameras, far = [], (1, 4)
    for n in range(7):
        focal, aside = (70, -side * 50) if n in far else (140, side * 50)
        cameras.append(replace(camera(f"cam{n}"), matrix=[[focal, 0, 79.5 + aside], [0, focal, 59.5], [0, 0, 1]]))
    image = _side_by_side([np.full((SIZE[1], SIZE[0], 3), 20 + 30 * n, np.uint8) for n in range(7)], cameras,
                          [JointTable(TRUTH.times[:1], TRUTH.names, TRUTH.positions[:1])])
    assert [np.median(tile) for tile in np.array_split(image, 5, axis=1)] == [20 + 30 * n for n in range(7) if n not in far]


def test_frames_of_several_cameras_are_drawn_from_the_recording(tmp_path):
    cameras = [camera("one"), camera("two", 1.2)]
    (tmp_path / "lab" / "video").mkdir(parents=True)
    write_calibration(tmp_path / "lab" / "calibration.toml", cameras)
    for name in ("one", "two"):
        frames = [np.full((SIZE[1], SIZE[0], 3), 40 + 2 * n, np.uint8) for n in range(len(TRUTH.times))]
        write_film(tmp_path / "lab" / "video" / f"{name}.mp4", frames, 15)
    run = run_that_errs(tmp_path, recording=str(tmp_path / "lab"), settings={"seed": 4, "max_size": 640})
    write_calibration(run / "calibration.toml", cameras)
    of = measure_run(run)
    shots, source = pictures(of, report_frames(of))
    assert (len(shots), source) == (8, "the recording")
    assert '<div class="shots wide">' in page(of)
    for each in report_frames(of):
        image = cv2.imdecode(np.frombuffer(shots[each.letter], np.uint8), cv2.IMREAD_COLOR)
        assert np.median(image) == pytest.approx(40 + 2 * each.frame, abs=5)
        assert image.max() > 220


def test_bones_are_drawn_where_the_camera_sees_them_at_any_size():
    for scale in (1, 3):
        image = np.zeros((scale * SIZE[1], scale * SIZE[0], 3), np.uint8)
        table = JointTable(TRUTH.times[:1], TRUTH.names, TRUTH.positions[:1])
        draw_bones(image, camera(), table)
        white = np.argwhere(image.min(2) > 200)[:, ::-1] / scale
        expected = camera().project(table.positions[0])
        assert np.abs(white.min(0) - expected.min(0)).max() < 3
        assert np.abs(white.max(0) - expected.max(0)).max() < 3


# As a user types it


def test_a_report_is_written_and_named(tmp_path, capsys, monkeypatch, quick):
    monkeypatch.chdir(tmp_path)
    run_that_errs(tmp_path)
    assert cli.run(["evaluate", "run", "--report", "page.html"]) == 0
    assert "report     page.html" in capsys.readouterr().out
    assert Checked((tmp_path / "page.html").read_text("utf-8")).open == []


def test_where_no_report_can_be_made_that_is_said(tmp_path, monkeypatch, quick):
    run_that_errs(tmp_path)
    of = measure_run(tmp_path / "run")
    with pytest.raises(ShadowPuppetError, match=r"page\.pdf: found the ending '\.pdf', expected \.html"):
        write_report(tmp_path / "page.pdf", of)
    with pytest.raises(ShadowPuppetError, match=r"page\.html: cannot be written \(there is no folder .*no\)"):
        write_report(tmp_path / "no" / "page.html", of)
    (tmp_path / "taken.html").mkdir()
    with pytest.raises(ShadowPuppetError, match=r"taken\.html: cannot be written"):
        write_report(tmp_path / "taken.html", of)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ShadowPuppetError, match=r"a report needs matplotlib: .*install 'shadowpuppet\[report\]'"):
        write_report(tmp_path / "page.html", of)


def test_measuring_needs_no_plots(tmp_path):
    import subprocess
    import sys

    run_that_errs(tmp_path)
    code = f"import sys\nfrom shadowpuppet.cli.app import run\nrun(['evaluate', {str(tmp_path / 'run')!r}, '--json'])\n" \
           "print('matplotlib' in sys.modules, 'cv2' in sys.modules, file=sys.stderr)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stderr == "False False\n"
