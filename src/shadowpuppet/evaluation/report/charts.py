"""Charts of an evaluation, as SVG for a page."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.evaluation.evaluation import Evaluation
from shadowpuppet.evaluation.report.drawing import BLUE, GREEN, INK, ORANGE, SIDES, binned, drawing, legend_above, span, svg
from shadowpuppet.geometry import Array
from shadowpuppet.motion.interpolation import true_runs
from shadowpuppet.motion.metrics import accelerations

STATUSES = {"tracked": "#dfe6ee", "uncertain": "#F0C75E", "predicted": "#9ECAE1", "lost": ORANGE, "absent": "#b9bdc4"}
WAYS = {"none": ("as it stands", BLUE, "-"), "root": ("from the root", GREEN, "--"), "rigid": ("each frame moved and turned", ORANGE, "-.")}


def over_time(of: Evaluation, marks: Mapping[str, float]) -> str:
    """Joint error over time, with the statuses below and letters at `marks` (s)."""
    assert of.table is not None
    assert of.errors is not None
    errors, times = 1000 * np.where(of.errors.known, of.errors.distance, np.nan), of.table.times
    known = np.isfinite(errors).any(1)
    t, low, quarter, middle, high, top = binned(times[known], _spread(errors[known]))
    with drawing("time", (10, 3.7), rows=2, ratios=(14, 1)) as (figure, (axes, strip)):
        axes.fill_between(t, low, top, color=BLUE, alpha=0.13, lw=0, label="all joints")
        axes.fill_between(t, quarter, high, color=BLUE, alpha=0.25, lw=0, label="middle half")
        axes.plot(t, middle, color=BLUE, label="mean")
        ceiling = max(1.15 * float(np.max(top)), 1.0)
        for letter, when in marks.items():
            axes.axvline(when, color=ORANGE, lw=0.9, ls=":")
            axes.annotate(letter, (when, ceiling), ha="center", va="top", color="white", fontsize=8.5, fontweight="bold",
                          bbox={"boxstyle": "circle,pad=0.18", "fc": ORANGE, "ec": "none"})
        axes.set(ylim=(0, ceiling), ylabel="error, mm")
        axes.tick_params(labelbottom=False)
        drawn = dict(zip(*reversed(axes.get_legend_handles_labels()))) | _statuses(strip, of)
        figure.legend(drawn.values(), drawn.keys(), loc="outside upper center", ncols=len(drawn))
        for each in (axes, strip):
            each.set_xlim(*span(times, of.run.motion.times))
        return svg(figure, "time")


def by_joint_and_time(of: Evaluation) -> str:
    """Error over time as a colour, a row a joint."""
    assert of.table is not None
    assert of.errors is not None
    errors, times = 1000 * np.where(of.errors.known, of.errors.distance, np.nan), of.table.times
    t, *rows = binned(times, [np.where(of.errors.lost[:, j], np.nan, errors[:, j]) for j in range(errors.shape[1])])
    with drawing("map", (10, 0.6 + 0.21 * len(rows))) as (figure, axes):
        from matplotlib import colormaps

        masked = np.ma.masked_invalid(rows)
        top = float(np.percentile(masked.compressed(), 99)) if masked.count() else 1.0
        edges = np.concatenate([t[:1], (t[1:] + t[:-1]) / 2, t[-1:] + 1e-9])
        colours = colormaps["YlOrBr"].with_extremes(bad="#6b7078")
        image = axes.pcolormesh(edges, np.arange(len(rows) + 1), masked, cmap=colours, vmin=0, vmax=top, rasterized=True)
        axes.set_yticks(np.arange(len(rows)) + 0.5, [name.replace("_", " ") for name in of.errors.names], fontsize=8.5)
        axes.invert_yaxis()
        axes.grid(False)
        axes.tick_params(length=0)
        axes.set_xlabel("time, s")
        bar = figure.colorbar(image, ax=axes, pad=0.012, aspect=14)
        bar.set_label("mm")
        bar.outline.set_visible(False)
        return svg(figure, "map")


def by_joint(of: Evaluation) -> str:
    """Percentiles of the errors of each joint: 5, 25, 50, 75 and 95 %."""
    assert of.errors is not None
    kept = [(name, 1000 * of.errors.distance[of.errors.known[:, j], j]) for j, name in enumerate(of.errors.names)]
    kept = [(name, values) for name, values in kept if len(values)]
    with drawing("joints", (5.2, 0.9 + 0.26 * len(kept))) as (figure, axes):
        for row, (name, values) in enumerate(kept):
            p5, p25, p50, p75, p95 = np.percentile(values, [5, 25, 50, 75, 95])
            colour = SIDES.get(name.split("_")[0], BLUE)
            axes.plot([p5, p95], [row, row], color=colour, lw=1.4, solid_capstyle="round")
            axes.barh(row, p75 - p25, left=p25, height=0.56, color=colour, alpha=0.45, lw=0)
            axes.plot([p50, p50], [row - 0.28, row + 0.28], color=INK, lw=1.8)
            axes.plot(values.mean(), row, "o", ms=3.6, mfc="white", mec=INK, mew=1)
        axes.set_yticks(range(len(kept)), [name.replace("_", " ") for name, _ in kept])
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set(xlabel="error, mm", xlim=(0, None))
        return svg(figure, "joints")


def shares(distances: Mapping[str, Array], known: NDArray[np.bool_]) -> str:
    """Share of joints below each error, after each alignment."""
    with drawing("shares", (5.2, 3.5)) as (figure, axes):
        far = max(float(np.percentile(1000 * distances["none"][known], 98)), 1.0)
        limits = np.linspace(0, far, 300)
        for way, (label, colour, dash) in WAYS.items():
            if way in distances:
                values = np.sort(1000 * distances[way][known])
                share = 100 * np.searchsorted(values, limits, side="right") / len(values)
                axes.plot(limits, share, dash, color=colour, label=label)
        axes.set(xlim=(0, far), ylim=(0, 100), xlabel="error, mm", ylabel="% of joints within")
        axes.legend(loc="lower right")
        return svg(figure, "shares")


def path_of(of: Evaluation, joint: str) -> str:
    """Position of one joint over time, run and truth."""
    assert of.table is not None
    assert of.truth is not None
    ours, theirs = (table.select([joint]).positions[:, 0] for table in (of.table, of.truth))
    with drawing("path", (10, 3.9), rows=3, ratios=(1, 1, 1)) as (figure, panels):
        for k, (axes, name) in enumerate(zip(panels, "xyz")):
            t, run, truth = binned(of.table.times, [ours[:, k], theirs[:, k]])
            axes.plot(t, truth, color=INK, lw=1.2, label="truth")
            axes.plot(t, run, color=BLUE, lw=1.4, label="run")
            axes.set_ylabel(f"{name}, m")
            axes.set_xlim(*span(t))
            axes.tick_params(labelbottom=k == 2)
        legend_above(figure, panels[:1])
        panels[2].set_xlabel("time, s")
        return svg(figure, "path")


def jitter_by_joint(of: Evaluation) -> str:
    """Root mean square acceleration of each joint, run and truth."""
    assert of.table is not None
    assert of.truth is not None
    assert of.errors is not None
    names = of.errors.names
    sizes = [_size(accelerations(table.select(names))) for table in (of.table, of.truth)]
    with drawing("jitter", (5.2, 0.9 + 0.26 * len(names))) as (figure, axes):
        rows = np.arange(len(names))
        axes.hlines(rows, sizes[1], sizes[0], color="#d3d8df", lw=2.2)
        axes.plot(sizes[1], rows, "o", color=INK, ms=5, label="truth")
        axes.plot(sizes[0], rows, "o", color=BLUE, ms=5, label="run")
        axes.set_yticks(rows, [name.replace("_", " ") for name in names])
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set(xlabel="acceleration, m/s² (rms)", xlim=(0, None))
        legend_above(figure, [axes])
        return svg(figure, "jitter")


def fit_over_time(of: Evaluation) -> str:
    """Overlap and cost over time."""
    motion, several = of.run.motion, "cost_m2" in of.measured
    scale, unit = (1e4, "cm²") if several else (1.0, "pixels")
    t, overlap, cost = binned(motion.times, [motion.overlap, scale * motion.cost])
    with drawing("fit", (10, 2.7), rows=2, ratios=(1, 1)) as (figure, (above, below)):
        above.plot(t, overlap, color=GREEN)
        low = float(np.nanmin(overlap)) if np.isfinite(overlap).any() else 0.0
        above.set(ylabel="overlap", ylim=(max(0.0, low - 0.05), 1))
        below.plot(t, cost, color=ORANGE)
        below.set(ylabel=f"cost, {unit}", ylim=(0, None), xlabel="time, s")
        above.tick_params(labelbottom=False)
        for axes in (above, below):
            axes.set_xlim(*span(motion.times, motion.times))
        return svg(figure, "fit")


def coverage_chart(coverage: Mapping[str, Any], levels: Sequence[str]) -> str:
    """Found against stated coverage of the intervals."""
    with drawing("coverage", (3.6, 3.3)) as (figure, axes):
        stated = [float(level) for level in levels]
        axes.plot([0, 100], [0, 100], color="#c4c9d0", lw=1.2, label="honest")
        axes.plot(stated, [100 * coverage[f"within_{level}"] for level in levels], "o-", color=BLUE, label="this run")
        axes.set(xlim=(0, 100), ylim=(0, 100), xlabel="stated, %", ylabel="of the truth within, %")
        axes.set_aspect("equal")
        axes.legend(loc="upper left")
        return svg(figure, "coverage")


def _spread(errors: Array) -> list[Array]:
    """Least, lower quartile, mean, upper quartile and greatest of each frame's errors (T, J)."""
    with np.errstate(invalid="ignore"):
        quarter, high = np.nanpercentile(errors, [25, 75], axis=1)
    return [np.nanmin(errors, 1), quarter, np.nanmean(errors, 1), high, np.nanmax(errors, 1)]


def _statuses(axes: Any, of: Evaluation) -> dict[str, Any]:
    """Draw the statuses as a strip; returns the handles for a legend."""
    motion = of.run.motion
    step = float(np.median(np.diff(motion.times))) if len(motion) > 1 else 1.0
    handles = {}
    for status in motion.status_counts:
        bars = [(motion.times[first] - step / 2, (end - first) * step) for first, end in true_runs(motion.status == status)]
        handles[status] = axes.broken_barh(bars, (0, 1), facecolors=STATUSES[status], lw=0)
    axes.set(ylim=(0, 1), yticks=[], xlabel="time, s")
    axes.grid(False)
    axes.spines["left"].set_visible(False)
    return handles


def _size(vectors: Array) -> Array:
    """Root mean square length (J,) of vectors (T, J, 3); NaN if none is known."""
    squares = (vectors**2).sum(2)
    known = np.isfinite(squares)
    return np.sqrt(np.where(known, squares, 0).sum(0) / np.where(known.any(0), known.sum(0), np.nan))
