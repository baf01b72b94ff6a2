"""Charts of angles, as SVG for a page: over time, over the gait cycle, beside a truth."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from shadowpuppet.evaluation.error_metrics import hinge_angles
from shadowpuppet.evaluation.evaluation import Evaluation
from shadowpuppet.evaluation.movement.angles import PERCENT, Cycle
from shadowpuppet.evaluation.movement.normal_walking import Normal
from shadowpuppet.evaluation.report.drawing import BLUE, POINTS, SIDES, binned, drawing, legend_above, span, svg
from shadowpuppet.geometry import evenly_spread
from shadowpuppet.io.intervals import HALF_WIDTH
from shadowpuppet.io.motion.table import dof_unit

COLUMNS = 3
"""Panels of angles in a row."""
USUAL = "#d3d7dc"


def angles_over_time(of: Evaluation) -> str:
    """Every angle over time with its 90 % interval, left and right of a pair in one panel."""
    motion = of.run.motion
    angles = [(d, name) for d, name in enumerate(motion.dof_names) if dof_unit(name) == "rad"]
    panels = list(dict.fromkeys(name.removeprefix("left_").removeprefix("right_") for _, name in angles))
    rows = -(-len(panels) // COLUMNS)
    with drawing("angles", (10, 0.4 + 1.45 * rows), rows, (1,) * rows, COLUMNS) as (figure, grid):
        places = dict(zip(panels, grid.flat))
        for axes in list(grid.flat)[len(panels) :]:
            axes.set_axis_off()
        for d, name in angles:
            side = name.split("_")[0]
            axes = places[name.removeprefix("left_").removeprefix("right_")]
            t, middle, wide = binned(motion.times, [np.degrees(motion.poses[:, d]), HALF_WIDTH * np.degrees(motion.pose_sd[:, d])])
            colour = SIDES.get(side, BLUE)
            axes.plot(t, middle, color=colour, lw=1.3, label=side if side in SIDES else "trunk, head")
            axes.fill_between(t, middle - wide, middle + wide, color=colour, alpha=0.16, lw=0)
        for panel, axes in places.items():
            axes.set_title(panel.replace("_", " "), fontsize=9, loc="left", pad=3)
            axes.set_xlim(*span(motion.times))
            axes.tick_params(labelsize=8)
        legend_above(figure, places.values())
        return svg(figure, "angles")


def bland_altman(of: Evaluation) -> str:
    """Differences of the angles of elbows and knees over their means, with the mean difference and 1.96 standard deviations on both sides
    of it."""
    assert of.table is not None
    assert of.truth is not None
    pairs = hinge_angles(of.table, of.truth)
    hinges = list(dict.fromkeys(name.partition("_")[2] for name in pairs))
    with drawing("agreement", (10, 3.2), columns=len(hinges)) as (figure, grid):
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
        legend_above(figure, grid.flat, markerscale=3)
        return svg(figure, "agreement")


def gait_cycle(cycles: Sequence[Cycle], normal: Callable[[Cycle], Normal | None], stance: Mapping[str, float]) -> str:
    """Every angle over the gait cycle, both sides in one panel, before the band of normal angles, one standard deviation to each side, and
    with `stance`, % of the cycle by side, dotted."""
    panels = list(dict.fromkeys(each.name for each in cycles))
    rows = -(-len(panels) // COLUMNS)
    with drawing("cycle", (10, 0.6 + 1.6 * rows), rows, (1,) * rows, COLUMNS) as (figure, grid):
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
        legend_above(figure, places.values())
        return svg(figure, "cycle")
