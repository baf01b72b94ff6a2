"""What the plot of a batch shows."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from shadowpuppet.errors import ShadowPuppetError
from shadowpuppet.pipeline.batch import plot

pytest.importorskip("matplotlib")


def run_of(name: str, choice: str, error: object, overlap: object = 0.9, status: str = "done"):
    task = SimpleNamespace(name=name, choice=choice)
    return SimpleNamespace(task=task, status=status, metrics={"errors": {"mean_mm": error}, "overlap": {"mean": overlap}})


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """The figure of runs."""
    from matplotlib.figure import Figure

    kept = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, path, **how: kept.append((figure, path)))

    def draw(runs):
        plot.plot_batch(runs, tmp_path / "summary.png")
        return kept[-1][0]

    return draw


def test_a_point_a_run_with_median_and_quartiles(drawn):
    values = [10.0, 14.0, 11.0, 30.0]
    runs = [run_of("lab", "drs", value) for value in values] + [run_of("lab", "srs", None, None, "failed"), run_of("lab", "srs", 20.0)]
    figure = drawn(runs)
    errors, overlaps = figure.axes
    assert (errors.get_xlabel(), overlaps.get_xlabel()) == ("mean joint error, mm", "mean overlap with the silhouettes")
    points, median, one, _ = errors.lines
    np.testing.assert_array_equal(points.get_xdata(), values)
    assert (np.abs(points.get_ydata()) <= 0.25).all()
    assert np.diff(np.sort(points.get_ydata())).min() > 0.05
    np.testing.assert_allclose(median.get_data(), [[12.5, 12.5], [-0.36, 0.36]])
    box = errors.patches[0]
    low, high = np.percentile(values, (25, 75))
    np.testing.assert_allclose([box.get_x(), box.get_width(), box.get_y() + box.get_height() / 2], [low, high - low, 0])
    np.testing.assert_array_equal(one.get_xdata(), [20.0])
    assert [label.get_text() for label in errors.get_yticklabels()] == ["drs", "srs\n1 of 2"]
    assert errors.get_ylim() == (1.6, -0.6)
    assert [side for axes in figure.axes for side, line in axes.spines.items() if line.get_visible()] == ["bottom", "bottom"]
    assert figure.get_suptitle() == "5 of 6 runs of lab; a point each, line: median, bar: quartiles"


def test_recordings_have_their_colours_and_names(drawn):
    runs = [run_of(name, choice, 10.0) for name in "abcdefg" for choice in ("x", "")]
    figure = drawn(runs)
    axes = figure.axes[0]
    assert [label.get_text() for label in axes.get_yticklabels()][:3] == ["a, x", "a", "b, x"]
    colours = [line.get_color() for line in axes.lines[::2]]
    assert colours[0] == colours[1] == colours[12] != colours[2]
    assert len(set(colours)) == len(plot.COLOURS)
    assert "runs; a point" in figure.get_suptitle()


def test_a_long_table_is_cut_and_what_is_unknown_is_not_drawn(drawn):
    figure = drawn([run_of("lab", str(n), None) for n in range(plot.MAX_ROWS + 2)])
    (axes,) = figure.axes
    assert axes.get_xlabel() == "mean overlap with the silhouettes"
    assert len(axes.get_yticks()) == plot.MAX_ROWS
    assert figure.get_suptitle().endswith("quartiles; 2 more rows in the table")
    (nothing,) = drawn([run_of("lab", "", None, None, "failed")]).axes
    assert len(nothing.lines[0].get_xdata()) == 0
    assert [label.get_text() for label in nothing.get_yticklabels()] == ["lab\n0 of 1"]


def test_where_it_cannot_be_written_that_is_said(tmp_path):
    with pytest.raises(ShadowPuppetError, match=r"summary\.png: cannot be written \(no such file or directory\)"):
        plot.plot_batch([run_of("lab", "", 1.0)], tmp_path / "no" / "summary.png")
