"""Plots of an evaluation, as SVG for a page."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shadowpuppet.evaluation.error_metrics import hinge_angles, true_stretches
from shadowpuppet.evaluation.evaluation import Evaluation
from shadowpuppet.evaluation.movement.angles import PERCENT, Cycle
from shadowpuppet.evaluation.movement.normal_walking import Normal
from shadowpuppet.geometry import Array, evenly_spread
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.io.motion.table import dof_unit
from shadowpuppet.motion.metrics import accelerations

# Colours that colour-blind people can tell apart: Okabe & Ito 2008.
BLUE, ORANGE, GREEN, PINK, GREY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#8a8f98"
SIDES = {"left": GREEN, "right": PINK}
STATUSES = {"tracked": "#dfe6ee", "uncertain": "#F0C75E", "predicted": "#9ECAE1", "lost": ORANGE, "absent": "#b9bdc4"}
WAYS = {"none": ("as it stands", BLUE, "-"), "root": ("from the root", GREEN, "--"), "rigid": ("each frame moved and turned", ORANGE, "-.")}
READABLE = 1.1
"""Least size at which charts are shown: narrower pages scroll them sideways, so that letters stay readable."""
POINTS = 1200
"""Greatest number of points of a line; more do not show."""
COLUMNS = 3
"""Panels of angles in a row."""
USUAL = "#d3d7dc"
INK = "#2b2f36"
STYLE = {"svg.fonttype": "none", "font.size": 9.5, "axes.edgecolor": "#c4c9d0", "axes.labelcolor": INK, "text.color": INK,
         "xtick.color": "#5b6470", "ytick.color": "#5b6470", "axes.grid": True, "grid.color": "#e6e9ed", "grid.linewidth": 0.8,
         "axes.axisbelow": True, "axes.spines.top": False, "axes.spines.right": False, "legend.frameon": False, "legend.fontsize": 9,
         "lines.linewidth": 1.5}  # fmt: skip


def over_time(of: Evaluation, marks: Mapping[str, float]) -> str:
    """Joint error over time, with the statuses below and letters at `marks` (s)."""
    assert of.table is not None
    assert of.errors is not None
    errors, times = 1000 * np.where(of.errors.known, of.errors.distance, np.nan), of.table.times
    known = np.isfinite(errors).any(1)
    t, low, quarter, middle, high, top = _binned(times[known], _spread(errors[known]))
    with _drawing("time", (10, 3.7), rows=2, ratios=(14, 1)) as (figure, (axes, strip)):
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
            each.set_xlim(*_span(times, of.run.motion.times))
        return _svg(figure, "time")


def by_joint_and_time(of: Evaluation) -> str:
    """Error over time as a colour, a row a joint."""
    assert of.table is not None
    assert of.errors is not None
    errors, times = 1000 * np.where(of.errors.known, of.errors.distance, np.nan), of.table.times
    t, *rows = _binned(times, [np.where(of.errors.lost[:, j], np.nan, errors[:, j]) for j in range(errors.shape[1])])
    with _drawing("map", (10, 0.6 + 0.21 * len(rows))) as (figure, axes):
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
        return _svg(figure, "map")


def by_joint(of: Evaluation) -> str:
    """Percentiles of the errors of each joint: 5, 25, 50, 75 and 95 %."""
    assert of.errors is not None
    kept = [(name, 1000 * of.errors.distance[of.errors.known[:, j], j]) for j, name in enumerate(of.errors.names)]
    kept = [(name, values) for name, values in kept if len(values)]
    with _drawing("joints", (5.2, 0.9 + 0.26 * len(kept))) as (figure, axes):
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
        return _svg(figure, "joints")


def shares(distances: Mapping[str, Array], known: NDArray[np.bool_]) -> str:
    """Share of joints below each error, after each alignment."""
    with _drawing("shares", (5.2, 3.5)) as (figure, axes):
        far = max(float(np.percentile(1000 * distances["none"][known], 98)), 1.0)
        limits = np.linspace(0, far, 300)
        for way, (label, colour, dash) in WAYS.items():
            if way in distances:
                values = np.sort(1000 * distances[way][known])
                share = 100 * np.searchsorted(values, limits, side="right") / len(values)
                axes.plot(limits, share, dash, color=colour, label=label)
        axes.set(xlim=(0, far), ylim=(0, 100), xlabel="error, mm", ylabel="% of joints within")
        axes.legend(loc="lower right")
        return _svg(figure, "shares")


def path_of(of: Evaluation, joint: str) -> str:
    """Position of one joint over time, run and truth."""
    assert of.table is not None
    assert of.truth is not None
    ours, theirs = (table.select([joint]).positions[:, 0] for table in (of.table, of.truth))
    with _drawing("path", (10, 3.9), rows=3, ratios=(1, 1, 1)) as (figure, panels):
        for k, (axes, name) in enumerate(zip(panels, "xyz")):
            t, run, truth = _binned(of.table.times, [ours[:, k], theirs[:, k]])
            axes.plot(t, truth, color=INK, lw=1.2, label="truth")
            axes.plot(t, run, color=BLUE, lw=1.4, label="run")
            axes.set_ylabel(f"{name}, m")
            axes.set_xlim(*_span(t))
            axes.tick_params(labelbottom=k == 2)
        figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2)
        panels[2].set_xlabel("time, s")
        return _svg(figure, "path")


def jitter_by_joint(of: Evaluation) -> str:
    """Root mean square acceleration of each joint, run and truth."""
    assert of.table is not None
    assert of.truth is not None
    assert of.errors is not None
    names = of.errors.names
    sizes = [_size(accelerations(table.select(names))) for table in (of.table, of.truth)]
    with _drawing("jitter", (5.2, 0.9 + 0.26 * len(names))) as (figure, axes):
        rows = np.arange(len(names))
        axes.hlines(rows, sizes[1], sizes[0], color="#d3d8df", lw=2.2)
        axes.plot(sizes[1], rows, "o", color=INK, ms=5, label="truth")
        axes.plot(sizes[0], rows, "o", color=BLUE, ms=5, label="run")
        axes.set_yticks(rows, [name.replace("_", " ") for name in names])
        axes.invert_yaxis()
        axes.grid(axis="y", visible=False)
        axes.set(xlabel="acceleration, m/s² (rms)", xlim=(0, None))
        figure.legend(*axes.get_legend_handles_labels(), loc="outside upper center", ncols=2)
        return _svg(figure, "jitter")


def fit_over_time(of: Evaluation) -> str:
    """Overlap and cost over time."""
    motion, several = of.run.motion, "cost_m2" in of.measured
    scale, unit = (1e4, "cm²") if several else (1.0, "pixels")
    t, overlap, cost = _binned(motion.times, [motion.overlap, scale * motion.cost])
    with _drawing("fit", (10, 2.7), rows=2, ratios=(1, 1)) as (figure, (above, below)):
        above.plot(t, overlap, color=GREEN)
        low = float(np.nanmin(overlap)) if np.isfinite(overlap).any() else 0.0
        above.set(ylabel="overlap", ylim=(max(0.0, low - 0.05), 1))
        below.plot(t, cost, color=ORANGE)
        below.set(ylabel=f"cost, {unit}", ylim=(0, None), xlabel="time, s")
        above.tick_params(labelbottom=False)
        for axes in (above, below):
            axes.set_xlim(*_span(motion.times, motion.times))
        return _svg(figure, "fit")


def angles_over_time(of: Evaluation) -> str:
    """Every angle over time with its 90 % interval, left and right of a pair in one panel."""
    motion = of.run.motion
    angles = [(d, name) for d, name in enumerate(motion.dof_names) if dof_unit(name) == "rad"]
    panels = list(dict.fromkeys(name.removeprefix("left_").removeprefix("right_") for _, name in angles))
    rows = -(-len(panels) // COLUMNS)
    with _drawing("angles", (10, 0.4 + 1.45 * rows), rows, (1,) * rows, COLUMNS) as (figure, grid):
        places = dict(zip(panels, grid.flat))
        for axes in list(grid.flat)[len(panels) :]:
            axes.set_axis_off()
        for d, name in angles:
            side = name.split("_")[0]
            axes = places[name.removeprefix("left_").removeprefix("right_")]
            t, middle, wide = _binned(motion.times, [np.degrees(motion.poses[:, d]), HALF_WIDTH * np.degrees(motion.pose_sd[:, d])])
            colour = SIDES.get(side, BLUE)
            axes.plot(t, middle, color=colour, lw=1.3, label=side if side in SIDES else "trunk, head")
            axes.fill_between(t, middle - wide, middle + wide, color=colour, alpha=0.16, lw=0)
        for panel, axes in places.items():
            axes.set_title(panel.replace("_", " "), fontsize=9, loc="left", pad=3)
            axes.set_xlim(*_span(motion.times))
            axes.tick_params(labelsize=8)
        drawn = {label: handle for axes in places.values() for handle, label in zip(*axes.get_legend_handles_labels())}
        figure.legend(drawn.values(), drawn.keys(), loc="outside upper center", ncols=len(drawn))
        return _svg(figure, "angles")


def bland_altman(of: Evaluation) -> str:
    """Differences of the angles of elbows and knees over their means, with the mean difference and 1.96 standard deviations on both sides
    of it."""
    assert of.table is not None
    assert of.truth is not None
    pairs = hinge_angles(of.table, of.truth)
    hinges = list(dict.fromkeys(name.partition("_")[2] for name in pairs))
    with _drawing("agreement", (10, 3.2), columns=len(hinges)) as (figure, grid):
        for name, (ours, theirs) in pairs.items():
            side, _, hinge = name.partition("_")
            axes, colour, off = grid.flat[hinges.index(hinge)], SIDES[side], ours - theirs
            chosen = evenly_spread(len(off), POINTS)
            axes.plot((ours + theirs)[chosen] / 2, off[chosen], ".", ms=3, color=colour, alpha=0.5, label=side)
            axes.axhline(off.mean(), color=colour, lw=1.4)
            for limit in (-1.96, 1.96):
                axes.axhline(off.mean() + limit * off.std(), color=colour, lw=1, ls="--")
            axes.set_title(hinge, fontsize=9, loc="left", pad=3)
            axes.set(xlabel="mean of run and truth, degrees", ylabel="run less truth, degrees")
        drawn = {label: handle for axes in grid.flat for handle, label in zip(*axes.get_legend_handles_labels())}
        figure.legend(drawn.values(), drawn.keys(), loc="outside upper center", ncols=len(drawn), markerscale=3)
        return _svg(figure, "agreement")


def gait_cycle(cycles: Sequence[Cycle], normal: Callable[[Cycle], Normal | None], stance: Mapping[str, float]) -> str:
    """Every angle over the gait cycle, both sides in one panel, before the band of what is normal, one standard deviation to each side, and
    with `stance`, % of the cycle by side, dotted."""
    panels = list(dict.fromkeys(each.name for each in cycles))
    rows = -(-len(panels) // COLUMNS)
    with _drawing("cycle", (10, 0.6 + 1.6 * rows), rows, (1,) * rows, COLUMNS) as (figure, grid):
        places = dict(zip(panels, grid.flat))
        for axes in list(grid.flat)[len(panels) :]:
            axes.set_axis_off()
        for each in cycles:
            axes, colour = places[each.name], SIDES[each.side]
            if usual := normal(each):
                low, high = usual.mean - usual.sd, usual.mean + usual.sd
                axes.fill_between(PERCENT, low, high, color=USUAL, alpha=0.6, lw=0, zorder=0.5, label="normal")
            axes.fill_between(PERCENT, each.mean - each.stated, each.mean + each.stated, color=colour, alpha=0.1, lw=0)
            axes.fill_between(PERCENT, each.mean - each.sd, each.mean + each.sd, color=colour, alpha=0.35, lw=0)
            axes.plot(PERCENT, each.mean, color=colour, lw=1.4, label=each.side)
        for name, axes in places.items():
            for side, percent in stance.items():
                axes.axvline(percent, color=SIDES[side], lw=0.9, ls=":")
            axes.set_title(name, fontsize=9, loc="left", pad=3)
            axes.set(xlim=(0, 100), xticks=(0, 25, 50, 75, 100))
            axes.tick_params(labelsize=8)
        drawn = {label: handle for axes in places.values() for handle, label in zip(*axes.get_legend_handles_labels())}
        figure.legend(drawn.values(), drawn.keys(), loc="outside upper center", ncols=len(drawn))
        return _svg(figure, "cycle")


def coverage_chart(coverage: Mapping[str, Any], levels: Sequence[str]) -> str:
    """Found against stated coverage of the intervals."""
    with _drawing("coverage", (3.6, 3.3)) as (figure, axes):
        stated = [float(level) for level in levels]
        axes.plot([0, 100], [0, 100], color="#c4c9d0", lw=1.2, label="honest")
        axes.plot(stated, [100 * coverage[f"within_{level}"] for level in levels], "o-", color=BLUE, label="this run")
        axes.set(xlim=(0, 100), ylim=(0, 100), xlabel="stated, %", ylabel="of the truth within, %")
        axes.set_aspect("equal")
        axes.legend(loc="upper left")
        return _svg(figure, "coverage")


class _drawing:
    """Context of a matplotlib figure with panels, in our style."""

    def __init__(self, name: str, size: tuple[float, float], rows: int = 1, ratios: Sequence[float] = (1,),
                 columns: int | None = None) -> None:
        from matplotlib import rc_context

        style: dict[Any, Any] = {**STYLE, "svg.hashsalt": name}
        self._context = rc_context(style)
        self._size, self._rows, self._ratios, self._columns = size, rows, ratios, columns

    def __enter__(self) -> tuple[Any, Any]:
        from matplotlib.backends.backend_svg import FigureCanvasSVG
        from matplotlib.figure import Figure

        self._context.__enter__()
        figure = Figure(figsize=self._size, layout="constrained")
        FigureCanvasSVG(figure)
        return figure, figure.subplots(self._rows, self._columns or 1, height_ratios=self._ratios, squeeze=self._columns is None)

    def __exit__(self, *error: Any) -> None:
        self._context.__exit__(*error)


def _svg(figure: Any, name: str) -> str:
    """The figure's SVG without header and metadata, with unique ids."""
    out = io.StringIO()
    figure.savefig(out, format="svg", transparent=True, dpi=150, metadata={"Date": None, "Creator": None})
    text = out.getvalue()
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r'(\bid="|"#|url\(#)', lambda found: f"{found[1]}{name}-", text)
    least = READABLE * 72 * figure.get_size_inches()[0]
    return re.sub(r'<svg [^>]*?viewBox="([^"]*)"[^>]*>', rf'<svg viewBox="\1" style="min-width:{least:.0f}px" role="img" '
                  r'xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink">', text, count=1)


def _spread(errors: Array) -> list[Array]:
    """Least, lower quartile, mean, upper quartile and greatest of each frame's errors (T, J)."""
    with np.errstate(invalid="ignore"):
        quarter, high = np.nanpercentile(errors, [25, 75], axis=1)
    return [np.nanmin(errors, 1), quarter, np.nanmean(errors, 1), high, np.nanmax(errors, 1)]


def _binned(times: Array, series: Sequence[Array]) -> tuple[Array, ...]:
    """Times and series (T,) reduced to `POINTS` means of neighbours."""
    if len(times) <= POINTS:
        return (times, *series)
    groups = np.arange(len(times)) * POINTS // len(times)

    def mean(values: Array) -> Array:
        known = np.isfinite(values)
        counts = np.bincount(groups[known], minlength=POINTS)
        return np.where(counts > 0, np.bincount(groups[known], values[known], POINTS) / np.maximum(counts, 1), np.nan)

    return (mean(times), *(mean(np.asarray(values)) for values in series))


def _statuses(axes: Any, of: Evaluation) -> dict[str, Any]:
    """Draw the statuses as a strip; returns the handles for a legend."""
    motion = of.run.motion
    step = float(np.median(np.diff(motion.times))) if len(motion) > 1 else 1.0
    handles = {}
    for status in motion.status_counts:
        bars = [(motion.times[first] - step / 2, (end - first) * step) for first, end in true_stretches(motion.status == status)]
        handles[status] = axes.broken_barh(bars, (0, 1), facecolors=STATUSES[status], lw=0)
    axes.set(ylim=(0, 1), yticks=[], xlabel="time, s")
    axes.grid(False)
    axes.spines["left"].set_visible(False)
    return handles


def _span(*times: Array) -> tuple[float, float]:
    known = np.concatenate(times)
    low, high = float(known.min()), float(known.max())
    return (low, high) if high > low else (low - 0.5, high + 0.5)


def _size(vectors: Array) -> Array:
    """Root mean square length (J,) of vectors (T, J, 3); NaN if none is known."""
    squares = (vectors**2).sum(2)
    known = np.isfinite(squares)
    return np.sqrt(np.where(known, squares, 0).sum(0) / np.where(known.any(0), known.sum(0), np.nan))
