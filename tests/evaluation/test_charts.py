"""What the plots of a report show: the figures of the run, in the units that stand beside them."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
import runs
from measured import NAMES, TRUTH, moved, run_that_errs, write_run

from shadowpuppet.evaluation.error_metrics import aligned_distances, hinge_angles
from shadowpuppet.evaluation.evaluation import Evaluation, measure_run
from shadowpuppet.evaluation.report import angle_charts, charts
from shadowpuppet.evaluation.report.charts import STATUSES
from shadowpuppet.evaluation.report.drawing import BLUE, GREEN, PINK, span
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.io.motion.table import write_joints


@pytest.fixture
def drawn(monkeypatch):
    """The functions return their figures instead of SVG."""
    for each in (angle_charts, charts):
        monkeypatch.setattr(each, "svg", lambda figure, name: figure)


@pytest.fixture
def of(tmp_path) -> Evaluation:
    """A run with errors of 10 mm, two worst frames, ten frames without a pose, and deviations."""
    table = moved(TRUTH, np.random.default_rng(1).normal(size=TRUTH.positions.shape) * 0.01)
    table.positions[[12, 40], NAMES.index("left_wrist")] += [[1.0], [2.0]]
    table.positions[20:30] = np.nan
    table.positions[50:, NAMES.index("head")] = np.nan
    status = np.where((np.arange(60) >= 20) & (np.arange(60) < 30), "lost", np.where(np.arange(60) % 7 == 0, "uncertain", "tracked"))
    write_joints(tmp_path / "truth.csv", TRUTH)
    return measure_run(write_run(tmp_path / "run", table, truth=tmp_path / "truth.csv", sd=0.01, status=status))


def errors_of(of: Evaluation) -> np.ndarray:
    """Errors (T, J), mm, of the joints in their order; not a number where nothing is known."""
    assert of.errors is not None
    return 1000 * np.where(of.errors.known, of.errors.distance, np.nan)


def joint(table, name: str) -> np.ndarray:
    return table.positions[:, table.names.index(name)]


def xy(line) -> np.ndarray:
    return np.column_stack(line.get_data())


def labels(axes) -> list[str]:
    return [label.get_text() for label in axes.get_yticklabels()]


def test_errors_over_time(of, drawn):
    errors = errors_of(of)
    figure = charts.over_time(of, {"A": of.table.times[12], "B": of.table.times[40]})
    axes, strip = figure.axes
    np.testing.assert_allclose(xy(axes.lines[0]), np.column_stack([of.table.times, np.nanmean(errors, 1)]))
    for area, low, high in zip(axes.collections, (0, 25), (100, 75)):
        at_20 = area.get_paths()[0].vertices
        at_20 = at_20[np.isclose(at_20[:, 0], of.table.times[5]), 1]
        np.testing.assert_allclose([at_20.min(), at_20.max()], np.percentile(errors[5], [low, high]))
    assert axes.get_ylim() == (0, pytest.approx(1.15 * np.nanmax(errors)))
    letters = {text.get_text(): text.xy for text in axes.texts}
    assert letters == {"A": (of.table.times[12], axes.get_ylim()[1]), "B": (of.table.times[40], axes.get_ylim()[1])}
    assert [line.get_xdata()[0] for line in axes.lines[1:]] == [of.table.times[12], of.table.times[40]]
    assert axes.get_xlim() == strip.get_xlim() == pytest.approx((0, 59 / 15))
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {"mean", "middle half", "all joints", "tracked", "lost",
                                                                           "uncertain"}


def test_statuses_are_a_strip_without_gaps(of, drawn):
    strip = charts.over_time(of, {}).axes[1]
    bars = sorted((path.vertices[:, 0].min(), path.vertices[:, 0].max(), tuple(np.rint(255 * each.get_facecolor()[0, :3]).astype(int)))
                  for each in strip.collections for path in each.get_paths())
    begins, ends, colours = zip(*bars)
    step = 1 / 15
    np.testing.assert_allclose(begins[1:], ends[:-1])
    np.testing.assert_allclose([begins[0], ends[-1]], [-step / 2, of.table.times[-1] + step / 2])
    wanted = [of.run.motion.status[round((begin + ends[n]) / 2 / step - 0.01)] for n, begin in enumerate(begins)]
    assert colours == tuple(tuple(int(STATUSES[status][k : k + 2], 16) for k in (1, 3, 5)) for status in wanted)
    assert strip.get_ylim() == (0, 1)


def test_errors_by_joint_and_time(of, drawn):
    figure = charts.by_joint_and_time(of)
    axes, bar = figure.axes
    mesh = axes.collections[0]
    assert labels(axes) == [name.replace("_", " ") for name in of.errors.names]
    np.testing.assert_allclose(np.ma.filled(mesh.get_array(), np.nan), np.where(of.errors.lost, np.nan, errors_of(of)).T)
    assert mesh.get_clim() == (0, pytest.approx(np.percentile(mesh.get_array().compressed(), 99)))
    edges = mesh.get_coordinates()[0, :, 0]
    np.testing.assert_allclose(edges[1:-1], (of.table.times[1:] + of.table.times[:-1]) / 2)
    np.testing.assert_allclose(edges[[0, -1]], of.table.times[[0, -1]])
    low, high = axes.get_ylim()
    assert low > high  # the first joint stands above
    assert bar.get_ylabel() == "mm"


def test_percentiles_of_each_joint(of, drawn):
    axes = charts.by_joint(of).axes[0]
    assert labels(axes) == [name.replace("_", " ") for name in of.errors.names]
    assert axes.get_xlim()[0] == 0
    for row, name in enumerate(of.errors.names):
        values = errors_of(of)[:, row]
        values = values[np.isfinite(values)]
        p5, p25, p50, p75, p95 = np.percentile(values, [5, 25, 50, 75, 95])
        whisker, stroke, ring = axes.lines[3 * row : 3 * row + 3]
        box = axes.patches[row]
        np.testing.assert_allclose(xy(whisker), [[p5, row], [p95, row]])
        np.testing.assert_allclose(xy(stroke), [[p50, row - 0.28], [p50, row + 0.28]])
        np.testing.assert_allclose(xy(ring), [[values.mean(), row]])
        np.testing.assert_allclose([box.get_x(), box.get_width(), box.get_y() + box.get_height() / 2], [p25, p75 - p25, row])
        assert whisker.get_color() == {"left": GREEN, "right": PINK}.get(name.split("_")[0], BLUE)


def test_shares_of_joints_within_each_error(of, drawn):
    distances = aligned_distances(of.errors, of.table, of.truth)
    axes = charts.shares(distances, of.errors.known).axes[0]
    assert [line.get_label() for line in axes.lines] == ["as it stands", "from the root", "each frame moved and turned"]
    for line, way in zip(axes.lines, ("none", "root", "rigid")):
        values = 1000 * distances[way][of.errors.known]
        np.testing.assert_allclose(line.get_ydata(), [100 * (values <= limit).mean() for limit in line.get_xdata()])
    assert axes.get_xlim() == (0, pytest.approx(np.percentile(1000 * distances["none"][of.errors.known], 98)))
    assert axes.get_ylim() == (0, 100)


def test_the_path_of_a_joint(of, drawn):
    figure = charts.path_of(of, "left_wrist")
    assert [axes.get_ylabel() for axes in figure.axes] == ["x, m", "y, m", "z, m"]
    assert [axes.get_xlabel() for axes in figure.axes] == ["", "", "time, s"]
    for k, axes in enumerate(figure.axes):
        truth, run = axes.lines
        assert (truth.get_label(), run.get_label()) == ("truth", "run")
        for line, table in ((truth, of.truth), (run, of.table)):
            np.testing.assert_allclose(xy(line), np.column_stack([table.times, joint(table, "left_wrist")[:, k]]))
        assert axes.get_xlim() == pytest.approx((0, 59 / 15), abs=1e-6)
        assert axes.xaxis.get_tick_params()["labelbottom"] == (k == 2)


def test_accelerations_of_joints(of, drawn):
    axes = charts.jitter_by_joint(of).axes[0]
    for line, table in zip(axes.lines, (of.truth, of.table)):
        found = np.diff([joint(table, name) for name in of.errors.names], n=2, axis=1) * 15**2
        np.testing.assert_allclose(line.get_xdata(), np.sqrt(np.nanmean((found**2).sum(2), axis=1)), rtol=1e-5)
        np.testing.assert_array_equal(line.get_ydata(), np.arange(len(of.errors.names)))
    assert [line.get_label() for line in axes.lines] == ["truth", "run"]
    assert labels(axes) == [name.replace("_", " ") for name in of.errors.names]
    np.testing.assert_allclose([path.vertices[:, 0] for path in axes.collections[0].get_paths()],
                               np.column_stack([line.get_xdata() for line in axes.lines]))


@pytest.mark.parametrize(("several", "scale", "unit"), [(False, 1, "pixels"), (True, 1e4, "cm²")])
def test_overlap_and_cost(tmp_path, drawn, several, scale, unit):
    of = measure_run(run_that_errs(tmp_path))
    measured = of.measured | ({"cost_m2": of.measured.get("cost_m2")} if several else {})
    above, below = charts.fit_over_time(replace(of, measured=measured)).axes
    np.testing.assert_allclose(xy(above.lines[0]), np.column_stack([of.table.times, 0.9 - 0.001 * np.arange(60)]), atol=1e-6)
    np.testing.assert_allclose(xy(below.lines[0]), np.column_stack([of.table.times, scale * (100.0 + np.arange(60))]), rtol=1e-4)
    assert below.get_ylabel() == f"cost, {unit}"
    np.testing.assert_allclose(above.get_ylim(), (0.9 - 0.059 - 0.05, 1), atol=1e-6)
    assert below.get_ylim()[0] == 0
    assert above.get_xlim() == below.get_xlim() == pytest.approx((0, 59 / 15))


def test_differences_of_bends_with_their_mean_and_limits(of, drawn):
    figure = angle_charts.bland_altman(of)
    elbow = next(axes for axes in figure.axes if axes.get_title(loc="left") == "elbow")
    points, mean, low, high = (line for line in elbow.lines if line.get_color() == GREEN)
    angles = hinge_angles(of.table, of.truth)["left_elbow"]
    off = angles[0] - angles[1]
    np.testing.assert_allclose(xy(points), np.column_stack([angles.mean(0), off]))
    measured = of.measured["bends_deg"]["left_elbow"]
    assert mean.get_ydata()[0] == pytest.approx(measured["bias"])
    assert (high.get_ydata()[0] - low.get_ydata()[0]) / 2 == pytest.approx(1.96 * measured["aligned"])


def test_angles_with_their_intervals(tmp_path, drawn):
    of = measure_run(runs.make_run(tmp_path / "run", "anatomical", lost=(3,)))
    deviations = np.random.default_rng(0).uniform(0.01, 0.1, of.run.motion.poses.shape)
    deviations[3] = np.nan
    of = replace(of, run=replace(of.run, motion=replace(of.run.motion, pose_sd=deviations)))
    figure = angle_charts.angles_over_time(of)
    panels = {axes.get_title(loc="left"): axes for axes in figure.axes if axes.axison}
    motion = of.run.motion
    axes = panels["elbow flexion"]
    assert axes.get_xlim() == (motion.times[0], motion.times[-1])
    for line, area, side, colour in zip(axes.lines, axes.collections, ("left", "right"), (GREEN, PINK), strict=True):
        d = motion.dof_names.index(f"{side}_elbow_flexion")
        angle, wide = np.degrees(motion.poses[:, d]), HALF_WIDTH * np.degrees(motion.pose_sd[:, d])
        assert (line.get_label(), line.get_color()) == (side, colour)
        np.testing.assert_allclose(line.get_ydata(), angle)
        at_10 = area.get_paths()[-1].vertices
        at_10 = at_10[np.isclose(at_10[:, 0], motion.times[10]), 1]
        np.testing.assert_allclose([at_10.min(), at_10.max()], [angle[10] - wide[10], angle[10] + wide[10]])
    middle = panels["root heading"]
    assert [(line.get_label(), line.get_color()) for line in middle.lines] == [("trunk, head", BLUE)]
    assert len(figure.axes) % 3 == 0
    assert len(figure.axes) - len(panels) < 3
    assert {text.get_text() for text in figure.legends[0].get_texts()} == {"left", "right", "trunk, head"}


def test_found_against_stated_coverage(drawn):
    axes = charts.coverage_chart({"within_50": 0.4, "within_90": 0.95}, ["50", "90"]).axes[0]
    honest, found = map(xy, axes.lines)
    np.testing.assert_array_equal(honest, [[0, 0], [100, 100]])
    np.testing.assert_allclose(found, [[50, 40], [90, 95]])
    assert axes.get_xlim() == axes.get_ylim() == (0, 100)


def test_one_frame_has_a_span_too():
    assert span(np.array([3.0])) == (2.5, 3.5)
    assert span(np.array([3.0, 5.0]), np.array([1.0])) == (1, 5)


def test_plots_have_no_ground_of_their_own_and_scale_with_the_page(of):
    text = charts.coverage_chart({"within_50": 0.4}, ["50"])
    wide, least = re.match(r'<svg viewBox="0 0 ([\d.]+) [\d.]+" style="min-width:(\d+)px" role="img"', text).groups()
    assert float(least) >= float(wide)  # so that letters are never smaller than they were drawn
    assert "#ffffff" not in text  # the page has a dark form, too
    assert "<metadata>" not in text
